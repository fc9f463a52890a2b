//! `slice` against linear fields, slabs in closed form, and what is refused.

mod asked;
mod planes;
mod slabs;
