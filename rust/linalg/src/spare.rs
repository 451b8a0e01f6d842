//! Memory that is used again, since touching new pages costs as much as a small product or solution.

use std::sync::Mutex;

/// Elements of the last use. A use beside another one finds none and takes its own.
#[derive(Debug)]
pub struct Spare<T>(Mutex<Vec<T>>);

impl<T> Default for Spare<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Copy> Spare<T> {
    /// At least `n` elements, whatever they hold; `fill` for those that are new.
    pub fn take(&self, n: usize, fill: T) -> Vec<T> {
        let mut kept = self.0.lock().map_or_else(|_| Vec::new(), |mut kept| std::mem::take(&mut *kept));
        kept.resize(kept.len().max(n), fill);
        kept
    }

    /// Gives them back.
    pub fn give(&self, elements: Vec<T>) {
        if let Ok(mut kept) = self.0.lock() {
            *kept = elements;
        }
    }
}
