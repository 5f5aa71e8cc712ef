//! Which rows `derived.mcap` has: all of them around events, few elsewhere.

use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::verdict::Level;

use crate::base::options::DerivedRows;
use crate::base::rows::Rows;
use crate::events::Event;

/// Time (ns) before and after an event in which all rows are written.
const MARGIN_NS: i64 = 300_000_000;
/// Longest event of which all rows are written (ns); of a longer one, those around its start, its worst moment and its end.
const LONG_NS: i64 = 10_000_000_000;
/// Elsewhere, the extremes of every such time (ns), a bin, are written.
const BIN_NS: i64 = 2_000_000_000;

/// Decides which rows are written. What it takes depends on the rows and the events alone, not on how the rows are
/// divided into blocks.
#[derive(Debug)]
pub(super) struct Selection {
    extent: DerivedRows,
    /// Consecutive rows of one bin whose choice is not made yet.
    waiting: Vec<Piece>,
    last_state: Option<(Reasons, Option<[Level; 2]>)>,
}

/// Consecutive rows of a block.
#[derive(Debug)]
struct Piece {
    block: Arc<Rows>,
    rows: Range<usize>,
}

/// Spans (ns) in which all rows are written, in order, without overlap; `None` for all rows of the log.
#[derive(Debug)]
pub(super) struct FullRate(Option<Vec<[i64; 2]>>);

impl FullRate {
    fn has(&self, time_ns: i64) -> bool {
        self.0.as_ref().is_none_or(|spans| {
            let next = spans.partition_point(|span| span[1] < time_ns);
            spans.get(next).is_some_and(|span| span[0] <= time_ns)
        })
    }
}

/// A row to write.
#[derive(Debug)]
pub(super) struct SelectedRow {
    pub(super) block: Arc<Rows>,
    /// Its index in the block.
    pub(super) row: usize,
    /// Whether all neighbours of the row are written, too.
    pub(super) is_at_full_rate: bool,
}

impl Selection {
    /// Longest time after a row to the beginning of an event for which the row is still written (ns).
    pub(super) const AHEAD_NS: i64 = MARGIN_NS + BIN_NS;

    pub(super) fn new(extent: DerivedRows) -> Self {
        Self {
            extent,
            waiting: Vec::new(),
            last_state: None,
        }
    }

    /// Returns the spans in which all rows are written.
    pub(super) fn full_rate<'e>(&self, events: impl Iterator<Item = &'e Event>) -> FullRate {
        FullRate(match self.extent {
            DerivedRows::Full => None,
            DerivedRows::Events => Some(joined(events.flat_map(spans_of).collect())),
        })
    }

    /// Takes the rows of a block from `first` on; those of its last bin wait for the next block.
    pub(super) fn add(
        &mut self,
        block: &Arc<Rows>,
        first: usize,
        full_rate: &FullRate,
    ) -> Vec<SelectedRow> {
        let bin = |row: usize| block.times_ns[row].div_euclid(BIN_NS);
        let mut selected = Vec::new();
        let mut start = first;
        while start < block.len() {
            let before = self.waiting.last();
            let before = before.map(|p| p.block.times_ns[p.rows.end - 1].div_euclid(BIN_NS));
            if before.is_some_and(|before| before != bin(start)) {
                selected.append(&mut self.end_bin(full_rate));
            }
            let end = (start..block.len()).find(|&row| bin(row) != bin(start));
            let rows = start..end.unwrap_or(block.len());
            start = rows.end;
            self.waiting.push(Piece {
                block: Arc::clone(block),
                rows,
            });
        }
        selected
    }

    /// The rows that wait.
    pub(super) fn end_bin(&mut self, full_rate: &FullRate) -> Vec<SelectedRow> {
        let pieces = std::mem::take(&mut self.waiting);
        let telling = self.telling_rows(&pieces);
        let rows = pieces.iter().flat_map(|piece| {
            let rows = piece.rows.clone();
            rows.map(|row| (&piece.block, row))
        });
        let rows = rows.zip(telling).filter_map(|((block, row), is_telling)| {
            let is_at_full_rate = full_rate.has(block.times_ns[row]);
            (is_at_full_rate || is_telling).then(|| SelectedRow {
                block: Arc::clone(block),
                row,
                is_at_full_rate,
            })
        });
        rows.collect()
    }

    /// Returns for the rows of a bin whether each is written in any case: those with the smallest and the largest OTF of each
    /// wheel, the last one, and those at which verdict or reasons change, with the ones before.
    fn telling_rows(&mut self, pieces: &[Piece]) -> Vec<bool> {
        let rows = || (pieces.iter()).flat_map(|p| p.rows.clone().map(|row| (&p.block, row)));
        let mut is_telling = vec![false; rows().count()];
        if let Some(last) = is_telling.last_mut() {
            *last = true;
        }
        let quantities = pieces.first().map(|piece| &piece.block.outcomes.quantities);
        for (column, quantity) in quantities.into_iter().flatten().enumerate() {
            if !matches!(quantity, Quantity::Otf(_)) {
                continue;
            }
            let values = rows().map(|(block, row)| block.outcomes.columns[column][row]);
            let known = || {
                let values = values.clone().enumerate();
                values.filter(|(_, value)| value.is_finite())
            };
            let least = known().min_by(|a, b| a.1.total_cmp(&b.1));
            let largest = known().max_by(|a, b| a.1.total_cmp(&b.1));
            for (at, _) in [least, largest].into_iter().flatten() {
                is_telling[at] = true;
            }
        }
        for (at, (block, row)) in rows().enumerate() {
            let verdicts = block.verdicts.as_ref();
            let verdict = verdicts.map(|verdicts| verdicts.verdicts[row]);
            let levels = verdict.map(|verdict| [verdict.level, verdict.latched_level]);
            let state = Some((block.reasons[row], levels));
            if self.last_state.is_some() && self.last_state != state {
                is_telling[at] = true;
                // that of the bin before was its last, which is written
                if let Some(before) = at.checked_sub(1) {
                    is_telling[before] = true;
                }
            }
            self.last_state = state;
        }
        is_telling
    }
}

/// Returns the spans in which an event needs all rows.
fn spans_of(event: &Event) -> Vec<[i64; 2]> {
    let around = |from_ns: i64, to_ns: i64| {
        [
            from_ns.saturating_sub(MARGIN_NS),
            to_ns.saturating_add(MARGIN_NS),
        ]
    };
    match event.end_ns {
        Some(end_ns) if end_ns.saturating_sub(event.start_ns) <= LONG_NS => {
            vec![around(event.start_ns, end_ns)]
        }
        end_ns => {
            let start = [event.start_ns, event.worst_ns].map(|at_ns| around(at_ns, at_ns));
            let end = end_ns.map(|at_ns| around(at_ns, at_ns));
            start.into_iter().chain(end).collect()
        }
    }
}

/// Sorts spans, and joins those that overlap.
fn joined(mut spans: Vec<[i64; 2]>) -> Vec<[i64; 2]> {
    spans.sort_unstable();
    let mut joined: Vec<[i64; 2]> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if span[0] <= last[1] => last[1] = last[1].max(span[1]),
            _ => joined.push(span),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::EventKind;

    #[test]
    fn short_events_are_written_whole_and_long_ones_at_their_ends() {
        let second = 1_000_000_000;
        let mut short = Event::blank(EventKind::WheelLift, 100 * second, "fl".into());
        short.end_ns = Some(103 * second);
        let mut long = Event::blank(EventKind::WheelLight, 103 * second, "fl".into());
        (long.end_ns, long.worst_ns) = (Some(400 * second), 200 * second);
        let selection = Selection::new(DerivedRows::Events);
        let FullRate(spans) = selection.full_rate([long, short].iter());
        let around = |from: i64, to: i64| [from * second - MARGIN_NS, to * second + MARGIN_NS];
        assert_eq!(
            spans.unwrap(),
            [around(100, 103), around(200, 200), around(400, 400)]
        );
    }
}
