//! `isosurface` against a double-precision host reference of the crossings, closed forms of light and layers, and its requests.

mod agreement;
mod asked;
mod cameras;
mod convergence;
mod depth;
mod falling;
mod layers;
mod light;
mod marschner_lobb;
mod occlusion;
mod skewed;
mod thick;
mod voids;
