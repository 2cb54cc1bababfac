//! When a tree that is only brought up to date is to be built anew.

/// The rule of those who rent skis: buy once you have paid the price in rent (Karlin, Manasse, Rudolph
/// and Sleator, "Competitive Snoopy Caching", Algorithmica 3, 1988). The rent of an old tree is what
/// tracing takes longer than it did right after the last build; the price is a build. Whatever comes,
/// both together are no more than twice what they are at best.
#[derive(Clone, Copy, Debug, Default)]
pub struct SkiRental {
    /// What the last build took.
    build_ms: f64,
    /// What tracing the first frame after it took.
    fresh_trace_ms: Option<f64>,
    /// What tracing took longer since.
    paid_ms: f64,
}

impl SkiRental {
    /// After a build that took `build_ms`.
    pub fn new(build_ms: f64) -> Self {
        Self { build_ms, fresh_trace_ms: None, paid_ms: 0.0 }
    }

    /// Tells what tracing a frame took. Frames that were faster than the first count too: what is
    /// noise must cancel out.
    pub fn traced(&mut self, trace_ms: f64) {
        let fresh_trace_ms = *self.fresh_trace_ms.get_or_insert(trace_ms);
        self.paid_ms = (self.paid_ms + trace_ms - fresh_trace_ms).max(0.0);
    }

    /// Whether to build now.
    pub fn is_due(&self) -> bool {
        self.fresh_trace_ms.is_some() && self.paid_ms > self.build_ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_is_due_once_its_price_is_paid() {
        let mut rule = SkiRental::new(100.0);
        assert!(!rule.is_due());
        rule.traced(50.0);
        // 10 more each frame, 100 are paid after ten; not yet more.
        for frame in 0..10 {
            rule.traced(60.0);
            assert!(!rule.is_due(), "{frame}");
        }
        rule.traced(50.5);
        assert!(rule.is_due());
    }

    #[test]
    fn noise_cancels_out_and_gains_are_not_saved_up() {
        let mut rule = SkiRental::new(10.0);
        rule.traced(50.0);
        for frame in 0..1000 {
            rule.traced(if frame % 2 == 0 { 55.0 } else { 45.0 });
            assert!(!rule.is_due(), "{frame}");
        }
        (0..1000).for_each(|_| rule.traced(1.0));
        rule.traced(61.0);
        assert!(rule.is_due());
    }
}
