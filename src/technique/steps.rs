//! Steps along a ray.

use serde_json::{Value, json};

/// The longest step without a warning: a grid holds no period shorter than two voxels.
pub const LONGEST_STEP_VOXELS: f64 = 2.0;

/// A warning if steps are so long that they may miss details of the grid. An error that is estimated from samples does not include details that
/// all samples missed.
pub fn coarse_step(step_voxels: f64) -> Option<Value> {
    let message =
        "steps of more than two voxels may pass over what lies between them, and the stated error knows nothing of it";
    let warning =
        json!({"code": "coarse_step", "message": message, "measured": step_voxels, "bound": LONGEST_STEP_VOXELS});
    (step_voxels > LONGEST_STEP_VOXELS).then_some(warning)
}
