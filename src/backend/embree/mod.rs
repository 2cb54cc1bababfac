//! Intel Embree 4, the baseline beside the native backends.
//!
//! The catalogue lists it in every build, so that specs and help are the same everywhere; only
//! builds with the feature `embree` can build one.

#[cfg(feature = "embree")]
mod abi;
#[cfg(feature = "embree")]
mod accelerator;
#[cfg(feature = "embree")]
mod error;
#[cfg(feature = "embree")]
mod ffi;
#[cfg(feature = "embree")]
mod moving;

use super::catalogue::BackendEntry;
use super::{Choice, Key};

/// The catalogue's entry.
pub(super) static ENTRY: BackendEntry = BackendEntry {
    name: "embree",
    about: "Intel Embree 4, the usual CPU ray-tracing library",
    keys: &[
        Key {
            name: "quality",
            about: "Embree's build quality",
            choices: || {
                vec![
                    Choice { name: "low", about: "Morton order: the fastest build" },
                    Choice { name: "medium", about: "binned SAH" },
                    Choice { name: "high", about: "SAH with spatial splits: the fastest rays" },
                ]
            },
            default: "high",
        },
        Key {
            name: "mode",
            about: "Embree's scene flag for accuracy",
            choices: || {
                vec![
                    Choice { name: "fast", about: "Embree's default; may miss at shared edges" },
                    Choice { name: "robust", about: "watertight at shared edges, slower" },
                ]
            },
            default: "fast",
        },
        Key {
            name: "width",
            about: "rays a call",
            choices: || {
                vec![
                    Choice { name: "1", about: "single rays (rtcOccluded1)" },
                    Choice { name: "4", about: "packets of 4 (rtcOccluded4)" },
                    Choice { name: "8", about: "packets of 8 (rtcOccluded8)" },
                    Choice { name: "16", about: "packets of 16 (rtcOccluded16)" },
                ]
            },
            default: "1",
        },
        Key {
            name: "flags",
            about: "what Embree is told of the rays; matters for packets only",
            choices: || {
                vec![
                    Choice { name: "incoherent", about: "rays may go anywhere" },
                    Choice { name: "coherent", about: "rays of a packet go the same way" },
                ]
            },
            default: "incoherent",
        },
    ],
    moving_keys: &[
        Key {
            name: "update",
            about: "how trees follow the triangles",
            choices: || {
                vec![
                    Choice { name: "rebuild", about: "built anew by `quality` in each frame" },
                    Choice {
                        name: "refit",
                        about: "boxes refitted; the first tree is by binned SAH for any `quality`",
                    },
                ]
            },
            default: "rebuild",
        },
        Key {
            name: "geometries",
            about: "what Embree is told of the scene's objects",
            choices: || {
                vec![
                    Choice { name: "one", about: "nothing: all triangles are one geometry" },
                    Choice {
                        name: "objects",
                        about: "each is a geometry with a tree; only those that move are updated",
                    },
                ]
            },
            default: "one",
        },
        Key {
            name: "scene",
            about: "Embree's scene flag for changes",
            choices: || {
                vec![
                    Choice { name: "dynamic", about: "trees and memory are kept between frames" },
                    Choice { name: "static", about: "everything is thrown away at each frame" },
                ]
            },
            default: "dynamic",
        },
    ],
    unavailable: if cfg!(feature = "embree") { None } else { Some(UNAVAILABLE) },
    check: Some(check),
    build,
    build_moving: BUILD_MOVING,
};

const UNAVAILABLE: &str =
    "this build has no Embree: run `make setup`, then build with `--features embree`";

#[cfg(feature = "embree")]
const BUILD_MOVING: Option<super::BuildMoving> = Some(moving::build_moving);
// Nothing can be built that could be built anew.
#[cfg(not(feature = "embree"))]
const BUILD_MOVING: Option<super::BuildMoving> = None;

fn check(spec: &super::BackendSpec) -> Result<(), String> {
    match (spec.value("update"), spec.value("scene")) {
        ("refit", "static") => Err("a static scene keeps no tree that could be refitted".into()),
        _ => Ok(()),
    }
}

#[cfg(feature = "embree")]
use accelerator::build;

#[cfg(not(feature = "embree"))]
fn build(
    spec: &super::BackendSpec,
    _: &super::BuildContext<'_>,
) -> crate::Result<Box<dyn super::Accelerator>> {
    Err(crate::Error::Backend { backend: spec.to_string(), message: UNAVAILABLE.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::BackendSpec;

    #[test]
    fn specs_parse_in_every_build() {
        let spec: BackendSpec = "embree:mode=robust,width=8".parse().unwrap();
        assert_eq!(spec.full(), "embree:quality=high,mode=robust,width=8,flags=incoherent");
        assert!("embree:width=2".parse::<BackendSpec>().is_err());
    }

    #[test]
    fn a_build_without_it_says_how_to_get_it() {
        assert_eq!(ENTRY.unavailable.is_none(), cfg!(feature = "embree"));
        if let Some(line) = ENTRY.unavailable {
            assert!(line.contains("make setup") && line.contains("--features embree"));
        }
    }
}
