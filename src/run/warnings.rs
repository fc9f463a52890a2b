//! The warnings about a volume and the parameters on it.

use serde_json::{Value, json};

use crate::render::Scene;
use crate::scene::bounds::Bounds;
use crate::technique::PreparedView;
use crate::volume::Volume;

/// The warnings about the subject of a scene, which fills the box, as codes and messages.
pub(super) fn warnings(scene: &Scene, view: &dyn PreparedView, bounds: &Bounds) -> Vec<Value> {
    let mut warnings = view.volume().map_or(Vec::new(), |volume| of_volume(volume));
    if scene.clip().removes_all(bounds) {
        let message = "the clipping planes leave nothing of the volume";
        warnings.push(json!({"code": "clipped_away", "message": message}));
    }
    warnings.extend(view.warnings());
    warnings
}

fn of_volume(volume: &Volume) -> Vec<Value> {
    let mut warnings: Vec<Value> =
        volume.notes().iter().map(|n| json!({"code": "volume_note", "message": n})).collect();
    if volume.non_finite() > 0 {
        let message = format!(
            "{} voxels are not finite; they and the cells they touch are rendered as empty",
            volume.non_finite()
        );
        warnings.push(
            json!({"code": "non_finite_voxels", "message": message, "measured": volume.non_finite(), "bound": 0}),
        );
    }
    warnings
}
