//! Work on Bevy's task pool, and its progress.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use bevy::tasks::{AsyncComputeTaskPool, TaskPool};

/// Progress of reading, which another thread can watch. Clones are one progress.
#[derive(Clone, Debug, Default)]
pub struct DicomProgress(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    done: AtomicUsize,
    total: AtomicUsize,
    cancelled: AtomicBool,
}

impl DicomProgress {
    /// Files or slices read so far.
    pub fn done(&self) -> usize {
        self.0.done.load(Ordering::Relaxed)
    }

    /// Files or slices to read; 0 before their number is known.
    pub fn total(&self) -> usize {
        self.0.total.load(Ordering::Relaxed)
    }

    /// Ends reading early, with an error.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    pub(super) fn begin(&self, total: usize) {
        self.0.done.store(0, Ordering::Relaxed);
        self.0.total.store(total, Ordering::Relaxed);
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::Relaxed)
    }

    fn advance(&self) {
        self.0.done.fetch_add(1, Ordering::Relaxed);
    }
}

/// Does work on each item, side by side, and returns the results in order. After a failure the rest is left.
pub(super) fn each<T: Send, R: Send + 'static, E: Send + 'static>(
    items: Vec<T>,
    progress: &DicomProgress,
    work: impl Fn(T) -> Result<R, E> + Sync,
) -> Result<Vec<Option<R>>, E> {
    let failed = AtomicBool::new(false);
    let (work, failed) = (&work, &failed);
    let pool = AsyncComputeTaskPool::get_or_init(TaskPool::default);
    let results = pool.scope(|scope| {
        for item in items {
            scope.spawn(async move {
                if failed.load(Ordering::Relaxed) || progress.is_cancelled() {
                    return Ok(None);
                }
                let result = work(item);
                progress.advance();
                failed.fetch_or(result.is_err(), Ordering::Relaxed);
                result.map(Some)
            });
        }
    });
    results.into_iter().collect()
}
