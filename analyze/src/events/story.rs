//! Combines the evidence of the loads and of gyro and attitude for a tipping.
//!
//! A measured rotation decides whether the machine tipped, how far it rotated and how certain that is. The loads sharpen the
//! onset, where theirs fits that of the rotation.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use tipwatch_mechanics::machine::{LoadOnTool, Machine};
use tipwatch_mechanics::number::SURE_SIGMAS;
use tipwatch_mechanics::{Placement, Scope, State};

use super::event::{Bound, Event, EventKind, MeasuredRotation, ShownBy};
use super::pages::MOST_ROWS_BACK;
use super::rotation::{FIRST_S, FoundRotation};
use super::row_derivatives::RowDerivatives;
use super::tipping::{FALLEN_RAD, ROTATES_SIGMAS, factors_off};
use crate::base::table::Table;

/// Point of no return: the rotation at which gravity through the stated centre of mass passes over an edge.
#[derive(Clone, Copy)]
struct NoReturn {
    /// Rotation about the edge (rad).
    rotation_rad: f64,
    /// Its standard deviation, by those of the masses (rad); `None` without uncertainties.
    sigma_rad: Option<f64>,
}

/// Time before a rotation in which the loads may show its beginning (ns).
const BEFORE_NS: i64 = 1_500_000_000;
/// An onset by loads fits that of a rotation within so many standard deviations.
const FITS_SIGMAS: f64 = 3.0;

/// Tells the rotations of a log and the events by its loads as one.
pub(crate) struct Stories<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) table: &'a Table,
    pub(crate) scope: Scope,
    pub(crate) rotations: &'a [FoundRotation],
}

impl Stories<'_> {
    /// The row before which all events are known if those by loads are known before `row`.
    pub(crate) fn settled(&self, row: usize) -> usize {
        let times = &self.table.times_ns;
        let is_open = |rotation: &&FoundRotation| {
            let end = rotation
                .end_ns
                .map_or(usize::MAX, |end_ns| self.row_at(end_ns));
            end >= row.min(times.len() - 1)
        };
        let open = self.rotations.iter().filter(is_open);
        let begins = open.map(|it| self.row_at(it.start_ns.saturating_sub(BEFORE_NS)));
        begins.min().map_or(row, |begins| begins.min(row))
    }

    /// The rows in which the loads may date a rotation: from well before it until it is a fall, or over.
    pub(crate) fn rows_of(&self, rotation: &FoundRotation) -> Range<usize> {
        let [start_ns, end_ns] = rotation.span_ns();
        let until_ns = rotation.reached(FALLEN_RAD).unwrap_or(end_ns);
        let from = self.row_at(start_ns.saturating_sub(2 * BEFORE_NS));
        from..self.row_at(until_ns.saturating_add(BEFORE_NS))
    }

    /// Joins the events with those of rotations that begin before `row`.
    pub(crate) fn told(&self, mut events: Vec<Event>, row: usize) -> Vec<Event> {
        let is_known = |it: &&FoundRotation| self.row_at(it.start_ns) <= row;
        // apart: a machine that tumbles on rotates about the same edge again
        let (mut stories, mut fallen) = (Vec::new(), Vec::new());
        for rotation in self.rotations.iter().filter(is_known) {
            let (same, others): (Vec<Event>, Vec<Event>) =
                (events.into_iter()).partition(|event| is_same(event, rotation));
            events = others;
            let story = self.story(rotation, &same);
            self.lift_with(&story, &same, &mut events);
            if has_fallen(rotation, &story) {
                fallen.push(rotation);
            }
            stories.extend(story);
        }
        for rotation in fallen {
            self.leave_out(rotation, &mut events);
        }
        events.extend(stories);
        events
    }

    /// Leaves out what begins by computed loads after a rotation has turned the machine over. Of a wheel that may be off the edge,
    /// what is its first event stays: it left the ground then or earlier.
    fn leave_out(&self, rotation: &FoundRotation, events: &mut Vec<Event>) {
        let is_first = |event: &Event| {
            let mut earlier = events.iter().filter(|it| it.start_ns < event.start_ns);
            !earlier.any(|it| {
                let is_same = it.kind == event.kind && it.subject == event.subject;
                is_same && it.overlaps(rotation.span_ns())
            })
        };
        let stays = |event: &Event| {
            !is_of_fallen(event, rotation)
                || (self.may_lift_with(event, rotation) && is_first(event))
        };
        let stay: Vec<bool> = events.iter().map(stays).collect();
        let mut stay = stay.into_iter();
        events.retain(|_| stay.next().unwrap_or(true));
        let left = events.iter_mut().filter(|it| is_of_fallen(it, rotation));
        left.for_each(|event| event.start_bound = Bound::AtOrBefore);
    }

    /// Whether an event is that of a wheel that leaves the ground when the machine tips about the edge of a rotation, or may.
    fn may_lift_with(&self, event: &Event, rotation: &FoundRotation) -> bool {
        if !matches!(event.kind, EventKind::WheelLight | EventKind::WheelLift) {
            return false;
        }
        // on other supports, its edges are others
        if self.table.supports().is_some() {
            return true;
        }
        let edges = [Some(&rotation.edge), rotation.other_edge.as_ref()];
        let mut edges = edges.into_iter().flatten();
        edges.any(|edge| self.machine.is_off(edge, &event.subject))
    }

    /// No wheel off an edge leaves the ground after the machine has begun to tip about it: where gyro and attitude date that earlier
    /// than the loads, `by_loads`, the first lift of each wheel begins with it, and so does the time in which it is light.
    fn lift_with(&self, story: &[Event], by_loads: &[Event], events: &mut [Event]) {
        let began = |events: &[Event]| {
            let mut events = events.iter();
            events
                .find(|event| event.kind == EventKind::EdgeTipping)
                .cloned()
        };
        let Some(tipping) = began(story).filter(|it| it.is_fact() && it.other_edge().is_none())
        else {
            return;
        };
        // on other supports, its edges are others
        if self.table.supports().is_some() {
            return;
        }
        let by_loads_ns = began(by_loads).map(|event| event.start_ns);
        let names = (self.machine.wheels().iter()).map(|wheel| wheel.name.to_lowercase());
        let off = names.filter(|name| self.machine.is_off(&tipping.subject, name));
        let kinds = [EventKind::WheelLight, EventKind::WheelLift];
        for (name, kind) in off.flat_map(|name| kinds.map(|kind| (name.clone(), kind))) {
            let of_wheel = events.iter_mut().filter(|event| {
                event.kind == kind && event.subject == name && event.overlaps(tipping.span_ns())
            });
            let first = of_wheel.min_by_key(|event| event.start_ns);
            let Some(lift) = first.filter(|lift| lift.start_ns >= tipping.start_ns) else {
                continue;
            };
            // only the last wheel off the edge lifts when the machine begins to tip; it was light before
            let is_last = kind == EventKind::WheelLift
                && lift.start_bound == Bound::At
                && by_loads_ns == Some(lift.start_ns);
            lift.start_bound = match is_last {
                true => tipping.start_bound,
                false => Bound::AtOrBefore,
            };
            lift.start_ns = tipping.start_ns;
            lift.start_sigma_s = tipping.start_sigma_s;
            lift.is_under_way = tipping.is_under_way;
            lift.any_split_ns = None;
            lift.causes.clone_from(&tipping.causes);
        }
    }

    /// Whether an event began before the first row, or may have, by one standard deviation.
    fn may_precede_rows(&self, event: &Event) -> bool {
        let sigma_ns = (event.start_sigma_s.unwrap_or(0.0) * 1e9) as i64;
        let times = &self.table.times_ns;
        (times.first()).is_some_and(|first_ns| event.start_ns.saturating_sub(sigma_ns) < *first_ns)
    }

    fn row_at(&self, time_ns: i64) -> usize {
        let times = &self.table.times_ns;
        times.partition_point(|&at_ns| at_ns < time_ns)
    }

    /// The edge tipping of a rotation, and the tip-over that it turned into; `by_loads` are the events of the same.
    fn story(&self, rotation: &FoundRotation, by_loads: &[Event]) -> Vec<Event> {
        let tippings = by_loads
            .iter()
            .filter(|event| event.kind == EventKind::EdgeTipping);
        let first = tippings.clone().min_by_key(|event| event.start_ns);
        let blank = || Event {
            split_dependent: Some(false),
            unit: "N m",
            ..Event::blank(
                EventKind::EdgeTipping,
                rotation.start_ns,
                rotation.edge.clone(),
            )
        };
        let mut tipping = first.cloned().unwrap_or_else(blank);
        if let Some(worst) = tippings.max_by(|a, b| a.severity().total_cmp(&b.severity())) {
            (tipping.worst, tipping.worst_ns) = (worst.worst, worst.worst_ns);
        }
        let dates = |by_loads: &Event| {
            // a rotation that creeps at first is dated by the loads alone
            let alone = rotation.creeps && by_loads.shown_by != Some(ShownBy::Rotation);
            sharpens(by_loads, rotation) || (alone && by_loads.start_sigma_s.is_some())
        };
        if !first.is_some_and(dates) {
            tipping.start_ns = rotation.start_ns;
            tipping.start_sigma_s = rotation.start_sigma_s;
            tipping.is_under_way = false;
            tipping.start_bound = match rotation.start_sigma_s {
                Some(_) => Bound::At,
                None => Bound::AtOrBefore,
            };
        }
        let by_loads_ns = tipping.end_ns;
        tipping.end_ns = match (rotation.end_ns, first.map(|event| event.end_ns)) {
            (Some(end_ns), Some(Some(by_loads_ns))) => Some(end_ns.max(by_loads_ns)),
            (Some(end_ns), None) => Some(end_ns),
            (None, _) | (_, Some(None)) => None,
        };
        if tipping.end_ns != by_loads_ns {
            tipping.end_sigma_s = None;
        }
        // what began before the log is counted from where the platform stands on its wheels, not from where the log begins
        let is_dated = rotation.start_sigma_s.is_some() || tipping.start_sigma_s.is_some();
        tipping.is_under_way |= !is_dated || self.may_precede_rows(&tipping);
        if tipping.is_under_way {
            tipping.start_bound = Bound::AtOrBefore;
        }
        let at_start_rad = rotation.angle_at(tipping.start_ns);
        let since_rad = if is_dated { at_start_rad } else { 0.0 };
        let (largest_rad, largest_ns) = rotation.largest();
        let largest_rad = largest_rad - since_rad;
        tipping.rotation_rad = Some(largest_rad);
        let is_by_loads = first.is_some_and(|event| event.shown_by != Some(ShownBy::Rotation));
        let by_rotation = rotation.certainty(is_by_loads);
        // a doubt of the loads is none of what gyro and attitude show for more certain
        let by_loads = tipping.certainty;
        if by_loads.is_none_or(|by_loads| by_rotation >= by_loads) {
            (tipping.certainty, tipping.doubt) = (Some(by_rotation), None);
        }
        tipping.certainty_any_split = tipping.certainty;
        tipping.shown_by = Some(match is_by_loads {
            true => ShownBy::Both,
            false => ShownBy::Rotation,
        });
        let reached = |angle: f64| rotation.reached(angle + since_rad);
        // the point of no return is that of the posture at the start
        let passed = |angle: f64| rotation.reached(angle + at_start_rad);
        let no_return = self.no_return(self.machine, rotation, tipping.start_ns);
        tipping.measured_rotation = Some(MeasuredRotation {
            other_edge: rotation.other_edge.clone(),
            onset_in_log: !tipping.is_under_way,
            ten_degrees_ns: reached(super::TIP_OVER_RAD),
            at_rest_ns: rotation.spell.at_rest_ns,
            rested_ns: rotation.spell.rested_ns.filter(|_| !is_by_loads),
            ..MeasuredRotation::blank(rotation.witness(), rotation.spell.sigma)
        });
        // without an onset, nothing is known of the posture in which it began
        set_no_return(&mut tipping, rotation, no_return.filter(|_| is_dated));
        // beyond 10 degrees, or for certain beyond the point of no return, and never back
        let is_past = no_return.is_some_and(|no_return| {
            let surely_rad =
                no_return.rotation_rad + SURE_SIGMAS * no_return.sigma_rad.unwrap_or(0.0);
            rotation.end_ns.is_none()
                && largest_rad > ROTATES_SIGMAS * rotation.spell.sigma
                && passed(surely_rad).is_some()
        });
        // how steep the ground is on which it stood before the log began is not known
        let by_ground_rad = match is_dated || !rotation.spell.is_from_start {
            true => 0.0,
            false => FITS_SIGMAS * rotation.spell.sigma,
        };
        let seen_rad = largest_rad + since_rad - at_start_rad;
        let is_far =
            seen_rad >= super::TIP_OVER_RAD || largest_rad >= super::TIP_OVER_RAD + by_ground_rad;
        // nothing shows that it had not begun in rows that begin just before it
        if tipping.is_under_way
            && let Some(first_ns) = self.table.times_ns.first()
            && tipping.start_ns.saturating_sub(*first_ns) <= (FIRST_S * 1e9) as i64
        {
            tipping.start_ns = tipping.start_ns.min(*first_ns);
        }
        let over = (is_far || is_past).then(|| Event {
            kind: EventKind::TipOver,
            worst: largest_rad,
            worst_ns: largest_ns,
            unit: "rad",
            ..tipping.clone()
        });
        over.into_iter().chain([tipping]).collect()
    }

    /// Takes the point of no return from a rotation that neither the stated machine nor a load explains.
    pub(crate) fn without_no_return(event: &mut Event) {
        if let Some(measured) = &mut event.measured_rotation {
            (measured.no_return_rad, measured.no_return_sigma_rad) = (None, None);
            (measured.no_return_ns, measured.no_return_time_sigma_s) = (None, None);
        }
    }

    /// Replaces the point of no return of an event by that of the machine with more mass on its tool than stated (kg; its
    /// standard deviation).
    pub(crate) fn with_load(
        &self,
        event: &mut Event,
        load: LoadOnTool,
        mass_kg: f64,
        sigma_kg: f64,
    ) {
        let rotation = self.rotations.iter().find(|it| is_same(event, it));
        let no_return = rotation.and_then(|rotation| {
            let of = |mass_kg: f64| {
                let machine = self.machine.with_load(load.body, load.place, mass_kg);
                self.no_return(&machine, rotation, event.start_ns)
            };
            let (own, heavier) = (of(mass_kg)?, of(mass_kg + sigma_kg)?);
            let by_load_rad = heavier.rotation_rad - own.rotation_rad;
            Some(NoReturn {
                sigma_rad: own.sigma_rad.map(|sigma_rad| sigma_rad.hypot(by_load_rad)),
                ..own
            })
        });
        match rotation.zip(no_return) {
            Some((rotation, no_return)) => {
                set_no_return(event, rotation, Some(no_return));
                if let Some(measured) = &mut event.measured_rotation {
                    measured.no_return_load_kg = Some(mass_kg);
                }
            }
            None => Self::without_no_return(event),
        }
    }

    /// Computes the point of no return, where gravity through the centre of mass of a machine, the stated one or one with a load,
    /// passes over the edge, in the posture of the last known row up to the start. With q from the edge to the centre of mass and
    /// the up direction u, both across the edge,
    /// ```text
    ///     rotation = atan2(a . (q x u), q . u),      sigma = reach sigma(load off the edge) / (W |q|)
    /// ```
    fn no_return(
        &self,
        machine: &Machine,
        rotation: &FoundRotation,
        start_ns: i64,
    ) -> Option<NoReturn> {
        if self.table.supports().is_some() || rotation.other_edge.is_some() {
            return None;
        }
        let edge = machine.edge_named(&rotation.edge)?;
        let until = self
            .row_at(start_ns.saturating_add(1))
            .min(self.table.len());
        let mut placement = Placement::new(machine);
        let mut state = State::zero(machine);
        let loads = machine.payloads().len();
        let read = |row: usize, state: &mut State<f64>| {
            // the table knows the payloads of the stated machine alone; a load is there all the time
            state.payload_share.truncate(self.machine.payloads().len());
            self.table.state(row, state);
            state.payload_share.resize(loads, 1.0);
        };
        let is_placed = |row: &usize| {
            read(*row, &mut state);
            placement.place(&state);
            placement.centre_of_mass.iter().all(|c| c.is_finite())
        };
        let row = (0..until).rev().take(MOST_ROWS_BACK).find(is_placed)?;
        read(row, &mut state);
        let [from, to] = placement.tipping_line(edge).through;
        let axis = (to - from).try_normalize(1e-9)?;
        let across = |vector: nalgebra::Vector3<f64>| vector - axis * axis.dot(&vector);
        let centre = across(placement.centre_of_mass - from);
        let up = across(state.base.known_up().unwrap_or(placement.normal));
        let rotation_rad = axis.dot(&centre.cross(&up)).atan2(centre.dot(&up));
        // Derivatives are unknown while the machine tips, so they are taken where it does not yet.
        let mut derivatives = RowDerivatives::new(machine);
        let mut sigma_at = |row: usize| {
            let (factors, reach) = factors_off(machine, &placement, edge)?;
            let read_row = |state: &mut State<f64>| read(row, state);
            let sigma_n = derivatives.sigma(machine, row, &factors, read_row)?;
            let weight = machine.mass() * machine.gravity();
            Some(reach * sigma_n / (weight * centre.norm())).filter(|sigma| sigma.is_finite())
        };
        let sigma = || (0..=row).rev().take(MOST_ROWS_BACK).find_map(&mut sigma_at);
        Some(NoReturn {
            rotation_rad,
            sigma_rad: (self.scope.sensitivities).then(sigma).flatten(),
        })
        // of a posture that is not known, or that no machine has
        .filter(|it| it.rotation_rad.abs() < FRAC_PI_2 && it.sigma_rad.unwrap_or(0.0) < FRAC_PI_2)
    }
}

/// Sets the point of no return of an event, and when its platform passed it: where its rotation reached it, not before the
/// event began. How certain that time is follows from when it was within one standard deviation of it.
fn set_no_return(event: &mut Event, rotation: &FoundRotation, no_return: Option<NoReturn>) {
    let (start_ns, start_sigma_s) = (event.start_ns, event.start_sigma_s);
    let (Some(measured), Some(no_return)) = (&mut event.measured_rotation, no_return) else {
        return;
    };
    let at_start_rad = rotation.angle_at(start_ns);
    let passed = |rotation_rad: f64| {
        let at_ns = rotation.reached(rotation_rad + at_start_rad);
        at_ns.map(|at_ns| at_ns.max(start_ns))
    };
    measured.no_return_rad = Some(no_return.rotation_rad);
    measured.no_return_sigma_rad = no_return.sigma_rad;
    measured.no_return_load_kg = None;
    measured.no_return_ns = passed(no_return.rotation_rad);
    measured.no_return_time_sigma_s = no_return.sigma_rad.and_then(|sigma_rad| {
        let sigma_rad = sigma_rad.hypot(measured.sigma_rad);
        let [first_ns, last_ns] =
            [-sigma_rad, sigma_rad].map(|off_rad| passed(no_return.rotation_rad + off_rad));
        let half_s = 0.5 * last_ns?.saturating_sub(first_ns?) as f64 * 1e-9;
        measured.no_return_ns?;
        Some(half_s.hypot(start_sigma_s.unwrap_or(0.0)))
    });
}

fn is_tipping(event: &Event) -> bool {
    matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver)
}

/// Whether an event by the loads is the tipping that a rotation shows: one that went on into it, or began and ended shortly before.
/// Where a rotation creeps at first, the loads may show its beginning long before.
fn is_same(event: &Event, rotation: &FoundRotation) -> bool {
    let until_ns = rotation.end_ns.unwrap_or(i64::MAX);
    let from_ns = rotation.start_ns.saturating_sub(BEFORE_NS);
    let band_ns = (2e9 * rotation.start_sigma_s.unwrap_or(0.0)) as i64;
    let ends_after = |time_ns: i64| event.end_ns.is_none_or(|end_ns| end_ns >= time_ns);
    let goes_on = ends_after(rotation.start_ns.saturating_sub(band_ns));
    let is_near = ends_after(from_ns) && (rotation.creeps || event.start_ns >= from_ns);
    is_tipping(event)
        && event.subject == rotation.edge
        && event.start_ns <= until_ns
        && (goes_on || is_near)
}

/// Whether a rotation turned the machine over for good: one that comes back stands on its wheels again.
fn has_fallen(rotation: &FoundRotation, story: &[Event]) -> bool {
    let is_over = |event: &Event| event.kind == EventKind::TipOver && event.is_fact();
    rotation.end_ns.is_none() && story.iter().any(is_over)
}

/// Whether an event begins by computed loads alone while a rotation has turned the platform over: these loads are those of a machine
/// on its wheels.
fn is_of_fallen(event: &Event, rotation: &FoundRotation) -> bool {
    let [from_ns, until_ns] = rotation.span_ns();
    event.measured_load_n.is_none()
        && (from_ns..=until_ns).contains(&event.start_ns)
        && rotation.angle_at(event.start_ns) >= super::TIP_OVER_RAD
}

/// Whether the onset by the loads is that of the rotation, and is the more certain or the only one. One that is later and less certain
/// is it, too, where its band reaches back to that of the rotation: wheels off the edge carry load until then, and what gyro and
/// attitude take for the beginning may be a platform that rocks.
fn sharpens(by_loads: &Event, rotation: &FoundRotation) -> bool {
    match (by_loads.start_sigma_s, rotation.start_sigma_s) {
        (None, _) => false,
        (Some(_), None) => by_loads.start_ns <= rotation.start_ns,
        (Some(by_loads_s), Some(by_rotation_s)) => {
            let later_s = by_loads.start_ns.saturating_sub(rotation.start_ns) as f64 * 1e-9;
            let fits = later_s.abs() <= FITS_SIGMAS * by_loads_s.hypot(by_rotation_s);
            let leaves_open = later_s > by_rotation_s && later_s <= by_loads_s;
            fits && (by_loads_s <= by_rotation_s || leaves_open)
        }
    }
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::estimation::rotation::{RotationSpell, RotationWitness};

    use super::*;

    const SECOND_NS: i64 = 1_000_000_000;

    /// A rotation about the right edge from 5 s on, by 10 degrees a second.
    fn rotation(creeps: bool) -> FoundRotation {
        let spell = RotationSpell {
            edge: 0,
            other_edge: None,
            left_ns: 5 * SECOND_NS,
            certain_ns: 6 * SECOND_NS,
            angle: 0.5,
            rate: 0.1,
            largest: 0.5,
            largest_ns: 9 * SECOND_NS,
            sigma: 0.02,
            by_ground: 0.0,
            witness: RotationWitness::GyroAlone,
            certainty: 0.9999,
            at_rest_ns: None,
            rested_ns: None,
            is_from_start: false,
            last_ns: 9 * SECOND_NS,
        };
        let angles = (0..5).map(|s: i32| ((5 + i64::from(s)) * SECOND_NS, f64::from(s)));
        FoundRotation {
            edge: "right".into(),
            other_edge: None,
            spell,
            start_ns: 5 * SECOND_NS,
            start_sigma_s: Some(0.05),
            end_ns: None,
            creeps,
            angles: angles
                .map(|(at_ns, steps)| (at_ns, steps * crate::events::TIP_OVER_RAD))
                .collect(),
            on_tyres_rad: 0.05,
        }
    }

    fn by_loads(kind: EventKind, subject: &str, span_s: [f64; 2]) -> Event {
        let [start_ns, end_ns] = span_s.map(|at_s| (at_s * 1e9) as i64);
        Event {
            end_ns: Some(end_ns),
            ..Event::blank(kind, start_ns, subject.into())
        }
    }

    #[test]
    fn a_tipping_by_loads_that_was_over_before_a_fall_is_none_of_it() {
        let is_of_fall = |creeps: bool, span_s| {
            let tipping = by_loads(EventKind::EdgeTipping, "right", span_s);
            is_same(&tipping, &rotation(creeps))
        };
        assert!(!is_of_fall(false, [0.3, 4.5]));
        // it went on into the fall, or began shortly before
        assert!(is_of_fall(false, [0.3, 4.95]) && is_of_fall(false, [0.3, 7.0]));
        assert!(is_of_fall(false, [3.9, 4.5]));
        // one that creeps at first began when the loads show it
        assert!(is_of_fall(true, [0.3, 4.5]) && !is_of_fall(true, [0.3, 3.0]));
    }

    #[test]
    fn loads_that_are_carried_after_a_rotation_seemed_to_begin_date_it() {
        let dates = |start_s: f64, sigma_s: f64| {
            let tipping = Event {
                start_sigma_s: Some(sigma_s),
                ..by_loads(EventKind::EdgeTipping, "right", [start_s, 9.0])
            };
            sharpens(&tipping, &rotation(false))
        };
        assert!(dates(5.05, 0.04) && !dates(5.5, 0.04));
        // by the rotation it began at 5.00 s, by 0.05 s
        assert!(dates(5.3, 0.35));
        assert!(!dates(4.7, 0.35) && !dates(5.04, 0.35) && !dates(5.3, 0.2));
    }

    #[test]
    fn computed_loads_of_a_machine_that_has_fallen_begin_nothing() {
        let rotation = rotation(false);
        let lift_from = |start_s| by_loads(EventKind::WheelLift, "fl", [start_s, 9.0]);
        let is_left_out = |event: &Event| is_of_fallen(event, &rotation);
        assert!(is_left_out(&lift_from(6.5)) && is_left_out(&lift_from(8.0)));
        assert!(!is_left_out(&lift_from(4.0)) && !is_left_out(&lift_from(5.5)));
        // a load cell shows its own support, however the machine lies
        let measured = Event {
            measured_load_n: Some(0.0),
            ..lift_from(6.5)
        };
        assert!(!is_left_out(&measured));
    }

    #[test]
    fn a_machine_that_comes_back_or_does_not_tip_over_has_not_fallen() {
        let story = |kind| [by_loads(kind, "right", [5.0, 9.0])];
        let over = story(EventKind::TipOver);
        assert!(has_fallen(&rotation(false), &over));
        let back = FoundRotation {
            end_ns: Some(9 * SECOND_NS),
            ..rotation(false)
        };
        assert!(!has_fallen(&back, &over));
        assert!(!has_fallen(
            &rotation(false),
            &story(EventKind::EdgeTipping)
        ));
        let unlikely = over.map(|event| Event {
            certainty: Some(0.3),
            ..event
        });
        assert!(!has_fallen(&rotation(false), &unlikely));
    }
}
