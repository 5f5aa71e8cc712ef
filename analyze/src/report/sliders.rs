//! What the wheel that came closest to lifting would have carried with another load, tilt, speed or boom: sliders, to first
//! order from the derivatives at its worst instant, beside the simulated values.

use maud::{Markup, html};
use serde::Serialize;
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Axis;
use tipwatch_mechanics::{BaseMotion, Parameter, Quantity, State};

use super::explanations::no_derivatives;
use super::findings::{Scene, incidents};
use crate::analysis::Analysis;
use crate::analysis::advice::Change;
use crate::events::support_words::SupportWord;
use crate::events::{Counterfactual, Supposition};
use crate::page::{json_script, number};

/// Reach of the sliders of a joint (rad or m).
const JOINT_REACH: f64 = 0.5;
/// Most joints.
const MOST_JOINTS: usize = 3;
/// Effects smaller than this over half a slider have none (N).
const LEAST_EFFECT_N: f64 = 1.0;

/// A wheel at its worst instant, and what changes its overturning force (OTF).
#[derive(Debug, PartialEq, Serialize)]
pub struct Sliders {
    /// Name of the wheel.
    pub wheel: String,
    /// What it is called: a wheel, another support, a point of a track.
    pub word: &'static str,
    /// Seconds from the first row.
    pub t: f64,
    /// OTF as logged (N).
    pub otf_n: f64,
    /// Its standard deviation (N); null if unknown.
    pub sigma_n: Option<f64>,
    /// The changes.
    pub changes: Vec<Slider>,
}

/// One change.
#[derive(Debug, PartialEq, Serialize)]
pub struct Slider {
    /// What changes.
    pub name: String,
    /// Unit of the change.
    pub unit: &'static str,
    /// Least, logged and largest value.
    pub range: [f64; 3],
    /// Change of the OTF for each unit, to first order (N).
    pub per_unit_n: f64,
    /// What was simulated: the value, and the smallest OTF of the incident (N) with its standard deviation.
    pub simulated: Option<(f64, f64, Option<f64>)>,
}

/// The sliders; `None` if the model has no derivatives, or nothing would change the load.
#[must_use]
pub fn sliders(analysis: &Analysis) -> Option<Sliders> {
    let table = analysis.sensitivity.as_ref()?;
    let machine = &analysis.machine;
    let of_wheel = || {
        table
            .rows
            .iter()
            .filter(|row| row.wheel == table.worst_wheel)
    };
    let first = of_wheel().next()?;
    let per_unit = |parameter: Parameter| {
        let row = of_wheel().find(|row| row.parameter == parameter);
        row.map(|row| row.derivative)
            .filter(|d| d.is_finite())
            .unwrap_or(0.0)
    };
    let row = analysis.rows.at(first.worst_ns);
    let found = analysis.rows.window(row..row + 1);
    let mut state = State::zero(machine);
    found.states.get(0, &mut state);
    let asked = incidents(&analysis.events).into_iter().next();
    let wheel = machine.wheels()[table.worst_wheel].name.to_lowercase();
    let asked = asked.iter().flat_map(|incident| &incident.events);
    let asked = asked.filter(|event| event.subject == wheel);
    let answers: Vec<&Counterfactual> = asked.flat_map(|event| &event.counterfactuals).collect();
    let simulated = |supposed: Supposition, at: f64| {
        let answers = answers.iter().filter(|answer| answer.supposed == supposed);
        // what is open tells no value
        let known = answers.filter(|answer| answer.why_not.is_none());
        let known = known.filter_map(|answer| Some((at, answer.otf_n?, answer.sigma_n)));
        // of several wheels that which comes closest
        known.min_by(|a, b| a.1.total_cmp(&b.1))
    };

    let mut changes = Vec::new();
    let payloads = machine.payloads();
    let stated_kg: f64 = payloads.iter().map(|payload| payload.inertia.mass).sum();
    // a mass that is known by row alone is not that of the payload as stated
    if stated_kg > 0.0 && !payloads.iter().any(|payload| payload.is_by_row) {
        // all of them in proportion
        let per_kg = payloads.iter().enumerate().map(|(index, payload)| {
            payload.inertia.mass / stated_kg * per_unit(Parameter::PayloadMass(index))
        });
        changes.push(Slider {
            name: word!("Payload").into(),
            unit: "kg",
            range: [0.0, stated_kg, 2.0 * stated_kg],
            per_unit_n: per_kg.sum(),
            simulated: simulated(Supposition::WithoutLoad, 0.0),
        });
    }
    let up = &state.base.up;
    if up.iter().all(|part| part.is_finite()) {
        // a platform turned by an angle measures what an IMU does whose mounting is turned back by it
        let (roll, pitch) = (up.y.atan2(up.z), (-up.x).atan2(up.y.hypot(up.z)));
        let whole = -roll * per_unit(Parameter::ImuRotation(Axis::X))
            - pitch * per_unit(Parameter::ImuRotation(Axis::Y));
        changes.push(Slider {
            name: say!(
                "Tilt of the platform (logged: roll {:.1}°, pitch {:.1}°)",
                roll.to_degrees(),
                pitch.to_degrees()
            ),
            unit: "%",
            range: [0.0, 100.0, 200.0],
            per_unit_n: whole / 100.0,
            simulated: simulated(Supposition::LevelGround, 0.0),
        });
    }
    changes.push(Slider {
        name: word!("Speed of machine and arm").into(),
        unit: "%",
        range: [0.0, 100.0, 200.0],
        per_unit_n: per_speed(analysis, &state, &per_unit) / 100.0,
        simulated: simulated(Supposition::HalfSpeed, 50.0),
    });
    changes.extend(joints(analysis, &state, &per_unit));
    changes.retain(|it| {
        let half = (it.range[2] - it.range[1]) * it.per_unit_n;
        half.is_finite() && half.abs() >= LEAST_EFFECT_N
    });
    let sigma = found.value(Quantity::OtfSigma(table.worst_wheel), 0);
    (!changes.is_empty()).then(|| Sliders {
        word: SupportWord::of_kind(machine.wheels()[table.worst_wheel].kind).one,
        wheel: machine.wheels()[table.worst_wheel].name.clone(),
        t: Scene::of(analysis).seconds(first.worst_ns),
        otf_n: first.worst_otf_n,
        sigma_n: Some(sigma).filter(|sigma| sigma.is_finite()),
        changes,
    })
}

/// Change of the OTF with the speed on the same path, as a share of the logged one (N): velocities grow with it, accelerations
/// with its square.
fn per_speed(analysis: &Analysis, state: &State<f64>, per_unit: &dyn Fn(Parameter) -> f64) -> f64 {
    let (base, imu) = (&state.base, &state.imu);
    let of_base = [
        (BaseMotion::ForwardVelocity, base.velocity.x),
        (BaseMotion::LeftVelocity, base.velocity.y),
        (BaseMotion::YawRate, imu.angular_velocity.z),
        (BaseMotion::ForwardAcceleration, 2.0 * base.velocity_rate.x),
        (BaseMotion::LeftAcceleration, 2.0 * base.velocity_rate.y),
        (
            BaseMotion::YawAcceleration,
            2.0 * imu.angular_acceleration.z,
        ),
    ];
    let of_base = of_base
        .iter()
        .filter(|(_, value)| value.is_finite())
        .map(|&(motion, value)| value * per_unit(Parameter::BaseMotion(motion)));
    let joints = 0..analysis.machine.joints().len();
    let of_joints = joints.map(|joint| {
        let now = &state.joints[joint];
        now.rate * per_unit(Parameter::JointVelocity(joint))
            + 2.0 * now.acceleration * per_unit(Parameter::JointAcceleration(joint))
    });
    of_base.sum::<f64>() + of_joints.filter(|n| n.is_finite()).sum::<f64>()
}

/// The joints that an operator moves and that change the load most.
fn joints(
    analysis: &Analysis,
    state: &State<f64>,
    per_unit: &dyn Fn(Parameter) -> f64,
) -> Vec<Slider> {
    let Some(advice) = &analysis.advice else {
        return Vec::new();
    };
    let tried = advice.changes.iter().map(|change| change.name.as_str());
    let tried = tried.chain(advice.rejected.iter().map(|tried| tried.name.as_str()));
    let tried: Vec<&str> = tried.collect();
    let named = analysis.machine.joints().iter().enumerate();
    let mut found: Vec<Slider> = named
        .filter(|(_, joint)| {
            let name = format!("{}.position", joint.name);
            tried
                .iter()
                .any(|it| it.split(' ').next() == Some(name.as_str()))
        })
        .map(|(index, joint)| {
            let now = state.joints[index].position;
            let moved = advice
                .changes
                .iter()
                .find(|change| change.of == Change::JointOffset(index));
            let simulated = moved.map(|it| (now + it.change, it.least_otf_n, it.otf_sigma_n));
            let at = simulated.map_or(now, |(at, ..)| at);
            let [least, most] = joint.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            Slider {
                name: say!("Joint {}", joint.name),
                unit: Parameter::JointPosition(index).unit(&analysis.machine),
                range: [
                    (now - JOINT_REACH).min(at).max(least.min(now)),
                    now,
                    (now + JOINT_REACH).max(at).min(most.max(now)),
                ],
                per_unit_n: per_unit(Parameter::JointPosition(index)),
                simulated,
            }
        })
        .collect();
    found.sort_by(|a, b| b.per_unit_n.abs().total_cmp(&a.per_unit_n.abs()));
    found.truncate(MOST_JOINTS);
    found
}

/// The sliders as a part of a page, with the numbers that the script reads.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let Some(found) = sliders(analysis) else {
        return match analysis.sensitivity {
            Some(_) => html! {},
            None => {
                html! { p.hint { (say!("There are no sliders to try a change. {}", no_derivatives(analysis))) } }
            }
        };
    };
    html! {
        div.screen id="what-if" {
            h3 { (word!("Try a change")) }
            p.hint {
                (say!("The overturning force (OTF) of {} {} at t = {:.2} s to first order, from its derivatives at that instant: a \
                straight line, less true the farther a slider goes. The values under the sliders were simulated over the whole \
                incident, and hold where the two differ.", found.word, found.wheel, found.t))
            }
            @for (place, it) in found.changes.iter().enumerate() {
                @let [least, now, most] = it.range;
                p.slider {
                    label for=(format_args!("what-if-{place}")) { (it.name) ": " }
                    output id=(format_args!("what-if-{place}-value")) { (number(now)) " " (it.unit) }
                    input type="range" id=(format_args!("what-if-{place}")) min=(least) max=(most) value=(now)
                        step=((most - least) / 200.0);
                    @if let Some((at, otf_n, sigma_n)) = it.simulated {
                        @let band = sigma_n.map_or(String::new(), |sigma_n| format!(" ± {}", number(2.0 * sigma_n)));
                        span.hint {
                            (say!("simulated at {} {}: smallest OTF {}{band} N", number(at), it.unit, number(otf_n)))
                        }
                    }
                }
            }
            p.lead {
                output id="what-if-result" aria-live="polite"
                    data-result=(say!("OTF of {} {}: {{otf}} N to first order (logged: {{logged}} N): {{lifts}}.", found.word, found.wheel))
                    data-open=(say!("open whether the {} lifts", found.word)) data-lifts=(say!("the {} lifts", found.word))
                    data-stays=(say!("the {} stays on the ground", found.word)) {}
            }
            p { button type="button" id="what-if-reset" { (word!("As logged")) } }
            (json_script("what-if-data", &found))
        }
    }
}
