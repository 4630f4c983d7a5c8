//! The part of Bevy that the readers name.

pub use glam as math;

pub mod asset {
    pub use bevy_shim_derive::Asset;
}

pub mod reflect {
    pub use bevy_shim_derive::{Reflect, TypePath};

    pub mod std_traits {
        /// Named by sources that derive `Reflect`.
        pub struct ReflectDefault;
    }
}

pub mod log {
    pub use crate::warn;
}

/// Takes its arguments and logs nothing.
#[macro_export]
macro_rules! warn {
    ($($argument:tt)*) => {
        let _ = format_args!($($argument)*);
    };
}

/// Tasks one after the other, on the thread that asks for them.
pub mod tasks {
    use std::{
        cell::RefCell,
        future::Future,
        pin::{Pin, pin},
        task::{Context, Poll, Waker},
    };

    #[derive(Default)]
    pub struct TaskPool;

    pub struct AsyncComputeTaskPool;

    impl AsyncComputeTaskPool {
        pub fn get_or_init(_: impl FnOnce() -> TaskPool) -> TaskPool {
            TaskPool
        }
    }

    pub struct Scope<'env, T>(RefCell<Vec<Pin<Box<dyn Future<Output = T> + 'env>>>>);

    impl<'env, T> Scope<'env, T> {
        pub fn spawn(&self, task: impl Future<Output = T> + 'env) {
            self.0.borrow_mut().push(Box::pin(task));
        }
    }

    impl TaskPool {
        pub fn scope<'env, T>(&self, spawn: impl FnOnce(&Scope<'env, T>)) -> Vec<T> {
            let scope = Scope(RefCell::default());
            spawn(&scope);
            let run = |task: Pin<Box<dyn Future<Output = T> + 'env>>| match pin!(task).poll(&mut Context::from_waker(Waker::noop())) {
                Poll::Ready(result) => result,
                Poll::Pending => unreachable!("these tasks wait for nothing"),
            };
            scope.0.into_inner().into_iter().map(run).collect()
        }
    }
}
