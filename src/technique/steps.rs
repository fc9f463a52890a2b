//! Steps along a ray.

use serde_json::{Value, json};

/// A grid holds no period shorter than two voxels.
const LONGEST_VOXELS: f64 = 2.0;

/// A word of warning where steps are so long that they may pass over what is in the grid. An error that is told from what other
/// samples found knows nothing of what all of them missed.
pub(super) fn coarse_step(step_voxels: f64) -> Option<Value> {
    let message =
        "steps of more than two voxels may pass over what lies between them, and the stated error knows nothing of it";
    let warning = json!({"code": "coarse_step", "message": message, "measured": step_voxels, "bound": LONGEST_VOXELS});
    (step_voxels > LONGEST_VOXELS).then_some(warning)
}
