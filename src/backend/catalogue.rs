//! Every backend there is. Command-line parsing, help, `sato list` and the test matrix read this
//! list; a new backend is one file and its line here.

use super::{Accelerator, BackendSpec, BuildContext, Key};
use crate::Result;

/// One backend.
#[derive(Debug)]
pub struct BackendEntry {
    /// As typed in a spec.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// The keys that it understands.
    pub keys: &'static [Key],
    /// Whether this build of the program has it, and if not, how to get it.
    pub unavailable: Option<&'static str>,
    /// Refuses combinations of values that do not exist, saying why.
    pub check: Option<Check>,
    /// Builds it.
    pub build: fn(&BackendSpec, &BuildContext<'_>) -> Result<Box<dyn Accelerator>>,
}

/// Says why a combination of values does not exist.
pub type Check = fn(&BackendSpec) -> std::result::Result<(), String>;

/// All backends, in the order in which they are listed.
pub static BACKENDS: &[&BackendEntry] = &[
    &super::brute::ENTRY,
    &super::bvh2::ENTRY,
    &super::bvh8::ENTRY,
    &super::kd::ENTRY,
    &super::embree::ENTRY,
];
