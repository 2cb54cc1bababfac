//! Whether to look on.

/// Decides which of many alike are looked at on their own: all while that says something, few while it does
/// not.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gate {
    seen: u32,
    /// Looked at since one of them was of use.
    in_vain: u32,
}

impl Gate {
    const PATIENCE: u32 = 4;
    const STRIDE: u32 = 8;

    /// Whether to look at the next one.
    #[inline]
    pub(crate) fn is_open(&mut self) -> bool {
        self.seen = self.seen.wrapping_add(1);
        self.in_vain < Self::PATIENCE || self.seen.is_multiple_of(Self::STRIDE)
    }

    /// One was looked at.
    #[inline]
    pub(crate) fn note(&mut self, of_use: bool) {
        self.in_vain = if of_use { 0 } else { self.in_vain + 1 };
    }
}
