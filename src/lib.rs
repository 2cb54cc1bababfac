//! Shadow rays on CPUs: which way round a tree is walked is free speed.

pub mod error;
pub mod geometry;
pub mod output;
pub mod ray;
pub mod scene;

pub mod backend;

pub use error::{Error, Result};
