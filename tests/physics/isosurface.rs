//! `isosurface` against a double-precision host reference of where rays cross, closed forms of light and layers, and what is asked.

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
