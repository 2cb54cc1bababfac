//! The town: squares with a tall house on arcades, a gabled house, a market canopy, a wall with a gate,
//! a fountain and shade sails, within a ring of houses.

use super::super::kit::{PI, Place, Rng, Shape, V, at, mix, tilted, turned, v};

/// Width and depth of a square with the streets around it.
const SQUARE: f64 = 52.0;
/// How near to a wall somebody may come.
const MARGIN: f64 = 0.55;

/// What stands, and where people may not walk.
pub(super) struct Town {
    pub(super) shape: Shape,
    /// Half its width and depth, within the ring of houses.
    pub(super) half: f64,
    /// Eye, and where it looks.
    pub(super) view: (V, V),
    /// Footprints: least and greatest x and z.
    blocked: Vec<[[f64; 2]; 2]>,
}

impl Town {
    /// A town of `squares` by `squares` squares around the origin.
    pub(super) fn new(squares: u32, seed: u64) -> Self {
        let half = 0.5 * SQUARE * f64::from(squares);
        let front = half - 0.5 * SQUARE;
        let x = if squares.is_multiple_of(2) { -0.5 * SQUARE } else { 0.0 };
        let view = (v(x + 5.0, 3.4, front + 23.5), v(x - 2.5, 2.2, front - 8.0));
        let mut town = Self { shape: Shape::new(), half, view, blocked: Vec::new() };
        let wide = half + 80.0;
        let p = |x: f64, z: f64| v(x * wide, 0.0, z * wide);
        town.shape.quad(p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0), p(-1.0, -1.0));
        for i in 0..squares * squares {
            let middle = |k: u32| (f64::from(k) + 0.5) * SQUARE - half;
            let (x, z) = (middle(i % squares), middle(i / squares));
            // The one in view stands as it was drawn.
            let quarters = if z == front { 0 } else { 2 * (i % 2) };
            let mut rng = Rng::new(seed, &format!("square {i}"));
            town.square(turned(v(x, 0.0, z), PI * 0.5 * f64::from(quarters)), &mut rng);
        }
        town.ring(seed);
        town
    }

    /// Whether somebody can stand at `p`.
    pub(super) fn is_free(&self, p: V) -> bool {
        let within = self.half - MARGIN;
        let outside = |[x, z]: &[[f64; 2]; 2]| {
            p.x < x[0] - MARGIN || p.x > x[1] + MARGIN || p.z < z[0] - MARGIN || p.z > z[1] + MARGIN
        };
        p.x.abs() < within && p.z.abs() < within && self.blocked.iter().all(outside)
    }

    /// Keeps people out of `size` around `middle` of what is placed at `place`, by quarter turns.
    fn block(&mut self, place: &Place, middle: V, size: V) {
        let corners = [-0.5, 0.5].map(|side| place.transform_point3(middle + size * side));
        let range = |a: f64, b: f64| [a.min(b), a.max(b)];
        let [a, b] = corners;
        self.blocked.push([range(a.x, b.x), range(a.z, b.z)]);
    }

    fn square(&mut self, place: Place, rng: &mut Rng) {
        let tall = v(-13.0, 0.0, -13.0);
        let height = rng.range(15.0, 22.0);
        self.shape.add(&arcaded_house(18.0, 15.0, height), place * at(tall));
        self.block(&place, tall - V::Z * 1.75, v(18.0, 0.0, 11.5));
        let gabled = v(15.5, 0.0, 10.0);
        self.shape.add(&gabled_house(11.0, 15.0, rng.range(8.0, 11.0)), place * at(gabled));
        self.block(&place, gabled, v(11.0, 0.0, 15.0));
        self.shape.add(&canopy(17.0, 12.0), place * at(v(11.0, 0.0, -13.0)));
        let wall = v(-15.0, 0.0, 12.0);
        self.shape.add(&wall_with_gate(), place * at(wall));
        for x in [-5.25, 5.25] {
            self.block(&place, wall + V::X * x, v(7.5, 0.0, 0.7));
        }
        self.shape.add(&fountain(), place * at(V::ZERO));
        self.block(&place, V::ZERO, v(4.4, 0.0, 4.4));
        for k in 0..5 {
            let k = f64::from(k);
            let at = v(mix(-9.0, 9.0, k / 4.0), rng.range(5.6, 7.2), rng.range(0.0, 6.5));
            self.shape.add(&sail(rng), place * turned(at, rng.angle()));
        }
        for (x, z) in [(-4.5, -3.5), (5.5, -4.0), (-6.5, 6.0), (7.0, 19.0), (-20.0, 19.5)] {
            self.shape.add(&lamp(), place * at(v(x, -0.002, z)));
            self.block(&place, v(x, 0.0, z), v(0.3, 0.0, 0.3));
        }
    }

    /// Houses wall to wall around all squares.
    fn ring(&mut self, seed: u64) {
        let mut rng = Rng::new(seed, "ring");
        let houses = (2.0 * self.half / 13.0).round().max(1.0);
        let width = 2.0 * self.half / houses;
        for side in 0..4 {
            for i in 0..houses as u32 {
                let along = (f64::from(i) + 0.5) * width - self.half;
                let height = rng.range(11.0, 20.0);
                let place = turned(V::ZERO, PI * 0.5 * f64::from(side))
                    * at(v(along, 0.0, -self.half - 7.0));
                self.shape.add(&row_house(width, height, side == 0), place);
            }
        }
    }
}

/// A house of `width` along x and `depth` along z whose upper floors stand on arcades at the front, +z.
fn arcaded_house(width: f64, depth: f64, height: f64) -> Shape {
    Shape::of(|s| {
        let (walk, floor) = (3.5, 4.4);
        s.block(v(0.0, -0.01, -0.5 * walk), v(width, floor + 0.02, depth - walk));
        s.block(v(0.0, floor, 0.0), v(width, height - floor, depth));
        s.bevelled(v(0.0, height - 0.02, 0.0), v(width + 0.8, 0.5, depth + 0.8), 0.1);
        let bays = (width / 3.0).round();
        let bay = width / bays;
        for i in 0..bays as u32 {
            let x = (f64::from(i) + 0.5) * bay - 0.5 * width;
            let arch = Shape::of(|s| s.arch(bay, floor - 2.7, 0.6, 0.5 * bay - 0.35, 12));
            s.add(&arch, at(v(x, 2.7, 0.5 * depth - 0.31)));
        }
        let column = Shape::of(|s| {
            s.block(V::ZERO, v(0.74, 0.3, 0.62));
            s.lathe(&[(0.3, 0.29), (0.24, 0.4), (0.21, 2.4), (0.34, 2.62)], 14);
            s.block(v(0.0, 2.6, 0.0), v(0.74, 0.11, 0.62));
        });
        for i in 0..=bays as u32 {
            let x = f64::from(i) * bay - 0.5 * width;
            let x = x.clamp(-0.5 * width + 0.37, 0.5 * width - 0.37);
            s.add(&column, at(v(x, -0.002, 0.5 * depth - 0.31)));
        }
        let floors = ((height - floor - 1.0) / 3.2) as u32;
        for i in 0..floors * bays as u32 {
            let x = (f64::from(i % bays as u32) + 0.5) * bay - 0.5 * width;
            let y = floor + 0.9 + 3.2 * f64::from(i / bays as u32);
            s.add(&window(), at(v(x, y, 0.5 * depth)));
        }
    })
}

/// A window's frame and sill, proud of a wall at z = 0.
fn window() -> Shape {
    Shape::of(|s| {
        for x in [-0.55, 0.55] {
            s.block(v(x, 0.0, 0.03), v(0.1, 1.7, 0.12));
        }
        s.block(v(0.0, 1.68, 0.03), v(1.3, 0.12, 0.16));
        s.block(v(0.0, -0.1, 0.06), v(1.4, 0.11, 0.24));
        s.block(v(0.0, 0.0, 0.005), v(0.05, 1.69, 0.04));
    })
}

/// A house with its ridge along z.
fn gabled_house(width: f64, depth: f64, height: f64) -> Shape {
    Shape::of(|s| {
        s.block(v(0.0, -0.01, 0.0), v(width, height, depth));
        let (half, eave, ridge) = (0.5 * width + 0.5, 0.5 * depth + 0.5, height + 4.6);
        let p = |x: f64, y: f64, z: f64| v(x * half, y, z * eave);
        let low = height - 0.3;
        s.quad(p(-1.0, low, 1.0), p(0.0, ridge, 1.0), p(0.0, ridge, -1.0), p(-1.0, low, -1.0));
        s.quad(p(1.0, low, -1.0), p(0.0, ridge, -1.0), p(0.0, ridge, 1.0), p(1.0, low, 1.0));
        for z in [-0.5, 0.5] {
            let (a, b) = (
                v(-0.5 * width, height - 0.02, z * depth),
                v(0.5 * width, height - 0.02, z * depth),
            );
            s.tri(a, b, v(0.0, ridge - 0.35, z * depth));
        }
        for i in 0..8 {
            let (z, y) = (f64::from(i % 4) * 3.4 - 5.1, 1.2 + 3.3 * f64::from(i / 4));
            s.add(&window(), turned(v(-0.5 * width, y, z), -PI * 0.5));
        }
        for i in 0..6 {
            let (x, y) = (f64::from(i % 3) * 3.2 - 3.2, 1.2 + 3.3 * f64::from(i / 3));
            s.add(&window(), at(v(x, y, 0.5 * depth)));
        }
    })
}

/// A roof of cloth in bays on posts.
fn canopy(width: f64, depth: f64) -> Shape {
    Shape::of(|s| {
        let bays = 4;
        for i in 0..bays {
            let x = |t: f64| ((f64::from(i) + t) / f64::from(bays) - 0.5) * width;
            // Each bay sags between its beams.
            s.grid([6, 4], [false, false], |u, w| {
                let sag = 0.5 * u * (1.0 - u);
                v(x(u), 4.3 - sag + 1.1 * w, mix(0.5, -0.5, w) * depth)
            });
        }
        for i in 0..=bays {
            let x = (f64::from(i) / f64::from(bays) - 0.5) * width;
            for (z, top) in [(0.48, 4.34), (0.0, 4.87), (-0.48, 5.4)] {
                s.rod(v(x, -0.01, z * depth), v(x, top, z * depth), 0.08, 8);
            }
            let (a, b) = (v(x, 4.3, 0.5 * depth), v(x, 5.4, -0.5 * depth));
            s.rod(a, b, 0.06, 6);
        }
    })
}

/// A garden wall along x, 18 wide, with a gate in the middle.
fn wall_with_gate() -> Shape {
    Shape::of(|s| {
        for x in [-5.25, 5.25] {
            s.block(v(x, -0.01, 0.0), v(7.5, 3.2, 0.5));
            s.bevelled(v(x, 3.18, 0.0), v(7.6, 0.2, 0.7), 0.05);
        }
        for x in [-1.7, 1.7] {
            s.bevelled(v(x, -0.01, 0.0), v(0.6, 4.0, 0.7), 0.05);
        }
        let arch = Shape::of(|s| s.arch(4.0, 1.9, 0.6, 1.4, 16));
        s.add(&arch, at(v(0.0, 2.6, 0.0)));
    })
}

fn fountain() -> Shape {
    Shape::of(|s| {
        let basin =
            [(0.0, -0.01), (2.1, -0.01), (2.1, 0.55), (1.85, 0.6), (1.8, 0.25), (0.4, 0.25)];
        s.lathe(&basin, 40);
        let stem = [(0.4, 0.25), (0.22, 0.7), (0.2, 1.5), (0.9, 1.75), (0.92, 1.85), (0.12, 1.7)];
        s.lathe(&stem, 32);
        s.lathe(&[(0.14, 1.65), (0.1, 2.4), (0.35, 2.55), (0.0, 2.75)], 20);
    })
}

/// A three-cornered sail that hangs level, more or less.
fn sail(rng: &mut Rng) -> Shape {
    let corner = |x: f64, z: f64, rng: &mut Rng| v(x, rng.range(-0.7, 0.7), z);
    let a = corner(-3.6, -2.4, rng);
    let b = corner(3.6, -2.2, rng);
    let c = corner(0.2, 4.4, rng);
    Shape::of(|s| s.tri(a, c, b)).placed(tilted(V::ZERO, 0.0, 0.1, 0.05))
}

fn lamp() -> Shape {
    Shape::of(|s| {
        s.lathe(&[(0.16, 0.0), (0.15, 0.15), (0.06, 0.3), (0.045, 3.6), (0.0, 3.62)], 10);
        s.lathe(&[(0.1, 3.6), (0.17, 3.95), (0.22, 4.0), (0.0, 4.2)], 8);
    })
}

/// A house of the ring, facing +z, with eaves and windows on the side that is seen.
fn row_house(width: f64, height: f64, windows: bool) -> Shape {
    Shape::of(|s| {
        s.block(v(0.0, -0.01, 0.0), v(width, height, 14.0));
        s.block(v(0.0, height - 0.02, 0.1), v(width - 0.05, 0.35, 14.6));
        let bays = if windows { 4 } else { 0 };
        for i in 0..bays * ((height - 1.5) / 3.3) as u32 {
            let x = ((f64::from(i % bays) + 0.5) / f64::from(bays) - 0.5) * width;
            s.add(&window(), at(v(x, 1.1 + 3.3 * f64::from(i / bays), 7.0)));
        }
    })
}
