use super::*;

fn mesh() -> Arc<TriangleMesh> {
    let vertices = (0..3000).map(|i| Vec3::new(i as f32, (i % 7) as f32, (i % 5) as f32));
    let triangles = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Arc::new(TriangleMesh::new(vertices.collect(), triangles))
}

fn scene(limit: i64, mesh: &Arc<TriangleMesh>, quality: Quality) -> Result<Scene, String> {
    let device = Device::new(1, limit).unwrap();
    let settings = Settings { quality: Quality::LOW, robust: false, dynamic: true };
    let parts = [0..400, 400..400, 400..1000].map(|triangles| Part {
        moves: triangles.start == 400,
        triangles,
        quality,
    });
    Scene::build(device, Arc::clone(mesh), &parts, settings)
}

#[test]
fn a_failing_build_is_an_error_and_leaks_nothing() {
    let mesh = mesh();
    let error = scene(0, &mesh, Quality::MEDIUM).unwrap_err();
    assert!(error.starts_with("Embree: out of memory"), "{error}");
    assert!(scene(i64::MAX, &mesh, Quality::HIGH).is_ok());
    assert_eq!(Arc::strong_count(&mesh), 1);
}

#[test]
fn a_scene_keeps_the_meshes_that_it_reads_and_no_others() {
    let first = mesh();
    for quality in [Quality::LOW, Quality::MEDIUM, Quality::REFIT] {
        let mut scene = scene(i64::MAX, &first, quality).unwrap();
        let frames =
            [1.0, 2.0].map(|x| Arc::new(first.moved(|v| v.iter_mut().for_each(|v| v.x += x))));
        for frame in &frames {
            scene.update(Arc::clone(frame)).unwrap();
        }
        assert_eq!(frames.each_ref().map(Arc::strong_count), [1, 2], "{quality:?}");
        let other = Arc::new(TriangleMesh::new(vec![Vec3::ZERO; 3000], vec![[0; 3]; 1000]));
        assert!(scene.update(other).unwrap_err().contains("other triangles"));
        drop(scene);
        assert_eq!(frames.each_ref().map(Arc::strong_count), [1, 1]);
        assert_eq!(Arc::strong_count(&first), 1);
    }
}

#[test]
fn a_failing_update_is_an_error_and_leaks_nothing() {
    let first = mesh();
    let mut scene = scene(i64::MAX, &first, Quality::MEDIUM).unwrap();
    scene.device.monitor.limit.store(0, Ordering::Relaxed);
    let frame = Arc::new(first.moved(|vertices| vertices.reverse()));
    let error = scene.update(Arc::clone(&frame)).unwrap_err();
    assert!(error.starts_with("Embree: out of memory"), "{error}");
    scene.device.monitor.limit.store(i64::MAX, Ordering::Relaxed);
    // Embree crashes when such a scene is committed again.
    let error = scene.update(Arc::clone(&frame)).unwrap_err();
    assert!(error.contains("earlier update failed"), "{error}");
    scene.intersect(RTCRay {
        dir_x: 1.0,
        tfar: f32::INFINITY,
        mask: u32::MAX,
        ..RTCRay::default()
    });
    drop(scene);
    assert_eq!([&first, &frame].map(Arc::strong_count), [1, 1]);
}

#[test]
fn the_device_says_what_it_is() {
    let device = Device::new(1, i64::MAX).unwrap();
    assert!(device.version().starts_with("4."));
    assert!(!device.native_widths().is_empty());
    assert_ne!(device.tasking(), "unknown");
}
