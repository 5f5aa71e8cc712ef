//! Means over slots of half a second, in which signals of different rates can be compared.

use std::collections::BTreeMap;

/// Length of a slot (ns).
const LENGTH_NS: i64 = 500_000_000;

/// Mean of the finite values in each slot, by number of the slot.
pub(super) fn means(stamps_ns: &[i64], mut value: impl FnMut(usize) -> f64) -> BTreeMap<i64, f64> {
    let mut sums = Sums::default();
    for (sample, stamp) in stamps_ns.iter().enumerate() {
        sums.add(*stamp, value(sample));
    }
    sums.means()
}

/// Sum and number of the finite values in each slot.
#[derive(Debug, Default)]
pub(super) struct Sums {
    slots: BTreeMap<i64, (f64, f64)>,
    /// The slot of the last value, which the next one usually shares.
    last: Option<(i64, (f64, f64))>,
}

impl Sums {
    pub(super) fn add(&mut self, stamp_ns: i64, value: f64) {
        if !value.is_finite() {
            return;
        }
        let slot = stamp_ns.div_euclid(LENGTH_NS);
        if self.last.is_none_or(|(last, _)| last != slot) {
            self.slots.extend(self.last.take());
            let so_far = self.slots.get(&slot).copied().unwrap_or_default();
            self.last = Some((slot, so_far));
        }
        if let Some((_, (sum, count))) = &mut self.last {
            *sum += value;
            *count += 1.0;
        }
    }

    pub(super) fn means(mut self) -> BTreeMap<i64, f64> {
        self.slots.extend(self.last);
        (self.slots.into_iter())
            .map(|(slot, (sum, count))| (slot, sum / count))
            .collect()
    }
}

/// Pairs of means of the slots that both have.
pub(super) fn pairs<'m>(
    a: &'m BTreeMap<i64, f64>,
    b: &'m BTreeMap<i64, f64>,
) -> impl Iterator<Item = (f64, f64)> + 'm {
    a.iter()
        .filter_map(|(slot, &value)| Some((value, *b.get(slot)?)))
}

/// Removes the slots of which a part lies in a time, first and last (ns).
pub(super) fn leave_out(means: &mut BTreeMap<i64, f64>, [from_ns, to_ns]: [i64; 2]) {
    let left_out = from_ns.div_euclid(LENGTH_NS)..=to_ns.div_euclid(LENGTH_NS);
    means.retain(|slot, _| !left_out.contains(slot));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_left_out_if_a_part_of_it_is() {
        let mut means: BTreeMap<i64, f64> = (-2..4).map(|slot| (slot, 1.0)).collect();
        leave_out(&mut means, [-1, 600_000_000]);
        assert_eq!(means.into_keys().collect::<Vec<_>>(), [-2, 2, 3]);
        let mut means = BTreeMap::from([(0, 1.0), (1, 1.0)]);
        leave_out(&mut means, [500_000_000, i64::MAX]);
        assert_eq!(means.into_keys().collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn slots_hold_the_means_of_what_is_finite() {
        let stamps = [0, 400_000_000, 600_000_000, -1, 100_000_000];
        let values = [1.0, 2.0, f64::NAN, 7.0, 3.0];
        let found = means(&stamps, |sample| values[sample]);
        assert_eq!(found, BTreeMap::from([(-1, 7.0), (0, 2.0)]));
        let other = BTreeMap::from([(0, 5.0), (9, 1.0)]);
        assert_eq!(pairs(&found, &other).collect::<Vec<_>>(), [(2.0, 5.0)]);
    }
}
