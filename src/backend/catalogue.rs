//! Every backend there is. Command-line parsing, help, `sato list` and the test matrix read this
//! list; a new backend is one file and its line here.

use super::{Accelerator, BackendSpec, BuildContext, BuildMoving, Key};
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
    /// More of them, which say how it follows moving scenes; they mean nothing for others.
    pub moving_keys: &'static [Key],
    /// Whether this build of the program has it, and if not, how to get it.
    pub unavailable: Option<&'static str>,
    /// Refuses combinations of values that do not exist, saying why.
    pub check: Option<Check>,
    /// Builds it.
    pub build: fn(&BackendSpec, &BuildContext<'_>) -> Result<Box<dyn Accelerator>>,
    /// Builds what follows a moving scene; `None` where that is one built anew for each frame.
    pub build_moving: Option<BuildMoving>,
}

impl BackendEntry {
    /// Every key that a spec may have.
    pub fn all_keys(&self) -> impl Iterator<Item = &'static Key> {
        self.keys.iter().chain(self.moving_keys)
    }
}

/// Says why a combination of values does not exist.
pub type Check = fn(&BackendSpec) -> std::result::Result<(), String>;

/// All backends, in the order in which they are listed.
pub static BACKENDS: &[&BackendEntry] = &[
    &super::brute::ENTRY,
    &super::bvh2::ENTRY,
    &super::bvh8::ENTRY,
    &super::lazy::ENTRY,
    &super::kd::ENTRY,
    &super::embree::ENTRY,
];

/// Every spec that this build offers for scenes that stand still: all values of all keys that go
/// together.
pub fn every_spec() -> Vec<BackendSpec> {
    let mut specs = Vec::new();
    for entry in BACKENDS.iter().filter(|e| e.unavailable.is_none()) {
        let mut texts = vec![entry.name.to_string()];
        for (index, key) in entry.keys.iter().enumerate() {
            let separator = if index == 0 { ':' } else { ',' };
            let choices = (key.choices)();
            texts = texts
                .iter()
                .flat_map(|t| {
                    choices.iter().map(move |c| format!("{t}{separator}{}={}", key.name, c.name))
                })
                .collect();
        }
        // Combinations that do not exist are refused.
        specs.extend(texts.iter().filter_map(|t| t.parse::<BackendSpec>().ok()));
    }
    specs
}

/// Orders to try with every builder and mode. These know no orders and orders know none of them, so
/// that one of each kind will do: by the ray, by area, by number, and of the leaves' triangles.
const ORDERS_FOR_EVERY_BUILDER: &[&str] = &["near", "node-sato", "prim-num", "rtsah"];

/// As [`every_spec`], but few orders with builders and modes that are not the default: what tests and
/// `sato stress` go through.
pub fn varied_specs() -> Vec<BackendSpec> {
    let is_tried = |spec: &BackendSpec| {
        let keys = spec.entry().keys.iter();
        let by_default = keys
            .filter(|k| ["builder", "mode"].contains(&k.name))
            .all(|k| spec.value(k.name) == k.default);
        let order = spec.find_value("order");
        by_default || order.is_none_or(|order| ORDERS_FOR_EVERY_BUILDER.contains(&order))
    };
    every_spec().into_iter().filter(is_tried).collect()
}
