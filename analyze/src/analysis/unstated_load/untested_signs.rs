//! Certainty of events, weighed with the probability that an encoder has the other sign.

use tipwatch_mechanics::estimation::plausibility::Part;
use tipwatch_mechanics::machine::{Machine, Parameter, Proof, Proofs};
use tipwatch_mechanics::number::normal_distribution;
use tipwatch_mechanics::state::Sensor;
use tipwatch_mechanics::{Placement, Scope, State, Workspace, combination_sigma, evaluate};

use super::super::standing_rows::StandingRows;
use super::amounts::reverse;
use crate::base::table::Table;
use crate::events::{Event, EventKind, UntestedSign, distances};

/// Smallest part of a confidence that shows in its digits: smaller reductions are omitted.
const SHOWS: f64 = 1e-3;

/// Lowers the certainty of each event that rests on computed loads by the untested signs of encoders. `reversed` holds the
/// probability of each joint's other sign, by the motion of the log. With it, the row on which the certainty c rests is
/// evaluated again:
/// ```text
///     c' = c (1 - sum over joints P(other sign) max(1 - p with the other sign / p with this one, 0))
/// ```
/// Both p are those of the one row: the certainty of a tipping has that of its whole span in it.
/// Joints that a commissioning has proven are left out, and signs with which the joint would be beyond its limits or no linkage
/// could close: nobody would have overlooked that. So are joints of which a doubt of the event says that they contradict
/// themselves or the gyro: it contains their signs. Measured rotations and supports that measure their own load need no encoder,
/// nor do wheels off an edge about which a measured rotation shows.
pub(crate) fn weigh_signs(
    standing: &[StandingRows<'_>],
    table: &Table,
    reversed: &[(usize, f64)],
    commissioned: Proofs,
    events: &mut [Event],
) {
    let open: Vec<(usize, f64)> = (reversed.iter().copied())
        .filter(|(joint, probability)| {
            *probability >= SHOWS && !commissioned.has(Proof::Joint(*joint))
        })
        .collect();
    if open.is_empty() {
        return;
    }
    let falls = events
        .iter()
        .filter(|event| event.measured_rotation.is_some());
    let falls: Vec<(String, [i64; 2])> = falls
        .map(|fall| (fall.subject.clone(), fall.span_ns()))
        .collect();
    for event in events.iter_mut() {
        let is_measured = falls.iter().any(|(edge, span_ns)| {
            event.overlaps(*span_ns) && is_off(table, edge, &event.subject, span_ns[0])
        });
        let rests_on_signs =
            event.measured_rotation.is_none() && event.measured_load_n.is_none() && !is_measured;
        let Some(certainty) = event.certainty.filter(|_| rests_on_signs) else {
            continue;
        };
        let row = table.at(event.judged_ns.unwrap_or(event.worst_ns));
        let place = StandingRows::place_of(row, table);
        let Some(standing) = place.and_then(|place| standing.get(place)) else {
            continue;
        };
        let machine = standing.machine;
        let mut state = State::zero(machine);
        table.state(row, &mut state);
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS_AND_DERIVATIVES);
        let stated = chance(standing, &state, event, &mut workspace);
        let Some(stated) = stated.filter(|p| *p > 0.0) else {
            continue;
        };
        let mut taken = 0.0;
        for &(joint, probability) in &open {
            if is_doubted(machine, event, joint) {
                continue;
            }
            let mut other = state.clone();
            let signal = Parameter::JointPosition(joint);
            reverse(&mut other, signal);
            let limits = machine.joints()[joint].limits;
            let position = other.joints[joint].position;
            if limits.is_some_and(|[least, most]| position < least || most < position) {
                continue;
            }
            let Some(reversed) = chance(standing, &other, event, &mut workspace) else {
                continue;
            };
            let share = (reversed / stated).min(1.0);
            let taken_by_it = probability * (1.0 - share);
            if taken_by_it * certainty >= SHOWS {
                taken += taken_by_it;
                event.untested.push(UntestedSign {
                    joint: machine.joints()[joint].name.clone(),
                    reversed: probability,
                    certainty_if_reversed: certainty * share,
                });
            }
        }
        let left = (1.0 - taken).max(0.0);
        for of in [&mut event.certainty, &mut event.certainty_any_split] {
            *of = of.map(|of| of * left);
        }
    }
    follow_tippings(table, events);
}

/// Whether the doubt of an event is about the encoder of a joint, alone or beside the gyro.
fn is_doubted(machine: &Machine, event: &Event, joint: usize) -> bool {
    let of = [Part::Joint(joint), Part::Lean].map(|part| part.subject(Sensor::Imu, machine));
    let doubted = event.doubt.iter().flat_map(|doubt| &doubt.subjects);
    doubted.into_iter().any(|subject| of.contains(subject))
}

/// Tipping about an edge needs every wheel off it unloaded: none of them was so less certainly.
fn follow_tippings(table: &Table, events: &mut [Event]) {
    let tippings =
        (events.iter()).filter(|it| it.kind.is_lift() && it.kind != EventKind::WheelLift);
    let tippings: Vec<Event> = tippings.cloned().collect();
    let most = |one: Option<f64>, other: Option<f64>| one.into_iter().chain(other).reduce(f64::max);
    for event in events.iter_mut().filter(|event| !event.untested.is_empty()) {
        let span_ns = event.span_ns();
        for tipping in tippings.iter().filter(|it| it.overlaps(span_ns)) {
            let is_other = tipping.subject != event.subject;
            if is_other && is_off(table, &tipping.subject, &event.subject, tipping.start_ns) {
                event.certainty = most(event.certainty, tipping.certainty);
                event.certainty_any_split =
                    most(event.certainty_any_split, tipping.certainty_any_split);
            }
        }
    }
}

/// Whether a subject is the edge, or a wheel off the ground while the machine rotates about the edge from a time on (ns).
fn is_off(table: &Table, edge: &str, subject: &str, from_ns: i64) -> bool {
    let Some(machine) = table.machine_at(table.at(from_ns)) else {
        return false;
    };
    let both = machine.edge_named(edge).zip(machine.wheel_named(subject));
    let is_off = |(edge, wheel): (usize, usize)| !machine.polygon().edges()[edge].carries[wheel];
    subject == edge || both.is_some_and(is_off)
}

/// Probability that the wheels of an event are below their limit in a state.
fn chance(
    standing: &StandingRows<'_>,
    state: &State<f64>,
    event: &Event,
    workspace: &mut Workspace<f64>,
) -> Option<f64> {
    let machine = standing.machine;
    let (factors, limit_n): (Vec<f64>, f64) = match event.kind {
        EventKind::WheelLight | EventKind::WheelLift => {
            let wheel = machine.wheel_named(&event.subject)?;
            let wheels = 0..machine.wheels().len();
            let limit_n = match event.kind {
                EventKind::WheelLight => *standing.min_loads_n.as_ref()?.get(wheel)?,
                _ => 0.0,
            };
            let own = wheels.map(|other| f64::from(u8::from(other == wheel)));
            (own.collect(), limit_n)
        }
        _ => {
            let edge = machine.edge_named(&event.subject)?;
            let mut placement = Placement::new(machine);
            placement.place(state);
            (distances(machine, &placement, edge), 0.0)
        }
    };
    let otf = &evaluate(machine, state, workspace).otf;
    let sum_n: f64 = otf
        .iter()
        .zip(&factors)
        .map(|(otf, factor)| otf * factor)
        .sum();
    let sigma_n = combination_sigma(machine, state, workspace, &factors);
    let probability = normal_distribution((limit_n - sum_n) / sigma_n);
    probability.is_finite().then_some(probability)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rigid::rigid;

    #[test]
    fn a_doubt_contains_the_signs_of_the_encoders_that_it_is_about() {
        let machine = rigid();
        let joint = |name: &str| {
            let mut joints = machine.joints().iter();
            joints.position(|joint| joint.name == name).unwrap()
        };
        let doubted = |subject: &str| {
            let mut event = Event::blank(EventKind::WheelLift, 0, "rr".into());
            event.doubt_by(vec![subject.into()], 0.5);
            ["slew", "lift"].map(|name| is_doubted(&machine, &event, joint(name)))
        };
        assert_eq!(
            doubted("imu.specific_force against the speeds of the wheels"),
            [false; 2]
        );
        assert_eq!(doubted("measured loads"), [false; 2]);
        assert_eq!(doubted("joint_states.slew"), [true, false]);
        assert_eq!(
            doubted("imu.angular_velocity against joint_states"),
            [true; 2]
        );
    }
}
