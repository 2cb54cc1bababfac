//! Input that cannot be used: one clear line with file, line and key each time, and never a panic.

use sato::scene::load;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// The scene file that bad ones are made of; the geometry is at `t.obj` beside it.
const CAMERA: &str = "[camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\n";
const GEOMETRY: &str = "[[geometry]]\nfile = 't.obj'\n";

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("t.obj", TRIANGLE);
        folder.write("bad.toml.txt", TRIANGLE);
        folder
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    /// The message for `content` in a file called `name`; it is one line.
    fn refusal(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        message(self.write(name, content))
    }
}

fn message(path: PathBuf) -> String {
    let message = load(path).expect_err("loaded").to_string();
    assert!(!message.chars().any(char::is_control), "more than one line: {message:?}");
    message
}

/// Every one of `expected` is in `message`.
fn assert_says(message: &str, expected: &[&str], input: &str) {
    for part in expected {
        assert!(message.contains(part), "{message:?} does not say {part:?} of {input:?}");
    }
}

#[test]
fn bad_obj_files_are_refused_by_line() {
    let folder = Folder::new();
    let table: &[(&str, &[&str])] = &[
        ("", &["no triangles"]),
        ("# nothing\n", &["no triangles"]),
        ("v 0 0 0\nl 1 1\np 1\n", &["no triangles"]),
        ("\u{89}PNG\r\n\u{1a}\n", &["no triangles"]),
        ("v 0 0\nf 1 1 1", &[":1:", "2 numbers"]),
        ("v\n", &[":1:", "0 numbers"]),
        ("\r\n\r\nv 0 0 0 1 2\r\n", &[":3:", "5 numbers"]),
        ("v 0 0 zero\nf 1 1 1\n", &[":1:", "not a number: `zero`"]),
        ("v 0 0 0,5\nf 1 1 1\n", &[":1:", "`0,5`"]),
        ("v 0 0 0 0\nf 1 1 1\n", &[":1:", "weight 0"]),
        ("v 0 0 0 w\nf 1 1 1\n", &[":1:", "`w`"]),
        ("\u{feff}v 0 0 x\n", &[":1:", "`x`"]),
        ("v 0 0 0\nf 1 1 2\n", &[":2:", "index 2", "out of range", "1 vertices in the file"]),
        ("v 0 0 0\nf 1 1 0\n", &[":2:", "index 0"]),
        ("v 0 0 0\nf -1 -1 -2\nv 1 1 1\n", &[":2:", "index -2", "1 vertices before this line"]),
        ("v 0 0 0\nf 1 1 4294967297\n", &[":2:", "4294967297", "out of range"]),
        ("v 0 0 0\nf 1 1 9223372036854775807\n", &[":2:", "out of range"]),
        ("v 0 0 0\nf 1 1 -9223372036854775808\n", &[":2:", "out of range"]),
        ("v 0 0 0\nf 1 1 99999999999999999999\n", &[":2:", "not a vertex index"]),
        ("v 0 0 0\nf 1 1 1.5\n", &[":2:", "not a vertex index: `1.5`"]),
        ("v 0 0 0\nf 1 1 /1/1\n", &[":2:", "`/1/1`"]),
        ("v 0 0 0\nf 1 1 \u{7}\n", &[":2:", r"`\u{7}`"]),
        ("v 0 0 0\n\nf\n", &[":3:", "fewer than 3 vertices: 0"]),
        ("v 0 0 0\nf 1\n", &[":2:", "fewer than 3 vertices: 1"]),
        ("v 0 0 0\nf 1 1 # 1\n", &[":2:", "fewer than 3 vertices: 2"]),
        ("v 0 0 0\nf 1\\\n 1 \\\n 7\n", &[":2:", "index 7"]),
        ("v nan 0 0\nf 1 1 1\n", &["none of 1 triangles has finite vertices"]),
        ("v 1e400 -inf 0\nf 1 1 1\n", &["none of 1 triangles has finite vertices"]),
        ("v 0 0 0\nv 0 2e18 0\nf 1 1 2\n", &[":2:", "2e18 is beyond 1e18"]),
        ("v 1e10 0 0 1e-20\nf 1 1 1\n", &[":1:", "beyond 1e18"]),
    ];
    for (content, expected) in table {
        let message = folder.refusal("bad.obj", content);
        assert_says(&message, &[&["bad.obj"], *expected].concat(), content);
    }
    assert_says(&folder.refusal("bad.obj", b"v 0 0 \xff\n"), &["bad.obj:1:"], "not UTF-8");
    let long = format!("v 0 0 0\nf 1 1 {}\n", "9".repeat(1 << 20));
    assert!(folder.refusal("bad.obj", long).len() < 400);
}

#[test]
fn odd_obj_files_are_accepted() {
    let folder = Folder::new();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let table: &[(&str, usize)] = &[
        ("f 1 2 3", 1),
        ("f -3 -2 -1\n", 1),
        ("f 1/1 2/ 3/-9223372036854775808\n", 1),
        ("vt 0 0\nvn 0 0 1\nf 1/9223372036854775800/1 2//18 3/-7/-7\n", 1),
        ("f 1 2 3 2 1 3\r\nf 1 2 3\r", 5),
        ("l 1 2 3\nl 1 2\np 1\ncurv 0 1\nf 1 2 3\n", 1),
        ("v 1 1 1 0.5 0.5 0.5\nf 1 2 3 4 # a quad\n", 2),
        ("v nan 0 0\nf 1 2 4\nf 1 2 3\n", 1),
        ("usemtl\nmtllib\nmtllib no such file\ng\no\nf 1 2 3\n", 1),
    ];
    for (rest, triangles) in table {
        let scene = load(folder.write("odd.obj", format!("{corners}{rest}"))).unwrap();
        assert_eq!(scene.mesh.len(), *triangles, "{rest:?}");
    }
    let latin_1 = [b"# caf\xe9\ng caf\xe9\n", TRIANGLE.as_bytes()].concat();
    assert!(load(folder.write("odd.obj", latin_1)).is_ok());
    let polygon = format!("{TRIANGLE}f{}\n", " 1 2 3".repeat(100_000));
    assert_eq!(load(folder.write("odd.obj", polygon)).unwrap().mesh.len(), 299_999);
}

#[test]
fn bad_scene_files_are_refused_by_line_and_key() {
    let folder = Folder::new();
    let table: &[(&str, &[&str])] = &[
        ("", &["geometry", "at least one"]),
        ("geometry = []", &[":1:", "geometry"]),
        ("name = 'x", &[":1:"]),
        ("\u{feff}\n= 3", &[":2:"]),
        ("name = 3", &[":1:", "name", "string"]),
        ("name = 'a/b'\n$G", &[":1:", "name", "a/b"]),
        ("name = ''\n$G", &[":1:", "name"]),
        ("nmae = 'x'\n$G", &[":1:", "nmae", "unknown"]),
        ("\"na\\nme\" = 'x'\n$G", &[":1:", "unknown"]),
        ("size = [1280]\n$G", &[":1:", "size", "2 numbers"]),
        ("size = 5\n$G", &[":1:", "size", "2 numbers"]),
        ("size = [0, 720]\n$G", &[":1:", "size", "0 x 720"]),
        ("size = [-1, 720]\n$G", &[":1:", "size"]),
        ("size = [1.5, 720]\n$G", &[":1:", "size"]),
        ("size = [1, 1e12]\n$G", &[":1:", "size"]),
        ("size = [nan, 1]\n$G", &[":1:", "size"]),
        ("$G[camera]\neye = [0, 0, 1]", &[":3:", "look_at"]),
        ("$G[camera]\nlook_at = [0, 0, 1]\neye = [0, 1]", &[":5:", "camera.eye", "3 numbers"]),
        ("$G[camera]\nlook_at = [0, 0, 1]\neye = [0, 1, 2, 3]", &[":5:", "camera.eye"]),
        ("$G[camera]\nlook_at = [0, 0, 1]\neye = [0, 'a', 2]", &[":5:", "camera.eye"]),
        ("$G[camera]\neye = [1, 2, 3]\nlook_at = [1, 2, 3]", &[":5:", "camera.look_at", "apart"]),
        ("$G[camera]\neye = [1e300, 2, 3]\nlook_at = [1, 2, 3]", &[":4:", "camera.eye", "finite"]),
        ("$G[camera]\neye = [nan, 2, 3]\nlook_at = [1, 2, 3]", &[":4:", "camera.eye", "finite"]),
        ("$G$Cup = [0, 0, -2]", &[":6:", "camera.up", "parallel"]),
        ("$G$Cup = [0, 0, 0]", &[":6:", "camera.up", "direction"]),
        ("$G$Cup = [0, inf, 0]", &[":6:", "camera.up", "finite"]),
        ("$G$Cfov_degrees = 0", &[":6:", "camera.fov_degrees", "not 0"]),
        ("$G$Cfov_degrees = 180", &[":6:", "camera.fov_degrees", "not 180"]),
        ("$G$Cfov_degrees = nan", &[":6:", "camera.fov_degrees", "NaN"]),
        ("$G$Cfov_degrees = '60'", &[":6:", "camera.fov_degrees", "60"]),
        ("$G$Cfov = 60", &[":6:", "fov", "unknown"]),
        ("$G[ambient_occlusion]\nradius = 0", &[":4:", "ambient_occlusion.radius", "above 0"]),
        ("$G[ambient_occlusion]\nradius = -1.5", &[":4:", "ambient_occlusion.radius", "-1.5"]),
        ("$G[ambient_occlusion]\nradius = inf", &[":4:", "ambient_occlusion.radius"]),
        ("$G[ambient_occlusion]", &[":3:", "radius"]),
        ("[[geometry]]", &[":1:", "geometry[0].file", "missing"]),
        ("[[geometry]]\nfile = ''", &[":2:", "geometry[0].file", "empty"]),
        ("$G[[geometry]]\ngenerator = 'x'\nfile = 't.obj'", &[":4:", "geometry[1].generator"]),
        ("[[geometry]]\ngenerator = 'no-such'", &[":2:", "geometry[0].generator", "no-such"]),
        ("$Gseed = 1", &[":3:", "geometry[0].seed"]),
        ("[[geometry]]\ngenerator = 'x'\nseed = -1", &[":3:", "geometry[0].seed", "-1"]),
        ("[[geometry]]\nfile = 'bad.toml'", &["a scene file, not a mesh"]),
        ("[[geometry]]\nfile = 'bad.toml.txt'", &["bad.toml.txt", "unknown format", ".obj.zst"]),
        ("$Gscale = 0", &[":3:", "geometry[0].scale", "flatten"]),
        ("$Gscale = [1, 0, 1]", &[":3:", "geometry[0].scale", "flatten"]),
        ("$Gscale = [1, 1]", &[":3:", "geometry[0].scale", "3 numbers"]),
        ("$Gscale = nan", &[":3:", "geometry[0].scale", "finite"]),
        ("$Gscale = 1e30", &[":1:", "geometry[0]", "beyond 1e18"]),
        ("$Gtranslate = [inf, 0, 0]", &[":3:", "geometry[0].translate", "finite"]),
        ("$Gtranslate = [1e19, 0, 0]", &[":1:", "geometry[0]", "beyond 1e18"]),
        ("$Grotate_degrees = 90", &[":3:", "geometry[0].rotate_degrees", "3 numbers"]),
        ("$Grotate_degrees = [0, nan, 0]", &[":3:", "geometry[0].rotate_degrees", "finite"]),
        ("$Gmatrix = [1, 0, 0, 0]", &[":3:", "geometry[0].matrix", "16 numbers"]),
        (
            "$Gmatrix = [0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,1]",
            &[":3:", "geometry[0].matrix", "flatten"],
        ),
        (
            "$Gmatrix = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,1,1]",
            &[":3:", "geometry[0].matrix", "last row"],
        ),
        (
            "$Gscale = 1\nmatrix = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]",
            &[":4:", "matrix", "beside"],
        ),
        ("$G[animation]\nframes = 0", &[":4:", "animation.frames", "not 0"]),
        ("$G[animation]\nframes = 100001", &[":4:", "animation.frames", "100001"]),
        ("$G[animation]\nframes = 1.5", &[":4:", "animation.frames", "1.5"]),
        ("$G[animation]\nframes = nan", &[":4:", "animation.frames", "NaN"]),
        ("$G[animation]\nframes = '9'", &[":4:", "animation.frames"]),
        ("$G[animation]", &[":3:", "frames"]),
        ("$G[animation]\nframes = 5", &[":4:", "animation.frames", "nothing", "moves"]),
        ("$Gkeys = [0, 1]", &[":2:", "geometry[0].file", "%02d", "t.obj"]),
        ("$Gkeys = [0, 1, 2]", &[":3:", "geometry[0].keys", "2 numbers"]),
        ("$K[1, 1]", &[":3:", "geometry[0].keys", "[1, 1]"]),
        ("$K[1, 0]", &[":3:", "geometry[0].keys"]),
        ("$K[-1, 1]", &[":3:", "geometry[0].keys"]),
        ("$K[0, 1.5]", &[":3:", "geometry[0].keys"]),
        ("$K[0, inf]", &[":3:", "geometry[0].keys"]),
        ("$K[0, 100000]", &[":3:", "geometry[0].keys", "100000"]),
        ("[[geometry]]\ngenerator = 'ship'\nkeys = [0, 1]", &[":3:", "geometry[0].keys"]),
        ("$G[[geometry.key]]\ntime = 0", &[":3:", "geometry[0].key", "at least two, not 1"]),
        ("$Gkey = []", &[":3:", "geometry[0].key", "at least two, not 0"]),
        ("$G[[geometry.key]]\nscale = 2", &[":3:", "time"]),
        ("$T0.1$T0.1", &[":6:", "geometry[0].key[1].time", "after"]),
        ("$T-0.1$T1", &[":4:", "geometry[0].key[0].time", "-0.1"]),
        ("$T0$T1.5", &[":6:", "geometry[0].key[1].time", "1.5"]),
        ("$T0$Tnan", &[":6:", "geometry[0].key[1].time", "NaN"]),
        ("$T0$T1\nscale = 0", &[":7:", "geometry[0].key[1].scale", "flatten"]),
        ("$T0$T1\nscale = [1, 2]", &[":7:", "geometry[0].key[1].scale", "3 numbers"]),
        ("$T0$T1\ntranslate = [inf, 0, 0]", &[":7:", "geometry[0].key[1].translate", "finite"]),
        ("$T0$T1\nrotate_degrees = [0, nan, 0]", &[":7:", "rotate_degrees", "finite"]),
        ("$T0$T1\nmatrix = 1", &[":7:", "matrix", "unknown"]),
        ("$T0$T1\ntranslate = [2e18, 0, 0]", &[":1:", "geometry[0]", "move beyond 1e18"]),
        ("$T0$T1\nscale = 2e18", &[":1:", "geometry[0]", "move beyond 1e18"]),
        ("$G[[light]]", &[":3:", "type"]),
        ("$G[[light]]\ntype = 'spot'", &[":4:", "light[0].type", "spot", "quad, disk"]),
        ("$Lquad'\ncorner=[0,0,0]\nedge_u=[1,0,0]", &[":3:", "light[0].edge_v", "missing"]),
        (
            "$Lquad'\ncorner=[0,0,0]\nedge_u=[1,0,0]\nedge_v=[-2,0,0]",
            &[":7:", "light[0].edge_v", "parallel"],
        ),
        ("$Lquad'\ncorner=[0,0,0]\nedge_u=[0,0,0]\nedge_v=[1,0,0]", &[":6:", "light[0].edge_u"]),
        (
            "$Lquad'\ncorner=[0,nan,0]\nedge_u=[0,1,0]\nedge_v=[1,0,0]",
            &[":5:", "light[0].corner", "finite"],
        ),
        (
            "$Ldisk'\ncenter=[0,0,0]\nnormal=[0,1,0]\nradius=0",
            &[":7:", "light[0].radius", "above 0"],
        ),
        (
            "$Ldisk'\ncenter=[0,0,0]\nnormal=[0,0,0]\nradius=1",
            &[":6:", "light[0].normal", "direction"],
        ),
        ("$Lsphere'\ncenter=[0,0,0]\nradius=-1", &[":6:", "light[0].radius", "-1"]),
        ("$Lsphere'\ncenter=[0,0,0]\nradius=nan", &[":6:", "light[0].radius", "NaN"]),
        (
            "$Lsphere'\ncenter=[0,0,0]\nradius=1\nnormal=[0,1,0]",
            &[":7:", "light[0].normal", "does not belong"],
        ),
        (
            "$Lsphere'\ncenter=[0,0,0]\nradius=1\nintensity=1",
            &[":7:", "light[0].intensity", "sphere"],
        ),
        (
            "$Lsphere'\ncenter=[0,0,0]\nradius=1\nradiance=-1",
            &[":7:", "light[0].radiance", "negative"],
        ),
        (
            "$Lsphere'\ncenter=[0,0,0]\nradius=1\nradiance=[1,2]",
            &[":7:", "light[0].radiance", "3 numbers"],
        ),
        (
            "$Lsphere'\ncenter=[0,0,0]\nradius=1\nradiance=[1,inf,2]",
            &[":7:", "light[0].radiance", "finite"],
        ),
        ("$Lsphere'\ncenter=[0,0,0]\nradius=1\ncolor=[1,1,2]", &[":7:", "color", "unknown"]),
        ("$Lsphere'\ncenter=[0,0,0]\nradius=1\nname='a.b'", &[":7:", "light[0].name", "a.b"]),
        ("$Lsphere'\ncenter=[0,0,0]\nradius=1\nname=''", &[":7:", "light[0].name"]),
        ("$Ldirectional'\ndirection=[0,0,0]", &[":5:", "light[0].direction"]),
        (
            "$Ldirectional'\ndirection=[0,-1,0]\nangular_diameter_degrees=180",
            &[":6:", "angular_diameter_degrees", "180"],
        ),
        (
            "$Ldirectional'\ndirection=[0,-1,0]\nangular_diameter_degrees=-1",
            &[":6:", "angular_diameter_degrees", "-1"],
        ),
        (
            "$Ldirectional'\ndirection=[0,-1,0]\nangular_diameter_degrees=nan",
            &[":6:", "angular_diameter_degrees", "NaN"],
        ),
        ("$Lpoint'\nposition=[0,-inf,0]", &[":5:", "light[0].position"]),
        (
            "$Lpoint'\nposition=[0,0,0]\n[[light]]\nname='light1'\ntype='point'\nposition=[1,0,0]",
            &[":7:", "light[1].name", "earlier"],
        ),
    ];
    for (content, expected) in table {
        let content = content
            .replacen("$T", &format!("{GEOMETRY}[[geometry.key]]\ntime = "), 1)
            .replace("$T", "\n[[geometry.key]]\ntime = ")
            .replace("$K", "[[geometry]]\nfile = 't%d.obj'\nkeys = ")
            .replace("$G", GEOMETRY)
            .replace("$C", CAMERA)
            .replace("$L", &format!("{GEOMETRY}[[light]]\ntype = '"));
        let message = folder.refusal("bad.toml", &content);
        assert_says(&message, &[&["bad.toml"], *expected].concat(), &content);
    }
}

#[test]
fn absent_meshes_are_told_from_bad_ones() {
    let folder = Folder::new();
    let text = "mesh_folders = ['meshes', '/nowhere']\norigin = \"\"\"an archive\n  far away\"\"\"\n\
        [[geometry]]\nfile = 'absent.obj'\n";
    let error = load(folder.write("absent.toml", text)).unwrap_err();
    assert!(matches!(error, sato::Error::MissingMesh { .. }), "{error:?}");
    let message = error.to_string();
    let own = folder.0.path().to_string_lossy().into_owned();
    let meshes = folder.0.path().join("meshes").to_string_lossy().into_owned();
    let expected =
        ["absent.toml:5:", "absent.obj", &own, &meshes, "/nowhere", "SATO_SCENES", "an archive"];
    assert_says(&message, &expected, text);
    assert!(!message.contains('\n'), "{message:?}");

    let error =
        load(folder.write("bad.toml", "geometry = [{ file = '/no/such.obj' }]")).unwrap_err();
    assert!(matches!(error, sato::Error::MissingMesh { .. }), "{error:?}");
    assert_says(&error.to_string(), &["bad.toml:1:", "looked in /no;"], "absolute");

    folder.write("bad.obj", "v x");
    let error = load(folder.write("bad.toml", "geometry = [{ file = 'bad.obj' }]")).unwrap_err();
    assert!(matches!(error, sato::Error::Input { .. }), "{error:?}");
    assert_says(&error.to_string(), &["bad.obj:1:"], "a bad mesh");
}

#[test]
fn keys_of_a_sequence_must_be_alike() {
    let folder = Folder::new();
    let scene = "[[geometry]]\nfile = 'k%02d.obj'\nkeys = [7, 9]\n";
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let first = format!("{square}f 1 2 3\nf 1 3 4\n");
    folder.write("k07.obj", &first);
    folder.write("k08.obj", &first);
    let error = load(folder.write("keys.toml", scene)).unwrap_err();
    assert!(matches!(error, sato::Error::MissingMesh { .. }), "{error:?}");
    assert_says(&error.to_string(), &["keys.toml:2:", "k09.obj", "looked in"], "an absent key");

    let table: &[(&str, &[&str])] = &[
        ("", &["no triangles"]),
        ("v 0 0 x\nf 1 1 1", &[":1:", "not a number"]),
        (&format!("{square}f 1 2 3\n"), &["1 triangles, not 2", "k07.obj"]),
        (&format!("{square}f 1 2 3 4\nf 1 2 3"), &["3 triangles, not 2"]),
        (&format!("{first}v 9 9 9\n"), &["5 vertices, not 4"]),
        (&format!("{square}f 1 2 3\nf 3 2 1\n"), &["3 vertices in use, not 4"]),
        (&format!("{square}f 1 2 3\nf 2 3 4\n"), &["triangle 2 ", "the same vertices"]),
        (&format!("{square}f 1 2 3\nf 1 4 3\n"), &["triangle 2 ", "the same vertices"]),
        (&first.replace("v 0 1 0", "v 0 nan 0"), &["1 triangles", "not finite"]),
        (&first.replace("v 0 1 0", "v 0 3e18 0"), &["beyond 1e18"]),
    ];
    for (content, expected) in table {
        folder.write("k09.obj", content);
        let message = folder.refusal("keys.toml", scene);
        assert_says(&message, &[&["k09.obj"], *expected].concat(), content);
    }
    folder.write("k08.obj", "v 0 0 0");
    assert_says(&folder.refusal("keys.toml", scene), &["k08.obj", "no triangles"], "two bad keys");
    folder.write("k07.obj", format!("{first}v nan 0 0\nf 1 2 5"));
    assert_says(&folder.refusal("keys.toml", scene), &["k07.obj", "not finite"], "the first key");

    folder.write("k07.obj", &first);
    folder.write("k08.obj", &first);
    folder.write("k09.obj", first.replace("v 1 1 0", "v 9e17 1 0"));
    assert!(load(folder.write("keys.toml", scene)).is_ok());
    let message = folder.refusal("keys.toml", format!("{scene}scale = 2"));
    assert_says(&message, &["keys.toml:1:", "geometry[0]", "move beyond 1e18"], "a far key");
}

#[test]
fn what_is_no_scene_is_refused() {
    let folder = Folder::new();
    let usage = load("no-such-scene").unwrap_err();
    assert_eq!(usage.exit_status(), 2);
    assert_says(&usage.to_string(), &["no-such-scene", ".toml", ".obj.zst"], "a bare name");
    let absent = message(folder.0.path().join("absent.obj"));
    assert_says(&absent, &["absent.obj", "No such file"], "an absent file");
    assert_says(&folder.refusal("picture.png", ""), &["picture.png", "unknown format"], "a png");
    assert_says(&message(folder.0.path().into()), &["unknown format"], "a folder");
    for name in ["folder.obj", "folder.toml", "folder.obj.zst"] {
        fs::create_dir(folder.0.path().join(name)).unwrap();
        let message = message(folder.0.path().join(name));
        assert_says(&message, &[name, "not a regular file"], name);
    }
    assert_says(
        &folder.refusal("bad.toml", b"name = 'x'\n# \xff\n"),
        &["bad.toml:2:", "UTF-8"],
        "",
    );
    assert_says(&folder.refusal("two\nlines.toml", "name = 3"), &["lines.toml:1:"], "a newline");
}

#[test]
fn bad_compressed_files_are_refused() {
    let folder = Folder::new();
    let scene = load(folder.0.path().join("t.obj")).unwrap();
    let good = folder.0.path().join("t.obj.zst");
    sato::scene::export(&scene, &good).unwrap();
    let bytes = fs::read(&good).unwrap();
    assert!(load(&good).is_ok());
    assert!(load(folder.write("bare.zst", &bytes)).is_ok());
    for length in 0..bytes.len() {
        let message = folder.refusal("cut.obj.zst", &bytes[..length]);
        assert_says(&message, &["cut.obj.zst", "damaged or truncated"], "a truncated file");
    }
    let text = folder.refusal("text.obj.zst", TRIANGLE);
    assert_says(&text, &["text.obj.zst", "not Zstandard data"], "text");
    let rubbish = [&bytes, &b"rubbish"[..]].concat();
    assert_says(
        &folder.refusal("more.obj.zst", rubbish),
        &["not Zstandard data"],
        "appended bytes",
    );
}

#[test]
fn odd_scene_files_are_accepted() {
    let folder = Folder::new();
    let load = |text: String| load(folder.write("odd scene.v2.toml", text)).unwrap();
    let scene = load(GEOMETRY.into());
    assert_eq!((scene.name.as_str(), scene.lights.len()), ("odd_scene", 1));
    assert!(load(format!("light = []\n{GEOMETRY}")).lights.is_empty());
    let scene = load(format!(
        "\u{feff}size = [640, 360]\r\n{GEOMETRY}scale = -2\n{GEOMETRY}translate = [0, 0, 1]\n{CAMERA}\
         [[light]]\ntype = 'directional'\ndirection = [0, -2, 0]\n\
         [[light]]\nname = 'lamp'\ntype = 'point'\nposition = [0, 3, 0]\nintensity = [1, 2, 3]\n"
    ));
    assert_eq!(scene.defaults.size, [640, 360]);
    assert_eq!(scene.mesh.len(), 2);
    assert_eq!(scene.mesh.bounds().min.to_array(), [-2.0, -2.0, 0.0]);
    assert_eq!(scene.mesh.bounds().max.to_array(), [1.0, 1.0, 1.0]);
    let names: Vec<_> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["light1", "lamp"]);
    assert_eq!(scene.lights[1].strength.to_array(), [1.0, 2.0, 3.0]);
}
