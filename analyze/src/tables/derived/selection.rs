//! Which rows `derived.mcap` has: all of them around events, few elsewhere.

use tipwatch_mechanics::Quantity;

use crate::base::options::DerivedRows;
use crate::base::rows::Rows;
use crate::events::Event;

/// Time (ns) before and after an event in which all rows are written.
const MARGIN_NS: i64 = 500_000_000;
/// Of an event that lasts longer, all rows are written around its start, its worst moment and its end (ns).
const LONG_NS: i64 = 10_000_000_000;
/// Elsewhere, the extremes of every such time (ns) are written.
const BIN_NS: i64 = 1_000_000_000;

/// A row to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SelectedRow {
    /// Its index in the block.
    pub(super) row: usize,
    /// Whether all of its neighbours are written, too.
    pub(super) is_at_full_rate: bool,
}

/// Decides which rows are written.
#[derive(Debug)]
pub(super) struct Selection {
    /// Spans (ns) with all rows, in order, without overlap; `None` for all rows of the log.
    spans: Option<Vec<[i64; 2]>>,
}

impl Selection {
    pub(super) fn of(events: &[Event], rows: DerivedRows) -> Self {
        let spans = match rows {
            DerivedRows::Full => None,
            DerivedRows::Events => Some(joined(events.iter().flat_map(spans_of).collect())),
        };
        Self { spans }
    }

    /// The rows of a block to write, in order.
    pub(super) fn rows(&self, block: &Rows) -> Vec<SelectedRow> {
        let Some(spans) = &self.spans else {
            let all = 0..block.len();
            let selected = all.map(|row| SelectedRow {
                row,
                is_at_full_rate: true,
            });
            return selected.collect();
        };
        let is_at_full_rate = |row: usize| {
            let time_ns = block.times_ns[row];
            let next = spans.partition_point(|span| span[1] < time_ns);
            spans.get(next).is_some_and(|span| span[0] <= time_ns)
        };
        let is_telling = telling_rows(block);
        (0..block.len())
            .map(|row| SelectedRow {
                row,
                is_at_full_rate: is_at_full_rate(row),
            })
            .filter(|selected| selected.is_at_full_rate || is_telling[selected.row])
            .collect()
    }
}

/// Where an event needs all rows.
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

/// The same spans in order, those that overlap joined.
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

/// Of every second the rows with the smallest and the largest OTF of each wheel, and the last one; the rows at which
/// verdict or reasons change, with the ones before.
fn telling_rows(block: &Rows) -> Vec<bool> {
    let mut is_telling = vec![false; block.len()];
    let otf: Vec<&[f64]> = (block.outcomes.quantities.iter())
        .zip(&block.outcomes.columns)
        .filter(|(quantity, _)| matches!(quantity, Quantity::Otf(_)))
        .map(|(_, column)| column.as_slice())
        .collect();
    let bin = |row: usize| block.times_ns[row].div_euclid(BIN_NS);
    let mut first = 0;
    while first < block.len() {
        let rest = first..block.len();
        let end = rest.clone().find(|&row| bin(row) != bin(first));
        let rows = first..end.unwrap_or(rest.end);
        is_telling[rows.end - 1] = true;
        for column in &otf {
            let known = || rows.clone().filter(|&row| column[row].is_finite());
            let least = known().min_by(|&a, &b| column[a].total_cmp(&column[b]));
            let largest = known().max_by(|&a, &b| column[a].total_cmp(&column[b]));
            for row in [least, largest].into_iter().flatten() {
                is_telling[row] = true;
            }
        }
        first = rows.end;
    }
    let state = |row: usize| {
        let verdicts = block.verdicts.as_ref();
        let verdict = verdicts.map(|verdicts| verdicts.verdicts[row]);
        (
            block.reasons[row],
            verdict.map(|verdict| (verdict.level, verdict.latched_level)),
        )
    };
    for row in 1..block.len() {
        if state(row) != state(row - 1) {
            (is_telling[row - 1], is_telling[row]) = (true, true);
        }
    }
    is_telling
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
        let Some(spans) = Selection::of(&[long, short], DerivedRows::Events).spans else {
            panic!("expected spans");
        };
        let half = second / 2;
        let around = |from: i64, to: i64| [from * second - half, to * second + half];
        assert_eq!(
            spans,
            [around(100, 103), around(200, 200), around(400, 400)]
        );
    }
}
