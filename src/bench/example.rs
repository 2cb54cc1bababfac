//! The example of the slides "SATO: Surface-Area Traversal Order for Ray Tracing" (Nah, 2013): five
//! nodes, and a large occluder behind small triangles that the ray passes.

use super::{Experiment, ExperimentEntry, Subject};
use crate::Result;
use crate::geometry::{Aabb, TriangleMesh};
use crate::intersect::Exact;
use crate::order::{ORDERS, OrderContext, OrderEntry};
use crate::ray::Ray;
use crate::report::table;
use crate::results::Output;
use crate::trace::{Counter, single};
use crate::tree::{Bvh2, ChildRef, Node2};
use glam::Vec3;
use serde::Serialize;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "example",
    about: "what a ray visits in the slides' five-node tree under each order (E8)",
    of_the_paper: true,
    start: |_| Box::new(Example),
};

struct Example;

#[derive(Serialize)]
struct Row {
    order: &'static str,
    visits: String,
    steps: usize,
}

impl Experiment for Example {
    fn steps(&self) -> usize {
        0
    }

    fn measure(&mut self, _: &Subject<'_>, _: &dyn Fn()) -> Result<()> {
        Ok(())
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        let rows: Vec<Row> = ORDERS
            .iter()
            .map(|order| {
                let visits = visits(order);
                Row { order: order.name, visits: visits.join(" "), steps: visits.len() }
            })
            .collect();
        output.rows(ENTRY.name, &rows)?;
        let mut table = table(["order", "steps", "visits"]);
        for row in &rows {
            table.add_row([row.order.to_string(), row.steps.to_string(), row.visits.clone()]);
        }
        Ok(table.trim_fmt())
    }
}

/// The names of the nodes and triangles that the example's ray visits, in order.
pub fn visits(order: &OrderEntry) -> Vec<String> {
    let (mesh, tree) = tree();
    // Through the boxes of T2 and T3, past both; past the box of N3; into T0 and T1.
    let ray = Ray::new(Vec3::new(0.0, 0.9, 0.9), Vec3::X, f32::INFINITY);
    let plan = (order.plan_bvh2)(&tree, &OrderContext::new(&mesh));
    let mut names = Names { tree: &tree, leaf: 0..0, visits: Vec::new() };
    let hit = single::any_hit(&tree, tree.root, &plan, Exact, &ray, &mut names);
    debug_assert!(hit);
    names.visits
}

/// N0 has the children N2 and N1, a leaf of two large triangles; N2 has the leaves N3 and N4 of two
/// small ones each.
pub fn tree() -> (TriangleMesh, Bvh2) {
    let small = |x: f32, y: f32| [[x, y, 0.0], [x, y + 1.0, 0.0], [x, y, 1.0]];
    let large = |x: f32| [[x, -9.0, -9.0], [x, 30.0, -9.0], [x, -9.0, 30.0]];
    let corners = [
        large(9.0),
        large(8.0),
        small(2.0, 0.0),
        small(3.0, 0.0),
        small(4.0, 5.0),
        small(5.0, 5.0),
    ];
    let mesh = TriangleMesh::new(
        corners.iter().flatten().map(|c| Vec3::from_array(*c)).collect(),
        (0..6).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    );
    let triangle_ids = vec![0, 1, 4, 5, 2, 3];
    let bounds_of = |ids: &[u32]| {
        ids.iter().fold(Aabb::EMPTY, |b, &i| b.union(mesh.triangle(i as usize).bounds()))
    };
    let leaf = |first| ChildRef::leaf(first, 2);
    let nodes = vec![
        Node2 {
            bounds: [bounds_of(&[2, 3, 4, 5]), bounds_of(&[0, 1])],
            children: [ChildRef::inner(1), leaf(0)],
            counts: [4, 2],
        },
        Node2 {
            bounds: [bounds_of(&[4, 5]), bounds_of(&[2, 3])],
            children: [leaf(2), leaf(4)],
            counts: [2, 2],
        },
    ];
    let bounds = bounds_of(&triangle_ids);
    let triangles = triangle_ids.iter().map(|&i| mesh.triangle(i as usize)).collect();
    let tree = Bvh2::new(nodes, Some(ChildRef::inner(0)), bounds, triangles, triangle_ids);
    (mesh, tree)
}

/// Names nodes and triangles as the slides do.
struct Names<'a> {
    tree: &'a Bvh2,
    leaf: std::ops::Range<usize>,
    visits: Vec<String>,
}

impl Counter for Names<'_> {
    fn node(&mut self) {}

    fn triangles(&mut self, count: usize) {
        for slot in self.leaf.by_ref().take(count) {
            self.visits.push(format!("T{}", self.tree.triangle_ids[slot]));
        }
    }

    fn enter(&mut self, child: ChildRef) {
        if child.is_leaf() {
            self.leaf = child.leaf_slots();
            self.visits.push(["N1", "N3", "N4"][self.leaf.start / 2].into());
        } else {
            self.visits.push(["N0", "N2"][child.node_index()].into());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::order;

    #[test]
    fn the_ray_goes_as_in_the_slides() {
        let (mesh, tree) = tree();
        tree.validate(&mesh).unwrap();
        let visits = |name: &str| visits(order::find(name).unwrap()).join(" ");
        assert_eq!(visits("near"), "N0 N2 N4 T2 T3 N1 T0");
        let by_size =
            ["node-sato", "prim-sato-avg", "prim-sato-max", "prim-num", "rtsah", "p-over-c"];
        for order in by_size {
            assert_eq!(visits(order), "N0 N1 T0", "{order}");
        }
    }
}
