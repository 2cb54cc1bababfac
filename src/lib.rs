//! Shadow rays on CPUs: which way round a tree is walked is free speed.

pub mod error;
pub mod geometry;
pub mod ray;
pub mod scene;

pub mod backend;
pub mod render;

pub use error::{Error, Result};
