use super::around::Around;
use super::octants::EntryPoint;
use super::tests::rays;
use super::*;
use crate::geometry::{Aabb, Vec3};
use crate::intersect::PreparedRay;
use crate::test_random::Random;
use crate::tree::{ChildRef, WIDTH};

/// The box test of streams accepts what that of single rays accepts.
#[test]
fn boxes_that_a_ray_meets_are_met() {
    let mut random = Random::new(0xb0c5);
    let mesh = TriangleMesh::default();
    let (mut met, mut missed, mut spared) = (0, 0, 0);
    for round in 0..4000 {
        let (scale, offset) = [(1.0, 0.0), (1.0, 3e5), (1e-20, 0.0), (1e30, 0.0)][round % 4];
        let scene =
            Aabb { min: Vec3::splat(offset - 4.0 * scale), max: Vec3::splat(offset + 4.0 * scale) };
        // More is known of rays that start close to each other.
        let close = [1.0, 0.02][round / 8 % 2];
        let given: Vec<_> = rays(&mut random, &mesh, STREAM)
            .into_iter()
            // One odd ray would hide what is known of all others.
            .map(|ray| if round / 4 % 2 == 0 || is_common(&ray) { ray } else { random.ray() })
            .map(|ray| Ray { origin: ray.origin * scale * close + Vec3::splat(offset), ..ray })
            .collect();
        for set in Instructions::all() {
            let mut prepared = Numbers::ZERO;
            let boxes: Vec<_> = (0..8)
                .map(|_| {
                    // Flat and small ones too, some touching a ray's origin.
                    let ray = &given[random.bits() as usize % STREAM];
                    let place = ray.origin + ray.direction * random.unit();
                    let usable = place.is_finite() && random.bits().is_multiple_of(2);
                    let a =
                        if usable { place } else { random.point() * scale + Vec3::splat(offset) };
                    let mut b = a + random.point()
                        * scale
                        * [0.001, 0.1, 1.0][(random.bits() % 3) as usize];
                    if random.bits().is_multiple_of(3) {
                        b.x = a.x;
                    }
                    let (lower, upper) = (scene.min, scene.max);
                    Aabb::of_points([a.clamp(lower, upper), b.clamp(lower, upper)])
                })
                .collect();
            let node =
                Node8::new(&boxes.iter().map(|b| (ChildRef::inner(0), *b)).collect::<Vec<_>>());
            let (masks, sorted) = match set.0 {
                Set::Portable => masks(Portable, Portable, &mut prepared, &scene, &given, &node),
                #[cfg(target_arch = "x86_64")]
                Set::Avx2(avx2) => masks(avx2, avx2, &mut prepared, &scene, &given, &node),
                #[cfg(target_arch = "x86_64")]
                Set::Avx512(avx2, avx512) => {
                    masks(avx2, avx512, &mut prepared, &scene, &given, &node)
                }
            };
            spared += sorted;
            for (index, ray) in given.iter().enumerate() {
                let scalar = PreparedRay::new(ray, &scene);
                assert_eq!(masks[index].is_some(), scalar.is_some(), "{ray:?}");
                let Some((scalar, [alone, within])) = scalar.zip(masks[index]) else { continue };
                for (slot, bounds) in boxes.iter().enumerate() {
                    let found = alone & within & 1 << slot != 0;
                    assert!(found || scalar.enter(bounds).is_none(), "{set:?} {ray:?} {bounds:?}");
                    met += u32::from(found);
                    missed += u32::from(!found);
                }
            }
        }
    }
    assert!(spared > 4000, "{spared}");
    assert!(met > 100_000 && missed > 500_000, "{met} met, {missed} missed");
}

/// The words of a node's children, as they are put on a stack.
fn unloaded<W: Wide>(w: W, words: W::Words, here: Bits, some: u32) -> [Bits; WIDTH] {
    let mut children = [ChildRef::UNUSED; WIDTH];
    let (mut lower, mut upper) = ([7; WIDTH], [7; WIDTH]);
    let slots = std::array::from_fn(ChildRef::inner);
    let to = (&mut children, [&mut lower, &mut upper]);
    let len = w.unload(words, here, &slots, some, to);
    let children = children[..len].iter().map(|child| child.node_index());
    assert!(children.clone().is_sorted_by(|a, b| a > b), "the last first");
    let mut words = [0; WIDTH];
    for (place, slot) in children.enumerate() {
        words[slot] = Bits::from(lower[place]) | Bits::from(upper[place]) << 64;
    }
    words
}

#[test]
fn words_of_children_are_those_of_rays_one_by_one() {
    fn check<S: Simd, W: Wide>(s: S, w: W) -> u32 {
        let mut random = Random::new(0x3d);
        let mut picked = 0;
        for _ in 0..2000 {
            let bits = |random: &mut Random| (random.bits() & random.bits()) as u32 & 255;
            let children: [u32; STREAM] = std::array::from_fn(|_| bits(&mut random));
            let halves = [random.bits(), random.bits()].map(Bits::from);
            let (here, some) = (halves[0] | halves[1] << 64, bits(&mut random));
            let start: [[u64; WIDTH]; 2] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.bits() & random.bits()));
            let all = bits(&mut random) & bits(&mut random);
            let mut words = w.words(start, all);
            for (index, children) in children.into_iter().enumerate() {
                words = w.with_ray(words, children, index);
            }
            let word = |slot: usize| {
                let met =
                    |(index, children): (usize, &u32)| Bits::from(children >> slot & 1) << index;
                let start = Bits::from(start[0][slot]) | Bits::from(start[1][slot]) << 64;
                let start = if all >> slot & 1 == 1 { Bits::MAX } else { start };
                children.iter().enumerate().map(met).fold(start, |all, bit| all | bit)
            };
            let expected =
                std::array::from_fn(
                    |slot| if some >> slot & 1 == 0 { 0 } else { word(slot) & here },
                );
            assert_eq!(unloaded(w, words, here, some), expected);
            // Some of the groups have nobody.
            let sparse = here & halves[1] << 32 & halves[0] << 7 & !(halves[0] >> 3);
            for active in [here, sparse, 1 << (halves[0] % 128), 0] {
                let group = |group: &usize| group::of_group::<W>(active, *group) != 0;
                let expected = (0..STREAM / W::GROUP).filter(group).fold(0, |all, g| all | 1 << g);
                assert_eq!(w.groups(active), expected, "{active:x}");
            }
            let slots = std::array::from_fn(ChildRef::inner);
            let mut children = [ChildRef::UNUSED; WIDTH];
            s.pick(&slots, some, &mut children);
            let downwards = (0..WIDTH).rev().filter(|slot| some >> slot & 1 != 0);
            for (child, slot) in children.iter().zip(downwards) {
                assert_eq!(child.node_index(), slot);
                picked += 1;
            }
        }
        picked
    }
    for set in Instructions::all() {
        let picked = match set.0 {
            Set::Portable => check(Portable, Portable),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(avx2) => avx2.run(|| check(avx2, avx2)),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(avx2, avx512) => avx512.run(|| check(avx2, avx512)),
        };
        assert!(picked > 3000, "{picked}");
    }
}

fn is_common(ray: &Ray) -> bool {
    let length = ray.direction.abs().max_element();
    ray.origin.is_finite()
        && ray.direction.is_finite()
        && ray.t_min <= ray.t_max
        && (1e-5..1e5).contains(&length)
}

/// The children that each valid ray meets, alone and as one of a group whose stream's box is known; and
/// how many children that spared from being asked of each ray.
fn masks<S: Simd, W: Wide>(
    s: S,
    w: W,
    numbers: &mut Numbers,
    scene: &Aabb,
    rays: &[Ray],
    node: &Node8,
) -> (Vec<Option<[u32; 2]>>, u32) {
    w.run(|| {
        let (mut masks, mut spared) = (vec![None; rays.len()], 0);
        let mut places = Places::default();
        places.list(s, w, rays, MOST_SORTED, |_| EntryPoint::Whole);
        for picked in places.streams(rays) {
            let mesh = TriangleMesh::default();
            let target = Target { bounds: scene, mesh: &mesh, mode: Mode::Exact };
            let prepared = Rays::new(s, w, numbers, target, picked);
            let active = prepared.valid;
            let by_group = |around: &Around| {
                let words = group::node_by_group(s, w, node, &prepared, around, w.groups(active));
                unloaded(w, words, active, node.occupied())
            };
            let around = Around::new(w, &prepared);
            let (all, some) = around.sort(s, node);
            spared += (all | !some & node.occupied()).count_ones();
            let (asked, within) = (by_group(&Around::UNBOUNDED), by_group(&around));
            for (index, &place) in picked.places.iter().enumerate() {
                if active >> index & 1 != 0 {
                    let octant = prepared.octants[index / W::GROUP];
                    let alone = one_ray::OneRay::new(s, &prepared, index, octant).meets(s, node);
                    let [asked, within] = [asked, within].map(|words| {
                        let bit = |slot: usize| ((words[slot] >> index & 1) as u32) << slot;
                        (0..WIDTH).fold(0, |all, slot| all | bit(slot))
                    });
                    assert_eq!(alone, asked, "{:?}", rays[usize::from(place)]);
                    masks[usize::from(place)] = Some([alone, within]);
                }
            }
        }
        (masks, spared)
    })
}

/// Of numbers that single rays are held against boxes with: none but exits may have a sign.
#[test]
fn quick_comparisons_are_those_of_numbers() {
    fn check<S: Simd>(s: S) {
        let mut random = Random::new(0x9c);
        let special = [0.0, f32::MIN_POSITIVE, 1e-40, 1.0, f32::MAX, f32::INFINITY];
        let mut number = || match random.bits() % 4 {
            0 => special[(random.bits() % 6) as usize],
            1 => f32::from_bits(random.bits() as u32 >> 9 << 6),
            _ => random.unit() * 8.0,
        };
        let (mut held, mut signed) = (0, 0);
        for _ in 0..20_000 {
            let entries: [f32; 8] = std::array::from_fn(|_| number());
            let begin: [f32; 8] = std::array::from_fn(|_| number());
            let exits: [f32; 8] = std::array::from_fn(|i| number() * [1.0, 1.0, -1.0][i % 3]);
            let ends: [f32; 8] = std::array::from_fn(|_| number());
            // An entry behind the ray is before it begins.
            let behind: [f32; 8] = std::array::from_fn(|i| entries[i] * [1.0, -1.0][i % 2]);
            let entry = s.quick_max(Simd::load(s, &behind), Simd::load(s, &begin));
            let exit = s.quick_min(Simd::load(s, &exits), Simd::load(s, &ends));
            let mut stored = [0.0; 8];
            Simd::store(s, &mut stored, entry);
            let bits = s.quick_less_equal(entry, exit);
            for lane in 0..8 {
                let (entry, exit) = (behind[lane].max(begin[lane]), exits[lane].min(ends[lane]));
                assert_eq!(stored[lane], entry);
                let is_signed = exits[lane].is_sign_negative();
                let expected = entry <= exit && !is_signed;
                assert_eq!(bits >> lane & 1 != 0, expected, "{entry} {exit}");
                held += u32::from(expected);
                signed += u32::from(is_signed);
            }
        }
        assert!(held > 20_000 && signed > 20_000, "{held} {signed}");
    }
    for set in Instructions::all() {
        match set.0 {
            Set::Portable => check(Portable),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(avx2) | Set::Avx512(avx2, _) => avx2.run(|| check(avx2)),
        }
    }
}
