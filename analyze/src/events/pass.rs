//! Finds the events while the rows are computed, block by block.
//!
//! Rows in which a wheel is light or an edge has little load are gathered into spells around which nothing happens.
//! A spell is looked into as soon as all tipping near it is known, while its rows are still at hand.

use std::collections::VecDeque;
use std::sync::Arc;

use tipwatch_mechanics::estimation::plausibility::FaultSpan;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{Quantity, Scope};

use super::causes::{Causes, SteadyRows};
use super::detect::{Finder, add_leads};
use super::episodes::Episode;
use super::event::Event;
use super::evidence::{CONSTANT_ERROR_NS, Evidence};
use super::inputs;
use super::pages::Pages;
use super::rotation::FoundRotation;
use super::tipping::{self, Tipping, is_small};
use super::unloaded::UnloadedSupports;
use crate::base::rows::Rows;
use crate::base::table::Table;
use crate::load::{LoadedLog, MeasuredLoads};

/// Time without anything between two spells (ns): longer than the gap between merged episodes.
const APART_NS: i64 = 1_000_000_000;
/// Time (ns) and rows before a spell that onsets and standard deviations are looked for in.
const BEFORE_NS: i64 = 2_500_000_000;
const ROWS_BEFORE: usize = 512;

/// Finds events block by block.
pub(crate) struct EventPass<'a> {
    machine: &'a Machine,
    scope: Scope,
    min_loads_n: Option<&'a [f64]>,
    /// Rotations about edges by gyro and attitude.
    rotations: &'a [FoundRotation],
    /// Distance of the farthest wheel from each edge (m).
    sizes_m: Vec<f64>,
    rows: Pages<'a>,
    steady: SteadyRows,
    /// The spell that may go on.
    open: Option<Episode>,
    /// Spells that are over.
    waiting: VecDeque<Episode>,
    /// Tipping in the waiting spells and shortly before.
    tippings: Vec<Tipping>,
    /// Supports without load, by their measured loads.
    unloaded: UnloadedSupports<'a>,
    events: Vec<Event>,
    lowest: Option<LowestOtf>,
}

/// The smallest OTF below its limit, compared with the static load, in the valid rows of all stability events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LowestOtf {
    /// Index of the wheel, of the machine on the supports of the row.
    pub(crate) wheel: usize,
    pub(crate) row: usize,
    pub(crate) otf_n: f64,
    pub(crate) limit_n: f64,
    share: f64,
}

impl LowestOtf {
    /// The lower one; of equal ones the first.
    pub(crate) fn lower(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(one), Some(other)) if other.share < one.share => Some(other),
            (one, other) => one.or(other),
        }
    }
}

impl<'a> EventPass<'a> {
    /// Prepares the pass, before the first block of a table.
    pub(crate) fn new(
        machine: &'a Machine,
        table: &'a Table,
        min_loads_n: Option<&'a [f64]>,
        scope: Scope,
        rotations: &'a [FoundRotation],
        measured: &'a MeasuredLoads,
    ) -> Self {
        let edges = 0..machine.polygon().edges().len();
        Self {
            machine,
            scope,
            min_loads_n,
            rotations,
            sizes_m: edges.map(|edge| tipping::size(machine, edge)).collect(),
            rows: Pages::new(machine, table),
            steady: SteadyRows::default(),
            open: None,
            waiting: VecDeque::new(),
            tippings: Vec::new(),
            unloaded: match table.is_supposed() {
                true => UnloadedSupports::of_supposed(measured),
                false => UnloadedSupports::of(machine, measured),
            },
            events: Vec::new(),
            lowest: None,
        }
    }

    /// Takes rows, with these reasons, in which the machine is on other supports.
    pub(crate) fn skip(&mut self, reasons: &[Reasons]) {
        self.rows.skip(reasons);
        self.unloaded.end();
        let Some(last) = self.rows.known().checked_sub(1) else {
            return;
        };
        self.close_before(last);
        self.look_into_spells(last);
    }

    /// Takes the next block.
    pub(crate) fn take(&mut self, rows: &Arc<Rows>) {
        self.rows.add(rows);
        self.unloaded.take(self.machine, rows);
        if self.scope.contributions {
            self.steady.add(self.machine, rows, self.min_loads_n);
        }
        for row in self.remarkable(rows) {
            self.close_before(row);
            match &mut self.open {
                Some(spell) => spell.last = row,
                None => {
                    self.open = Some(Episode {
                        first: row,
                        last: row,
                    });
                }
            }
        }
        let next = rows.first + rows.len();
        if next < self.rows.len() {
            self.close_before(next);
        }
        self.look_into_spells(next - 1);
        let spells = self.waiting.front().or(self.open.as_ref());
        let needed = spells.map_or(next, |spell| spell.first);
        let needed = self.well_before(needed);
        self.rows.forget_before(needed);
    }

    /// The row before which all events of the machine are known.
    pub(crate) fn settled(&self) -> usize {
        let spell = self.waiting.front().or(self.open.as_ref());
        let known = self.rows.known();
        // an onset may be earlier than the spell
        self.well_before(spell.map_or(known, |spell| spell.first))
    }

    /// A row before which nothing is looked for that concerns a spell from `row` on.
    fn well_before(&self, row: usize) -> usize {
        let times = self.rows.times_ns;
        let time_ns = times.get(row).or(times.last()).copied().unwrap_or(0);
        let by_time = self.rows.at(time_ns.saturating_sub(BEFORE_NS));
        by_time.min(row.saturating_sub(ROWS_BEFORE))
    }

    /// The events of the machine that are known.
    pub(crate) fn events(&self) -> &[Event] {
        &self.events
    }

    /// Ends the pass after the last block; returns the events of the machine, in no order, and the smallest OTF in them.
    pub(crate) fn finish(mut self) -> (Vec<Event>, Option<LowestOtf>) {
        self.close();
        while let Some(spell) = self.waiting.pop_front() {
            self.look_into(spell);
        }
        self.unloaded.join(&mut self.events);
        (self.events, self.lowest)
    }

    /// The rows of a block in which a wheel is light, an edge has little load, or the platform rotates about one.
    fn remarkable(&self, rows: &Rows) -> Vec<usize> {
        let wheels = 0..self.machine.wheels().len();
        let limit_n = |wheel: usize| {
            self.min_loads_n
                .map_or(0.0, |limits| limits[wheel].max(0.0))
        };
        let loads: Vec<(&[f64], f64)> = wheels
            .map(|wheel| (rows.outcomes.column(Quantity::Load(wheel)), limit_n(wheel)))
            .collect();
        let moment = |edge: usize| rows.outcomes.column(Quantity::ItomFull(edge));
        let edges = self.sizes_m.iter().enumerate();
        let edges: Vec<(&[f64], f64)> = edges.map(|(edge, &size)| (moment(edge), size)).collect();
        let weight = rows.outcomes.column(Quantity::NormalForce);
        let rotates = |row: usize| {
            let time_ns = rows.times_ns[row];
            let mut spans = self.rotations.iter().map(FoundRotation::span_ns);
            spans.any(|[from, to]| (from..=to).contains(&time_ns))
        };
        let is_remarkable = |&row: &usize| {
            let light = |(load, limit_n): &(&[f64], f64)| load[row] <= *limit_n;
            let small = |(moment, size): &(&[f64], f64)| is_small(moment[row], weight[row], *size);
            rows.reasons[row].leave_loads()
                && (loads.iter().any(light) || edges.iter().any(small) || rotates(row))
        };
        let found = (0..rows.len()).filter(is_remarkable);
        found.map(|row| rows.first + row).collect()
    }

    /// Closes the open spell if it is over before a row.
    fn close_before(&mut self, row: usize) {
        let times = self.rows.times_ns;
        let is_over = |spell: Episode| times[row].saturating_sub(times[spell.last]) > APART_NS;
        if self.open.is_some_and(is_over) {
            self.close();
        }
    }

    fn close(&mut self) {
        if let Some(spell) = self.open.take() {
            let found =
                tipping::within(self.machine, &self.rows, spell, self.scope, self.rotations);
            self.tippings.extend(found);
            self.waiting.push_back(spell);
        }
    }

    /// Looks into the spells after which all tipping within the time that matters is known. `row` is the last one known.
    fn look_into_spells(&mut self, row: usize) {
        let times = self.rows.times_ns;
        while let Some(&spell) = self.waiting.front() {
            let until_ns = times[spell.last].saturating_add(CONSTANT_ERROR_NS as i64);
            let unknown_from = self.open.map_or(row, |open| open.first);
            if times[unknown_from] <= until_ns {
                return;
            }
            self.waiting.pop_front();
            self.look_into(spell);
        }
    }

    fn look_into(&mut self, spell: Episode) {
        let times = self.rows.times_ns;
        let from_ns = times[spell.first].saturating_sub(CONSTANT_ERROR_NS as i64);
        self.tippings
            .retain(|tipping| times[tipping.episode.last] >= from_ns);
        let finder = Finder {
            machine: self.machine,
            rows: &self.rows,
            within: spell,
            min_loads_n: self.min_loads_n,
            tippings: &self.tippings,
            evidence: Evidence::new(self.machine, &self.rows, self.scope, &self.tippings),
            causes: (self.scope.contributions).then_some(Causes {
                rows: &self.rows,
                steady: &self.steady,
            }),
        };
        let events = finder.events();
        for event in &events {
            let first = self.rows.at(event.start_ns);
            let last = event
                .end_ns
                .map_or(self.rows.len() - 1, |end_ns| self.rows.at(end_ns));
            self.look_for_lowest(first..=last);
        }
        self.events.extend(events);
    }

    fn look_for_lowest(&mut self, rows: std::ops::RangeInclusive<usize>) {
        for wheel in 0..self.machine.wheels().len() {
            let limit_n = self.min_loads_n.map_or(0.0, |limits| limits[wheel]);
            let static_n = self.machine.reference().static_load[wheel];
            let scale = if static_n > 0.0 { static_n } else { 1.0 };
            for row in rows.clone().filter(|&row| self.rows.is_valid(row)) {
                let otf_n = self.rows.value(Quantity::Otf(wheel), row);
                let share = otf_n / scale;
                let is_lower = self.lowest.is_none_or(|lowest| share < lowest.share);
                if otf_n < limit_n && is_lower {
                    self.lowest = Some(LowestOtf {
                        wheel,
                        row,
                        otf_n,
                        limit_n,
                        share,
                    });
                }
            }
        }
    }
}

/// The events of the inputs: gaps and faults.
pub(crate) fn of_inputs(loaded: &LoadedLog, faults: &[FaultSpan], table: &Table) -> Vec<Event> {
    let mut events = inputs::gaps(loaded, table);
    events.extend(inputs::faults(loaded, faults, table));
    events
}

/// Takes the causes from what happened in a fall that was under way when the rows begin: what they show is the fall, not what led to it.
fn leave_unseen_open(events: &mut [Event]) {
    let all: &[Event] = events;
    let is_open = all.iter().map(|event| event.is_of_fall_under_way(all));
    let is_open: Vec<bool> = is_open.collect();
    for (event, _) in events
        .iter_mut()
        .zip(is_open)
        .filter(|(_, is_open)| *is_open)
    {
        event.causes = None;
    }
}

/// All events, sorted by start: those that the pass found and those of the inputs.
pub(crate) fn sorted(
    machine: &Machine,
    mut events: Vec<Event>,
    of_inputs: Vec<Event>,
) -> Vec<Event> {
    add_leads(&mut events);
    leave_unseen_open(&mut events);
    events.extend(of_inputs);
    inputs::add_doubts(&mut events, &|edge, wheel| machine.is_off(edge, wheel));
    events.sort_by(|a, b| {
        a.start_ns
            .cmp(&b.start_ns)
            .then(a.kind.cmp(&b.kind))
            .then(a.subject.cmp(&b.subject))
    });
    events
}
