//! Visibility beside walls, in wedges, pits and boxes, under spheres and sheets.

use super::form_factor::{Receiver, long_wall, wall_within, wedge_opening};
use super::stage::{FAR, Stage, exact, sheet};
use super::{Case, CaseEntry};
use crate::geometry::Vec3;
use glam::DVec3;
use std::f32::consts::{PI, TAU};

pub(super) static WALL: CaseEntry = CaseEntry {
    name: "wall",
    about: "beside a wall without end: half of the sky, at any distance",
    make: || {
        let stage = Stage::floor([0.0, 0.0], 0.5, 0.5).polygon(&wall(1.0, FAR));
        stage.visibility(None, |_| 0.5).within(1.5 / f64::from(FAR))
    },
};

pub(super) static CORNER: CaseEntry = CaseEntry {
    name: "corner",
    about: "in the inner corner of two walls without end: a quarter of the sky",
    make: || {
        let across = wall(1.0, FAR).map(|p| Vec3::new(p.y, p.x, p.z));
        let stage = Stage::floor([0.0, 0.0], 0.9, 0.5).polygon(&wall(1.0, FAR)).polygon(&across);
        stage.visibility(None, |_| 0.25).within(4.0 / f64::from(FAR))
    },
};

pub(super) static WEDGE_30: CaseEntry = CaseEntry {
    name: "wedge-30",
    about: "in a wedge of 30 degrees, at any distance from its edge",
    make: || wedge(PI / 6.0),
};

pub(super) static WEDGE_60: CaseEntry = CaseEntry {
    name: "wedge-60",
    about: "in a wedge of 60 degrees: a quarter of the sky",
    make: || wedge(PI / 3.0),
};

pub(super) static WEDGE_120: CaseEntry = CaseEntry {
    name: "wedge-120",
    about: "in a wedge of 120 degrees: three quarters of the sky",
    make: || wedge(2.0 * PI / 3.0),
};

pub(super) static LONG_WALL: CaseEntry = CaseEntry {
    name: "long-wall",
    about: "beside a wall of height 1 without ends",
    make: || {
        let stage = Stage::floor([0.0, 0.0], 0.8, 0.5).polygon(&wall(1.0, 1.0));
        stage.visibility(None, |r| 1.0 - long_wall(1.0 - r.at.x, 1.0))
    },
};

pub(super) static WALL_WITHIN: CaseEntry = CaseEntry {
    name: "wall-within",
    about: "beside a wall that ends beyond the radius, from a twentieth of the radius to out of reach",
    make: || {
        let stage = Stage::floor([-0.2, 0.0], 1.2, 0.5).polygon(&wall(1.1, 3.0));
        let at = f64::from(1.1f32);
        stage.visibility(Some(2.0), move |r| 1.0 - wall_within(at - r.at.x, 2.0))
    },
};

pub(super) static SQUARE_PIT: CaseEntry = CaseEntry {
    name: "square-pit",
    about: "on the floor of a pit 2 wide and 1.5 deep",
    make: || {
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        pit(&square, 1.5, 0.8)
    },
};

pub(super) static ROUND_PIT: CaseEntry = CaseEntry {
    name: "round-pit",
    about: "on the floor of a pit with 48 sides",
    make: || {
        let corner = |i| {
            let (sin, cos) = (i as f32 * (TAU / 48.0)).sin_cos();
            [cos, sin]
        };
        pit(&(0..48).map(corner).collect::<Vec<_>>(), 0.7, 0.6)
    },
};

pub(super) static BOX: CaseEntry = CaseEntry {
    name: "box",
    about: "in a closed box: nothing of the sky",
    make: || closed_box().visibility(None, |_| 0.0),
};

pub(super) static BOX_BEYOND: CaseEntry = CaseEntry {
    name: "box-beyond",
    about: "in a closed box whose walls are beyond the radius: all of the sky",
    make: || closed_box().visibility(Some(0.45), |_| 1.0),
};

pub(super) static SPHERE: CaseEntry = CaseEntry {
    name: "sphere",
    about: "under a sphere of radius 1 at height 2, as the polyhedron that it is",
    make: || sphere(Vec3::new(0.0, 0.0, 2.0), 1.0),
};

pub(super) static SPHERE_SETTING: CaseEntry = CaseEntry {
    name: "sphere-setting",
    about: "beside a sphere that the horizon cuts",
    make: || sphere(Vec3::new(1.9, 0.2, 0.3), 0.75),
};

pub(super) static CEILING: CaseEntry = CaseEntry {
    name: "ceiling",
    about: "on a slope under a square that reaches below its horizon",
    make: || {
        let stage = Stage::tilted(Vec3::ZERO, Vec3::new(-1.2, 0.3, 1.0), 0.4, 0.3);
        sheets(stage, vec![sheet([-1.0, -1.5], [3.0, 2.0], 1.0)])
    },
};

pub(super) static SHEETS: CaseEntry = CaseEntry {
    name: "sheets",
    about: "under three sheets that overlap",
    make: || {
        let triangle = [[-1.0, 0.5, 1.5], [1.2, -0.8, 0.9], [0.3, 1.6, 1.2]].map(Vec3::from);
        let all = vec![
            sheet([-0.5, -0.5], [1.0, 0.25], 0.7),
            sheet([-1.0, -0.25], [0.25, 1.0], 0.8),
            triangle.into(),
        ];
        sheets(Stage::floor([0.1, 0.0], 0.6, 0.4), all)
    },
};

/// The plane x = `x` from the floor to `height`.
fn wall(x: f32, height: f32) -> [Vec3; 4] {
    [[-FAR, 0.0], [FAR, 0.0], [FAR, height], [-FAR, height]].map(|[y, z]| Vec3::new(x, y, z))
}

/// The floor up to x = 1, and a plane that rises there.
fn wedge(angle: f32) -> Case {
    let (sin, cos) = angle.sin_cos();
    let corners = [[-FAR, 0.0], [FAR, 0.0], [FAR, FAR], [-FAR, FAR]];
    let corners = corners.map(|[y, s]| Vec3::new(1.0 - s * cos, y, s * sin));
    let value = wedge_opening(f64::from(sin).atan2(f64::from(cos)));
    let stage = Stage::floor([0.0, 0.0], 0.5, 0.25).polygon(&corners);
    stage.visibility(None, move |_| value).within(2.0 / f64::from(FAR))
}

/// The floor within walls along a convex `outline`: what is seen is the opening.
fn pit(outline: &[[f32; 2]], depth: f32, half: f32) -> Case {
    let at = |[x, y]: [f32; 2], z| Vec3::new(x, y, z);
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    let sides: Vec<_> =
        sides.map(|(&a, &b)| vec![at(a, 0.0), at(b, 0.0), at(b, depth), at(a, depth)]).collect();
    let opening: Vec<_> = outline.iter().map(|&p| at(p, depth).as_dvec3()).collect();
    let stage = Stage::floor([0.0, 0.0], half, 0.4).polygons(&sides);
    stage.visibility(None, move |r| r.polygon(&opening))
}

/// A floor of half size 0.5 in a box that is at least half a unit away.
fn closed_box() -> Stage {
    let side = |axis: usize, side: f32| {
        let corner = |[u, v]: [f32; 2]| {
            let mut p = Vec3::splat(side);
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
            p
        };
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner).to_vec()
    };
    let sides: Vec<_> = (0..3).flat_map(|axis| [side(axis, -1.0), side(axis, 1.0)]).collect();
    Stage::floor([0.0, 0.0], 0.5, 0.5).polygons(&sides)
}

/// A floor and a sphere as rings of quads. Seen from outside, its front faces are its outline.
fn sphere(center: Vec3, radius: f32) -> Case {
    const RINGS: u32 = 10;
    const SECTORS: u32 = 20;
    let at = |ring: u32, sector: u32| {
        let (ring_sin, ring_cos) = (ring as f32 * (PI / RINGS as f32)).sin_cos();
        let (sin, cos) = ((sector % SECTORS) as f32 * (TAU / SECTORS as f32)).sin_cos();
        center + Vec3::new(ring_sin * cos, ring_sin * sin, ring_cos) * radius
    };
    let mut faces = Vec::new();
    for (ring, sector) in (0..RINGS).flat_map(|r| (0..SECTORS).map(move |s| (r, s))) {
        let [a, b] = [at(ring, sector), at(ring, sector + 1)];
        let [c, d] = [at(ring + 1, sector + 1), at(ring + 1, sector)];
        if ring + 1 < RINGS {
            faces.push(vec![a, c, d]);
        }
        if ring > 0 {
            faces.push(vec![a, b, c]);
        }
    }
    let middle = center.as_dvec3();
    let exact: Vec<_> = faces.iter().map(|face| exact(face)).collect();
    let value = move |receiver: &Receiver| {
        let in_front = |face: &&Vec<DVec3>| {
            let normal = (face[1] - face[0]).cross(face[2] - face[0]);
            let outwards = normal * normal.dot(face[0] - middle).signum();
            outwards.dot(receiver.at - face[0]) > 0.0
        };
        1.0 - exact.iter().filter(in_front).map(|face| receiver.polygon(face)).sum::<f64>()
    };
    Stage::floor([0.0, 0.0], 0.8, 0.5).polygons(&faces).visibility(None, value)
}

/// A patch under convex sheets.
fn sheets(stage: Stage, sheets: Vec<Vec<Vec3>>) -> Case {
    let exact: Vec<_> = sheets.iter().map(|sheet| exact(sheet)).collect();
    stage.polygons(&sheets).visibility(None, move |r| 1.0 - r.union(&exact))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::form_factor::parallel_disk;

    /// The value of a case at a point of the floor.
    fn on_floor(case: &CaseEntry, x: f64, y: f64) -> f64 {
        let receiver = Receiver { at: DVec3::new(x, y, 0.0), normal: DVec3::Z };
        ((case.make)().value)(&receiver)
    }

    /// What is known of the ideal shape holds for the polyhedron, within what it lacks.
    #[test]
    fn polyhedra_are_nearly_round() {
        for (x, y) in [(0.0, 0.0), (0.5, -0.3)] {
            let pit = on_floor(&ROUND_PIT, x, y);
            let [outer, inner] = [1.0, (std::f64::consts::PI / 48.0).cos()]
                .map(|radius| parallel_disk(f64::from(0.7f32), x.hypot(y), radius));
            assert!(inner < pit && pit < outer, "{inner} {pit} {outer}");
            // The sphere as polyhedron lies in the sphere, and holds one that is 4 % smaller.
            let to_center = DVec3::new(-x, -y, 2.0);
            let receiver = Receiver { at: DVec3::ZERO, normal: DVec3::Z };
            let [outer, inner] =
                [1.0, 0.96].map(|r| receiver.cone(to_center, r / to_center.length()));
            let sphere = 1.0 - on_floor(&SPHERE, x, y);
            assert!(inner < sphere && sphere < outer, "{inner} {sphere} {outer}");
        }
    }

    /// Ideal values against polygons as large as they are built.
    #[test]
    fn walls_and_wedges_are_polygons() {
        for (case, corners) in [(&WALL, wall(1.0, FAR)), (&LONG_WALL, wall(1.0, 1.0))] {
            for x in [-0.5, 0.0, 0.4] {
                let receiver = Receiver { at: DVec3::new(x, 0.3, 0.0), normal: DVec3::Z };
                let expected = 1.0 - receiver.polygon(&exact(&corners));
                let error = (on_floor(case, x, 0.3) - expected).abs();
                assert!(error <= (case.make)().slack + 1e-9, "{case:?}: {error}");
            }
        }
    }

    #[test]
    fn pits_have_the_known_value_at_the_centre() {
        // By arc tangents (Howell, B-3), 4 F(2/3, 2/3).
        let x = 1f64 / 1.5;
        let q = (1.0 + x * x).sqrt();
        let expected = 4.0 * 2.0 * x / q * (x / q).atan() / std::f64::consts::TAU;
        let value = on_floor(&SQUARE_PIT, 0.0, 0.0);
        assert!((value - expected).abs() < 1e-12, "{value} is not {expected}");
    }
}
