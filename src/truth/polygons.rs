//! Irradiance of quad lights with nothing in the way: across the horizon, small, far, edge-on.

use super::stage::{Stage, quad};
use super::{Case, CaseEntry};
use crate::geometry::Vec3;
use crate::scene::LightShape;

pub(super) static ABOVE: CaseEntry = CaseEntry {
    name: "quad-above",
    about: "a square of 2 x 2 at height 1, facing down",
    make: || lit(Stage::floor([0.2, -0.1], 1.0, 0.5), above(1.0)),
};

pub(super) static BESIDE: CaseEntry = CaseEntry {
    name: "quad-beside",
    about: "an upright square that the horizon halves",
    make: || {
        let light = quad([1.0, -1.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0]);
        lit(Stage::floor([0.0, 0.1], 0.8, 0.5), light)
    },
};

pub(super) static TILTED: CaseEntry = CaseEntry {
    name: "quad-tilted",
    about: "a slanted rectangle whose corner is below a slope's horizon",
    make: || {
        let light = quad([1.5, -1.0, 0.5], [-2.0, -0.5, 1.5], [0.0, 3.0, 1.0]);
        lit(Stage::tilted(Vec3::new(0.1, 0.0, -0.2), Vec3::new(-0.9, 0.8, 0.5), 0.6, 0.5), light)
    },
};

pub(super) static TURNED: CaseEntry = CaseEntry {
    name: "quad-turned",
    about: "a square that faces away: dark",
    make: || {
        let light = quad([-1.0, -1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        lit(Stage::floor([0.0, 0.0], 1.0, 0.5), light)
    },
};

pub(super) static BELOW: CaseEntry = CaseEntry {
    name: "quad-below",
    about: "a square that lies below the horizon: dark",
    make: || {
        let light = quad([1.0, -1.0, -0.1], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0]);
        lit(Stage::floor([3.0, 0.0], 1.0, 0.5), light)
    },
};

pub(super) static SHEARED: CaseEntry = CaseEntry {
    name: "quad-sheared",
    about: "a parallelogram, partly below the horizon",
    make: || {
        let light = quad([1.5, -1.0, -0.5], [-1.0, 0.8, 1.5], [0.4, 2.0, 0.3]);
        lit(Stage::floor([0.0, 0.0], 0.6, 0.5), light)
    },
};

pub(super) static STRIP: CaseEntry = CaseEntry {
    name: "quad-strip",
    about: "a tube of 20 x 0.02 across the room",
    make: || {
        let light = quad([-10.0, 0.1, 1.0], [0.0, 0.02, 0.0], [20.0, 0.0, 0.0]);
        lit(Stage::floor([0.0, 0.0], 0.8, 0.5), light)
    },
};

pub(super) static NEAR: CaseEntry = CaseEntry {
    name: "quad-near",
    about: "a square a thousandth of its size away, from under it to beside it",
    make: || lit(Stage::floor([0.9, 0.0], 0.2, 8e-4), above(2e-3)).not_by_area(),
};

pub(super) static SMALL: CaseEntry = CaseEntry {
    name: "quad-small",
    about: "a square on both sides of the size from which on it is sampled in solid angle",
    make: || {
        // A solid angle of 1e-5 is 3.16 away.
        let light = quad([0.0, 0.0, 3.0], [0.0, 0.01, 0.0], [0.01, 0.0, 0.0]);
        lit(Stage::floor([0.7, 0.0], 1.0, 0.5), light)
    },
};

pub(super) static EDGE_ON: CaseEntry = CaseEntry {
    name: "quad-edge-on",
    about: "an upright square in whose plane the patch lies: half of it sees the dark side",
    make: || edge_on(0.1),
};

pub(super) static EDGE_ON_FLAT: CaseEntry = CaseEntry {
    name: "quad-edge-on-flat",
    about: "the same so near its plane that it is on both sides of the size for solid angles",
    make: || edge_on(2e-5),
};

pub(super) static EDGE_ON_NEAR: CaseEntry = CaseEntry {
    name: "quad-edge-on-near",
    about: "a square of 2 x 2 that stands on the floor 0.01 away, from before to beside it",
    make: || {
        let light = quad([0.0, -1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
        lit(Stage::floor([0.01, 1.0], 0.009, 0.01), light).not_by_area()
    },
};

/// A patch and a light, and nothing else.
fn lit(stage: Stage, light: LightShape) -> Case {
    stage.blocked(light, &[])
}

/// A square of 2 x 2 that faces down.
fn above(height: f32) -> LightShape {
    quad([-1.0, -1.0, height], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0])
}

/// A light in the plane x = 0 that faces +x, over a patch of this half size.
fn edge_on(half: f32) -> Case {
    let light = quad([0.0, -0.5, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    lit(Stage::floor([0.0, 0.0], half, half), light)
}
