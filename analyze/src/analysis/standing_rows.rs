//! The machine as it stands in some rows of a log, so that what is asked of a machine on fixed supports can be asked of one whose
//! supports come and go.

use tipwatch_mechanics::machine::Machine;

use crate::base::table::Table;
use crate::events::OnSet;

/// The machine on one set of supports, and the rows in which it stands on them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StandingRows<'a> {
    /// The machine on them.
    pub(crate) machine: &'a Machine,
    /// The rows of the log; those on other supports are unknown.
    pub(crate) rows: &'a Table,
    /// Load below which each wheel is light (N); `None` if unknown.
    pub(crate) min_loads_n: Option<&'a [f64]>,
    /// Index of the set; `None` for a machine that is always on the same supports.
    set: Option<usize>,
}

impl<'a> StandingRows<'a> {
    /// The machine on each of its sets; of a machine that is always on the same supports, that one.
    pub(crate) fn all(
        machine: &'a Machine,
        rows: &'a Table,
        min_loads_n: Option<&'a [f64]>,
        sets: &'a [OnSet<'a>],
    ) -> Vec<Self> {
        if rows.supports().is_none() {
            return vec![Self {
                machine,
                rows,
                min_loads_n,
                set: None,
            }];
        }
        let sets = sets.iter().map(|on| Self {
            machine: &on.set.machine,
            rows: &on.table,
            min_loads_n: on.min_loads_n.as_deref(),
            set: Some(on.index),
        });
        sets.collect()
    }

    /// The place of that of a row; `None` where it is not known on what the machine stands.
    pub(crate) fn place_of(all: &[Self], row: usize, rows: &Table) -> Option<usize> {
        let set = match rows.supports() {
            Some(supports) => Some(supports.index_of_row(row)?),
            None => None,
        };
        all.iter().position(|standing| standing.set == set)
    }

    /// The place of one of its wheels among those of the machine that names the results.
    pub(crate) fn named_wheel(&self, wheel: usize) -> usize {
        match self.set {
            Some(_) => self.machine.stands_on()[wheel].index(),
            None => wheel,
        }
    }
}
