//! The key `mode` of native backends: which triangle test answers shadow rays.

use super::{BackendSpec, Choice, Key};
use crate::intersect::Mode;

/// Closest hits, which only say where shadow rays start, are those of [`Mode::Fast`] in either mode.
pub(super) const KEY: Key = Key {
    name: "mode",
    about: "how sure answers to shadow rays are",
    choices: || {
        vec![
            Choice {
                name: "exact",
                about: "never wrong: what f32 leaves in doubt goes to wider numbers",
            },
            Choice {
                name: "fast",
                about: "rounded arithmetic: can be wrong where a ray grazes an edge",
            },
        ]
    },
    default: "exact",
};

/// What a checked spec asks for.
pub(super) fn of(spec: &BackendSpec) -> Mode {
    match spec.value("mode") {
        "fast" => Mode::Fast,
        _ => Mode::Exact,
    }
}
