//! Adaptive sampling: without bias, where it is needed, and the same on any machine.

mod common;

use common::{built, scene_of};
use glam::Vec3;
use sato::Error;
use sato::backend::Accelerator;
use sato::geometry::TriangleMesh;
use sato::measure;
use sato::render::{
    Adaptive, Film, Pass, RenderOptions, RenderSettings, SamplerEntry, Skip, Skips, TileOrder,
    record, render,
};
use sato::scene::{Camera, Light, LightShape, Scene};

const SIZE: [u32; 2] = [32, 24];
const SEEDS: u64 = 96;
/// Added to the seeds of references, so that they share no sample with what is held against them.
const REFERENCE_SEED: u64 = 1 << 32;

/// A floor seen from above, a board over a part of it, and lights whose shadows end softly, narrowly
/// and sharply.
fn scene() -> Scene {
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let floor = [at(-4.0, 0.0, -4.0), at(-4.0, 0.0, 4.0), at(4.0, 0.0, 4.0), at(4.0, 0.0, -4.0)];
    let board = [at(-0.9, 0.8, -3.0), at(-0.9, 0.8, 3.0), at(0.6, 0.8, 3.0), at(0.6, 0.8, -0.5)];
    let vertices = [floor, board].concat();
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let mut scene = scene_of(mesh);
    scene.camera = Camera {
        eye: at(0.3, 6.0, 0.2),
        look_at: at(0.3, 0.0, 0.0),
        up: Vec3::X,
        fov_degrees: 48.0,
    };
    scene.defaults.ao_radius = 1.5;
    let light = |name: &str, shape, strength| Light { name: name.into(), shape, strength };
    let quad = LightShape::Quad { corner: at(-0.5, 4.0, -0.5), edge_u: Vec3::X, edge_v: Vec3::Z };
    let sun =
        LightShape::Directional { direction: at(0.5, -1.0, 0.2), angular_diameter_degrees: 6.0 };
    scene.lights = vec![
        light("key", quad, Vec3::new(8.0, 7.0, 6.0)),
        light("sun", sun, Vec3::ONE),
        light("spark", LightShape::Point { position: at(2.0, 2.0, 2.0) }, Vec3::ONE),
    ];
    scene
}

fn settings(spp: u32, adaptive: bool, sampler: &str) -> RenderSettings {
    RenderSettings {
        size: SIZE,
        spp,
        camera_samples: 1,
        seed: 0,
        ao_radius: 1.5,
        passes: vec![Pass::AmbientOcclusion, Pass::Shadow],
        sampler: SamplerEntry::find(sampler).unwrap(),
        adaptive: adaptive.then_some(Adaptive { most: 8 * spp }),
        ..RenderSettings::of_scene(&scene())
    }
}

fn accelerator(scene: &Scene) -> Box<dyn Accelerator> {
    built(&"bvh8".parse().unwrap(), scene)
}

fn film(scene: &Scene, accelerator: &dyn Accelerator, settings: &RenderSettings) -> Film {
    render(scene, accelerator, settings, &RenderOptions::default()).unwrap().film
}

/// Values of a channel for each seed from `first` on.
fn seeds(settings: &RenderSettings, count: u64, first: u64, layers: &[&str]) -> Vec<Vec<Vec<f64>>> {
    let scene = scene();
    let accelerator = accelerator(&scene);
    let asked: Vec<String> = layers.iter().map(|&layer| layer.into()).collect();
    let mut values = vec![Vec::new(); layers.len()];
    for seed in first..first + count {
        let settings = RenderSettings { seed, layers: Some(asked.clone()), ..settings.clone() };
        let film = film(&scene, &*accelerator, &settings);
        for (values, layer) in values.iter_mut().zip(layers) {
            let channel = if *layer == "irradiance" { "G" } else { "Y" };
            let of_film = film.channel(layer, channel).unwrap();
            values.push(of_film.iter().map(|&v| f64::from(v)).collect());
        }
    }
    values
}

/// Mean, and variance of the mean.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
}

/// Mean of each pixel over seeds, and variance of that.
fn pixel_moments(images: &[Vec<f64>]) -> Vec<(f64, f64)> {
    (0..images[0].len()).map(|pixel| moments(images.iter().map(move |i| i[pixel]))).collect()
}

/// How many standard deviations the mean over the image is off.
fn z_of_image(images: &[Vec<f64>], reference: &[(f64, f64)]) -> f64 {
    let of_image = |image: &Vec<f64>| image.iter().sum::<f64>() / image.len() as f64;
    let (mean, variance) = moments(images.iter().map(of_image));
    let n = reference.len() as f64;
    let expected = reference.iter().map(|r| r.0).sum::<f64>() / n;
    let of_reference = reference.iter().map(|r| r.1).sum::<f64>() / (n * n);
    (mean - expected) / (variance + of_reference).sqrt()
}

/// Means over many seeds are those of references with many samples, in each pixel and over the image;
/// those of a rule that stops when the first samples agree are not.
#[test]
fn estimates_have_no_bias() {
    const LAYERS: [&str; 5] =
        ["ao", "irradiance", "samples.ao", "samples.shadow.key", "samples.shadow.sun"];
    let many = settings(4096, false, "sobol");
    let reference = seeds(&many, 8, REFERENCE_SEED, &LAYERS[..2]);
    let reference: Vec<_> = reference.iter().map(|images| pixel_moments(images)).collect();
    for sampler in ["independent", "sobol"] {
        let adapted = seeds(&settings(8, true, sampler), SEEDS, 0, &LAYERS);
        for (layer, reference) in reference.iter().enumerate() {
            let z = z_of_image(&adapted[layer], reference);
            println!("{sampler} {}: z of the image {z:.2}", LAYERS[layer]);
            assert!(z.abs() < 4.0, "{sampler} {}: z of the image {z}", LAYERS[layer]);
        }
        if sampler != "independent" {
            continue;
        }
        // The variance of a share from so many independent samples is known.
        let mut squares = Vec::new();
        for (pixel, &(p, error)) in reference[0].iter().enumerate() {
            let n = SEEDS as f64;
            let samples = adapted[2].iter().map(|image| image[pixel]);
            let variance = samples.map(|samples| p * (1.0 - p) / samples).sum::<f64>() / (n * n);
            let mean = adapted[0].iter().map(|image| image[pixel]).sum::<f64>() / n;
            let z = (mean - p) / (variance + error).sqrt();
            if variance + error < 1e-12 {
                assert!((mean - p).abs() < 1e-6, "pixel {pixel}: {mean} is not {p}");
            } else {
                assert!(z.abs() < 4.0, "pixel {pixel}: z {z} of {mean} for {p}");
                squares.push(z * z);
            }
        }
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        println!("{} pixels: mean square of z {mean:.3}", squares.len());
        assert!((0.75..1.3).contains(&mean) && squares.len() > 300, "mean square of z {mean}");
    }
    let [few, all] = [4, 64].map(|spp| {
        let mut layers = seeds(&settings(spp, false, "independent"), SEEDS, 0, &["ao"]);
        layers.remove(0)
    });
    // The first samples of `all` are those of `few`.
    let naive = few.iter().zip(&all).map(|(few, all)| {
        let stop = |(&few, &all): (&f64, &f64)| if few == 0.0 || few == 1.0 { few } else { all };
        few.iter().zip(all).map(stop).collect()
    });
    let naive: Vec<Vec<f64>> = naive.collect();
    let z = [&all, &naive].map(|images| z_of_image(images, &reference[0]));
    println!("all samples: z {:.2}; stopping when four agree: z {:.2}", z[0], z[1]);
    assert!(z[0].abs() < 4.0 && z[1].abs() > 8.0, "z of the image: {z:?}");
}

#[test]
fn samples_go_where_shadows_end() {
    let spp = 16;
    let adapted = settings(spp, true, "sobol");
    let [truth, samples] =
        [(&settings(1024, false, "sobol"), "shadow.key"), (&adapted, "samples.shadow.key")]
            .map(|(settings, layer)| seeds(settings, 1, 0, &[layer]).remove(0).remove(0));
    let [width, height] = SIZE.map(|n| n as usize);
    let (mut certain, mut between) = (Vec::new(), Vec::new());
    for pixel in 0..width * height {
        let (x, y) = (pixel % width, pixel / width);
        // Neighbours in its tile are asked too: what is certain must be so for all of the tile.
        let (x0, y0) = (x / 8 * 8, y / 8 * 8);
        let mut tile = (y0..y0 + 8).flat_map(|y| (x0..x0 + 8).map(move |x| y * width + x));
        let is_certain = truth[pixel] == 0.0 || truth[pixel] == 1.0;
        if is_certain && tile.all(|other| truth[other] == truth[pixel]) {
            certain.push(samples[pixel]);
        } else if (0.25..0.75).contains(&truth[pixel]) {
            between.push(samples[pixel]);
        }
    }
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    println!(
        "{} certain: {:.2}, {} between: {:.2}, all: {:.2}",
        certain.len(),
        mean(&certain),
        between.len(),
        mean(&between),
        mean(&samples)
    );
    assert!(certain.len() >= 64 && between.len() >= 32, "the scene has both");
    // What the penumbrae leave of the mean is for all.
    let (least, half) = (f64::from(spp / 4), f64::from(spp / 2));
    assert!(certain.iter().all(|&n| n <= half), "certain pixels get few");
    assert!(mean(&certain) < 1.5 * least, "mostly the fewest: {}", mean(&certain));
    assert!(mean(&between) >= 1.5 * f64::from(spp), "{}", mean(&between));
    assert!(mean(&samples) <= f64::from(spp) && mean(&samples) > 0.9 * f64::from(spp));
    let powers = samples.iter().all(|&n| [4.0, 8.0, 16.0, 32.0, 64.0, 128.0].contains(&n));
    assert!(powers, "powers of two, between the fewest and the most");
}

/// Bit by bit, all layers.
fn bits(film: &Film) -> Vec<(String, Vec<u32>)> {
    let channels = film.layers().iter().flat_map(|l| l.channels.iter().map(move |c| (l, c)));
    channels
        .map(|(l, c)| (l.name.clone(), c.values.iter().map(|v| v.to_bits()).collect()))
        .collect()
}

#[test]
fn adaptive_images_depend_on_scene_settings_and_seed_alone() {
    let scene = scene();
    let mut settings = settings(8, true, "sobol");
    settings.size = [45, 30];
    settings.passes = Pass::ALL.to_vec();
    let image = |threads, backend: &str, options: &RenderOptions<'_>| {
        let accelerator = built(&backend.parse().unwrap(), &scene);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bits(&render(&scene, &*accelerator, &settings, options).unwrap().film))
    };
    let all = RenderOptions::default();
    let expected = image(1, "bvh8", &all);
    for layer in ["samples.ao", "samples.ao-unbounded", "samples.shadow.key", "samples.shadow.sun"]
    {
        assert!(expected.iter().any(|(name, _)| name == layer), "{layer}");
    }
    assert!(expected.iter().all(|(name, _)| name != "samples.shadow.spark"));
    for (threads, order) in [(2, TileOrder::Reverse), (7, TileOrder::Shuffled(3))] {
        assert!(image(threads, "bvh8", &RenderOptions { order, ..all }) == expected, "{order:?}");
    }
    for skip in Skip::ALL.map(|skip| Skips::ALL.without(skip)).into_iter().chain([Skips::NONE]) {
        assert!(image(2, "bvh8", &RenderOptions { skip, ..all }) == expected, "{skip}");
    }
    for backend in ["brute", "bvh2", "kd", "bvh8:trace=single"] {
        assert!(image(2, backend, &all) == expected, "{backend}");
    }
    settings.seed = 1;
    let accelerator = built(&"bvh8".parse().unwrap(), &scene);
    let other = bits(&film(&scene, &*accelerator, &settings));
    assert!(other != expected, "seeds matter");
}

#[test]
fn a_recording_is_the_same_adaptive_image() {
    let scene = scene();
    let accelerator = accelerator(&scene);
    let settings = settings(16, true, "sobol");
    let recording = record(&scene, &*accelerator, &settings, None).unwrap();
    let answers: Vec<_> = recording
        .passes()
        .iter()
        .map(|pass| {
            let mut words = pass.rays().no_answers();
            measure::trace(&*accelerator, pass.rays(), &mut words);
            words
        })
        .collect();
    let film = film(&scene, &*accelerator, &settings);
    assert!(bits(&film) == bits(&recording.film(&answers, None)));
}

/// Against as many samples in each pixel as adaptive ones are on the mean, with the pilot and without.
#[test]
fn equal_samples_have_less_error() {
    const LAYERS: [&str; 3] = ["ao", "irradiance", "shadow.key"];
    let reference = seeds(&settings(4096, false, "sobol"), 4, REFERENCE_SEED, &LAYERS);
    let reference: Vec<_> = reference.iter().map(|images| pixel_moments(images)).collect();
    for sampler in ["independent", "sobol"] {
        let [adaptive, uniform, fewer] = [(32, true), (40, false), (32, false)].map(|(spp, is)| {
            let layers = seeds(&settings(spp, is, sampler), 16, 0, &LAYERS);
            let errors = layers.iter().zip(&reference).map(|(images, reference)| {
                let squares = images.iter().flat_map(|image| {
                    image.iter().zip(reference).map(|(value, (mean, _))| (value - mean).powi(2))
                });
                squares.sum::<f64>()
            });
            errors.collect::<Vec<_>>()
        });
        for (index, layer) in LAYERS.iter().enumerate() {
            // Powers of two are best: more need not be better.
            let ratio = adaptive[index] / uniform[index].min(fewer[index]);
            println!("{sampler} {layer}: {ratio:.3} of the squared error");
            // Nearly all of the floor is near the board, so ambient occlusion has little to gain.
            let most = if *layer == "ao" { 1.0 } else { 0.8 };
            assert!(ratio < most, "{sampler} {layer}: {ratio}");
        }
    }
}

#[test]
fn statistics_are_of_the_image() {
    let scene = scene();
    let accelerator = accelerator(&scene);
    // Pilots of 8 samples, the fewest that are looked after.
    let settings = settings(32, true, "sobol");
    let run = |skip| {
        let options = RenderOptions { skip, ..RenderOptions::default() };
        render(&scene, &*accelerator, &settings, &options).unwrap()
    };
    let (with, without) = (run(Skips::ALL), run(Skips::NONE));
    let alpha = with.film.channel("", "A").unwrap();
    for (class, plain) in with.stats.classes.iter().zip(&without.stats.classes) {
        let Some(layer) = with.film.channel(&format!("samples.{}", class.name), "Y") else {
            assert_eq!((class.name.as_str(), &class.adaptive), ("shadow.spark", &None));
            continue;
        };
        let stats = class.adaptive.as_ref().unwrap();
        let seen = || layer.iter().zip(alpha).filter(|(_, a)| **a > 0.0).map(|(n, _)| *n as u32);
        assert_eq!(Some(stats.samples_min), seen().min());
        assert_eq!(Some(stats.samples_max), seen().max());
        let sum = seen().map(u64::from).sum::<u64>();
        assert_eq!(class.rays + class.rays_skipped, sum, "{}", class.name);
        assert!((stats.samples_mean - sum as f64 / seen().count() as f64).abs() < 1e-9);
        assert_eq!(stats.pilot_rays + stats.pilot_rays_skipped, 8 * with.stats.primary_hits);
        assert!(plain.adaptive.as_ref().unwrap().pilot_rays >= stats.pilot_rays);
    }
    let skipped = with.stats.classes.iter().filter_map(|c| c.adaptive.as_ref());
    assert!(skipped.map(|a| a.pilot_rays_skipped).sum::<u64>() > 0, "shafts spare pilot rays");
    assert!(with.stats.pilot_ms > 0.0 && with.stats.pilot_ms <= with.stats.total_ms);
}

#[test]
fn what_cannot_be_adapted_is_refused() {
    let scene = scene();
    let settings = RenderSettings { camera_samples: 2, ..settings(16, true, "sobol") };
    let refused = render(&scene, &*accelerator(&scene), &settings, &RenderOptions::default());
    assert!(matches!(refused, Err(Error::Usage(_))));
}
