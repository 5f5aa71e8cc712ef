//! Exclusion of lifts between rows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Machine;

use super::super::study::{Block, StudiedLog, Study};
use crate::base::table::Table;
use crate::events::{Event, EventKind};

/// What is known between the rows of a sparse log.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Exclusion {
    /// Rows at which, or until the next of which, motion was not observed.
    pub static_rows: u64,
    /// Time after static rows with loads in which the greatest rates and accelerations exclude that a wheel lifted, under the
    /// stated load split (s).
    pub lift_excluded_s: f64,
    /// Time after static rows with loads in which a lift cannot be excluded (s).
    pub lift_not_excluded_s: f64,
}

impl Exclusion {
    /// Returns the exclusion with its times limited to those of the log itself: the time up to a row far away is not all of the
    /// log's.
    pub(in crate::analysis) fn within(self, covered_s: f64) -> Self {
        let lift_not_excluded_s = self.lift_not_excluded_s.min(covered_s);
        let rest_s = covered_s - lift_not_excluded_s;
        Self {
            lift_not_excluded_s,
            lift_excluded_s: self.lift_excluded_s.min(rest_s),
            ..self
        }
    }
}

/// Collects the exclusion of lifts between rows, block by block.
pub(in crate::analysis) struct ExclusionPass<'a> {
    machine: &'a Machine,
    table: &'a Table,
    is_sparse: bool,
    found: Exclusion,
    /// Event that may go on, by wheel.
    open: Vec<Option<Event>>,
    events: Vec<Event>,
}

impl<'a> Study<'a> for ExclusionPass<'a> {
    /// The events, and the exclusion; `None` for a log that is not sparse.
    type Found = (Vec<Event>, Option<Exclusion>);

    fn begin(log: &StudiedLog<'a>) -> Self {
        Self {
            machine: log.machine,
            table: log.table,
            is_sparse: log.table.has(Quantity::Static),
            found: Exclusion::default(),
            open: vec![None; log.machine.wheels().len()],
            events: Vec::new(),
        }
    }

    fn take(&mut self, block: &Block<'a>) {
        if !self.is_sparse {
            return;
        }
        let rows = &block.rows;
        let is_static = rows.outcomes.column(Quantity::Static);
        let wheels = 0..self.open.len();
        let least: Vec<&[f64]> = wheels
            .map(|wheel| rows.outcomes.column(Quantity::OtfBetweenLeast(wheel)))
            .collect();
        for row in 0..rows.len() {
            let time_ns = rows.times_ns[row];
            let place = rows.first + row;
            let next_ns = self.table.times_ns.get(place + 1).copied();
            let lasts_s = next_ns.map_or(0.0, |next| next.saturating_sub(time_ns) as f64 * 1e-9);
            let is_judged = is_static[row] == 1.0 && rows.reasons[row].leave_loads();
            self.found.static_rows += u64::from(is_static[row] == 1.0);
            // an unknown band excludes nothing
            let opens: Vec<bool> = (least.iter().enumerate())
                .map(|(wheel, least)| {
                    let is_open = least[row].is_nan() || least[row] <= 0.0;
                    is_judged && is_open && self.is_on_ground(wheel, place)
                })
                .collect();
            if is_judged {
                // while the weight passes to other supports nothing is known
                match opens.contains(&true) || self.changes_supports(place) {
                    true => self.found.lift_not_excluded_s += lasts_s,
                    false => self.found.lift_excluded_s += lasts_s,
                }
            }
            for (wheel, is_open) in opens.into_iter().enumerate() {
                match is_open {
                    true => self.extend(wheel, time_ns, next_ns, least[wheel][row]),
                    false => self.events.extend(self.open[wheel].take()),
                }
            }
        }
    }
}

impl From<ExclusionPass<'_>> for (Vec<Event>, Option<Exclusion>) {
    fn from(mut pass: ExclusionPass<'_>) -> Self {
        pass.events.extend(pass.open.into_iter().flatten());
        (pass.events, pass.is_sparse.then_some(pass.found))
    }
}

impl ExclusionPass<'_> {
    /// Whether a wheel is one of the supports of a row; without a known set, none is.
    fn is_on_ground(&self, wheel: usize, row: usize) -> bool {
        let Some(supports) = self.table.supports() else {
            return true;
        };
        let on = supports.of_row(row).map(|set| set.machine.stands_on());
        on.is_some_and(|on| on.iter().any(|support| support.index() == wheel))
    }

    /// Whether the machine stands on other supports in the next row, or the supports of only one of both rows are known.
    fn changes_supports(&self, row: usize) -> bool {
        self.table.supports().is_some_and(|supports| {
            row + 1 < self.table.len()
                && supports.index_of_row(row) != supports.index_of_row(row + 1)
        })
    }

    fn extend(&mut self, wheel: usize, time_ns: i64, next_ns: Option<i64>, least_n: f64) {
        let name = self.machine.wheels()[wheel].name.to_lowercase();
        let event = self.open[wheel].get_or_insert_with(|| Event {
            unit: "N",
            ..Event::blank(EventKind::LiftNotExcluded, time_ns, name)
        });
        event.end_ns = next_ns;
        // a band that is not known is the worst
        let is_worse = event.worst.is_nan() && event.worst_ns == time_ns || least_n.is_nan();
        if is_worse || least_n < event.worst {
            (event.worst, event.worst_ns) = (least_n, time_ns);
        }
    }
}
