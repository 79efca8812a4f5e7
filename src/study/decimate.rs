//! Lists of bounded length, thinned during a run.

use crate::error::Result;

/// A list of every `stride`-th item; the stride doubles at the bound of the length.
pub(super) struct Thinned<T> {
    pub list: Vec<T>,
    stride: usize,
    seen: usize,
    most: usize,
}

impl<T> Thinned<T> {
    pub fn new(most: usize) -> Self {
        Self {
            list: Vec::new(),
            stride: 1,
            seen: 0,
            most,
        }
    }

    pub fn show(&mut self, item: impl FnOnce() -> T) {
        // An item that cannot fail is always shown.
        let _ = self.try_show(|| Ok(item()));
    }

    pub fn try_show(&mut self, item: impl FnOnce() -> Result<T>) -> Result<()> {
        if self.seen.is_multiple_of(self.stride) {
            self.keep(item()?);
        }
        self.seen += 1;
        Ok(())
    }

    pub fn keep(&mut self, item: T) {
        self.list.push(item);
        if self.list.len() > self.most {
            let mut odd = false;
            self.list.retain(|_| {
                odd = !odd;
                odd
            });
            self.stride *= 2;
        }
    }
}
