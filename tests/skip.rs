//! Skipping: whatever is left out, the picture has the same bits, and what is left out is counted.

mod common;

use common::random::Random;
use common::{built, every_spec, scene_of};
use sato::backend::{Accelerator, BackendSpec};
use sato::geometry::{TriangleMesh, Vec3};
use sato::render::{
    ClassStats, Film, LightSampling, Pass, RenderOptions, RenderSettings, Rendering, SAMPLERS,
    Skip, Skips, render,
};
use sato::scene::{Camera, Light, LightShape, Scene};

/// Corners and triangles under way.
#[derive(Default)]
struct Shapes {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Shapes {
    fn triangle(&mut self, corners: [[f32; 3]; 3]) -> &mut Self {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners.map(Vec3::from));
        self.triangles.push([first, first + 1, first + 2]);
        self
    }

    fn quad(&mut self, [a, b, c, d]: [[f32; 3]; 4]) -> &mut Self {
        self.triangle([a, b, c]).triangle([a, c, d])
    }

    /// Level, `[x0, x1] x [z0, z1]`.
    fn level(&mut self, y: f32, [x0, x1]: [f32; 2], [z0, z1]: [f32; 2]) -> &mut Self {
        self.quad([[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]])
    }

    fn floor(&mut self) -> &mut Self {
        self.level(0.0, [-4.0, 4.0], [-4.0, 4.0])
    }

    /// A grid of points over `[-3, 3]` squared.
    fn grid(&mut self, cells: usize, at: impl Fn(f32, f32) -> [f32; 3]) -> &mut Self {
        let place = |i: usize| i as f32 / cells as f32 * 6.0 - 3.0;
        for i in 0..cells {
            for j in 0..cells {
                let [x, z] = [[place(i), place(i + 1)], [place(j), place(j + 1)]];
                self.quad([at(x[0], z[0]), at(x[1], z[0]), at(x[1], z[1]), at(x[0], z[1])]);
            }
        }
        self
    }

    fn scene(&mut self, lights: Vec<LightShape>) -> Scene {
        let Self { vertices, triangles } = std::mem::take(self);
        let mut scene = scene_of(TriangleMesh::new(vertices, triangles));
        scene.camera = Camera {
            eye: Vec3::new(0.3, 2.0, 6.0),
            look_at: Vec3::new(0.0, 0.2, 0.0),
            up: Vec3::Y,
            fov_degrees: 50.0,
        };
        scene.lights = lights
            .into_iter()
            .enumerate()
            .map(|(i, shape)| Light {
                name: format!("{}{i}", shape.kind()),
                shape,
                strength: Vec3::ONE,
            })
            .collect();
        scene
    }
}

fn quad(corner: [f32; 3], edge_u: Vec3, edge_v: Vec3) -> LightShape {
    LightShape::Quad { corner: corner.into(), edge_u, edge_v }
}

fn overhead() -> LightShape {
    quad([-0.5, 3.0, -0.5], Vec3::X, Vec3::Z)
}

/// Of every kind, above the floor.
fn all_lights() -> Vec<LightShape> {
    let sun = |degrees| LightShape::Directional {
        direction: Vec3::new(0.36, -0.8, -0.48),
        angular_diameter_degrees: degrees,
    };
    vec![
        overhead(),
        quad([1.0, 2.5, -1.0], Vec3::new(0.8, 0.1, 0.0), Vec3::new(0.5, 0.0, 0.6)),
        LightShape::Disk { center: Vec3::new(-2.0, 3.0, 0.0), normal: Vec3::NEG_Y, radius: 0.4 },
        LightShape::Sphere { center: Vec3::new(0.0, 3.5, -2.0), radius: 0.3 },
        sun(4.0),
        sun(0.0),
        LightShape::Point { position: Vec3::new(0.5, 2.0, 1.0) },
    ]
}

/// The scene, `scale` times as large and then moved.
fn moved(mut scene: Scene, scale: f32, by: Vec3) -> Scene {
    let at = |p: Vec3| p * scale + by;
    let vertices = scene.mesh.vertices().iter().map(|v| at(*v)).collect();
    scene.mesh = TriangleMesh::new(vertices, scene.mesh.triangles().to_vec()).into();
    (scene.camera.eye, scene.camera.look_at) = (at(scene.camera.eye), at(scene.camera.look_at));
    scene.defaults.ao_radius *= scale;
    for light in &mut scene.lights {
        match &mut light.shape {
            LightShape::Quad { corner, edge_u, edge_v } => {
                *corner = at(*corner);
                (*edge_u, *edge_v) = (*edge_u * scale, *edge_v * scale);
            }
            LightShape::Disk { center, radius, .. } | LightShape::Sphere { center, radius } => {
                (*center, *radius) = (at(*center), *radius * scale);
            }
            LightShape::Point { position } => *position = at(*position),
            LightShape::Directional { .. } => {}
        }
    }
    scene
}

fn open_sky() -> Scene {
    Shapes::default().floor().scene(all_lights())
}

/// One triangle between half of the floor and all lights.
fn roof() -> Scene {
    let roof = [[-0.5, 0.7, 40.0], [-0.5, 0.7, -40.0], [60.0, 0.7, 0.0]];
    let mut scene = Shapes::default().floor().triangle(roof).scene(all_lights());
    scene.camera.eye = Vec3::new(0.3, 0.6, 6.0);
    scene
}

/// A light that leans over its receivers so low that rays to it are shortened, to end before a wall
/// right before it that all ways to the light go through.
fn short_rays() -> Scene {
    let mut shapes = Shapes::default();
    shapes.level(0.0, [-0.05, 0.05], [-0.05, 0.05]);
    shapes.triangle([[0.998, -50.0, -50.0], [0.998, 50.0, -50.0], [0.998, 0.0, 90.0]]);
    let lamp = quad([1.0, 1e-6, -0.5], Vec3::Z, Vec3::new(-1e-3, 1e-6, 0.0));
    let mut scene = shapes.scene(vec![lamp]);
    scene.camera.eye = Vec3::new(0.0, 0.1, 0.01);
    scene.camera.look_at = Vec3::ZERO;
    scene
}

/// Boxes and bits on a floor.
fn clutter() -> Scene {
    let mut random = Random::new(0xc1);
    let mut shapes = Shapes::default();
    shapes.floor();
    let mesh = random.mesh(200);
    for index in 0..mesh.len() {
        let corners = mesh.triangle(index).0;
        if corners.iter().all(|c| (corners[0] - *c).length() < 1.0) {
            shapes.triangle(corners.map(|c| (c * 0.6 + Vec3::Y * 1.2).to_array()));
        }
    }
    shapes.scene(all_lights())
}

/// Two planes in a tile: of one some rays are stopped, of the other all, by a triangle that those of
/// the first cannot meet.
fn two_planes() -> Scene {
    let mut shapes = Shapes::default();
    shapes.level(0.0, [-3.0, -0.2], [-2.0, 2.0]);
    shapes.quad([[0.2, 0.0, -2.0], [3.0, 0.03, -2.0], [3.0, 0.03, 2.0], [0.2, 0.0, 2.0]]);
    shapes.triangle([[0.1, -20.0, -2.2], [0.1, 20.0, -2.2], [60.0, 0.0, -2.2]]);
    for i in 0..60 {
        let (x, z) = (-0.3 - (i % 8) as f32 * 0.3, -1.9 + (i / 8) as f32 * 0.4);
        shapes.triangle([[x, 0.1, z], [x + 0.03, 0.1, z], [x, 0.13, z]]);
    }
    shapes.scene(vec![quad([-0.2, 30.0, -60.0], Vec3::X * 0.4, Vec3::new(0.0, 0.4, 0.2))])
}

/// A strip of light whose sides are at right angles but for a part in a million: the rectangle that
/// is sampled in its place rises above the floor, which it does not.
fn skewed_strip() -> Scene {
    let strip =
        quad([-500.0, -1.1e-3, 5.0], Vec3::new(-9e-10, 1e-3, 0.0), Vec3::new(1000.0, 0.0, 0.0));
    Shapes::default().floor().scene(vec![strip])
}

/// Scenes in which leaving out too much would show.
fn scenes() -> Vec<(&'static str, Scene)> {
    let mut shapes = Shapes::default();
    let mut all = vec![("open sky", open_sky()), ("roof", roof()), ("clutter", clutter())];
    all.push(("two planes", two_planes()));
    all.push(("short rays", short_rays()));
    all.push(("skewed strip", skewed_strip()));
    shapes.floor().triangle([[-2.0, 1.5, 0.1], [2.0, 1.5, -0.1], [0.0, 1.5004, 0.0003]]);
    all.push(("sliver", shapes.scene(all_lights())));
    let on_horizon = vec![
        quad([4.0, -1.0, -1.0], Vec3::Z * 2.0, Vec3::Y * 2.0),
        quad([-4.0, 0.0, -1.0], Vec3::Y * 2.0, Vec3::Z * 2.0),
        LightShape::Disk { center: Vec3::new(0.0, 0.0, -4.0), normal: Vec3::Z, radius: 1.0 },
        LightShape::Sphere { center: Vec3::new(0.0, 0.0, -6.0), radius: 1.0 },
        LightShape::Directional { direction: Vec3::X, angular_diameter_degrees: 20.0 },
    ];
    shapes.floor().triangle([[1.0, 0.0, 0.0], [1.2, 0.0, 0.0], [1.0, 0.3, -0.5]]);
    all.push(("lights on the horizon", shapes.scene(on_horizon)));
    shapes.floor().level(3.0, [-4.0, 4.0], [-4.0, 4.0]).level(3.001, [-1.0, 1.0], [-1.0, 1.0]);
    shapes.level(4.0, [-1.0, 0.0], [-1.0, 1.0]);
    all.push(("ceiling", shapes.scene(all_lights())));
    // One hangs from the light, one stands on the floor.
    shapes.floor().quad([[0.5, 3.0, -0.5], [0.5, 3.0, 0.5], [0.5, 2.5, 0.5], [0.5, 2.5, -0.5]]);
    shapes.quad([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]);
    all.push(("touching", shapes.scene(all_lights())));
    let touching = all.last().map(|(_, scene)| scene.clone()).into_iter();
    for touching in touching {
        all.push(("tiny", moved(touching.clone(), 1e-4, Vec3::ZERO)));
        all.push(("huge", moved(touching.clone(), 1e5, Vec3::ZERO)));
        all.push(("far away", moved(touching, 1.0, Vec3::new(900.0, -2000.0, 300.0))));
    }
    // The light, but for a corner, is behind one triangle for some points.
    shapes.floor().triangle([[-9.0, 2.8, -0.6], [0.4, 2.8, 9.0], [0.4, 2.8, -0.6]]);
    all.push(("all but a corner", shapes.scene(all_lights())));
    // Rays pass to both sides of the diagonal.
    let wall = [[-3.0, 0.05, -1.0], [3.0, 0.05, -1.0], [3.0, 3.5, -1.2], [-3.0, 3.5, -1.2]];
    let behind = quad([-0.5, 0.5, -3.0], Vec3::X, Vec3::Y);
    shapes.floor().quad(wall);
    all.push(("wall", shapes.scene([all_lights(), vec![behind]].concat())));
    let waves = |x: f32, z: f32| [x, 0.2 * x + 1e-4 * (3.0 * x).sin() * (2.0 * z).cos(), z];
    shapes.grid(12, waves).triangle([[0.0, 0.8, 0.0], [0.5, 0.9, 0.0], [0.0, 0.8, 0.4]]);
    all.push(("nearly flat", shapes.scene(all_lights())));
    let ball = |x: f32, z: f32| {
        let (a, b) = (x * std::f32::consts::FRAC_PI_3, z * std::f32::consts::FRAC_PI_6);
        [b.cos() * a.sin(), 1.0 + b.sin(), b.cos() * a.cos()]
    };
    shapes.floor().grid(14, ball);
    all.push(("ball", shapes.scene(all_lights())));
    let [n, p] = [-6.5, 6.5];
    shapes.level(0.0, [n, p], [n, p]).level(p, [n, p], [n, p]);
    for x in [n, p] {
        shapes.quad([[x, n, n], [x, p, n], [x, p, p], [x, n, p]]);
        shapes.quad([[n, n, x], [p, n, x], [p, p, x], [n, p, x]]);
    }
    all.push(("closed box", shapes.scene(all_lights())));
    all
}

/// Settings for the scene in this place of the list: every sampler, way to sample lights and number
/// of samples gets its turn.
fn settings(scene: &Scene, turn: usize) -> Vec<RenderSettings> {
    const COUNTS: [(u32, u32); 4] = [(8, 3), (1, 2), (3, 2), (16, 1)];
    let of = |(spp, camera_samples), turn: usize| RenderSettings {
        size: if spp < 64 { [26, 18] } else { [18, 12] },
        spp,
        camera_samples,
        seed: turn as u64,
        passes: Pass::ALL.to_vec(),
        sampler: SAMPLERS[turn % SAMPLERS.len()],
        light_sampling: LightSampling::ALL[turn / 2 % LightSampling::ALL.len()],
        ..RenderSettings::of_scene(scene)
    };
    // With many samples pixels are looked at one by one, too.
    vec![of((64, 1), turn), of(COUNTS[turn % COUNTS.len()], turn + 1)]
}

fn run(scene: &Scene, by: &dyn Accelerator, settings: &RenderSettings, skip: Skips) -> Rendering {
    let options = RenderOptions { skip, ..RenderOptions::default() };
    render(scene, by, settings, &options).unwrap()
}

/// Bit by bit, and what differs if something does.
fn assert_same(a: &Film, b: &Film, what: &str) {
    for (a, b) in a.layers().iter().zip(b.layers()) {
        for (c, d) in a.channels.iter().zip(&b.channels) {
            let pairs = c.values.iter().zip(&d.values).enumerate();
            let different: Vec<_> =
                pairs.filter(|(_, (c, d))| c.to_bits() != d.to_bits()).take(3).collect();
            assert!(different.is_empty(), "{what}: {}.{}: {different:?}", a.name, c.name);
        }
    }
    assert_eq!(a.layers().len(), b.layers().len());
}

fn skipped(class: &ClassStats, skip: Skip) -> u64 {
    class.skipped.iter().filter(|s| s.by == skip.name()).map(|s| s.rays).sum()
}

fn skipped_in(rendering: &Rendering, skip: Skip) -> u64 {
    rendering.stats.classes.iter().map(|class| skipped(class, skip)).sum()
}

/// What was left out is told, and no more than was to be.
fn assert_counted(with: &Rendering, without: &Rendering, skips: Skips, what: &str) {
    for (with, without) in with.stats.classes.iter().zip(&without.stats.classes) {
        assert_eq!(with.rays + with.rays_skipped, without.rays, "{what}: {}", with.name);
        assert_eq!(without.rays_skipped + without.rays_from_entries, 0, "{what}: {}", with.name);
        for skip in Skip::ALL.into_iter().filter(|skip| !skips.has(*skip)) {
            assert_eq!(skipped(with, skip), 0, "{what}: {} of {}", skip.name(), with.name);
        }
        let enters = skips.has(Skip::EntryPoints);
        assert!(enters || with.rays_from_entries == 0, "{what}: {}", with.name);
        let remembers = skips.has(Skip::LastOccluders);
        assert!(remembers || with.rays_by_occluders == 0, "{what}: {}", with.name);
        assert!(with.rays_by_occluders <= with.rays_occluded, "{what}: {}", with.name);
    }
}

/// Native backends that differ in more than order: exact, as fast tests may differ by rounding.
fn specs() -> Vec<BackendSpec> {
    let is_tried = |spec: &BackendSpec| {
        let by_default = |key: &str| {
            let key = spec.entry().keys.iter().find(|k| k.name == key);
            key.is_none_or(|key| spec.value(key.name) == key.default)
        };
        spec.name() != "embree" && by_default("order") && by_default("mode")
    };
    every_spec().into_iter().filter(is_tried).collect()
}

#[test]
fn pictures_have_the_same_bits_whatever_is_left_out() {
    let specs = specs();
    assert!(specs.len() > 12, "{specs:?}");
    let alone: Vec<_> = Skip::ALL.map(|skip| Skips::NONE.with(skip)).to_vec();
    let all_but: Vec<_> = Skip::ALL.map(|skip| Skips::ALL.without(skip)).to_vec();
    // Over all scenes: each skip must have had something to do.
    let mut uses = [0; Skip::ALL.len()];
    let (mut from_entries, mut by_occluders) = (0, 0);
    for (turn, (name, scene)) in scenes().into_iter().enumerate() {
        let brute = built(&"brute".parse().unwrap(), &scene);
        let settings = settings(&scene, turn);
        let plain: Vec<_> = settings.iter().map(|s| run(&scene, &*brute, s, Skips::NONE)).collect();
        assert!(plain[0].stats.primary_hits > 50, "{name}: {}", plain[0].stats.primary_hits);
        for (place, spec) in specs.iter().enumerate() {
            let backend = built(spec, &scene);
            // All sets of skips with the defaults, and in turn with the others.
            let is_default = spec.to_string() == spec.name() || spec.full() == spec_of(spec.name());
            let sets = if is_default {
                [vec![Skips::ALL, Skips::NONE], alone.clone(), all_but.clone()].concat()
            } else {
                let index = (place + turn) % Skip::ALL.len();
                vec![Skips::ALL, alone[index], all_but[index]]
            };
            for (settings, plain) in settings.iter().zip(&plain) {
                for &skips in &sets {
                    let what = format!(
                        "{name}, {spec}, skip {skips}, {} spp, {} camera samples, {}, {}, seed {}",
                        settings.spp,
                        settings.camera_samples,
                        settings.sampler.name,
                        settings.light_sampling.name(),
                        settings.seed
                    );
                    let with = run(&scene, &*backend, settings, skips);
                    assert_same(&with.film, &plain.film, &what);
                    assert_counted(&with, plain, skips, &what);
                    for skip in Skip::ALL {
                        uses[skip as usize] += skipped_in(&with, skip);
                    }
                    for class in &with.stats.classes {
                        from_entries += class.rays_from_entries;
                        by_occluders += class.rays_by_occluders;
                    }
                }
            }
        }
    }
    println!("{uses:?} rays left out, {from_entries} from entries, {by_occluders} by occluders");
    uses[Skip::EntryPoints as usize] = from_entries;
    uses[Skip::LastOccluders as usize] = by_occluders;
    // Geometry is left out before a backend is built: see `src/render/unseen.rs`.
    for skip in Skip::ALL.into_iter().filter(|skip| *skip != Skip::UnseenGeometry) {
        assert!(uses[skip as usize] > 0, "{} has left out nothing", skip.name());
    }
}

/// The spec of a backend with all keys at their defaults, written out.
fn spec_of(name: &str) -> String {
    name.parse::<BackendSpec>().unwrap().full()
}

/// Each skip alone where it should work, with the trees that can be looked through.
#[test]
fn skips_leave_out_what_they_are_for() {
    let cases = [
        (Skip::Weightless, skewed_lights()),
        (Skip::DarkLights, skewed_lights()),
        (Skip::LitShafts, open_sky()),
        (Skip::BlockedShafts, roof()),
        (Skip::OpenHemispheres, open_sky()),
    ];
    for name in ["bvh2", "bvh8", "kd"] {
        let spec: BackendSpec = name.parse().unwrap();
        for (skip, scene) in &cases {
            let backend = built(&spec, scene);
            let [settings, _] = &settings(scene, 0)[..] else { unreachable!() };
            let with = run(scene, &*backend, settings, Skips::NONE.with(*skip));
            let all: u64 = with.stats.classes.iter().map(|c| c.rays + c.rays_skipped).sum();
            let left_out = skipped_in(&with, *skip);
            println!("{name}: {left_out} of {all} by {}", skip.name());
            assert!(left_out * 50 > all, "{name}: {left_out} of {all} by {}", skip.name());
            assert_eq!(left_out, with.stats.classes.iter().map(|c| c.rays_skipped).sum::<u64>());
        }
    }
    for name in ["bvh2", "bvh8"] {
        let scene = clutter();
        let backend = built(&name.parse().unwrap(), &scene);
        let [settings, _] = &settings(&scene, 0)[..] else { unreachable!() };
        let with = run(&scene, &*backend, settings, Skips::NONE.with(Skip::EntryPoints));
        let [rays, from] = with
            .stats
            .classes
            .iter()
            .fold([0, 0], |[rays, from], c| [rays + c.rays, from + c.rays_from_entries]);
        println!("{name}: {from} of {rays} rays from entries");
        assert!(from * 4 > rays, "{name}: {from} of {rays} rays from entries");
    }
}

/// What stopped rays of one light must be tried for those of another neither in vain nor wrongly: here
/// some tiles are dark for both lights, some for one, and what stops the rays changes from tile to tile.
/// Squares are several pixels wide, so that a stream's rays meet few of them.
#[test]
fn occluders_of_one_light_are_remembered_for_it() {
    let mut shapes = Shapes::default();
    shapes.floor();
    for i in 0..4 {
        for j in 0..4 {
            let (x, z) = (2.0 * i as f32 - 4.0, 2.0 * j as f32 - 4.0);
            if (i + j) % 2 == 0 {
                shapes.level(0.4, [x, x + 2.0], [z, z + 2.0]);
            }
        }
    }
    let scene = shapes.scene(vec![
        quad([-0.1, 30.0, -0.1], Vec3::X * 0.2, Vec3::Z * 0.2),
        quad([29.9, 30.0, -0.1], Vec3::X * 0.2, Vec3::Z * 0.2),
    ]);
    let [settings, _] = &settings(&scene, 0)[..] else { unreachable!() };
    let settings = &RenderSettings { size: [36, 24], ..settings.clone() };
    for name in ["bvh8", "lazy"] {
        let backend = built(&name.parse().unwrap(), &scene);
        let without = run(&scene, &*backend, settings, Skips::NONE);
        // Each thread remembers its own.
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let remembering = Skips::NONE.with(Skip::LastOccluders);
        let with = one.install(|| run(&scene, &*backend, settings, remembering));
        assert_same(&with.film, &without.film, name);
        for class in with.stats.classes.iter().filter(|c| c.name.starts_with("shadow")) {
            let [early, occluded] = [class.rays_by_occluders, class.rays_occluded];
            println!("{name}: {early} of {occluded} rays of {} by occluders", class.name);
            assert!(early * 2 > occluded, "{name}: {early} of {occluded}, {}", class.name);
        }
        assert!(without.stats.classes.iter().all(|class| class.rays_by_occluders == 0));
    }
}

/// Lights that are partly or wholly below the floor, or turned away.
fn skewed_lights() -> Scene {
    Shapes::default().floor().scene(vec![
        quad([4.0, -1.0, -1.0], Vec3::Z * 2.0, Vec3::Y * 2.0),
        quad([-0.5, 3.0, -0.5], Vec3::Z, Vec3::X),
        LightShape::Sphere { center: Vec3::new(0.0, -3.0, 0.0), radius: 1.0 },
    ])
}

/// Few samples are not looked after, and a list of triangles has no tree to look through.
#[test]
fn nothing_is_left_out_that_was_not_looked_at() {
    let scene = open_sky();
    let [settings, _] = &settings(&scene, 0)[..] else { unreachable!() };
    let shafts =
        [Skip::LitShafts, Skip::BlockedShafts, Skip::OpenHemispheres].map(|s| s.name().to_string());
    for (spec, spp) in [("bvh2", 1), ("bvh8", 3), ("brute", 16)] {
        let backend = built(&spec.parse().unwrap(), &scene);
        let settings = RenderSettings { spp, ..settings.clone() };
        let with = run(&scene, &*backend, &settings, Skips::ALL);
        for class in &with.stats.classes {
            assert_eq!(class.rays_from_entries, 0, "{spec}");
            assert!(class.skipped.iter().all(|s| !shafts.contains(&s.by.to_string())), "{spec}");
        }
    }
    // Inside a closed box no hemisphere is open, and a wall of two triangles has none that blocks
    // what passes on both sides of its diagonal.
    let (_, closed) = scenes().pop().unwrap();
    let backend = built(&"bvh8".parse().unwrap(), &closed);
    let with = run(&closed, &*backend, settings, Skips::ALL);
    let unbounded = with.stats.classes.iter().find(|c| c.name == "ao-unbounded").unwrap();
    assert_eq!(unbounded.rays_skipped, 0);
    assert_eq!(unbounded.rays, unbounded.rays_occluded);
}
