//! Rotations of eight-wide trees: those of binary ones (Kensler, "Tree Rotations for Improving
//! Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing, 2008) with more children to
//! choose from.
//!
//! At a node, a child may change places with a child of another one, or two grandchildren of
//! different parents with each other. Only the boxes of the children in between change, so what a
//! way gains is what those lose in area; at most what they lose by giving up a child, and most ways
//! are ruled out by that. The best is done, one at each node.

use super::super::LEAST_GAIN;
use super::refit::Part;
use super::slots_in;
use crate::geometry::Aabb;
use crate::tree::{MAX_WIDE_DEPTH, Node8, Step, WIDTH};

/// A place for a subtree: a node and a slot of it.
type Place = (usize, usize);

/// Two places whose subtrees change, and the slots of the node with the boxes that they then have.
#[derive(Clone, Copy, Debug)]
struct Rotation {
    places: [Place; 2],
    bounds: [Option<(usize, Aabb)>; 2],
}

/// The best way so far.
struct Best {
    gain: f64,
    rotation: Option<Rotation>,
}

impl Best {
    /// Whether boxes of the area `before` that lose `gain` are better than the best so far.
    #[inline(always)]
    fn is_beaten_by(&self, gain: f64, before: f64) -> bool {
        gain > self.gain && gain > before * LEAST_GAIN
    }
}

/// A child whose children may go elsewhere.
#[derive(Clone, Copy)]
struct Donor {
    slot: usize,
    index: usize,
    area: f64,
    /// Around all but each of its children.
    without: [Aabb; WIDTH],
    /// What it loses in area if that child goes.
    loss: [f64; WIDTH],
    most_loss: f64,
}

impl Donor {
    fn of(slot: usize, index: usize, node: &Node8) -> Self {
        let mut without = [Aabb::EMPTY; WIDTH];
        let mut all = Aabb::EMPTY;
        for place in slots_in(node) {
            without[place] = all;
            all = all.union(node.bounds(place));
        }
        let mut after = Aabb::EMPTY;
        for place in slots_in(node).rev() {
            without[place] = without[place].union(after);
            after = after.union(node.bounds(place));
        }
        let area = all.half_area();
        let mut loss = [0.0; WIDTH];
        for place in slots_in(node) {
            loss[place] = area - without[place].half_area();
        }
        let most_loss = loss.into_iter().fold(0.0, f64::max);
        Self { slot, index, area, without, loss, most_loss }
    }
}

impl Part<'_> {
    /// Does what gains most at a node, if anything does, and returns the children between whose own
    /// children changed.
    pub(super) fn rotate(&mut self, step: Step) -> [Option<usize>; 2] {
        let Some(rotation) = self.best_rotation(step) else { return [None; 2] };
        let place = step.index as usize - self.first;
        let mut between = [None; 2];
        self.exchange(rotation.places);
        for (between, changed) in between.iter_mut().zip(rotation.bounds) {
            let Some((slot, bounds)) = changed else { continue };
            let node = &mut self.nodes[place];
            self.cost += bounds.half_area() - node.bounds(slot).half_area();
            node.set_bounds(slot, &bounds);
            *between = Some(node.children[slot].node_index());
        }
        between
    }

    fn best_rotation(&self, step: Step) -> Option<Rotation> {
        let index = step.index as usize;
        let node = &self.nodes[index - self.first];
        let mut donors = [None; WIDTH];
        for slot in slots_in(node) {
            donors[slot] = self
                .open(node.children[slot])
                .map(|child| Donor::of(slot, child, &self.nodes[child - self.first]));
        }
        if donors.iter().all(Option::is_none) {
            return None;
        }
        let mut best = Best { gain: 0.0, rotation: None };
        for donor in donors.iter().flatten() {
            self.try_children(step, node, donor, &mut best);
        }
        for (place, first) in donors.iter().enumerate() {
            let Some(first) = first else { continue };
            for second in donors[place + 1..].iter().flatten() {
                self.try_grandchildren(first, second, &mut best);
            }
        }
        best.rotation
    }

    /// Each child of the node against each child of the donor.
    fn try_children(&self, step: Step, node: &Node8, donor: &Donor, best: &mut Best) {
        let below = &self.nodes[donor.index - self.first];
        for slot in slots_in(node).filter(|&slot| slot != donor.slot) {
            let depth = usize::from(step.depth) + 2 + usize::from(self.height(node.children[slot]));
            if depth > MAX_WIDE_DEPTH {
                continue;
            }
            let bounds = node.bounds(slot);
            for place in slots_in(below) {
                if !best.is_beaten_by(donor.loss[place], donor.area) {
                    continue;
                }
                let after = donor.without[place].union(bounds);
                let gain = donor.area - after.half_area();
                if best.is_beaten_by(gain, donor.area) {
                    let places = [(step.index as usize, slot), (donor.index, place)];
                    let bounds = [Some((donor.slot, after)), None];
                    *best = Best { gain, rotation: Some(Rotation { places, bounds }) };
                }
            }
        }
    }

    /// Each child of one donor against each of another.
    fn try_grandchildren(&self, first: &Donor, second: &Donor, best: &mut Best) {
        let before = first.area + second.area;
        if !best.is_beaten_by(first.most_loss + second.most_loss, before) {
            return;
        }
        let [lower, upper] = [first, second].map(|donor| &self.nodes[donor.index - self.first]);
        for a in slots_in(lower) {
            if !best.is_beaten_by(first.loss[a] + second.most_loss, before) {
                continue;
            }
            for b in slots_in(upper) {
                if !best.is_beaten_by(first.loss[a] + second.loss[b], before) {
                    continue;
                }
                let after = [
                    first.without[a].union(upper.bounds(b)),
                    second.without[b].union(lower.bounds(a)),
                ];
                let gain = before - (after[0].half_area() + after[1].half_area());
                if best.is_beaten_by(gain, before) {
                    let places = [(first.index, a), (second.index, b)];
                    let bounds = [Some((first.slot, after[0])), Some((second.slot, after[1]))];
                    *best = Best { gain, rotation: Some(Rotation { places, bounds }) };
                }
            }
        }
    }

    /// Lets the subtrees in two places change places, with their scores: a second time, it puts them
    /// back.
    pub(super) fn exchange(&mut self, places: [Place; 2]) {
        let [a, b] = places.map(|(index, slot)| (index - self.first, slot));
        let [from_a, from_b] = [a, b].map(|(place, slot)| {
            let node = &self.nodes[place];
            let score = self.scores.get(place).map(|scores| scores[slot]);
            (node.children[slot], node.bounds(slot), score)
        });
        for ((place, slot), (child, bounds, score)) in [(a, from_b), (b, from_a)] {
            self.nodes[place].children[slot] = child;
            self.nodes[place].set_bounds(slot, &bounds);
            if let Some(score) = score {
                self.scores[place][slot] = score;
            }
        }
    }
}
