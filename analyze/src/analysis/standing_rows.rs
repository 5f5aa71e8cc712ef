//! The machine as it stands in some rows of a log, so that what is asked of a machine on fixed supports can be asked of one whose
//! supports come and go: the times on each set of them are looked into by themselves, with the machine on that set. A support
//! that is set down or raised is in no such time, so that its load passes through zero unnoticed.

use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::Scope;
use tipwatch_mechanics::machine::Machine;

use crate::base::rows::Rows;
use crate::base::support_sets::SupportSet;
use crate::base::table::Table;

/// Default limit of a light wheel, as a share of its static load.
const DEFAULT_MIN_LOAD_SHARE: f64 = 0.05;

/// The load below which each wheel is light (N); `None` if it depends on unknown static loads.
pub(crate) fn min_loads(machine: &Machine) -> Option<Vec<f64>> {
    let (limits, static_load) = (machine.limits(), &machine.reference().static_load);
    if let Some(load) = limits.min_load {
        return Some(vec![load; static_load.len()]);
    }
    let share = limits.min_load_share.unwrap_or(DEFAULT_MIN_LOAD_SHARE);
    static_load
        .iter()
        .all(|load| load.is_finite())
        .then(|| static_load.iter().map(|load| load * share).collect())
}

/// The machine on one set of supports, and the rows in which it stands on them.
#[derive(Debug)]
pub(crate) struct StandingRows<'a> {
    /// The machine on its supports in these rows.
    pub(crate) machine: &'a Machine,
    /// Load below which each wheel is light (N); `None` if unknown.
    pub(crate) min_loads_n: Option<Vec<f64>>,
    /// The rows of the log.
    all: &'a Table,
    /// The set, and the rows on it; `None` for a machine that is always on the same supports.
    on_set: Option<(&'a SupportSet, Table)>,
}

impl<'a> StandingRows<'a> {
    /// The machine on each of its sets; of a machine that is always on the same supports, that one.
    pub(crate) fn all(
        machine: &'a Machine,
        table: &'a Table,
        min_loads_n: impl Fn(&Machine) -> Option<Vec<f64>>,
    ) -> Vec<Self> {
        let standing = |machine: &'a Machine, on_set| Self {
            machine,
            min_loads_n: min_loads_n(machine),
            all: table,
            on_set,
        };
        let Some(supports) = table.supports() else {
            return vec![standing(machine, None)];
        };
        let sets = supports.sets.iter().enumerate();
        let sets = sets.map(|(index, set)| {
            let rows = table.on_set(index, &set.machine);
            standing(&set.machine, Some((set, rows)))
        });
        sets.collect()
    }

    /// Returns the index of the set in which a row of the log is; `None` where the supports of the machine are not known.
    pub(crate) fn place_of(row: usize, table: &Table) -> Option<usize> {
        match table.supports() {
            Some(supports) => supports.index_of_row(row),
            None => Some(0),
        }
    }

    /// The parts of a block of the log, each with the place of that which stands in it, see [`place_of`](Self::place_of).
    pub(crate) fn parts_of(rows: &Rows, table: &Table) -> Vec<(Range<usize>, Option<usize>)> {
        match table.supports() {
            Some(supports) => {
                let spans = supports.spans_within(rows.first..rows.first + rows.len());
                spans.collect()
            }
            None => vec![(0..rows.len(), Some(0))],
        }
    }

    /// The rows of the log; those on other supports are unknown.
    pub(crate) fn rows(&self) -> &Table {
        self.on_set.as_ref().map_or(self.all, |(_, rows)| rows)
    }

    /// A part of a block of the log in which it stands, with the quantities of its machine.
    pub(crate) fn part(&self, rows: &Arc<Rows>, part: Range<usize>, scope: Scope) -> Arc<Rows> {
        match &self.on_set {
            Some((set, _)) => Arc::new(rows.on_set(set, scope, part)),
            None => Arc::clone(rows),
        }
    }

    /// The place of one of its wheels among those of the machine that names the results.
    pub(crate) fn named_wheel(&self, wheel: usize) -> usize {
        match self.on_set {
            Some(_) => self.machine.stands_on()[wheel].index(),
            None => wheel,
        }
    }
}
