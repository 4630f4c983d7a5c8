//! Work on another thread.

use bevy::tasks::{IoTaskPool, Task, futures::check_ready};
use bevy_contextual_ao::volume::dicom::DicomProgress;

/// Work that another thread does. It ends early when this is dropped.
pub struct Work<T> {
    task: Task<T>,
    pub progress: DicomProgress,
}

impl<T: Send + 'static> Work<T> {
    pub fn begin(work: impl FnOnce(&DicomProgress) -> T + Send + 'static) -> Self {
        let progress = DicomProgress::default();
        let of_work = progress.clone();
        Self { task: IoTaskPool::get().spawn(async move { work(&of_work) }), progress }
    }

    /// The result, once, when it is there.
    pub fn result(&mut self) -> Option<T> {
        check_ready(&mut self.task)
    }
}

impl<T> Drop for Work<T> {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
