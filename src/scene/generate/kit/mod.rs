//! The modelling kit: shapes in `f64`, built from `+ - * /` and square roots alone, so that every
//! platform makes the same mesh bit for bit.

mod illumination;
mod math;
mod moving;
mod nature;
mod props;
mod shape;
mod solids;
mod sweeps;

pub(crate) use illumination::{aimed_quad, camera, down_quad, light};
pub(crate) use math::{
    PI, Place, Rng, TAU, V, at, cos, mix, noise, scaled, sin, sin_cos, stand, tilted, turned, v,
};
pub(crate) use moving::Moving;
pub(crate) use nature::{blade, leaf, plant};
pub(crate) use props::{
    barrel, book, book_row, bottle, chair, chest, figure, flask, pillow, table, teddy,
};
pub(crate) use shape::Shape;
pub(crate) use sweeps::{curve, spline};
