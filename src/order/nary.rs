//! The order of up to eight children from recorded rays: by one sorting criterion, and the best
//! there is.
//!
//! A node's expected cost is the sum of the children's costs over the rays that no earlier child
//! has stopped. If children stop rays independently of each other, sorting by descending
//! probability of stopping over cost is optimal (Ogaki and Derouet-Jourdan, "An N-ary BVH Child
//! Node Sorting Technique for Occlusion Tests", Journal of Computer Graphics Techniques 5(2),
//! 2016). In general the problem is min-sum set cover, small enough for a dynamic program over
//! subsets: the yardstick for every heuristic.

/// Most children of a node.
pub const MAX_CHILDREN: usize = 8;

/// Children in the order of their visits; only as many count as the node has.
pub type ChildOrder = [u8; MAX_CHILDREN];

/// What one ray finds at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeRay {
    /// A bit for each child that stops the ray.
    pub stopped_by: u8,
    /// Cost of visiting each child; 0 where the ray does not meet its box.
    pub cost: [f64; MAX_CHILDREN],
}

impl NodeRay {
    /// Notes that the ray meets `child`, what visiting it costs, and whether it stops the ray.
    pub fn add(&mut self, child: usize, cost: f64, stops: bool) {
        self.cost[child] = cost;
        self.stopped_by |= u8::from(stops) << child;
    }
}

/// The total cost of all rays under an order of the first `children` children.
pub fn cost_of(rays: &[NodeRay], order: &ChildOrder, children: usize) -> f64 {
    let mut total = 0.0;
    for ray in rays {
        for &child in &order[..children] {
            total += ray.cost[usize::from(child)];
            if ray.stopped_by >> child & 1 != 0 {
                break;
            }
        }
    }
    total
}

/// The order by descending rays stopped over cost; ties keep the lower child first, and children
/// that no ray meets come last.
pub fn by_ratio(rays: &[NodeRay], children: usize) -> ChildOrder {
    let ratio: [f64; MAX_CHILDREN] = std::array::from_fn(|child| {
        let cost: f64 = rays.iter().map(|r| r.cost[child]).sum();
        let stopped = rays.iter().filter(|r| r.stopped_by >> child & 1 != 0).count();
        if cost > 0.0 { stopped as f64 / cost } else { -1.0 }
    });
    let mut order: ChildOrder = std::array::from_fn(|i| i as u8);
    order[..children].sort_by(|a, b| ratio[usize::from(*b)].total_cmp(&ratio[usize::from(*a)]));
    order
}

/// The order of the first `children` children with the least total cost, and that cost.
pub fn best_order(rays: &[NodeRay], children: usize) -> (ChildOrder, f64) {
    let subsets = 1usize << children;
    // passing[set][i]: cost of child i over all rays that no child in `set` stops.
    let mut passing = vec![[0.0; MAX_CHILDREN]; subsets];
    for ray in rays {
        let unstopping = !usize::from(ray.stopped_by) & (subsets - 1);
        for (sum, cost) in passing[unstopping].iter_mut().zip(ray.cost) {
            *sum += cost;
        }
    }
    // So far under the largest such set of each ray: now add it to all subsets of that set.
    for child in 0..children {
        for set in (0..subsets).filter(|set| set >> child & 1 == 0) {
            let with = passing[set | 1 << child];
            for (sum, more) in passing[set].iter_mut().zip(with) {
                *sum += more;
            }
        }
    }
    // least[set]: cost of visiting just these children in their best order, and which comes last.
    let mut least = vec![(0.0, 0u8); subsets];
    for set in 1..subsets {
        least[set] = (0..children)
            .filter(|child| set >> child & 1 != 0)
            .map(|child| {
                let before = set & !(1 << child);
                (least[before].0 + passing[before][child], child as u8)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("the set is not empty");
    }
    let mut order: ChildOrder = std::array::from_fn(|i| i as u8);
    let mut set = subsets - 1;
    for place in order[..children].iter_mut().rev() {
        *place = least[set].1;
        set &= !(1 << *place);
    }
    (order, least[subsets - 1].0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    fn random_rays(random: &mut Random, children: usize) -> Vec<NodeRay> {
        let rates: Vec<_> = (0..children).map(|_| random.unit()).collect();
        (0..200)
            .map(|_| {
                let mut ray = NodeRay::default();
                let like = random.unit();
                for (child, rate) in rates.iter().enumerate() {
                    if random.unit() < 0.6 {
                        // Children stop the same rays more often than chance would have it.
                        let stops = 0.5 * (like + random.unit()) < *rate;
                        ray.add(child, f64::from(1.0 + 9.0 * random.unit()), stops);
                    }
                }
                ray
            })
            .collect()
    }

    fn permutations(children: usize) -> Vec<ChildOrder> {
        let mut all = vec![std::array::from_fn(|i| i as u8)];
        for place in 0..children {
            all = all
                .iter()
                .flat_map(|order| {
                    (place..children).map(|other| {
                        let mut order: ChildOrder = *order;
                        order.swap(place, other);
                        order
                    })
                })
                .collect();
        }
        all
    }

    #[test]
    fn the_best_order_is_the_best_of_all() {
        let mut random = Random::new(81);
        for children in 1..=6 {
            for _ in 0..10 {
                let rays = random_rays(&mut random, children);
                let (order, cost) = best_order(&rays, children);
                assert!((cost_of(&rays, &order, children) - cost).abs() < 1e-9 * cost);
                let costs =
                    permutations(children).into_iter().map(|o| cost_of(&rays, &o, children));
                let least = costs.fold(f64::INFINITY, f64::min);
                assert!((least - cost).abs() < 1e-9 * cost, "{children}: {least} {cost}");
            }
        }
    }

    /// Sorting ignores that children stop the same rays: it beats chance, but not on each small set.
    #[test]
    fn best_is_at_most_sorted_is_at_most_the_mean_of_random_orders() {
        let mut random = Random::new(82);
        for children in 2..=MAX_CHILDREN {
            let (mut all_sorted, mut all_mean) = (0.0, 0.0);
            for _ in 0..20 {
                let rays = random_rays(&mut random, children);
                let (_, best) = best_order(&rays, children);
                let sorted = cost_of(&rays, &by_ratio(&rays, children), children);
                let mut order: ChildOrder = std::array::from_fn(|i| i as u8);
                let mut sum = 0.0;
                for _ in 0..100 {
                    for i in (1..children).rev() {
                        order.swap(i, (random.bits() % (i as u64 + 1)) as usize);
                    }
                    sum += cost_of(&rays, &order, children);
                }
                let mean = sum / 100.0;
                assert!(best <= sorted * (1.0 + 1e-12), "{children}: {best} {sorted}");
                assert!(best <= mean * (1.0 + 1e-12), "{children}: {best} {mean}");
                all_sorted += sorted;
                all_mean += mean;
            }
            assert!(all_sorted < all_mean, "{children}: {all_sorted} {all_mean}");
        }
    }

    /// All combinations of outcomes occur as often as their probabilities say.
    #[test]
    fn sorted_is_best_where_children_are_independent() {
        let mut random = Random::new(83);
        for children in 1..=5u32 {
            for _ in 0..10 {
                let any = |random: &mut Random| (0..children).map(|_| random.bits() % 5).collect();
                let quarters: Vec<u64> = any(&mut random);
                let costs: Vec<u64> = any(&mut random);
                let rays: Vec<_> = (0..4u64.pow(children))
                    .map(|outcome| {
                        let mut ray = NodeRay::default();
                        for child in 0..children as usize {
                            let stops = outcome >> (2 * child) & 3 < quarters[child];
                            ray.add(child, (1 + costs[child]) as f64, stops);
                        }
                        ray
                    })
                    .collect();
                let children = children as usize;
                let (_, best) = best_order(&rays, children);
                let sorted = cost_of(&rays, &by_ratio(&rays, children), children);
                assert!((best - sorted).abs() < 1e-9 * best, "{children}: {best} {sorted}");
            }
        }
    }

    #[test]
    fn children_that_no_ray_meets_come_last() {
        let mut ray = NodeRay::default();
        ray.add(1, 2.0, false);
        assert_eq!(by_ratio(&[ray], 3)[0], 1);
        assert_eq!(by_ratio(&[], 4)[..4], [0, 1, 2, 3]);
    }
}
