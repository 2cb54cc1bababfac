use super::*;
use crate::test_random::Random;

/// What the processor's own instructions find is what all processors find, to the bit.
#[test]
fn instructions_do_not_show() {
    let best = Instructions::detect();
    let mut random = Random::new(0x3a1);
    for count in (2..80).chain([511, 512, 3000, PARALLEL_BINNING + 7]) {
        for flat in [false, true] {
            let mut mesh = random.mesh(count);
            if flat {
                // All centres in a plane, and many in one place.
                let vertices = mesh.vertices().iter().map(|v| (*v * 4.0).round().with_y(0.0));
                mesh = crate::geometry::TriangleMesh::new(
                    vertices.collect(),
                    mesh.triangles().to_vec(),
                );
            }
            let (references, extent) = references_to(&mesh);
            let split_by = |instructions: Instructions| {
                let mut references = references.clone();
                let split = best_split(instructions, &references, &extent)?;
                let (middle, extents) = split.divide(instructions, &mut references);
                let ids: Vec<u32> = references.iter().map(Reference::id).collect();
                let numbers = extents.map(|extent| {
                    let boxes = [extent.boxes, extent.twice_centers];
                    boxes.map(|vectors| {
                        (vectors.lower().truncate(), vectors.negated_upper().truncate())
                    })
                });
                Some((split.cost.to_bits(), middle, ids, numbers))
            };
            assert_eq!(split_by(best), split_by(Instructions::PORTABLE), "{count} triangles");
        }
    }
}

/// What is said of the two sides of a split is what they are.
#[test]
fn sides_are_those_of_the_split() {
    let mut random = Random::new(0x3a2);
    for count in (2..80).chain([600, 5000]) {
        let mesh = random.mesh(count);
        let (mut references, extent) = references_to(&mesh);
        let mut set = Set::new(&mut references, extent);
        let Some(split) = set.best_split() else { continue };
        let all = count;
        let areas_by_count = |set: &Set<'_>| set.references.len() as f64 * set.bounds().half_area();
        let whole = set.bounds().half_area();
        let instructions = set.instructions;
        let (middle, extents) = split.divide(instructions, set.references);
        assert!(middle > 0 && middle < all, "{count}");
        for (side, extent) in
            [&set.references[..middle], &set.references[middle..]].iter().zip(&extents)
        {
            let own = Extent::of(side);
            assert_eq!(own.boxes.aabb(), extent.boxes.aabb(), "{count}");
            assert_eq!(own.twice_centers.aabb(), extent.twice_centers.aabb(), "{count}");
        }
        let [lower, upper] = {
            set.extent = extent;
            set.cut(middle, extents)
        };
        let cost = whole + areas_by_count(&lower) + areas_by_count(&upper);
        assert!(
            (f64::from(split.cost) / cost - 1.0).abs() < 1e-5,
            "{count}: {} {cost}",
            split.cost
        );
        let mut ids: Vec<u32> =
            lower.references.iter().chain(&*upper.references).map(Reference::id).collect();
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..count as u32));
    }
}
