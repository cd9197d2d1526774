//! Scratch memory that outlives the tasks that use it.

use std::sync::{Mutex, PoisonError};

/// Values lent to tasks, at most as many as tasks that run at one time.
///
/// Rayon's `map_init` makes a new value at every split of the work; fresh memory costs more than
/// the work of a small task.
#[derive(Debug)]
pub struct Pool<T> {
    idle: Mutex<Vec<T>>,
}

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self { idle: Mutex::new(Vec::new()) }
    }
}

impl<T> Pool<T> {
    /// Runs `task` on an idle value, or on a new one from `make`.
    pub fn lend<R>(&self, make: impl FnOnce() -> T, task: impl FnOnce(&mut T) -> R) -> R {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = idle().pop();
        let mut value = taken.unwrap_or_else(make);
        let result = task(&mut value);
        idle().push(value);
        result
    }
}
