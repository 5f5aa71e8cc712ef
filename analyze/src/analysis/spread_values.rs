//! The median of a long series from a bounded number of its values.

/// Most values that are kept.
const MOST: usize = 1 << 19;

/// Values evenly spread over a series: all of a short one, every second, fourth and so on of a longer one.
#[derive(Debug, Clone, Default)]
pub(super) struct SpreadValues {
    values: Vec<f64>,
    /// Values seen that are finite.
    seen: usize,
    /// Values from one that is kept to the next, as a power of two.
    step: u32,
}

impl SpreadValues {
    /// Adds the next value; one that is not finite is left out.
    pub(super) fn push(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        if self.seen.is_multiple_of(1 << self.step) {
            if self.values.len() == MOST {
                let mut place = 0;
                self.values.retain(|_| {
                    place += 1;
                    place % 2 == 1
                });
                self.step += 1;
            }
            if self.seen.is_multiple_of(1 << self.step) {
                self.values.push(value);
            }
        }
        self.seen += 1;
    }

    /// The median, the upper one of an even number; `None` without values.
    pub(super) fn middle(mut self) -> Option<f64> {
        let middle = self.values.len() / 2;
        let is_empty = self.values.is_empty();
        (!is_empty).then(|| *self.values.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn median_of(values: impl Iterator<Item = f64>) -> Option<f64> {
        let mut kept = SpreadValues::default();
        values.for_each(|value| kept.push(value));
        assert!(kept.values.len() <= MOST);
        kept.middle()
    }

    #[test]
    fn the_median_of_a_short_series_is_exact() {
        assert_eq!(median_of([3.0, f64::NAN, 1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median_of([1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median_of(std::iter::empty()), None);
        assert_eq!(
            median_of((0..MOST).map(|k| k as f64)),
            Some(MOST as f64 / 2.0)
        );
    }

    #[test]
    fn the_median_of_a_long_series_is_that_of_evenly_spread_values() {
        let count = 5 * MOST + 7;
        let median = median_of((0..count).map(|k| k as f64)).unwrap();
        assert!((median - count as f64 / 2.0).abs() <= 8.0, "{median}");
    }
}
