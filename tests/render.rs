//! Images: what they are a function of, what their layers say, how they are written.

mod common;

use common::{built, scene_of};
use exr::prelude::{ReadChannels, ReadLayers};
use glam::Vec3;
use sato::Error;
use sato::backend::Accelerator;
use sato::geometry::TriangleMesh;
use sato::image_file::{tone_map, write_exr, write_png};
use sato::measure;
use sato::render::{
    Film, LightSampling, Pass, RayClass, RenderOptions, RenderSettings, SamplerEntry, Skip, Skips,
    TileOrder, record, render,
};
use sato::scene::{Camera, Light, LightShape, Scene};
use std::sync::Mutex;

/// A floor, a box that stands on it, and lights of every kind. The sky is open.
fn scene() -> Scene {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let mut quad = |corners: [[f32; 3]; 4]| {
        let first = vertices.len() as u32;
        vertices.extend(corners.map(Vec3::from));
        triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| first + v)));
    };
    quad([[-4.0, 0.0, -4.0], [4.0, 0.0, -4.0], [4.0, 0.0, 4.0], [-4.0, 0.0, 4.0]]);
    quad([[-1.0, 1.5, -1.0], [1.0, 1.5, -1.0], [1.0, 1.5, 1.0], [-1.0, 1.5, 1.0]]);
    for (a, b) in [([-1.0, -1.0], [1.0, -1.0]), ([1.0, -1.0], [1.0, 1.0])] {
        for sign in [1.0, -1.0] {
            let at = |p: [f32; 2], y: f32| [sign * p[0], y, sign * p[1]];
            quad([at(a, 0.0), at(b, 0.0), at(b, 1.5), at(a, 1.5)]);
        }
    }
    let mut scene = scene_of(TriangleMesh::new(vertices, triangles));
    scene.camera = Camera {
        eye: Vec3::new(5.0, 4.0, 7.0),
        look_at: Vec3::new(0.0, 0.5, 0.0),
        up: Vec3::Y,
        fov_degrees: 45.0,
    };
    let light = |name: &str, shape, strength| Light { name: name.into(), shape, strength };
    scene.lights = vec![
        light(
            "key",
            LightShape::Quad { corner: Vec3::new(2.0, 4.0, 1.0), edge_u: Vec3::X, edge_v: Vec3::Z },
            Vec3::new(30.0, 25.0, 20.0),
        ),
        light(
            "disk",
            LightShape::Disk { center: Vec3::new(-3.0, 2.0, 0.0), normal: Vec3::X, radius: 0.5 },
            Vec3::splat(5.0),
        ),
        light(
            "bulb",
            LightShape::Sphere { center: Vec3::new(0.0, 3.0, -3.0), radius: 0.3 },
            Vec3::new(2.0, 4.0, 9.0),
        ),
        light(
            "sun",
            LightShape::Directional {
                direction: Vec3::new(0.6, -0.8, 0.0),
                angular_diameter_degrees: 2.0,
            },
            Vec3::splat(1.0),
        ),
        light("spark", LightShape::Point { position: Vec3::new(0.0, 2.0, 2.0) }, Vec3::ONE),
    ];
    scene
}

fn settings() -> RenderSettings {
    RenderSettings {
        size: [45, 30],
        spp: 5,
        camera_samples: 3,
        seed: 42,
        ao_radius: 1.0,
        passes: Pass::ALL.to_vec(),
        sampler: SamplerEntry::sobol(),
        light_sampling: LightSampling::SolidAngle,
        adaptive: None,
        layers: None,
    }
}

/// What recordings leave out: samples that bring nothing.
const WEIGHED: Skips = Skips::NONE.with(Skip::Weightless).with(Skip::DarkLights);

fn accelerator(scene: &Scene) -> Box<dyn Accelerator> {
    built(&"bvh2".parse().unwrap(), scene)
}

fn film(scene: &Scene, settings: &RenderSettings, options: &RenderOptions<'_>) -> Film {
    render(scene, &*accelerator(scene), settings, options).unwrap().film
}

/// Bit by bit: no two values may differ even in the sign of a zero.
fn assert_same(a: &Film, b: &Film) {
    let bits = |film: &Film| -> Vec<(String, &'static str, Vec<u32>)> {
        let channels = film.layers().iter().flat_map(|l| l.channels.iter().map(move |c| (l, c)));
        channels
            .map(|(l, c)| (l.name.clone(), c.name, c.values.iter().map(|v| v.to_bits()).collect()))
            .collect()
    };
    assert_eq!(a.size(), b.size());
    for (a, b) in bits(a).iter().zip(&bits(b)) {
        let other = a.2.iter().zip(&b.2).position(|(a, b)| a != b);
        assert_eq!((&a.0, a.1, other), (&b.0, b.1, None), "films differ");
    }
}

#[test]
fn images_do_not_depend_on_threads_or_tile_order() {
    let scene = scene();
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let film = |threads, order| {
        let options = RenderOptions { order, ..RenderOptions::default() };
        pool(threads).install(|| film(&scene, &settings(), &options))
    };
    let first = film(1, TileOrder::Scanline);
    for threads in [1, 2, 7] {
        let orders = [TileOrder::Morton, TileOrder::Reverse, TileOrder::Shuffled(threads as u64)];
        for order in orders {
            assert_same(&first, &film(threads, order));
        }
    }
}

#[test]
fn images_do_not_depend_on_the_backend() {
    let scene = scene();
    let brute = built(&"brute".parse().unwrap(), &scene);
    let rendering = render(&scene, &*brute, &settings(), &RenderOptions::default()).unwrap();
    assert_same(&rendering.film, &film(&scene, &settings(), &RenderOptions::default()));
}

#[test]
fn left_out_rays_change_nothing() {
    let scene = scene();
    let backend = accelerator(&scene);
    let run = |skip| {
        let options = RenderOptions { skip, ..RenderOptions::default() };
        render(&scene, &*backend, &settings(), &options).unwrap()
    };
    let (with, without) = (run(Skips::ALL.without_shafts()), run(Skips::NONE));
    assert_same(&with.film, &without.film);
    assert_same(&run(Skips::ALL).film, &without.film);
    for (with, without) in with.stats.classes.iter().zip(&without.stats.classes) {
        assert_eq!(with.rays + with.rays_skipped, without.rays, "{}", with.name);
        assert_eq!(without.rays_skipped, 0);
    }
    // Without looking at the geometry.
    let with = run(WEIGHED);
    assert_same(&with.film, &without.film);
    let left_out: Vec<_> =
        with.stats.classes.iter().filter(|c| c.rays_skipped > 0).map(|c| c.name.as_str()).collect();
    assert_eq!(left_out, ["shadow.disk", "shadow.bulb", "shadow.sun", "shadow.spark"]);
}

#[test]
fn seeds_matter() {
    let scene = scene();
    let other = RenderSettings { seed: 43, ..settings() };
    let [a, b] = [settings(), other].map(|s| film(&scene, &s, &RenderOptions::default()));
    assert_ne!(a.channel("ao", "Y"), b.channel("ao", "Y"));
}

#[test]
fn a_recording_is_the_same_image() {
    let scene = scene();
    let backend = accelerator(&scene);
    for (spp, camera_samples) in [(5, 3), (100, 1), (1, 70)] {
        let settings = RenderSettings { spp, camera_samples, size: [21, 10], ..settings() };
        let options =
            RenderOptions { count_visits: true, skip: WEIGHED, ..RenderOptions::default() };
        let rendering = render(&scene, &*backend, &settings, &options).unwrap();
        let recording = record(&scene, &*backend, &settings, None).unwrap();
        let mut answers = Vec::new();
        let mut counts = Vec::new();
        for pass in recording.passes() {
            let mut words = pass.rays().no_answers();
            measure::trace(&*backend, pass.rays(), &mut words);
            answers.push(words);
            counts.push(measure::count(&*backend, pass.rays()).unwrap());
        }
        assert_same(&rendering.film, &recording.film(&answers, Some(&counts)));
        let plain = recording.film(&answers, None);
        assert!(plain.channel("nodes", "Y").is_none());
        assert_eq!(rendering.stats.primary_rays, recording.primary_rays());
        assert_eq!(rendering.stats.primary_hits, recording.primary_hits());
        for pass in recording.passes() {
            let name = pass.pass().name();
            let classes = rendering.stats.classes.iter().filter(|c| {
                c.name == name || c.name.strip_prefix(name).is_some_and(|l| l.starts_with('.'))
            });
            let (rays, skipped) =
                classes.fold((0, 0), |sum, c| (sum.0 + c.rays, sum.1 + c.rays_skipped));
            assert_eq!((pass.rays().len() as u64, pass.rays_skipped()), (rays, skipped), "{name}");
        }
    }
}

#[test]
fn recorded_rays_know_their_pixels_and_lights() {
    let scene = scene();
    let settings = RenderSettings { camera_samples: 1, ..settings() };
    let recording = record(&scene, &*accelerator(&scene), &settings, None).unwrap();
    for (index, pass) in recording.passes().iter().enumerate() {
        for (ray_index, ray) in pass.rays().rays().iter().enumerate() {
            let [x, y] = recording.pixel(index, ray_index).map(|n| n as f32 + 0.5);
            let view = scene.camera.ray(x, y, settings.size);
            let off = (ray.origin - view.origin).normalize() - view.direction;
            assert!(off.length() < 1e-4, "ray {ray_index} of {:?}", pass.pass());
            assert!(pass.weight(ray_index) > 0.0);
            let class = recording.class(index, ray_index);
            assert_eq!(class.pass(), pass.pass());
            if class == (RayClass::Shadow { light: 3 }) {
                assert!(ray.t_max.is_infinite());
            }
        }
        let all: Vec<usize> = (0..pass.rays().len()).collect();
        let per_pixel = recording.rays_per_pixel(index, &all);
        assert_eq!(per_pixel.iter().sum::<u32>() as usize, all.len());
    }
}

#[test]
fn layers_say_what_is_documented() {
    let scene = scene();
    let film = film(&scene, &settings(), &RenderOptions::default());
    let get = |layer: &str, channel: &str| film.channel(layer, channel).unwrap();
    let names: Vec<_> = film.layers().iter().map(|l| l.name.as_str()).collect();
    let expected = [
        "",
        "shadow",
        "ao",
        "ao-unbounded",
        "shadow.key",
        "shadow.disk",
        "shadow.bulb",
        "shadow.sun",
        "shadow.spark",
        "irradiance",
        "depth",
        "normal",
    ];
    assert_eq!(names, expected);
    let alpha = get("", "A");
    assert!(alpha.contains(&0.0) && alpha.contains(&1.0));
    assert!(alpha.iter().any(|a| *a > 0.0 && *a < 1.0), "edges are partly covered");
    for (pixel, &alpha) in alpha.iter().enumerate() {
        let background = alpha == 0.0;
        assert_eq!(get("depth", "Z")[pixel].is_infinite(), background);
        let normal = Vec3::from(["X", "Y", "Z"].map(|c| get("normal", c)[pixel]));
        assert!(normal.length() < 1.0 + 1e-6);
        for layer in &names[1..9] {
            let value = get(layer, "Y")[pixel];
            assert!((0.0..=1.0).contains(&value) && (!background || value == 0.0), "{layer}");
        }
        assert!(get("ao", "Y")[pixel] >= 0.0);
    }
    let lit = |layer: &str| get(layer, "Y").iter().any(|v| *v > 0.9);
    assert!(names[1..9].iter().all(|layer| lit(layer)), "every layer has a bright place");
}

/// Layers alone and in company: the same bits, and no rays but those that they need.
#[test]
fn layers_not_asked_for_are_not_made() {
    let scene = scene();
    let backend = accelerator(&scene);
    let run = |passes: &[Pass], layers: Option<&[&str]>| {
        let layers = layers.map(|names| names.iter().map(|&name| name.into()).collect());
        let settings = RenderSettings { passes: passes.to_vec(), layers, ..settings() };
        render(&scene, &*backend, &settings, &RenderOptions::default())
    };
    for passes in [&Pass::ALL[..], &[Pass::AmbientOcclusionUnbounded], &[Pass::Shadow]] {
        let all = run(passes, None).unwrap();
        assert!(all.stats.layers_left_out.is_empty() && all.stats.bytes_left_out == 0);
        let called = |name: &str| if name.is_empty() { "picture" } else { name }.to_owned();
        let names: Vec<_> = all.film.layers().iter().map(|layer| called(&layer.name)).collect();
        let (alone, pairs) = (names.windows(1), names.windows(2));
        for asked in alone.chain(pairs).chain([&names[..]]) {
            let asked: Vec<&str> = asked.iter().map(String::as_str).collect();
            let some = run(passes, Some(&asked)).unwrap();
            let (mut kept, mut bytes) = (0, 0);
            for layer in all.film.layers() {
                let made = some.film.layers().iter().find(|l| l.name == layer.name);
                if asked.contains(&called(&layer.name).as_str()) {
                    let made = made.unwrap_or_else(|| panic!("{} of {asked:?}", layer.name));
                    let bits = |layer: &sato::render::Layer| {
                        let values = layer.channels.iter().flat_map(|c| c.values.iter());
                        values.map(|v| v.to_bits()).collect::<Vec<_>>()
                    };
                    assert!(bits(layer) == bits(made), "{} of {asked:?}", layer.name);
                    kept += 1;
                } else {
                    assert!(made.is_none(), "{} though {asked:?}", layer.name);
                    bytes += layer.channels.iter().map(|c| 4 * c.values.len() as u64).sum::<u64>();
                    assert!(some.stats.layers_left_out.contains(&called(&layer.name)));
                }
            }
            assert_eq!(some.film.layers().len(), kept);
            assert_eq!(some.stats.layers_left_out.len(), names.len() - kept);
            assert_eq!(some.stats.bytes_left_out, bytes);
            let traced = some.stats.classes.iter().map(|class| &class.name);
            let mut classes: Vec<_> = traced.chain(&some.stats.classes_left_out).collect();
            let mut of_all: Vec<_> = all.stats.classes.iter().map(|class| &class.name).collect();
            classes.sort();
            of_all.sort();
            assert_eq!(classes, of_all);
        }
    }
    let traced = |layers: &[&str]| {
        let stats = run(&Pass::ALL, Some(layers)).unwrap().stats;
        stats.classes.into_iter().map(|class| class.name).collect::<Vec<_>>()
    };
    let lights = ["shadow.key", "shadow.disk", "shadow.bulb", "shadow.sun", "shadow.spark"];
    assert_eq!(traced(&["depth", "normal"]), [""; 0]);
    assert_eq!(traced(&["shadow.bulb", "ao-unbounded"]), ["ao-unbounded", "shadow.bulb"]);
    assert_eq!(traced(&["irradiance"]), lights);
    assert_eq!(traced(&["shadow"]), lights);
    assert_eq!(traced(&["picture"]), [&["ao"], &lights[..]].concat());
    for (asked, message) in [
        (vec!["depht"], "no layer \"depht\": choose from picture, shadow, ao, ao-unbounded,"),
        (vec!["depth", ""], "no layer \"\""),
        (vec!["samples.ao"], "shadow.spark, irradiance, depth, normal"),
        (vec![], "no layer to make"),
    ] {
        let error = run(&Pass::ALL, Some(&asked)).unwrap_err();
        assert!(matches!(error, Error::Usage(_)));
        assert!(error.to_string().contains(message), "{error}");
    }
    let error = run(&[Pass::AmbientOcclusion], Some(&["irradiance"])).unwrap_err().to_string();
    assert!(error.contains("choose from picture, ao, depth, normal"), "{error}");
}

#[test]
fn samples_that_are_all_the_same_are_traced_once() {
    let scene = scene();
    let one = RenderSettings { camera_samples: 1, ..settings() };
    let rendering = render(&scene, &*accelerator(&scene), &one, &RenderOptions::default()).unwrap();
    let class = |name: &str| rendering.stats.classes.iter().find(|c| c.name == name).unwrap();
    let point = class("shadow.spark");
    assert_eq!(point.rays + point.rays_skipped, rendering.stats.primary_hits);
    let area = class("shadow.key");
    assert_eq!(area.rays + area.rays_skipped, 5 * rendering.stats.primary_hits);
    assert!(rendering.stats.classes.iter().all(|c| c.rays_occluded < c.rays));
}

#[test]
fn what_has_no_image_is_refused() {
    let mut scene = scene();
    let backend = accelerator(&scene);
    let empty = RenderSettings { size: [0, 4], ..settings() };
    let refused = render(&scene, &*backend, &empty, &RenderOptions::default());
    assert!(matches!(refused, Err(Error::Usage(_))));
    assert!(matches!(record(&scene, &*backend, &empty, None), Err(Error::Usage(_))));
    scene.lights.clear();
    let shadows = RenderSettings { passes: vec![Pass::Shadow], ..settings() };
    let error = render(&scene, &*backend, &shadows, &RenderOptions::default()).unwrap_err();
    assert!(error.to_string().contains("no light"), "{error}");
}

#[test]
fn scenes_without_triangles_or_lights_are_background_or_ambient() {
    let nothing = scene_of(TriangleMesh::default());
    let options = RenderOptions::default();
    let empty = film(&nothing, &settings(), &options);
    assert!(empty.channel("", "A").unwrap().iter().all(|a| *a == 0.0));
    tone_map(&empty);
    let mut unlit = scene();
    unlit.lights.clear();
    let unlit = film(&unlit, &settings(), &options);
    assert!(unlit.channel("shadow", "Y").is_none());
    let brightest = unlit.channel("", "R").unwrap().iter().copied().fold(0.0, f32::max);
    assert!((brightest - 0.8).abs() < 1e-6, "albedo under a white sky");
}

#[test]
fn progress_counts_every_tile() {
    let scene = scene();
    let seen = Mutex::new(Vec::new());
    let progress = |done, total| seen.lock().unwrap().push((done, total));
    let options = RenderOptions { progress: Some(&progress), ..RenderOptions::default() };
    film(&scene, &settings(), &options);
    let mut seen = seen.into_inner().unwrap();
    seen.sort_unstable();
    assert_eq!(seen, (1..=24).map(|n| (n, 24)).collect::<Vec<_>>());
}

#[test]
fn exr_files_hold_all_layers_and_metadata() {
    let scene = scene();
    let film = film(&scene, &settings(), &RenderOptions::default());
    let folder = tempfile::tempdir().unwrap();
    let (path, again) = (folder.path().join("image.exr"), folder.path().join("again.exr"));
    let mut metadata = settings().metadata();
    metadata.push(("sato:scene".into(), "scenes/Würfel.toml".into()));
    write_exr(&path, &film, &metadata).unwrap();
    write_exr(&again, &film, &metadata).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), std::fs::read(&again).unwrap());

    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(&path)
        .unwrap();
    let channels = &image.layer_data.channel_data.list;
    let mut count = 0;
    for layer in film.layers() {
        for channel in &layer.channels {
            let prefix = if layer.name.is_empty() { "" } else { "." };
            let name = format!("{}{prefix}{}", layer.name, channel.name);
            let read = channels.iter().find(|c| c.name.to_string() == name).expect(&name);
            let values: Vec<u32> = read.sample_data.values_as_f32().map(f32::to_bits).collect();
            let written: Vec<u32> = channel.values.iter().map(|v| v.to_bits()).collect();
            assert!(values == written, "{name}");
            count += 1;
        }
    }
    assert_eq!(channels.len(), count);
    let attributes = &image.layer_data.attributes;
    let software = attributes.software_name.as_ref().unwrap().to_string();
    assert_eq!(software, concat!("sato ", env!("CARGO_PKG_VERSION")));
    for (name, value) in &metadata {
        let read = attributes.other.iter().find(|(key, _)| key.as_slice() == name.as_bytes());
        let Some((_, exr::meta::attribute::AttributeValue::Text(text))) = read else {
            panic!("no text {name}")
        };
        assert_eq!(text.as_slice(), value.as_bytes());
    }
}

#[test]
fn the_picture_is_neither_black_nor_white() {
    let scene = scene();
    let film = film(&scene, &settings(), &RenderOptions::default());
    let picture = tone_map(&film);
    assert_eq!(picture.pixels.len(), 45 * 30);
    let mean = picture.pixels.iter().map(|p| u32::from(p[1])).sum::<u32>() / (45 * 30);
    assert!((50..200).contains(&mean), "mean green {mean}");
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("picture.png"), &picture).unwrap();
    let error = write_png(folder.path(), &picture).unwrap_err();
    assert!(matches!(error, Error::Io { .. }));
}
