//! Detects events in the rows; [`EventKind`] defines them.

use nalgebra::Vector3;
use tipwatch_mechanics::estimation::plausibility::FaultSpan;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Quantity, Scope, State};

use super::episodes::{Episode, MERGED_NS, episodes, least, most};
use super::event::{Event, EventKind};
use super::evidence::Evidence;
use super::inputs;
use crate::base::rows::Rows;
use crate::load::LoadedLog;

/// Growth of the tilt (rad) that turns edge tipping into a tip-over.
const TIP_OVER_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Detects all events, sorted by start.
pub(crate) fn events(
    loaded: &LoadedLog,
    faults: &[FaultSpan],
    rows: &Rows,
    min_loads_n: Option<&[f64]>,
    scope: Scope,
) -> Vec<Event> {
    let finder = Finder::new(&loaded.machine, rows);
    let mut events = Vec::new();
    for wheel in 0..loaded.machine.wheels().len() {
        if let Some(min_loads_n) = min_loads_n {
            events.extend(finder.wheel_light(wheel, min_loads_n[wheel]));
        }
        events.extend(finder.wheel_lift(wheel));
    }
    for edge in 0..loaded.machine.polygon().edges().len() {
        for tipping in finder.edge_tipping(edge) {
            events.extend(finder.tip_over(&tipping));
            events.push(tipping);
        }
    }
    let evidence = Evidence::new(&loaded.machine, rows, scope);
    for event in &mut events {
        evidence.add(event, min_loads_n);
    }
    add_leads(&mut events);
    events.extend(inputs::gaps(loaded, rows));
    events.extend(inputs::faults(loaded, faults, rows));
    events.sort_by(|a, b| {
        a.start_ns
            .cmp(&b.start_ns)
            .then(a.kind.cmp(&b.kind))
            .then(a.subject.cmp(&b.subject))
    });
    events
}

struct Finder<'a> {
    machine: &'a Machine,
    rows: &'a Rows,
    /// Rows with meaningful loads: no gap, no warm-up, wheels on the ground.
    meaningful: Vec<bool>,
}

impl<'a> Finder<'a> {
    fn new(machine: &'a Machine, rows: &'a Rows) -> Self {
        Self {
            machine,
            rows,
            meaningful: rows
                .reasons
                .iter()
                .map(|reasons| reasons.leave_loads())
                .collect(),
        }
    }

    fn column(&self, quantity: Quantity) -> &[f64] {
        self.rows.outcomes.column(quantity)
    }

    fn episodes(&self, holds: impl Fn(usize) -> bool) -> Vec<Episode> {
        episodes(&self.rows.times_ns, |row| {
            self.meaningful[row] && holds(row)
        })
    }

    fn event(
        &self,
        kind: EventKind,
        subject: &str,
        episode: Episode,
        worst: (usize, f64),
        unit: &'static str,
    ) -> Event {
        let times = &self.rows.times_ns;
        Event {
            kind,
            start_ns: times[episode.first],
            end_ns: (episode.last + 1 < times.len()).then(|| times[episode.last]),
            subject: subject.to_lowercase(),
            worst: worst.1,
            worst_ns: times[worst.0],
            unit,
            lead_s: None,
            certainty: None,
            split_dependent: None,
            causes: None,
            fault: None,
        }
    }

    fn wheel_light(&self, wheel: usize, min_load_n: f64) -> Vec<Event> {
        let load = self.column(Quantity::Load(wheel));
        let largest = self.column(Quantity::LoadLargest(wheel));
        let name = &self.machine.wheels()[wheel].name;
        let found = self
            .episodes(|row| load[row] < min_load_n)
            .into_iter()
            .map(|episode| {
                let worst = least(load, episode);
                let mut event = self.event(EventKind::WheelLight, name, episode, worst, "N");
                event.split_dependent = Some(largest[worst.0] >= min_load_n);
                event
            });
        found.collect()
    }

    fn wheel_lift(&self, wheel: usize) -> Vec<Event> {
        let (load, otf) = (
            self.column(Quantity::Load(wheel)),
            self.column(Quantity::Otf(wheel)),
        );
        let largest = self.column(Quantity::LoadLargest(wheel));
        let weight = self.column(Quantity::NormalForce);
        let name = &self.machine.wheels()[wheel].name;
        let found = self
            .episodes(|row| load[row] <= 0.0)
            .into_iter()
            .map(|episode| {
                let worst = least(otf, episode);
                let mut event = self.event(EventKind::WheelLift, name, episode, worst, "N");
                event.split_dependent = Some(largest[worst.0] > 1e-6 * weight[worst.0]);
                event
            });
        found.collect()
    }

    /// Edge tipping: every wheel off the edge is unloaded. Their sum does not depend on the load split.
    fn edge_tipping(&self, edge: usize) -> Vec<Event> {
        let spec = &self.machine.polygon().edges()[edge];
        let unloaded: Vec<&[f64]> = (0..self.machine.wheels().len())
            .filter(|&wheel| !spec.carries[wheel])
            .map(|wheel| self.column(Quantity::Load(wheel)))
            .collect();
        let moment = self.column(Quantity::ItomFull(edge));
        let found = self
            .episodes(|row| unloaded.iter().all(|load| load[row] <= 0.0))
            .into_iter()
            .map(|episode| {
                let worst = most(moment, episode);
                let mut event =
                    self.event(EventKind::EdgeTipping, &spec.name, episode, worst, "N m");
                event.split_dependent = Some(false);
                event
            });
        found.collect()
    }

    /// The tip-over that an edge tipping turned into, if it did.
    fn tip_over(&self, tipping: &Event) -> Option<Event> {
        let row_of = |time: i64| self.rows.times_ns.partition_point(|&t| t < time);
        let first = row_of(tipping.start_ns);
        let last = tipping.end_ns.map_or(self.rows.len() - 1, row_of);
        let (worst_row, growth) = self.tilt_growth(first, last);
        if tipping.end_ns.is_some() && growth <= TIP_OVER_RAD {
            return None;
        }
        let worst_ns = self.rows.times_ns[worst_row];
        Some(Event {
            kind: EventKind::TipOver,
            worst: growth,
            worst_ns,
            unit: "rad",
            ..tipping.clone()
        })
    }

    /// The row with the largest tilt relative to `first`, and that tilt (rad): from the attitude if the
    /// log has it, else from the integrated angular velocity.
    fn tilt_growth(&self, first: usize, last: usize) -> (usize, f64) {
        let mut worst = (first, 0.0);
        let mut state = State::zero(self.machine);
        let mut turned = Vector3::zeros();
        let before = self.rows.up_in_base(self.machine, first);
        for row in first..=last {
            let growth = match (before, self.rows.up_in_base(self.machine, row)) {
                (Some(before), Some(now)) => before.cross(&now).norm().atan2(before.dot(&now)),
                _ => {
                    self.rows.states.get(row, &mut state);
                    let step_s = (self.rows.times_ns[row]
                        - self.rows.times_ns[row.max(first + 1) - 1])
                        as f64
                        * 1e-9;
                    turned += state.imu.angular_velocity * step_s;
                    turned.xy().norm()
                }
            };
            if growth > worst.1 {
                worst = (row, growth);
            }
        }
        worst
    }
}

/// Sets the lead of each event: time since the onset of the earliest `wheel_light` still active at its start.
fn add_leads(events: &mut [Event]) {
    let light: Vec<(i64, i64)> = events
        .iter()
        .filter(|event| event.kind == EventKind::WheelLight)
        .map(|event| (event.start_ns, event.end_ns.unwrap_or(i64::MAX)))
        .collect();
    for event in events
        .iter_mut()
        .filter(|event| event.kind != EventKind::WheelLight)
    {
        let going = light.iter().filter(|(start, end)| {
            *start <= event.start_ns && event.start_ns <= end.saturating_add(MERGED_NS)
        });
        event.lead_s = going
            .map(|(start, _)| (event.start_ns - start) as f64 * 1e-9)
            .reduce(f64::max);
    }
}
