//! Finds the worst event, tries every candidate, and states the assumptions.

use std::collections::BTreeMap;

use rayon::prelude::*;
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::{SURE_SIGMAS, normal_distribution};
use tipwatch_mechanics::{ForcesByRule, Parameter};

use super::super::sensitivity::SensitivityTable;
use super::super::standing_rows::StandingRows;
use super::candidates::{Candidate, candidates};
use super::change::Change;
use super::counterfactual::sigma_by;
use super::result::{Advice, BeforeAfter, RejectedChange, SimulatedChange, WheelMargins};
use super::simulate::{Margins, as_logged};
use super::solve::{Bounds, Solution, solve};
use super::window::{FARTHEST_REST_NS, LONGEST_TIPPING_NS, MARGIN_NS, Window, event_around};
use crate::base::number::{known, percent, short};
use crate::base::table::Table;
use crate::events::{Event, EventKind, LowestOtf, ShownBy};

/// Share of an event's rows whose state may be unknown.
const MOST_LEFT_OUT: f64 = 0.1;
/// Most rows of an event that is simulated: half an hour at 100 Hz.
const MOST_ROWS: usize = 180_000;

/// Returns the changes that would have prevented the worst event, in which `worst` is the smallest OTF (overturning force) below
/// its limit; `None` if no row of the event can be simulated.
pub(crate) fn advise(
    standing: &StandingRows<'_>,
    events: &[Event],
    worst: &LowestOtf,
    sensitivity: &SensitivityTable,
    positions: &[[f64; 2]],
) -> Option<Advice> {
    let (machine, rows) = (standing.machine, standing.rows());
    let limits = standing.min_loads_n.as_ref();
    let limit = |wheel: usize| limits.map_or(0.0, |limits| limits[wheel]);
    let event = event_around(events, rows, worst.row)?;
    if goes_on_unseen(events, event) {
        return None;
    }
    let event = on_its_wheels(events, rows, event);
    let too_long = too_long(rows, event);
    let window = match too_long {
        None => event,
        // nothing is simulated
        Some(_) => [rows.times_ns[worst.row]; 2],
    };
    let window = Window::around(machine, rows, window);
    let mut advice = Advice {
        wheel: machine.wheels()[worst.wheel].name.to_lowercase(),
        limit_n: worst.limit_n,
        worst_otf_n: worst.otf_n,
        worst_ns: rows.times_ns[worst.row],
        event_start_ns: event[0],
        event_end_ns: event[1],
        from_ns: rows.times_ns[*window.rows.first()?],
        to_ns: rows.times_ns[*window.rows.last()?],
        rows: window.rows.len(),
        rows_left_out: window.left_out,
        rows_held: window.held.iter().filter(|held| **held).count(),
        changes: Vec::new(),
        rejected: Vec::new(),
        assumptions: assumptions(&window),
        not_simulated: too_long.or_else(|| not_simulated(rows, &window, event)),
    };
    if advice.not_simulated.is_some() {
        return Some(advice);
    }
    let logged = as_logged(&window);
    let bounds = bounds(machine, &logged, &limit);
    let sigmas = sigmas(&window, None, &logged);
    let sure = bounds.with_margin(|wheel| SURE_SIGMAS * sigmas[wheel].unwrap_or(0.0));
    let first_order = |parameter: Parameter| {
        let mut table = sensitivity.rows.iter();
        let wheel = standing.named_wheel(worst.wheel);
        let row = table.find(|row| row.wheel == wheel && row.parameter == parameter)?;
        // change = (limit - OTF) / (dOTF/dparameter), at the worst row of the log
        known((worst.limit_n - row.worst_otf_n) / row.derivative)
    };
    let candidates = candidates(machine, positions, &window, first_order);
    let tried: Vec<_> = candidates
        .par_iter()
        .map(|candidate| {
            let aimed = solve(&window, &sure, &logged, candidate);
            aimed.or_else(|_| solve(&window, &bounds, &logged, candidate))
        })
        .collect();
    for (candidate, tried) in candidates.iter().zip(tried) {
        match tried {
            Ok(solution) => advice.changes.push(
                ChangeContext {
                    machine,
                    rows,
                    window: &window,
                    bounds: &bounds,
                    logged: &logged,
                    worst,
                }
                .change(candidate, solution),
            ),
            Err(reason) => advice.rejected.push(RejectedChange {
                name: directed_name(machine, candidate),
                reason,
            }),
        }
    }
    (advice.changes).sort_by(|a, b| a.effort.total_cmp(&b.effort));
    Some(advice)
}

/// Whether an event of this time (ns) goes on in a fall that the loads of the machine as stated do not show: what would have kept that
/// machine on its wheels is no advice for the one that fell.
fn goes_on_unseen(events: &[Event], span_ns: [i64; 2]) -> bool {
    let is_unseen = |event: &Event| event.shown_by == Some(ShownBy::Rotation) && event.is_fact();
    let mut events = events.iter();
    events.any(|event| is_unseen(event) && event.overlaps(span_ns))
}

/// Limits an event in which the machine tips over to the time in which its wheels carry it: the rest is the fall, which no change
/// of a machine on its side could prevent.
fn on_its_wheels(events: &[Event], rows: &Table, event: [i64; 2]) -> [i64; 2] {
    let tips_over = events.iter().any(|other| {
        other.kind == EventKind::TipOver && (event[0]..=event[1]).contains(&other.start_ns)
    });
    let (first, last) = (rows.at(event[0]), rows.at(event[1]));
    let carried = (first..=last).rev();
    let carried = carried
        .into_iter()
        .find(|&row| rows.reasons[row].leave_loads());
    match carried.filter(|_| tips_over) {
        Some(row) => [event[0], rows.times_ns[row]],
        None => event,
    }
}

/// Returns the reason not to simulate an event whose states would not fit into memory, or would take long for many candidates;
/// `None` if the event is short enough.
fn too_long(rows: &Table, event: [i64; 2]) -> Option<String> {
    let of_event = rows.at(event[1]) - rows.at(event[0]) + 1;
    (of_event > MOST_ROWS).then(|| {
        say!("The event has {of_event} rows, of which at most {MOST_ROWS} are simulated: analyse a part of it (--from, --to)")
    })
}

fn not_simulated(rows: &Table, window: &Window, event: [i64; 2]) -> Option<String> {
    let of_event = rows.at(event[1]) - rows.at(event[0]) + 1;
    let share = window.left_out_of_event as f64 / of_event as f64;
    (share > MOST_LEFT_OUT).then(|| {
        say!(
            "The state of the machine is unknown in {} of the event's rows",
            percent(share)
        )
    })
}

/// Every wheel must stay at its limit over the whole window. The smallest load under any split must reach the limit too,
/// or be no less than as logged for a wheel that was not below its limit.
fn bounds(machine: &Machine, logged: &Margins, limit: &dyn Fn(usize) -> f64) -> Bounds {
    let wheels = 0..machine.wheels().len();
    let is_target = |wheel: &usize| logged.otf[*wheel].0 < limit(*wheel);
    let targets: Vec<usize> = wheels.clone().filter(is_target).collect();
    let any_split = wheels.clone().map(|wheel| match targets.contains(&wheel) {
        true => limit(wheel),
        false => limit(wheel).min(logged.any_split[wheel]),
    });
    Bounds {
        otf: wheels.map(limit).collect(),
        any_split: any_split.collect(),
        zmp: logged.zmp.0,
        moment: logged.moment.0,
        weight: machine.mass() * machine.gravity(),
        targets,
    }
}

fn assumptions(window: &Window) -> Vec<String> {
    let seconds = |ns: i64| short(ns as f64 * 1e-9);
    let mut all = vec![
        say!(
            "A change applies to the whole window: the event, {} s before and after it, and on to where every joint \
             rests, at most {} s away",
            seconds(MARGIN_NS),
            seconds(FARTHEST_REST_NS)
        ),
        word!("Everything else stays as logged: the ground, the measured motion of the base including its rocking, all other \
         joints, and the force on the tool; nobody reacts to the change")
            .into(),
        word!("A position is offset by a constant, so velocities and accelerations stay; a slower motion follows the same path \
         with velocities times s and accelerations times s²")
            .into(),
        word!("Collisions, hydraulic limits and the work to be done are not considered").into(),
        word!("Amounts bring the computed load above its limit by two standard deviations σ; where that is out of reach or σ is not \
         known, to its limit: then keeping it is about as likely as not")
            .into(),
    ];
    if window.held.iter().any(|held| *held) {
        all.push(say!(
            "While the machine was tipping the base keeps its motion from just before, because the measured one is that \
             of the fall; the joints move as logged for at most {} s",
            seconds(LONGEST_TIPPING_NS)
        ));
    }
    if window.may_measure_split() {
        all.push(
            word!(
                "The part of the load split that measured actuator forces determine stays as logged"
            )
            .into(),
        );
    }
    all
}

/// Returns the name of the changed quantity, with the direction of an offset.
fn directed_name(machine: &Machine, candidate: &Candidate) -> String {
    let name = candidate.change.name(machine);
    match candidate.change {
        Change::JointOffset(_) if candidate.bound < 0.0 => format!("{name} (lower)"),
        Change::JointOffset(_) => format!("{name} (higher)"),
        _ => name,
    }
}

/// Standard deviation of the smallest OTF of each wheel (N), in the states after a change by an amount.
fn sigmas(window: &Window, change: Option<(Change, f64)>, found: &Margins) -> Vec<Option<f64>> {
    let logged = window.machine();
    let changed = change.and_then(|(change, amount)| change.changed_machine(amount, logged));
    let machine = changed.as_ref().unwrap_or(logged);
    let wheels = 0..found.otf.len();
    let of_wheel = |wheel: usize| {
        let own: Vec<f64> = wheels
            .clone()
            .map(|other| f64::from(other == wheel))
            .collect();
        let place = found.otf[wheel].1;
        let mut forces = ForcesByRule::new(machine);
        let as_changed = sigma_by(machine, place, &own, |place, state| {
            window.states.get(place, state);
            if let Some((change, amount)) = change {
                forces.change([logged, machine], state, |state| {
                    change.apply(amount, window.entry_speed, state);
                });
            }
        });
        // a machine that would have tipped from the first row on has no derivatives: as logged it had
        as_changed.or_else(|| {
            sigma_by(logged, place, &own, |place, state| {
                window.states.get(place, state);
            })
        })
    };
    wheels.clone().map(of_wheel).collect()
}

/// Context for the description of a change.
struct ChangeContext<'a> {
    machine: &'a Machine,
    rows: &'a Table,
    window: &'a Window,
    bounds: &'a Bounds,
    logged: &'a Margins,
    worst: &'a LowestOtf,
}

impl ChangeContext<'_> {
    fn change(&self, candidate: &Candidate, solution: Solution) -> SimulatedChange {
        let (machine, logged, found) = (self.machine, self.logged, &solution.margins);
        let (least_otf_n, place) = found.otf[self.worst.wheel];
        let row = self.window.rows[place];
        let sigmas = sigmas(
            self.window,
            Some((candidate.change, solution.amount)),
            found,
        );
        let sign = candidate.change.sign();
        let of_wheel = |(wheel, spec): (usize, &tipwatch_mechanics::machine::Wheel)| {
            let margins = WheelMargins {
                limit_n: self.bounds.otf[wheel],
                otf_n: BeforeAfter {
                    before: logged.otf[wheel].0,
                    after: found.otf[wheel].0,
                },
                any_split_n: BeforeAfter {
                    before: logged.any_split[wheel],
                    after: found.any_split[wheel],
                },
            };
            (spec.name.to_lowercase(), margins)
        };
        let wheels: BTreeMap<_, _> = machine.wheels().iter().enumerate().map(of_wheel).collect();
        SimulatedChange {
            of: candidate.change,
            name: candidate.change.name(machine),
            statement: self.statement(candidate.change, solution.amount),
            change: sign * solution.amount,
            unit: candidate.change.unit(machine),
            effort: solution.amount.abs() / candidate.whole,
            effort_of: candidate.effort_of,
            first_order: candidate.first_order.map(|amount| sign * amount),
            least_otf_n,
            least_otf_ns: self.rows.times_ns[row],
            otf_sigma_n: sigmas[self.worst.wheel],
            residual_n: least_otf_n - self.worst.limit_n,
            chance: self.chance(found, &sigmas),
            wheels,
            zmp_margin_m: BeforeAfter {
                before: logged.zmp.0,
                after: found.zmp.0,
            },
            overturning_moment_nm: BeforeAfter {
                before: logged.moment.0,
                after: found.moment.0,
            },
            holds_under_any_split: self.bounds.hold_under_any_split(found),
        }
    }

    /// Probability that every wheel that was below its limit reaches it. Their errors are much the same, so that it is that
    /// of the least certain one.
    fn chance(&self, found: &Margins, sigmas: &[Option<f64>]) -> Option<f64> {
        let chances = self.bounds.targets.iter().map(|&wheel| {
            let sigma_n = sigmas[wheel].filter(|sigma_n| *sigma_n > 0.0)?;
            let spare_n = found.otf[wheel].0 - self.bounds.otf[wheel];
            Some(normal_distribution(spare_n / sigma_n))
        });
        let chances: Option<Vec<f64>> = chances.collect();
        chances?.into_iter().reduce(f64::min)
    }

    /// The change in words.
    fn statement(&self, change: Change, amount: f64) -> String {
        let machine = self.machine;
        let less = percent(amount);
        match change {
            Change::JointOffset(joint) => {
                let name = &machine.joints()[joint].name;
                let offset = format!(
                    "{}{}",
                    if amount < 0.0 { "-" } else { "+" },
                    short(amount.abs())
                );
                match change.unit(machine) {
                    "m" => say!("joint {name} moved by {offset} m"),
                    _ => say!(
                        "joint {name} turned by {offset} rad ({:+.0}°)",
                        amount.to_degrees()
                    ),
                }
            }
            Change::SlowerArm => say!("the arm {less} slower on the same path"),
            Change::SlowerManoeuvre => say!("machine and arm {less} slower on the same path"),
            Change::LessForwardAcceleration => say!("{less} less braking and accelerating"),
            Change::WiderCurve => say!("a wider curve: {less} less yaw rate at the same speed"),
            Change::LessPayload(payload) => {
                say!("payload {} lighter by {} kg", payload + 1, short(amount))
            }
            Change::LessLinkMass(link) => say!(
                "link {} lighter by {} kg",
                machine.links()[link].name,
                short(amount)
            ),
            Change::LessToolForce => say!("{less} less force on the tool"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_advised_against_what_goes_on_in_a_fall_that_loads_do_not_show() {
        let fall = Event {
            shown_by: Some(ShownBy::Rotation),
            ..Event::blank(EventKind::EdgeTipping, 5, "right".into())
        };
        assert!(goes_on_unseen(std::slice::from_ref(&fall), [0, 9]));
        assert!(!goes_on_unseen(std::slice::from_ref(&fall), [0, 4]));
        let by_both = Event {
            shown_by: Some(ShownBy::Both),
            ..fall.clone()
        };
        let unlikely = Event {
            certainty: Some(0.3),
            ..fall
        };
        for event in [by_both, unlikely] {
            assert!(!goes_on_unseen(&[event], [0, 9]));
        }
    }
}
