//! Memory that is used again by one piece of work after the other.

use std::sync::{Mutex, PoisonError};

/// As many of one kind as were ever in use at once.
#[derive(Debug)]
pub(super) struct Reused<T>(Mutex<Vec<Box<T>>>);

impl<T> Default for Reused<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Default> Reused<T> {
    /// Does `work` with one that nobody else uses: as it was left, or a new one.
    pub(super) fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        let left = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut one = left.unwrap_or_default();
        let result = work(&mut one);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(one);
        result
    }
}
