//! What a reader should know of a volume and of the parameters on it.

use serde_json::{Value, json};

use crate::render::Scene;
use crate::volume::Volume;

/// The warnings of a volume that a scene looks at, in codes and words.
pub(super) fn warnings(volume: &Volume, scene: &Scene) -> Vec<Value> {
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
    if scene.clip().removes_all(volume) {
        let message = "the clipping planes leave nothing of the volume";
        warnings.push(json!({"code": "clipped_away", "message": message}));
    }
    warnings.extend(scene.view().warnings(volume));
    warnings
}
