//! `slice` against linear fields, slabs in closed form, and refused requests.

mod asked;
mod planes;
mod slabs;
