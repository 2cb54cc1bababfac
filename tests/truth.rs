//! Estimates against closed forms: every case of `sato::truth`, through the real renderer.
//!
//! What is tested is the mean over many seeds, by a z-test: the difference to the closed form over
//! its standard error. Seeds follow from names, so every run gives the same numbers. Of a thousand
//! right estimates, 0.06 would be further off than 4 by chance.

mod common;

use common::built;
use glam::DVec3;
use rayon::prelude::*;
use sato::backend::{Accelerator, BackendSpec};
use sato::render::sampler::Points;
use sato::render::soft_shadow::LightView;
use sato::render::{
    LightSampling, Pass, RenderOptions, RenderSettings, SAMPLERS, Skips, SurfacePoint, render,
};
use sato::scene::{Light, LightShape};
use sato::truth::form_factor::Receiver;
use sato::truth::{CASES, Case, CaseEntry};

/// Images for each mean.
const SEEDS: u64 = 32;

/// One way to render a case.
struct Trial {
    label: String,
    settings: RenderSettings,
}

impl Trial {
    /// Whether it is by the default ways and at most samples.
    fn is_best(&self) -> bool {
        let RenderSettings { sampler, light_sampling, spp, .. } = self.settings;
        sampler == SAMPLERS[0] && light_sampling == LightSampling::default() && spp == 16
    }
}

/// Means over pixels and seeds, differences to the truth.
#[derive(Clone, Copy, Debug, Default)]
struct Deviation {
    difference: f64,
    /// Standard error of the difference.
    sigma: f64,
    /// What rounding and the ends of the scene may explain.
    floor: f64,
}

impl Deviation {
    fn z(&self) -> f64 {
        let beyond = (self.difference.abs() - self.floor).max(0.0);
        if beyond == 0.0 { 0.0 } else { beyond / self.sigma }
    }
}

/// A case, built.
struct Subject {
    entry: &'static CaseEntry,
    case: Case,
    accelerator: Box<dyn Accelerator>,
    values: Vec<f64>,
}

impl Subject {
    fn new(entry: &'static CaseEntry, backend: &str) -> Self {
        let case = (entry.make)();
        case.scene.check().unwrap_or_else(|fault| panic!("{entry:?}: {fault:?}"));
        let accelerator = built(&backend.parse::<BackendSpec>().unwrap(), &case.scene);
        let values = case.values(&*accelerator);
        Self { entry, case, accelerator, values }
    }

    /// Every sampler and way to sample lights.
    fn trials(&self, samples: &[u32]) -> Vec<Trial> {
        let mut trials = Vec::new();
        for &sampler in SAMPLERS {
            for light_sampling in LightSampling::ALL {
                let by_area = light_sampling == LightSampling::Area;
                if by_area && !(self.case.pass == Pass::Shadow && self.case.by_area) {
                    continue;
                }
                for &spp in samples {
                    let (name, light) = (sampler.name, light_sampling.name());
                    let label = format!("{}, {name}, {light}, {spp} spp", self.entry.name);
                    let settings = RenderSettings {
                        sampler,
                        light_sampling,
                        spp,
                        seed: seed(&label),
                        ..self.case.settings()
                    };
                    trials.push(Trial { label, settings });
                }
            }
        }
        // Where pixels are all alike, what several camera rays see has the same value.
        let (low, high) = self.range();
        if high - low < 1e-9 {
            for &sampler in SAMPLERS {
                let label = format!("{}, {}, 3 camera samples", self.entry.name, sampler.name);
                let settings = RenderSettings {
                    sampler,
                    spp: 4,
                    camera_samples: 3,
                    seed: seed(&label),
                    ..self.case.settings()
                };
                trials.push(Trial { label, settings });
            }
        }
        trials
    }

    /// Least and largest value.
    fn range(&self) -> (f64, f64) {
        let bounds = |(low, high): (f64, f64), v: &f64| (low.min(*v), high.max(*v));
        self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), bounds)
    }

    fn estimates(&self, settings: &RenderSettings, skip: Skips) -> Vec<f32> {
        let options = RenderOptions { skip, ..RenderOptions::default() };
        let rendering = render(&self.case.scene, &*self.accelerator, settings, &options).unwrap();
        self.case.estimates(&rendering.film).to_vec()
    }

    /// Of the mean over the image, and of its slopes from left to right and from top to bottom: a
    /// bias that the mean over pixels cancels. `values`: what pixels should be.
    fn deviations(&self, settings: &RenderSettings, values: &[f64]) -> [Deviation; 3] {
        let pixels = values.len();
        let (mut sums, mut squares) = (vec![0.0; pixels], vec![0.0; pixels]);
        for seed in 0..SEEDS {
            let settings = RenderSettings { seed: settings.seed + seed, ..settings.clone() };
            let estimates = self.estimates(&settings, Skips::ALL);
            if seed == 0 {
                let all = self.estimates(&settings, Skips::NONE);
                let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&estimates), bits(&all), "skipping changes {:?}", self.entry);
            }
            for (pixel, (estimate, value)) in estimates.iter().zip(values).enumerate() {
                let difference = f64::from(*estimate) - value;
                assert!(difference.is_finite(), "{:?}: pixel {pixel}", self.entry);
                sums[pixel] += difference;
                squares[pixel] += difference * difference;
            }
        }
        let n = SEEDS as f64;
        let scale = values.iter().map(|v| v.abs()).sum::<f64>() / pixels as f64;
        let [width, height] = settings.size;
        let slope = |i: u32, n: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
        let weights: [&dyn Fn(u32, u32) -> f64; 3] =
            [&|_, _| 1.0, &|x, _| slope(x, width), &|_, y| slope(y, height)];
        weights.map(|weight| {
            let (mut difference, mut variance) = (0.0, 0.0);
            for (pixel, (sum, squares)) in sums.iter().zip(&squares).enumerate() {
                let (x, y) = (pixel as u32 % width, pixel as u32 / width);
                let weight = weight(x, y) / pixels as f64;
                difference += weight * sum / n;
                let of_one = (squares - sum * sum / n).max(0.0) / (n - 1.0);
                variance += weight * weight * of_one / n;
            }
            // Images are of f32.
            let floor = self.case.slack + 1e-6 * scale;
            Deviation { difference, sigma: variance.sqrt(), floor }
        })
    }
}

/// A seed from a name (FNV-1a), so that cases share no samples and new ones leave old ones alone.
fn seed(name: &str) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    name.bytes().fold(0xcbf2_9ce4_8422_2325, step) >> 1
}

/// Every case, sampler, way to sample lights and number of samples.
#[test]
fn estimates_are_closed_forms() {
    let trials: Vec<(Subject, Vec<Trial>)> = CASES
        .par_iter()
        .map(|entry| {
            let subject = Subject::new(entry, "bvh8");
            let trials = subject.trials(&[1, 2, 5, 16]);
            (subject, trials)
        })
        .collect();
    let all: Vec<(&Subject, &Trial)> =
        trials.iter().flat_map(|(s, trials)| trials.iter().map(move |t| (s, t))).collect();
    let results: Vec<_> = all
        .par_iter()
        .map(|(subject, trial)| subject.deviations(&trial.settings, &subject.values))
        .collect();
    let (mut faults, mut squares, mut count) = (Vec::new(), 0.0, 0);
    for ((subject, trial), deviations) in all.iter().zip(&results) {
        let mean = subject.values.iter().sum::<f64>() / subject.values.len() as f64;
        let [of_mean, ..] = deviations;
        println!(
            "{}: {mean:.6}, z {:.2} {:.2} {:.2}, sigma {:.1e}",
            trial.label,
            of_mean.z(),
            deviations[1].z(),
            deviations[2].z(),
            of_mean.sigma
        );
        // By default, a few parts in a hundred are found everywhere, mostly in a thousand.
        if trial.is_best() && of_mean.sigma > 0.015 * mean {
            faults.push(format!("{}: blind, {of_mean:?}", trial.label));
        }
        // There are twice as many slopes, and nothing asks for them to be within 4.
        for (deviation, limit) in deviations.iter().zip([4.0, 4.5, 4.5]) {
            if deviation.z() >= limit {
                faults.push(format!("{}: {deviation:?}, z {:.2}", trial.label, deviation.z()));
            }
            if deviation.sigma > 10.0 * deviation.floor {
                squares += deviation.z().powi(2);
                count += 1;
            }
        }
    }
    println!("{} trials", all.len());
    assert!(faults.is_empty(), "{faults:#?}");
    // Were standard errors too large, nothing could fail; were there many small biases, it would be
    // more.
    let spread = (squares / f64::from(count)).sqrt();
    println!("{count} z with a spread of {spread:.3}");
    assert!(count > 1500 && (spread - 1.0).abs() < 0.06, "{count} z with a spread of {spread}");
}

/// Every traversal of every backend of the build, on a case of each kind.
#[test]
fn all_backends_give_closed_forms() {
    let names = ["wedge-60", "sphere", "pentagon-tilted", "sphere-behind-pentagon"];
    let trials: Vec<_> = common::all_specs()
        .into_iter()
        .flat_map(|spec| names.map(|name| (sato::truth::find(name).unwrap(), spec.full())))
        .collect();
    let faults: Vec<_> = trials
        .par_iter()
        .filter_map(|(entry, spec)| {
            let subject = Subject::new(entry, spec);
            // The same samples for all.
            let (spp, seed) = (4, seed(entry.name));
            let settings = RenderSettings { spp, seed, ..subject.case.settings() };
            let [of_mean, ..] = subject.deviations(&settings, &subject.values);
            (of_mean.z() >= 4.0).then(|| format!("{spec}, {entry:?}: {of_mean:?}"))
        })
        .collect();
    println!("{} trials", trials.len());
    assert!(faults.is_empty(), "{faults:#?}");
}

/// A floor at the origin.
fn floor() -> SurfacePoint {
    let (position, normal) = (DVec3::ZERO, DVec3::Z);
    SurfacePoint { position, origin: glam::Vec3::ZERO, normal, distance: 1.0 }
}

/// The mean of all weights over a grid of the unit square.
fn mean_weight(shape: LightShape, surface: &SurfacePoint, sampling: LightSampling) -> f64 {
    const N: usize = 128;
    let middle = |k: usize| (k as f32 + 0.5) / N as f32;
    let grid: Vec<[f32; 2]> = (0..N * N).map(|i| [middle(i % N), middle(i / N)]).collect();
    let light = Light { name: "light".into(), shape, strength: glam::Vec3::ONE };
    let view = LightView::new(&light, surface, sampling);
    let mut samples = sato::render::light_samples::LightSamples::default();
    view.sample_all(&Points::of(&grid), &mut samples);
    let weights = &samples.weights()[..N * N];
    assert!(weights.iter().all(|w| *w >= 0.0 && w.is_finite()), "{shape:?}");
    weights.iter().map(|w| f64::from(*w)).sum::<f64>() / (N * N) as f64
}

/// Quads that shrink and quads that turn their edge to the surface leave sampling in solid angle at
/// some size: nothing shows where.
#[test]
fn small_and_edge_on_quads_are_sampled_without_a_seam() {
    let surface = floor();
    let receiver = Receiver { at: DVec3::ZERO, normal: DVec3::Z };
    let quad = |corner: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3]| LightShape::Quad {
        corner: corner.into(),
        edge_u: edge_u.into(),
        edge_v: edge_v.into(),
    };
    let mut tried = 0;
    let mut check = |what: &str, shape: LightShape, expected: f64, tolerance: f64| {
        let value = mean_weight(shape, &surface, LightSampling::SolidAngle);
        let error = value / expected - 1.0;
        assert!(error.abs() < tolerance, "{what}: {value:e} is not {expected:e}, off by {error:e}");
        tried += 1;
    };
    for step in 0..100 {
        let size = 0.75f32.powi(step);
        // Facing the surface, square or four hundred times as long as wide.
        for [width, length] in [[1.0, 1.0], [0.1, 40.0]] {
            let [w, l] = [width * size, length * size];
            let shape = quad([0.7, -0.3, 1.0], [0.0, l, 0.0], [w, 0.0, 0.0]);
            let to_light = DVec3::new(0.7, -0.3, 1.0);
            let squared = to_light.length_squared();
            // Very small ones cost the formula its digits, and are points.
            let expected = if l > 1e-4 {
                receiver.irradiance(&shape, &[])
            } else {
                f64::from(w) * f64::from(l) / (squared * squared)
            };
            check(&format!("{w} x {l}"), shape, expected, 5e-4);
        }
        // Upright, in a plane that comes ever nearer.
        let shape = quad([-size, -0.5, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let expected = if size > 1e-6 {
            receiver.irradiance(&shape, &[])
        } else {
            let nearer = quad([-1e-6, -0.5, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
            receiver.irradiance(&nearer, &[]) * f64::from(size) / 1e-6
        };
        check(&format!("edge-on at {size:e}"), shape, expected, 5e-4);
    }
    assert_eq!(tried, 300);
}

/// Solid angle of a triangle seen from the origin (Van Oosterom and Strackee, "The Solid Angle of a
/// Plane Triangle", 1983).
fn solid_angle(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(DVec3::normalize);
    let divisor = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
    2.0 * a.dot(b.cross(c)).abs().atan2(divisor)
}

/// Rectangles of any size and place, most of them long, flat or near.
#[test]
fn hostile_rectangles_have_finite_weights_of_the_right_mean() {
    let mut random = common::random::Random::new(5);
    let (mut checked, mut small, mut faults) = (0, 0, Vec::new());
    for case in 0..1500 {
        let mut log = |low: f32, high: f32| 10f32.powf(low + random.unit() * (high - low));
        let (width, length, height) = (log(-3.0, 2.0), log(-3.0, 2.0), log(-6.0, 1.0));
        let mut direction = || (random.point() + glam::Vec3::splat(1e-3)).as_dvec3().normalize();
        let (normal, axis) = (direction(), direction());
        let u = axis.cross(normal).normalize();
        let v = u.cross(normal);
        let [x, y] = [random.unit(), random.unit()].map(|t| f64::from(t) * 6.0 - 3.0);
        // In front of it by `height`, over any place in or beside it.
        let corner =
            u * x * f64::from(width) + v * y * f64::from(length) - normal * f64::from(height);
        let shape = LightShape::Quad {
            corner: corner.as_vec3(),
            edge_u: (v * f64::from(length)).as_vec3(),
            edge_v: (u * f64::from(width)).as_vec3(),
        };
        let value = mean_weight(shape, &floor(), LightSampling::SolidAngle);
        mean_weight(shape, &floor(), LightSampling::Area);
        let LightShape::Quad { corner, edge_u, edge_v } = shape else { unreachable!() };
        let [a, u, v] = [corner, edge_u, edge_v].map(|v| v.as_dvec3());
        let angle = solid_angle([a, a + u, a + v]) + solid_angle([a + v, a + u, a + u + v]);
        let expected = Receiver { at: DVec3::ZERO, normal: DVec3::Z }.irradiance(&shape, &[]);
        // Smaller ones are sampled by area, and a grid may be too coarse for that.
        if angle < 2e-5 {
            small += 1;
            continue;
        }
        let error = (value - expected) / angle;
        if error.abs() >= 3e-3 {
            faults.push(format!("case {case}, {shape:?}: {value:e} is not {expected:e} {angle:e}"));
        }
        checked += 1;
    }
    assert!(faults.is_empty(), "{faults:#?}");
    assert!(checked > 500 && small > 100, "{checked} and {small}");
}
