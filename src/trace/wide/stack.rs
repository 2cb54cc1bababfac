//! What a stream has still to visit, and to settle.

use super::alone::Alone;
use super::numbers::Target;
use super::rays::{Bits, confirm};
use super::simd::Simd;
use crate::ray::Ray;
use crate::trace::packet::PacketCounter;
use crate::tree::{ChildRef, MAX_WIDE_DEPTH, WIDTH};

/// A subtree to visit, with the rays that meet its box.
#[derive(Clone, Copy)]
pub(super) struct Pending {
    pub(super) child: ChildRef,
    pub(super) rays: Bits,
}

/// Places for children, and for the lower and the upper halves of their rays.
pub(super) type Slots<'a> = (&'a mut [ChildRef; WIDTH], [&'a mut [u64; WIDTH]; 2]);

/// What is still to visit: of each node on the way all children but the current one.
pub(super) struct Stack {
    children: [ChildRef; Self::ROOM],
    /// Their lower and their upper halves.
    rays: [[u64; Self::ROOM]; 2],
    len: usize,
    /// Rays that go on alone when all else is done.
    pub(super) alone: Alone,
    /// Leaves to visit last, with the rays that meet them, and how many have been visited.
    put_off: Vec<Pending>,
    made_up: usize,
    /// Triangles that vector tests leave in doubt, each with the ray.
    doubts: Vec<(u32, u32)>,
}

impl Stack {
    /// For a tree, and another one in a leaf of it.
    const ROOM: usize = 2 * (MAX_WIDE_DEPTH * (WIDTH - 1) + 1) + WIDTH;

    pub(super) const EMPTY: Self = Self {
        children: [ChildRef::UNUSED; Self::ROOM],
        rays: [[0; Self::ROOM]; 2],
        len: 0,
        alone: Alone::EMPTY,
        put_off: Vec::new(),
        made_up: 0,
        doubts: Vec::new(),
    };

    pub(super) fn begin(&mut self) {
        self.len = 0;
        self.alone.steps = 0;
        self.put_off.clear();
        self.made_up = 0;
        self.doubts.clear();
    }

    /// Remembers that the vector tests leave a triangle in doubt for a ray, by its number in the stream.
    /// Settled later, as other triangles may stop the ray for certain, and meshes are far away: what is
    /// needed of them is fetched for all at once.
    #[inline(always)]
    pub(super) fn doubt(&mut self, index: usize, triangle: u32) {
        self.doubts.push((index as u32, triangle));
    }

    /// As [`doubt`](Self::doubt), of all rays that have a bit, from that with number `first` on.
    #[inline(always)]
    pub(super) fn doubt_all(&mut self, first: usize, mut rays: u64, triangle: u32) {
        while rays != 0 {
            self.doubt(first + rays.trailing_zeros() as usize, triangle);
            rays &= rays - 1;
        }
    }

    /// Those of `alive` rays that a triangle stops that was in doubt. `given` has rays by number.
    #[inline(always)]
    pub(super) fn settle<'a, S: Simd, C: PacketCounter>(
        &mut self,
        s: S,
        target: Target<'_>,
        given: impl Fn(usize) -> &'a Ray,
        alive: Bits,
        counter: &mut C,
    ) -> Bits {
        if self.doubts.is_empty() {
            return 0;
        }
        let mesh = target.mesh;
        for &(_, triangle) in &self.doubts {
            s.prefetch(&mesh.triangles()[triangle as usize]);
        }
        for &(_, triangle) in &self.doubts {
            for vertex in mesh.triangles()[triangle as usize] {
                s.prefetch(&mesh.vertices()[vertex as usize]);
            }
        }
        let mut left = alive;
        for (index, triangle) in self.doubts.drain(..) {
            if left >> index & 1 != 0 {
                let (hit, by) = confirm(given(index as usize), triangle, target);
                counter.settled(index as usize, by);
                left &= !(Bits::from(hit) << index);
            }
        }
        alive & !left
    }

    /// How much is still to visit.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Has `rays` visit a leaf when all else is done.
    pub(super) fn put_off(&mut self, leaf: ChildRef, rays: Bits) {
        self.put_off.push(Pending { child: leaf, rays });
    }

    /// The next leaf that was put off, and its rays.
    pub(super) fn make_up(&mut self) -> Option<(ChildRef, Bits)> {
        let Pending { child, rays } = *self.put_off.get(self.made_up)?;
        self.made_up += 1;
        Some((child, rays))
    }

    #[inline(always)]
    pub(super) fn push(&mut self, child: ChildRef, rays: Bits) {
        self.children[self.len] = child;
        (self.rays[0][self.len], self.rays[1][self.len]) = (rays as u64, (rays >> 64) as u64);
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop_above(&mut self, base: usize) -> Option<Pending> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
        let [lower, upper] = [self.rays[0][self.len], self.rays[1][self.len]];
        let rays = Bits::from(lower) | Bits::from(upper) << 64;
        Some(Pending { child: self.children[self.len], rays })
    }

    /// Forgets all but the first `len`.
    #[inline(always)]
    pub(super) fn cut(&mut self, len: usize) {
        self.len = len;
    }

    /// What is visited next.
    #[inline(always)]
    pub(super) fn top_above(&self, base: usize) -> Option<ChildRef> {
        (self.len > base).then(|| self.children[self.len - 1])
    }

    /// Places for a node's children; those that are used are [`added`](Self::added).
    #[inline(always)]
    pub(super) fn next(&mut self) -> Slots<'_> {
        let there = self.len..self.len + WIDTH;
        let children = (&mut self.children[there.clone()]).try_into().expect("eight places");
        let [lower, upper] = &mut self.rays;
        let rays = [&mut lower[there.clone()], &mut upper[there]];
        (children, rays.map(|rays| rays.try_into().expect("eight places")))
    }

    /// So many places are used now.
    #[inline(always)]
    pub(super) fn added(&mut self, len: usize) {
        self.len += len;
    }
}
