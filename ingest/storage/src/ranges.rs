//! Sets of byte ranges.

use std::collections::BTreeMap;
use std::ops::Range;

/// Ranges that neither overlap nor touch.
#[derive(Debug, Clone, Default)]
pub(crate) struct RangeSet(BTreeMap<u64, u64>);

impl RangeSet {
    pub(crate) fn insert(&mut self, range: Range<u64>) {
        if range.is_empty() {
            return;
        }
        let Range { mut start, mut end } = range;
        let before = self.0.range(..=start).next_back();
        if let Some((&first, &last)) = before
            && last >= start
        {
            start = first;
            end = end.max(last);
        }
        while let Some((&first, &last)) = self.0.range(start..=end).next() {
            self.0.remove(&first);
            end = end.max(last);
        }
        self.0.insert(start, end);
    }

    /// The parts of a range that are not in the set, in order.
    pub(crate) fn missing(&self, range: Range<u64>) -> Vec<Range<u64>> {
        let mut gaps = Vec::new();
        let mut at = range.start;
        if let Some((_, &last)) = self.0.range(..=at).next_back() {
            at = at.max(last);
        }
        for (&first, &last) in self.0.range(at..range.end.max(at)) {
            if first > at {
                gaps.push(at..first);
            }
            at = at.max(last);
        }
        if at < range.end {
            gaps.push(at..range.end);
        }
        gaps
    }

    pub(crate) fn has(&self, range: &Range<u64>) -> bool {
        self.missing(range.clone()).is_empty()
    }
}

/// Joins ranges whose gaps are small, and cuts those that are large. The ranges need not be in order.
pub(crate) fn merged(mut ranges: Vec<Range<u64>>, most_gap: u64, most: u64) -> Vec<Range<u64>> {
    ranges.retain(|range| !range.is_empty());
    ranges.sort_by_key(|range| (range.start, range.end));
    let mut joined: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end.saturating_add(most_gap) => {
                last.end = last.end.max(range.end);
            }
            _ => joined.push(range),
        }
    }
    let most = most.max(1);
    let cut = |range: Range<u64>| {
        let mut start = range.start;
        std::iter::from_fn(move || {
            let end = start.saturating_add(most).min(range.end);
            let part = (start < range.end).then_some(start..end);
            start = end;
            part
        })
    };
    joined.into_iter().flat_map(cut).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A set of ranges is the set of their bytes.
        #[test]
        fn missing_parts_are_those_of_single_bytes(
            ranges in prop::collection::vec((0_u64..60, 0_u64..12), 0..8),
            (start, length) in (0_u64..60, 0_u64..20),
        ) {
            let mut set = RangeSet::default();
            let mut bytes = [false; 100];
            for (start, length) in ranges {
                set.insert(start..start + length);
                bytes[start as usize..(start + length) as usize].fill(true);
            }
            let wanted = start..start + length;
            let mut missing = [false; 100];
            for gap in set.missing(wanted.clone()) {
                prop_assert!(!gap.is_empty());
                missing[gap.start as usize..gap.end as usize].fill(true);
            }
            for byte in 0..100 {
                let expected = wanted.contains(&(byte as u64)) && !bytes[byte];
                prop_assert_eq!(missing[byte], expected);
            }
        }

        /// Requests hold all requested bytes, once, and few others.
        #[test]
        fn merged_requests_cover_the_ranges(
            ranges in prop::collection::vec((0_u64..500, 0_u64..50), 0..12), gap in 0_u64..20, most in 1_u64..200,
        ) {
            let ranges: Vec<_> = ranges.into_iter().map(|(at, length)| at..at + length).collect();
            let requests = merged(ranges.clone(), gap, most);
            for pair in requests.windows(2) {
                prop_assert!(pair[0].end <= pair[1].start);
            }
            for request in &requests {
                prop_assert!(!request.is_empty() && request.end - request.start <= most);
            }
            let mut set = RangeSet::default();
            requests.iter().for_each(|request| set.insert(request.clone()));
            for range in &ranges {
                prop_assert!(set.has(range));
            }
        }
    }
}
