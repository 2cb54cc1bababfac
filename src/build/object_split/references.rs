//! Triangles as builders see them: boxes with the triangle's index.

use super::lanes::Row;
use crate::filled;
use crate::geometry::{Aabb, TriangleMesh};
use bytemuck::Zeroable;
use glam::{Vec3, Vec4};

/// A box: the lower corner, a number that means nothing, the upper corner negated, and another. A
/// union is then the smaller number in all lanes.
#[derive(Clone, Copy, Zeroable)]
#[repr(C, align(32))]
pub(super) struct VectorBox(pub(super) Row);

impl VectorBox {
    pub(super) const EMPTY: Self = Self([f32::INFINITY; 8]);

    #[inline(always)]
    pub(super) fn new(lower: Vec4, upper: Vec4) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (lower.to_array(), (-upper).to_array());
        Self([a, b, c, d, e, f, g, h])
    }

    #[inline(always)]
    pub(super) fn lower(&self) -> Vec4 {
        Vec4::from_slice(&self.0[..4])
    }

    #[inline(always)]
    pub(super) fn negated_upper(&self) -> Vec4 {
        Vec4::from_slice(&self.0[4..])
    }

    #[inline(always)]
    pub(super) fn union(self, other: Self) -> Self {
        // As vector instructions have it, and finite numbers do not care.
        let less = |a: f32, b: f32| if a < b { a } else { b };
        Self(std::array::from_fn(|lane| less(self.0[lane], other.0[lane])))
    }

    #[inline(always)]
    pub(super) fn size(&self) -> Vec4 {
        -(self.lower() + self.negated_upper())
    }

    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let d = self.size();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    #[inline(always)]
    pub(super) fn aabb(&self) -> Aabb {
        let [a, b, c, _, d, e, f, _] = self.0;
        // Without negative zeros, which negating makes.
        Aabb { min: Vec3::new(a, b, c), max: Vec3::ZERO - Vec3::new(d, e, f) }
    }
}

/// The box of a triangle, or of a part of it, with its index in the mesh.
#[derive(Clone, Copy, Zeroable)]
#[repr(C)]
pub(in crate::build) struct Reference {
    /// The index lies in the fourth lane of the lower corner; the last number is infinite.
    pub(super) vectors: VectorBox,
}

/// Added to an index before its bits are taken for a number: whatever the index, below
/// [`ChildRef::MAX_TRIANGLES`](crate::tree::ChildRef::MAX_TRIANGLES), the number is an ordinary one,
/// as arithmetic with denormal numbers is slow.
const ID_BITS: u32 = 0x4000_0000;

impl Reference {
    pub(in crate::build) fn new(bounds: &Aabb, id: u32) -> Self {
        let lower = bounds.min.extend(f32::from_bits(ID_BITS + id));
        Self { vectors: VectorBox::new(lower, bounds.max.extend(f32::NEG_INFINITY)) }
    }

    #[inline(always)]
    pub(in crate::build) fn id(&self) -> u32 {
        self.vectors.0[3].to_bits() - ID_BITS
    }

    #[inline(always)]
    pub(in crate::build) fn bounds(&self) -> Aabb {
        self.vectors.aabb()
    }

    /// Twice the box's centre; the fourth lane means nothing.
    #[inline(always)]
    fn twice_center(&self) -> Vec4 {
        self.vectors.lower() - self.vectors.negated_upper()
    }
}

/// What is known of a set of references.
#[derive(Clone, Copy)]
pub(in crate::build) struct Extent {
    /// Around their boxes.
    pub(super) boxes: VectorBox,
    /// Around twice the centres of their boxes.
    pub(super) twice_centers: VectorBox,
}

impl Extent {
    const EMPTY: Self = Self { boxes: VectorBox::EMPTY, twice_centers: VectorBox::EMPTY };

    /// Of all of `references`.
    pub(in crate::build) fn of(references: &[Reference]) -> Self {
        references.iter().fold(Self::EMPTY, |all, r| Self {
            boxes: all.boxes.union(r.vectors),
            twice_centers: all
                .twice_centers
                .union(VectorBox::new(r.twice_center(), r.twice_center())),
        })
    }

    fn union(self, other: Self) -> Self {
        Self {
            boxes: self.boxes.union(other.boxes),
            twice_centers: self.twice_centers.union(other.twice_centers),
        }
    }

    /// The box around the references' boxes.
    #[inline(always)]
    pub(in crate::build) fn bounds(&self) -> Aabb {
        self.boxes.aabb()
    }
}

/// One for each triangle, and their extent.
pub(in crate::build) fn references_to(mesh: &TriangleMesh) -> (Vec<Reference>, Extent) {
    const AT_ONCE: usize = 4096;
    let lengths: Vec<usize> =
        (0..mesh.len()).step_by(AT_ONCE).map(|first| AT_ONCE.min(mesh.len() - first)).collect();
    let (references, extents) = filled::in_parts(&lengths, |number, part| {
        let first = number * AT_ONCE;
        for id in first..first + lengths[number] {
            part.push(Reference::new(&mesh.triangle(id).bounds(), id as u32));
        }
        Extent::of(part.filled())
    });
    // The same in any order.
    let extent = extents.into_iter().fold(Extent::EMPTY, Extent::union);
    (references, extent)
}
