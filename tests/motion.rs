//! Scenes that move: the first frame is the scene, frames are functions of time alone, and objects say
//! what moves.

use assert_cmd::Command;
use predicates::str::contains;
use sato::geometry::TriangleMesh;
use sato::scene::generate::{GENERATORS, MANY_TRIANGLES};
use sato::scene::{Motion, Object, Scene, SceneInfo, load};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    fn scene(&self, content: &str) -> Scene {
        load(self.write("scene.toml", content)).unwrap()
    }

    /// Three keys, `k0.obj` to `k2.obj`: a square that stays, and one that rises by 1 a key.
    fn with_keys() -> Self {
        let folder = Self::new();
        for k in 0..3 {
            let mut text =
                String::from("o still\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3 4\no lift\n");
            for (x, z) in [(2, 0), (3, 0), (3, 1), (2, 1)] {
                writeln!(text, "v {x} {k} {z}").unwrap();
            }
            folder.write(&format!("k{k}.obj"), text + "f 5 6 7 8\n");
        }
        folder
    }
}

const SEQUENCE: &str = "[[geometry]]\nfile = 'k%d.obj'\nkeys = [0, 2]\n";

fn bits(mesh: &TriangleMesh) -> Vec<[u32; 3]> {
    mesh.vertices().iter().map(|v| v.to_array().map(f32::to_bits)).collect()
}

fn motion(scene: &Scene) -> &Motion {
    scene.motion.as_ref().expect("it moves")
}

/// What every moving scene promises.
fn check(scene: &Scene) {
    let (mesh, motion, name) = (&scene.mesh, motion(scene), &scene.name);
    let first = bits(mesh);
    assert!(bits(&motion.mesh_at(mesh, 0)) == first, "{name}: the first frame differs");

    let (mut vertices, mut triangles) = (0, 0);
    for object in &motion.objects {
        assert_eq!(object.triangles.start, triangles, "{name}: {object:?}");
        triangles = object.triangles.end;
        assert!(object.vertices.start >= vertices, "{name}: {object:?}");
        vertices = object.vertices.end;
        let mut used = mesh.triangles()[object.triangles.clone()].iter().flatten();
        let own = used.all(|&i| object.vertices.contains(&(i as usize)));
        assert!(own, "{name}: {object:?} has vertices of others");
    }
    assert_eq!((triangles, vertices), (mesh.len(), mesh.vertices().len()), "{name}");

    let mut moved = vec![false; motion.objects.len()];
    for frame in [motion.frames / 3, motion.frames / 2, motion.frames - 1] {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let there = |threads| bits(&pool(threads).install(|| motion.mesh_at(mesh, frame)));
        let one = there(1);
        assert!(one == there(3), "{name}: frame {frame} depends on threads");
        // Neither does it on what was posed before.
        let other = motion.mesh_at(mesh, motion.frames - 1);
        assert!(one == bits(&motion.mesh_at(&other, frame)), "{name}: frame {frame}");
        for (moved, object) in moved.iter_mut().zip(&motion.objects) {
            *moved |= one[object.vertices.clone()] != first[object.vertices.clone()];
        }
        let finite = motion.mesh_at(mesh, frame).vertices().iter().all(|v| v.is_finite());
        assert!(finite, "{name}: frame {frame}");
    }
    for (moved, object) in moved.iter().zip(&motion.objects) {
        assert_eq!(*moved, object.moves, "{name}: {object:?}");
    }
}

fn object(vertices: [usize; 2], triangles: [usize; 2], moves: bool) -> Object {
    let range = |[start, end]: [usize; 2]| start..end;
    Object { vertices: range(vertices), triangles: range(triangles), moves }
}

#[test]
fn sequences_go_straight_from_key_to_key() {
    let folder = Folder::with_keys();
    let scene = folder.scene(SEQUENCE);
    check(&scene);
    assert_eq!(motion(&scene).frames, 3);
    assert_eq!(
        motion(&scene).objects,
        [object([0, 4], [0, 2], false), object([4, 8], [2, 4], true)]
    );
    let height = |scene: &Scene, frame| motion(scene).mesh_at(&scene.mesh, frame).vertices()[4].y;
    assert_eq!([0, 1, 2].map(|frame| height(&scene, frame)), [0.0, 1.0, 2.0]);
    for k in 0..3 {
        let key = load(folder.0.path().join(format!("k{k}.obj"))).unwrap();
        assert_eq!(bits(&motion(&scene).mesh_at(&scene.mesh, k)), bits(&key.mesh), "key {k}");
    }

    let scene = folder.scene(&format!("[animation]\nframes = 9\n{SEQUENCE}translate = [0, 5, 0]"));
    check(&scene);
    assert_eq!(motion(&scene).frames, 9);
    assert_eq!([0, 3, 8].map(|frame| height(&scene, frame)), [5.0, 5.75, 7.0]);

    let one = folder.scene(&format!("[animation]\nframes = 1\n{SEQUENCE}"));
    assert_eq!((motion(&one).frames, height(&one, 0)), (1, 0.0));
}

#[test]
fn keys_of_transforms_come_before_the_placement() {
    let folder = Folder::with_keys();
    let keys = "[[geometry.key]]\ntime = 0\nscale = 2\n[[geometry.key]]\ntime = 0.5\n\
        rotate_degrees = [0, 90, 0]\ntranslate = [1, 0, 0]\nscale = 2\n[[geometry.key]]\ntime = 1\n\
        rotate_degrees = [0, 360, 0]\nscale = 2\n";
    let scene = folder.scene(&format!(
        "[[geometry]]\nfile = 'k0.obj'\ntranslate = [0, 10, 0]\nscale = 3\n{keys}"
    ));
    assert_eq!(motion(&scene).frames, 20);
    check(&scene);
    let objects = motion(&scene).objects.iter();
    assert_eq!(objects.map(|object| object.moves).collect::<Vec<_>>(), [true, true]);

    let scene = folder.scene(&format!(
        "[animation]\nframes = 3\n[[geometry]]\nfile = 'k0.obj'\ntranslate = [0, 10, 0]\nscale = 3\n{keys}"
    ));
    // The corner (1, 0, 0): scaled by 2, turned by 90 degrees about y, moved by x; then 3 times as
    // far from the origin, and up.
    let there = motion(&scene).mesh_at(&scene.mesh, 1).vertices()[1];
    assert!(there.distance(sato::geometry::Vec3::new(3.0, 10.0, -6.0)) < 1e-5, "{there}");
    let last = motion(&scene).mesh_at(&scene.mesh, 2).vertices()[1];
    assert!(last.distance(scene.mesh.vertices()[1]) < 1e-5, "{last}");
}

#[test]
fn still_and_moving_parts_stand_beside_each_other() {
    let folder = Folder::with_keys();
    let still = "[[geometry]]\nfile = 'k1.obj'\ntranslate = [0, 0, 9]\n";
    let turning =
        "[[geometry.key]]\ntime = 0.1\n[[geometry.key]]\ntime = 1\nrotate_degrees = [9, 0, 0]\n";
    let scene =
        folder.scene(&format!("{still}{SEQUENCE}scale = [1, -1, 1]\n{still}{SEQUENCE}{turning}"));
    check(&scene);
    let moves: Vec<_> = motion(&scene).objects.iter().map(|object| object.moves).collect();
    assert_eq!(moves, [false, false, false, true, false, false, true, true]);
    assert!(folder.scene(still).motion.is_none());
    // Keys that are all alike move nothing; neither do transforms.
    for k in [0, 2] {
        fs::copy(folder.0.path().join("k1.obj"), folder.0.path().join(format!("k{k}.obj"))).ok();
    }
    let same = "[[geometry.key]]\ntime = 0\nscale = 2\n[[geometry.key]]\ntime = 1\nscale = 2\n";
    let scene = folder.scene(&format!("{SEQUENCE}{same}"));
    assert!(scene.motion.is_none());
    assert_eq!(scene.mesh.vertices()[6], sato::geometry::Vec3::new(6.0, 2.0, 2.0));
}

#[test]
fn a_frame_is_a_scene_that_stands_still() {
    let folder = Folder::with_keys();
    let scene = folder.scene(SEQUENCE);
    let last = scene.at_frame(2).unwrap();
    assert!(last.motion.is_none() && last.at_frame(0).is_none());
    assert_eq!(bits(&last.mesh), bits(&motion(&scene).mesh_at(&scene.mesh, 2)));
    assert!(scene.at_frame(3).is_none());
    let info = SceneInfo::of(&scene).motion.unwrap();
    assert_eq!((info.frames, info.objects, info.moving_objects), (3, 2, 1));
}

#[test]
fn the_moving_crowd_of_the_sequence_is_whole() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/crowd_koth_moving.toml");
    let scene = match load(&path) {
        Ok(scene) => scene,
        Err(error @ sato::Error::MissingMesh { .. }) => return eprintln!("skipped: {error}"),
        Err(error) => panic!("{error}"),
    };
    check(&scene);
    let info = SceneInfo::of(&scene);
    assert_eq!((info.triangles, info.motion.unwrap().frames), (170_928, 10));
    // The agents are in four groups, by model; the map's groups stand.
    assert_eq!(info.motion.unwrap().moving_objects, 4);
    let first = load(path.with_file_name("crowd_koth.toml")).unwrap();
    assert_eq!(bits(&first.mesh), bits(&scene.mesh));
}

#[test]
fn moving_generators_keep_their_promises() {
    let folder = Folder::new();
    let mut moving = 0;
    for entry in GENERATORS.iter().filter(|entry| entry.triangles <= MANY_TRIANGLES) {
        let scene = load(entry.name).unwrap();
        let Some(motion) = &scene.motion else { continue };
        moving += 1;
        check(&scene);
        assert_eq!(motion.frames, 20, "{}", entry.name);
        for frame in 0..motion.frames {
            let bounds = motion.mesh_at(&scene.mesh, frame).bounds();
            let far = bounds.min.abs().max(bounds.max.abs()).max_element();
            assert!(far < 1e4, "{}: {bounds:?}", entry.name);
        }
        // As a part of another scene: placed, and turned as a whole.
        let entry = format!("[[geometry]]\ngenerator = '{}'\nscale = 2\n", entry.name);
        let placed = folder.scene(&entry);
        check(&placed);
        let there = |scene: &Scene| scene.motion.as_ref().unwrap().mesh_at(&scene.mesh, 7);
        let (plain, twice) = (there(&scene), there(&placed));
        let pairs = plain.vertices().iter().zip(twice.vertices());
        assert!(pairs.clone().all(|(a, b)| *a * 2.0 == *b), "{entry}");
        let keys =
            "[[geometry.key]]\ntime = 0\n[[geometry.key]]\ntime = 1\nrotate_degrees = [0, 90, 0]\n";
        let turned = folder.scene(&format!("{entry}{keys}"));
        check(&turned);
        assert!(self::motion(&turned).objects.iter().all(|object| object.moves), "{entry}");
    }
    assert!(moving >= 3, "{moving}");
}

#[test]
fn commands_take_a_frame_of_a_moving_scene() {
    let folder = Folder::with_keys();
    folder.write("moving.toml", SEQUENCE);
    folder.write("still.toml", "[[geometry]]\nfile = 'k1.obj'\n");
    let sato = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("sato").unwrap();
        command.current_dir(folder.0.path()).env_remove("SATO_SCENES").args(arguments);
        command.assert()
    };
    sato(&["scene", "info", "moving.toml"]).success().stdout(contains("2, of which 1 move"));
    sato(&["scene", "export", "moving.toml", "--frame", "1", "-o", "out.obj"]).success();
    let exported = load(folder.0.path().join("out.obj")).unwrap();
    let key = load(folder.0.path().join("k1.obj")).unwrap();
    assert_eq!(bits(&exported.mesh), bits(&key.mesh));

    let size = ["--size", "16", "9", "--spp", "1"];
    let picture = |scene: &str, frame: &[&str], name: &str| {
        let output = ["render", scene, "-q", "-o", name];
        sato(&[&output[..], frame, &size].concat()).success();
        fs::read(folder.0.path().join(name.replace("exr", "png"))).unwrap()
    };
    let [first, zeroth, last] =
        [("a.exr", None), ("b.exr", Some("0")), ("c.exr", Some("2"))].map(|(name, frame)| {
            match frame {
                None => picture("moving.toml", &[], name),
                Some(frame) => picture("moving.toml", &["--frame", frame], name),
            }
        });
    assert!(first == zeroth && first != last);

    let record = ["rays", "record", "moving.toml", "-q", "-o", "r.rays", "--frame", "2"];
    sato(&[&record[..], &size].concat()).success();
    let file = sato::ray_set::RayFile::read(&folder.0.path().join("r.rays")).unwrap();
    assert_eq!(file.frame, Some(2));
    let replay =
        ["rays", "replay", "r.rays", "--backend", "bvh2", "--backend", "brute", "--rounds", "1"];
    sato(&replay).success();

    let frames = "--frame 3: moving.toml has frames 0 to 2";
    for command in [&["render"][..], &["scene", "info"], &["compare", "--backend", "bvh2"]] {
        let refused = sato(&[command, &["moving.toml", "--frame", "3"]].concat());
        refused.failure().code(2).stderr(contains(frames));
    }
    let refused = sato(&["render", "still.toml", "--frame", "0", "-o", "no.exr"]);
    refused.failure().code(2).stderr(contains("nothing moves"));
    assert!(!folder.0.path().join("no.exr").exists());
}
