//! What was found last, to begin the next search with.

use std::sync::{Arc, Mutex};

/// The solution that was found last: a copy has it too, and goes its own way from there. What is found does not
/// depend on it beyond its tolerance, only how soon.
#[derive(Debug)]
pub struct Warm<T>(Mutex<Option<Arc<T>>>);

impl<T> Default for Warm<T> {
    fn default() -> Self {
        Self(Mutex::new(None))
    }
}

impl<T> Clone for Warm<T> {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.last()))
    }
}

impl<T> Warm<T> {
    /// The last one, if there was one.
    pub fn last(&self) -> Option<Arc<T>> {
        self.0.lock().ok()?.clone()
    }

    /// Puts another in its place.
    pub fn keep(&self, found: &Arc<T>) {
        if let Ok(mut kept) = self.0.lock() {
            *kept = Some(found.clone());
        }
    }
}
