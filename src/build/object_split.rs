//! Splitting a set of references between them, by binned surface-area heuristic (Wald, "On fast
//! Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing,
//! 2007); the few references of a small set in every possible way.
//!
//! Boxes are vectors of eight lanes, bins of all axes are filled in one pass, and what the planes cost
//! is found for the three axes at once, in lanes. (Compiled for AVX2 or AVX-512 it is no faster.)

use super::top_down::TRAVERSAL_COST;
use crate::geometry::{Aabb, TriangleMesh};
use bytemuck::Zeroable;
use glam::{BVec4A, Vec3, Vec4};
use rayon::prelude::*;

/// Bins on each axis, and those of smaller sets, where emptying and sweeping bins is what costs.
const BINS: usize = 32;
const FEWER_BINS: usize = 16;
const FEWEST_BINS: usize = 8;
/// Sets below these sizes have fewer, and fewest bins.
const FEWER_BELOW: usize = 512;
const FEWEST_BELOW: usize = 64;

/// Sets up to this size are split in the best of all possible ways.
const EXHAUSTIVE: usize = 4;

/// Ranges that several threads should bin.
pub(super) const PARALLEL_BINNING: usize = 1 << 16;

/// A box: the lower corner, a number that means nothing, the upper corner negated, and another. A
/// union is then the smaller number in all lanes.
#[derive(Clone, Copy, Zeroable)]
#[repr(C, align(32))]
struct VectorBox([f32; 8]);

impl VectorBox {
    const EMPTY: Self = Self([f32::INFINITY; 8]);

    #[inline(always)]
    fn new(lower: Vec4, upper: Vec4) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (lower.to_array(), (-upper).to_array());
        Self([a, b, c, d, e, f, g, h])
    }

    #[inline(always)]
    fn lower(&self) -> Vec4 {
        Vec4::from_slice(&self.0[..4])
    }

    #[inline(always)]
    fn negated_upper(&self) -> Vec4 {
        Vec4::from_slice(&self.0[4..])
    }

    #[inline(always)]
    fn union(self, other: Self) -> Self {
        // As vector instructions have it, and finite numbers do not care.
        let less = |a: f32, b: f32| if a < b { a } else { b };
        Self(std::array::from_fn(|lane| less(self.0[lane], other.0[lane])))
    }

    #[inline(always)]
    fn size(&self) -> Vec4 {
        -(self.lower() + self.negated_upper())
    }

    #[inline(always)]
    fn half_area(&self) -> f32 {
        let d = self.size();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    #[inline(always)]
    fn aabb(&self) -> Aabb {
        let [a, b, c, _, d, e, f, _] = self.0;
        // Without negative zeros, which negating makes.
        Aabb { min: Vec3::new(a, b, c), max: Vec3::ZERO - Vec3::new(d, e, f) }
    }
}

/// The box of a triangle, or of a part of it, with its index in the mesh.
#[derive(Clone, Copy, Zeroable)]
#[repr(C)]
pub(super) struct Reference {
    /// The index lies in the fourth lane of the lower corner.
    vectors: VectorBox,
}

/// Added to an index before its bits are taken for a number: whatever the index, below
/// [`ChildRef::MAX_TRIANGLES`](crate::tree::ChildRef::MAX_TRIANGLES), the number is an ordinary one,
/// as arithmetic with denormal numbers is slow.
const ID_BITS: u32 = 0x4000_0000;

impl Reference {
    pub(super) fn new(bounds: &Aabb, id: u32) -> Self {
        let lower = bounds.min.extend(f32::from_bits(ID_BITS + id));
        Self { vectors: VectorBox::new(lower, bounds.max.extend(0.0)) }
    }

    #[inline(always)]
    pub(super) fn id(&self) -> u32 {
        self.vectors.0[3].to_bits() - ID_BITS
    }

    #[inline(always)]
    pub(super) fn bounds(&self) -> Aabb {
        self.vectors.aabb()
    }

    /// The box's centre; the fourth lane means nothing.
    #[inline(always)]
    fn center(&self) -> Vec4 {
        self.vectors.lower() * 0.5 - self.vectors.negated_upper() * 0.5
    }
}

/// What is known of a set of references.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    /// Around their boxes.
    boxes: VectorBox,
    /// Around the centres of their boxes.
    centers: VectorBox,
}

impl Extent {
    const EMPTY: Self = Self { boxes: VectorBox::EMPTY, centers: VectorBox::EMPTY };

    /// Of all of `references`.
    pub(super) fn of(references: &[Reference]) -> Self {
        references.iter().fold(Self::EMPTY, |all, r| Self {
            boxes: all.boxes.union(r.vectors),
            centers: all.centers.union(VectorBox::new(r.center(), r.center())),
        })
    }

    fn union(self, other: Self) -> Self {
        Self { boxes: self.boxes.union(other.boxes), centers: self.centers.union(other.centers) }
    }

    /// The box around the references' boxes.
    #[inline(always)]
    pub(super) fn bounds(&self) -> Aabb {
        self.boxes.aabb()
    }
}

/// One for each triangle, and their extent.
pub(super) fn references_to(mesh: &TriangleMesh) -> (Vec<Reference>, Extent) {
    const AT_ONCE: usize = 4096;
    let mut references = bytemuck::zeroed_vec::<Reference>(mesh.len());
    let chunks = references.par_chunks_mut(AT_ONCE).enumerate();
    let extents = chunks.map(|(chunk, references)| {
        for (index, reference) in references.iter_mut().enumerate() {
            let id = chunk * AT_ONCE + index;
            *reference = Reference::new(&mesh.triangle(id).bounds(), id as u32);
        }
        Extent::of(references)
    });
    // The same in any order.
    let extent = extents.reduce(|| Extent::EMPTY, Extent::union);
    (references, extent)
}

/// Splits in the middle of the longest axis, by number: for what the heuristic cannot tell apart.
pub(super) fn halve(references: &mut [Reference], bounds: &Aabb) -> usize {
    let axis = bounds.size().max_position();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        let centers = (a.bounds().center()[axis], b.bounds().center()[axis]);
        centers.0.total_cmp(&centers.1).then(a.id().cmp(&b.id()))
    });
    middle
}

/// Maps centres to bins; the same for binning and dividing.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec4,
    scale: Vec4,
    last: Vec4,
}

impl Binning {
    #[inline(always)]
    fn new(centers: &VectorBox, bins: usize) -> Self {
        let bins = Vec4::splat(bins as f32);
        let scale = bins / centers.size();
        // An axis on which nothing differs, or too little to divide by, has one bin.
        let is_usable = scale.cmplt(Vec4::INFINITY);
        let scale = Vec4::select(is_usable, scale, Vec4::ZERO);
        Self { origin: centers.lower(), scale, last: bins - 1.0 }
    }

    /// For each axis a number whose nearest integer is the bin, below zero by a half at most.
    #[inline(always)]
    fn place(&self, center: Vec4) -> Vec4 {
        ((center - self.origin) * self.scale - 0.5).min(self.last)
    }

    #[inline(always)]
    fn bins<const N: usize>(&self, center: Vec4) -> [usize; 3] {
        // Numbers from here on are integers, which their lowest bits tell.
        const INTEGERS: f32 = (3 << 22) as f32;
        let bits = (self.place(center) + INTEGERS).to_array();
        [0, 1, 2].map(|axis| bits[axis].to_bits() as usize % N)
    }

    /// For each axis whether the bin is below `bin`, as `bins` rounds.
    #[inline(always)]
    fn is_below(&self, center: Vec4, bin: Vec4) -> BVec4A {
        const INTEGERS: f32 = (3 << 22) as f32;
        (self.place(center) + INTEGERS).cmplt(bin + INTEGERS)
    }
}

/// Boxes and numbers of references by bin and axis.
#[derive(Clone, Copy)]
struct Bins<const N: usize> {
    boxes: [[VectorBox; 3]; N],
    counts: [[i32; 4]; N],
}

impl<const N: usize> Bins<N> {
    #[inline(always)]
    fn empty() -> Self {
        Self { boxes: [[VectorBox::EMPTY; 3]; N], counts: [[0; 4]; N] }
    }

    #[inline(always)]
    fn fill(&mut self, references: &[Reference], binning: &Binning) {
        for reference in references {
            let bins = binning.bins::<N>(reference.center());
            for (axis, bin) in bins.into_iter().enumerate() {
                let around = &mut self.boxes[bin][axis];
                *around = around.union(reference.vectors);
                self.counts[bin][axis] += 1;
            }
        }
    }

    fn merged(mut self, other: Self) -> Self {
        for bin in 0..N {
            for axis in 0..3 {
                self.boxes[bin][axis] = self.boxes[bin][axis].union(other.boxes[bin][axis]);
                self.counts[bin][axis] += other.counts[bin][axis];
            }
        }
        self
    }

    /// The axis and the first bin of the upper side of the cheapest plane, and its cost without that
    /// of entering the node.
    #[inline(always)]
    fn cheapest(&self) -> Option<(usize, usize, f32)> {
        let counts = |bin: usize| Vec4::from_array(self.counts[bin].map(|count| count as f32));
        // upper[i]: of bins i and up.
        let mut upper = [Vec4::ZERO; N];
        let mut boxes = [VectorBox::EMPTY; 3];
        let mut count = Vec4::ZERO;
        for bin in (1..N).rev() {
            for (around, own) in boxes.iter_mut().zip(&self.boxes[bin]) {
                *around = around.union(*own);
            }
            count += counts(bin);
            upper[bin] = half_areas(&boxes) * count;
        }
        let mut boxes = [VectorBox::EMPTY; 3];
        let mut count = Vec4::ZERO;
        let (mut least, mut at) = (Vec4::INFINITY, Vec4::ZERO);
        for (bin, upper) in upper.iter().enumerate().skip(1) {
            for (around, own) in boxes.iter_mut().zip(&self.boxes[bin - 1]) {
                *around = around.union(*own);
            }
            count += counts(bin - 1);
            // An empty side costs infinity times 0, which is less than nothing.
            let cost = half_areas(&boxes) * count + *upper;
            let is_less = cost.cmplt(least);
            least = Vec4::select(is_less, cost, least);
            at = Vec4::select(is_less, Vec4::splat(bin as f32), at);
        }
        let (least, at) = (least.to_array(), at.to_array());
        let axis = (1..3).fold(0, |best, axis| if least[axis] < least[best] { axis } else { best });
        (least[axis] < f32::INFINITY).then_some((axis, at[axis] as usize, least[axis]))
    }

    #[inline(always)]
    fn split(&self, binning: Binning) -> Option<Split> {
        let (axis, bin, cost) = self.cheapest()?;
        let boxes = [self.around(axis, 0..bin), self.around(axis, bin..N)];
        let way = Way::Plane { axis, bin: Vec4::splat(bin as f32), binning };
        Some(Split { way, boxes, cost })
    }

    #[inline(always)]
    fn around(&self, axis: usize, bins: std::ops::Range<usize>) -> VectorBox {
        self.boxes[bins].iter().fold(VectorBox::EMPTY, |all, boxes| all.union(boxes[axis]))
    }
}

/// Half the areas of three boxes; infinite for empty ones.
#[inline(always)]
fn half_areas(boxes: &[VectorBox; 3]) -> Vec4 {
    let [a, b, c] = boxes.each_ref().map(VectorBox::size);
    let x = Vec4::new(a.x, b.x, c.x, c.x);
    let y = Vec4::new(a.y, b.y, c.y, c.y);
    let z = Vec4::new(a.z, b.z, c.z, c.z);
    x * y + y * z + z * x
}

/// How to split a set in two.
pub(super) struct Split {
    way: Way,
    boxes: [VectorBox; 2],
    /// In triangle tests, times half the area of the parent.
    pub(super) cost: f32,
}

#[derive(Clone, Copy)]
enum Way {
    /// By a plane between two bins of centres: the axis, the first bin of the upper side.
    Plane { axis: usize, bin: Vec4, binning: Binning },
    /// A bit for each reference of the lower side.
    Set(u32),
}

/// The cheapest split between two bins, or of all for few references; `None` where there is none, or
/// areas overflow. There are two references at least.
pub(super) fn best_split(references: &[Reference], extent: &Extent) -> Option<Split> {
    let mut split = match references.len() {
        count if count <= EXHAUSTIVE => best_set(references),
        count if count < FEWEST_BELOW => best_plane::<FEWEST_BINS>(references, extent),
        count if count < FEWER_BELOW => best_plane::<FEWER_BINS>(references, extent),
        count if count < PARALLEL_BINNING => best_plane::<BINS>(references, extent),
        _ => best_plane_on_all_threads(references, extent),
    }?;
    split.cost += TRAVERSAL_COST * extent.boxes.half_area();
    split.cost.is_finite().then_some(split)
}

fn best_plane<const N: usize>(references: &[Reference], extent: &Extent) -> Option<Split> {
    let binning = Binning::new(&extent.centers, N);
    let mut bins = Bins::<N>::empty();
    bins.fill(references, &binning);
    bins.split(binning)
}

fn best_plane_on_all_threads(references: &[Reference], extent: &Extent) -> Option<Split> {
    let binning = Binning::new(&extent.centers, BINS);
    let fill = |chunk: &[Reference]| {
        let mut bins = Bins::<BINS>::empty();
        bins.fill(chunk, &binning);
        bins
    };
    // Merging boxes and counts gives the same result in any order.
    let chunks = references.par_chunks(PARALLEL_BINNING / 4);
    chunks.map(fill).reduce(Bins::empty, Bins::merged).split(binning)
}

/// The best way to split up to four references, the last of them on the upper side.
fn best_set(references: &[Reference]) -> Option<Split> {
    let all = (1usize << references.len()) - 1;
    let mut boxes = [VectorBox::EMPTY; 1 << EXHAUSTIVE];
    let mut costs = [0.0; 1 << EXHAUSTIVE];
    for set in 1..=all {
        let first = references[set.trailing_zeros() as usize].vectors;
        boxes[set] = boxes[set & (set - 1)].union(first);
        costs[set] = boxes[set].half_area() * set.count_ones() as f32;
    }
    let mut best = (f32::INFINITY, 0);
    for set in 1..=all / 2 {
        let cost = costs[set] + costs[all - set];
        best = if cost < best.0 { (cost, set) } else { best };
    }
    let (cost, set) = best;
    (set > 0).then(|| Split {
        way: Way::Set(set as u32),
        boxes: [boxes[set], boxes[all - set]],
        cost,
    })
}

impl Split {
    /// The boxes around the two sides.
    pub(super) fn bounds(&self) -> [Aabb; 2] {
        self.boxes.each_ref().map(VectorBox::aabb)
    }

    /// Copies `from` to `to`, as long, with the lower side at the front; returns its length and the
    /// extents of both sides.
    pub(super) fn divide(&self, from: &[Reference], to: &mut [Reference]) -> (usize, [Extent; 2]) {
        let to = &mut to[..from.len()];
        let (lower, centers) = match self.way {
            Way::Plane { axis, bin, binning } => {
                divide(from, to, |_, center| binning.is_below(center, bin).bitmask() >> axis & 1)
            }
            Way::Set(set) => divide(from, to, |index, _| set >> index & 1),
        };
        let extent = |side: usize| Extent { boxes: self.boxes[side], centers: centers[side] };
        (lower, [extent(0), extent(1)])
    }
}

/// Copies those of which `is_lower` says 1, given their index and centre, to the front of `to`, the
/// others, of which it says 0, to its end; returns where they meet and the boxes around both sides'
/// centres.
#[inline(always)]
fn divide(
    from: &[Reference],
    to: &mut [Reference],
    is_lower: impl Fn(usize, Vec4) -> u32,
) -> (usize, [VectorBox; 2]) {
    // By turns, so that none has to wait for the one before.
    let mut centers = [[VectorBox::EMPTY; 2]; 2];
    let (mut lower, mut upper) = (0, to.len());
    for (index, reference) in from.iter().enumerate() {
        let center = reference.center();
        let is_lower = is_lower(index, center) as usize;
        // Written to both ends and kept at one: no processor foresees which.
        to[lower] = *reference;
        to[upper - 1] = *reference;
        lower += is_lower;
        upper -= 1 - is_lower;
        let around = &mut centers[index % 2][1 - is_lower];
        *around = around.union(VectorBox::new(center, center));
    }
    let [even, odd] = centers;
    (lower, [0, 1].map(|side| even[side].union(odd[side])))
}
