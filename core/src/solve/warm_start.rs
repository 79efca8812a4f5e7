//! Warm starts: the last solution, as the start of the next search.

use std::sync::{Arc, Mutex};

/// The last solution. Clones begin with the same one and are independent afterwards. Results depend on the last
/// solution only within their tolerance; a good start saves work.
#[derive(Debug)]
pub struct WarmStart<T>(Mutex<Option<Arc<T>>>);

impl<T> Default for WarmStart<T> {
    fn default() -> Self {
        Self(Mutex::new(None))
    }
}

impl<T> Clone for WarmStart<T> {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.last()))
    }
}

impl<T> WarmStart<T> {
    /// The last solution, if any.
    pub fn last(&self) -> Option<Arc<T>> {
        self.0.lock().ok()?.clone()
    }

    /// Replaces the last solution.
    pub fn keep(&self, found: &Arc<T>) {
        if let Ok(mut kept) = self.0.lock() {
            *kept = Some(found.clone());
        }
    }
}
