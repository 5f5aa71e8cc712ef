//! An evenly spaced subset of a long sequence, in bounded memory.

/// Enough values for a median within a hundredth of the spread.
const CAPACITY: usize = 4096;

/// Every n-th value of a series, with n a power of two such that the values fit.
#[derive(Debug, Clone)]
pub(super) struct Thinned<T> {
    values: Vec<T>,
    /// A power of two.
    stride: u64,
    seen: u64,
}

impl<T> Default for Thinned<T> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            stride: 1,
            seen: 0,
        }
    }
}

impl<T> Thinned<T> {
    #[inline]
    pub(super) fn push(&mut self, value: T) {
        if self.is_turn() {
            if self.values.len() == CAPACITY {
                let mut index = 0;
                self.values.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.stride *= 2;
            }
            if self.is_turn() {
                self.values.push(value);
            }
        }
        self.seen += 1;
    }

    #[inline]
    fn is_turn(&self) -> bool {
        self.seen & (self.stride - 1) == 0
    }

    pub(super) fn values(&self) -> &[T] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_values_are_thinned_evenly() {
        let mut thinned = Thinned::default();
        for value in 0..1_000_000_u64 {
            thinned.push(value);
        }
        let values = thinned.values();
        assert!((CAPACITY / 2..=CAPACITY).contains(&values.len()));
        assert!(values.windows(2).all(|pair| pair[1] - pair[0] == 256));
    }
}
