//! Shadow rays on CPUs: which way round a tree is walked is free speed.

// In layers: each module uses only those above it.
pub mod error;
mod filled;
pub mod geometry;
mod huge_pages;
pub mod output;
mod processor;
pub mod ray;
pub mod ray_set;
mod vectorized;

pub mod intersect;
pub mod scene;
pub mod tree;

pub mod build;
pub mod order;
pub mod trace;

pub mod dynamics;
pub mod parts;

pub mod arbiter;
pub mod backend;

pub mod measure;
pub mod render;

pub mod lab;

pub mod chart;
pub mod image_file;
pub mod report;

pub mod results;

pub mod animate;
pub mod bench;
pub mod converge;
pub mod stress;
pub mod truth;

pub mod cli;

// Unit tests and the suites in `tests` share their random geometry.
#[cfg(test)]
extern crate self as sato;
#[cfg(test)]
#[path = "../tests/common/motion.rs"]
mod test_motion;
#[cfg(test)]
#[path = "../tests/common/random.rs"]
mod test_random;
#[cfg(test)]
use test_random as random;

pub use error::{Error, Result};
