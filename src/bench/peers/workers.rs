//! One thread, and all of them.

use crate::{Error, Result};
use rayon::ThreadPool;

/// Threads that build and answer.
pub(super) struct Workers {
    pub(super) threads: usize,
    /// None for the current pool.
    pool: Option<ThreadPool>,
}

impl Workers {
    /// One thread, then those of the current pool if it has more.
    pub(super) fn one_and_all() -> Result<Vec<Self>> {
        let current = Self { threads: rayon::current_num_threads(), pool: None };
        if current.threads == 1 {
            return Ok(vec![current]);
        }
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .map_err(|e| Error::Usage(format!("cannot start a thread: {e}")))?;
        Ok(vec![Self { threads: 1, pool: Some(one) }, current])
    }

    /// Does `work` on them.
    pub(super) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_by_as_many_threads_as_stated() {
        for most in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(most).build().unwrap();
            pool.install(|| {
                let all = Workers::one_and_all().unwrap();
                let stated: Vec<usize> = all.iter().map(|workers| workers.threads).collect();
                assert_eq!(stated, if most == 1 { vec![1] } else { vec![1, most] });
                let found = all.iter().map(|workers| workers.run(rayon::current_num_threads));
                assert_eq!(found.collect::<Vec<_>>(), stated);
            });
        }
    }
}
