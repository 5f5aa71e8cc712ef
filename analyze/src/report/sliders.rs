//! Counterfactual sliders of the gravest event, for another load, slope, speed or boom: they move between simulated values.

use maud::{Markup, html};
use serde::Serialize;
use tipwatch_language::{say, word};
use tipwatch_mechanics::{Machine, Parameter, State};

use super::explanations::no_derivatives;
use super::findings::{Incident, Scene, incidents};
use super::unstated_load;
use crate::analysis::Analysis;
use crate::analysis::advice::{Change, GroundSlope, Hypothesis, Question, moves_arm_alone};
use crate::analysis::standing_rows::StandingRows;
use crate::events::{Event, EventKind, Reply};
use crate::page::{json_script, number, probability, with_sure_band};

/// Reach of the sliders of a joint (rad or m).
const JOINT_REACH: f64 = 0.5;
/// Sliders that change less over their whole range have no effect (N).
const LEAST_EFFECT_N: f64 = 1.0;
/// Steps of a slider: a little more than a whole number, so that rounding never takes the last one.
const STEPS: f64 = 200.0 + 1e-6;
/// Simulated values on either side of the logged one.
const SIDE_VALUES: usize = 2;

/// Sliders of an event, and how near its wheels come to lifting.
#[derive(Debug, PartialEq, Serialize)]
pub struct Sliders {
    /// Kind of the event.
    pub kind: EventKind,
    /// Name of its wheel or edge, in lower case.
    pub subject: String,
    /// As logged, by the same evaluation as everything simulated.
    pub logged: Simulated,
    /// The changes.
    pub changes: Vec<Slider>,
}

/// One change.
#[derive(Debug, PartialEq, Serialize)]
pub struct Slider {
    /// Name of the quantity that changes.
    pub name: String,
    /// Unit of the change.
    pub unit: &'static str,
    /// The logged value.
    pub logged: f64,
    /// Simulated values, ascending, the logged value among them. Between them is a straight line.
    pub simulated: Vec<Simulated>,
    /// Values that could not be simulated.
    pub not_simulated: Vec<NotSimulated>,
}

/// A value of a change that cannot be simulated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotSimulated {
    /// The value, in the unit of the change.
    pub at: f64,
    /// Reason.
    pub why: &'static str,
}

/// A simulated value of a change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Simulated {
    /// The value, in the unit of the change; 0 of what was logged.
    pub at: f64,
    /// Smallest OTF of the event's wheel, of the wheels off its edge weighted by their distance (N).
    pub otf_n: f64,
    /// Its standard deviation (N); null if unknown.
    pub sigma_n: Option<f64>,
    /// Probability that the wheels lift; null where `sigma_n` is.
    pub probability: Option<f64>,
}

impl Simulated {
    fn of(at: f64, reply: &Reply) -> Result<Self, &'static str> {
        let unknown = || {
            reply
                .why_not
                .unwrap_or(word!("the loads cannot be computed"))
        };
        Ok(Self {
            at,
            otf_n: reply.otf_n.ok_or_else(unknown)?,
            sigma_n: reply.sigma_n,
            probability: reply.probability,
        })
    }
}

/// The values of a change that are simulated, from the least through the logged one to the most, ascending and without it: none
/// on a side to which it cannot change.
fn values([least, now, most]: [f64; 3]) -> Vec<f64> {
    let step = |k: usize| k as f64 / SIDE_VALUES as f64;
    let below = (0..SIDE_VALUES).map(|k| least + (now - least) * step(k));
    let above = (1..=SIDE_VALUES).map(|k| now + (most - now) * step(k));
    let below = below.filter(|at| *at < now);
    let mut values: Vec<f64> = below.chain(above.filter(|at| *at > now)).collect();
    values.dedup();
    values
}

/// The event that the sliders change: the one that the first page asks about, else the smallest load of the wheel that came
/// closest to lifting, which nothing shows to have lifted.
fn event(analysis: &Analysis) -> Option<(Event, bool)> {
    let gravest = incidents(&analysis.events).into_iter().next();
    if let Some(asked) = gravest.and_then(|incident| incident.asked()) {
        return Some((asked.clone(), true));
    }
    let table = analysis.sensitivity.as_ref()?;
    let worst = table
        .rows
        .iter()
        .find(|row| row.wheel == table.worst_wheel)?;
    let wheel = analysis.machine.wheels()[table.worst_wheel]
        .name
        .to_lowercase();
    let event = Event {
        end_ns: Some(worst.worst_ns),
        ..Event::blank(EventKind::WheelLift, worst.worst_ns, wheel)
    };
    Some((event, false))
}

/// Simulates the sliders.
///
/// # Errors
/// There are none: nothing can be simulated, nothing would change the load, or the machine as stated does not show the event. The
/// error says so in a sentence.
pub fn sliders(analysis: &Analysis) -> Result<Sliders, String> {
    let gravest = incidents(&analysis.events).into_iter().next();
    let is_hidden = |incident: &Incident<'_>| incident.gravest().hides_onset();
    if gravest.as_ref().is_some_and(is_hidden) {
        return Err(Event::onset_not_shown().into());
    }
    let (event, is_recorded) = event(analysis).ok_or_else(|| no_derivatives(analysis))?;
    // beside a fall that nothing could be asked about, the load of another moment tells nothing
    let has_fallen = gravest.is_some_and(|incident| {
        let gravest = incident.gravest();
        gravest.kind == EventKind::TipOver && gravest.is_fact()
    });
    if has_fallen && !is_recorded {
        return Err(word!(
            "It is not known on what the machine stood, or no row can be evaluated."
        )
        .into());
    }
    let standing = StandingRows::all(&analysis.machine, &analysis.rows, |_| None);
    let found = Question::about(&standing, &analysis.rows, &event, |question| {
        of_question(analysis, &event, is_recorded, question)
    });
    found.ok_or_else(|| {
        word!("It is not known on what the machine stood, or no row can be evaluated.")
    })?
}

fn of_question(
    analysis: &Analysis,
    event: &Event,
    is_recorded: bool,
    question: &Question<'_>,
) -> Result<Sliders, String> {
    if is_recorded && (unstated_load::contradicts(analysis, event) || !question.is_shown()) {
        return Err(word!(
            "The machine as stated does not show what was recorded: its loads do not tell what would have become of it otherwise."
        )
        .into());
    }
    // the machine as stated contradicts nothing where nothing was recorded
    let simulate = |machine: &Machine, hypotheses: &[Hypothesis]| match is_recorded {
        true => question.reply(machine, hypotheses),
        false => question.simulate(machine, hypotheses),
    };
    let reply = |hypothesis: Hypothesis| {
        let hypotheses = [hypothesis];
        let machine = Hypothesis::machine(&hypotheses, question.machine())?;
        Ok(simulate(&machine, &hypotheses))
    };
    let logged = Simulated::of(0.0, &simulate(question.machine(), &[]))
        .map_err(|why| say!("Nothing is simulated: {why}."))?;
    let slider = |name: String, unit, range: [f64; 3], suppose: &dyn Fn(f64) -> Hypothesis| {
        let as_logged = Simulated {
            at: range[1],
            ..logged.clone()
        };
        let (mut simulated, mut not_simulated) = (vec![as_logged], Vec::new());
        for at in values(range) {
            match reply(suppose(at)).and_then(|reply| Simulated::of(at, &reply)) {
                Ok(found) => simulated.push(found),
                Err(why) => not_simulated.push(NotSimulated { at, why }),
            }
        }
        simulated.sort_by(|a, b| a.at.total_cmp(&b.at));
        let effect_n = |of: &Simulated| (of.otf_n - logged.otf_n).abs();
        let has_effect = simulated.iter().any(|of| effect_n(of) >= LEAST_EFFECT_N);
        (has_effect || !not_simulated.is_empty()).then_some(Slider {
            name,
            unit,
            logged: range[1],
            simulated,
            not_simulated,
        })
    };

    let mut changes = Vec::new();
    let machine = question.machine();
    let stated_kg = question.payload_kg();
    // the mass of a stated payload is its own, attached or not
    let is_stated = (machine.payloads().iter()).any(|payload| payload.inertia.mass > 0.0);
    let on_tool = machine.load_on_tool().filter(|_| !is_stated);
    changes.extend(match stated_kg > 0.0 {
        true => {
            let more = |at: f64| Hypothesis::Payload(at - stated_kg);
            slider(
                word!("Payload").into(),
                "kg",
                [0.0, stated_kg, 2.0 * stated_kg],
                &more,
            )
        }
        false => on_tool.and_then(|load| {
            let link = &machine.links()[load.link];
            let name = say!("Load beyond what is stated, on link {}", link.name);
            let mass = link.inertia.mass;
            slider(name, "kg", [-0.5 * mass, 0.0, mass], &Hypothesis::Payload)
        }),
    });
    if let Some(ground) = GroundSlope::of(&analysis.machine, &analysis.rows) {
        let slope = ground.at(event.start_ns);
        let degrees = (slope.tilt.norm() * slope.share()).to_degrees();
        let times = |at: f64| Hypothesis::Slope(ground.clone(), at / 100.0);
        let band = (2.0 * slope.sigma_rad).to_degrees();
        let name = say!("Slope of the ground (estimated: {degrees:.1}° ± {band:.1}°)");
        changes.extend(slider(name, "%", [0.0, 100.0, 200.0], &times));
    }
    let speed = |at: f64| question.speed(at / 100.0);
    let name = match question.base_rests() {
        true => word!("Speed of the arm"),
        false => word!("Speed of machine and arm"),
    };
    changes.extend(slider(name.into(), "%", [0.0, 100.0, 200.0], &speed));
    let joints = joints(analysis, event);
    let of_joint = |(joint, name, range): (usize, String, [f64; 3])| {
        let offset = |at: f64| Hypothesis::Joint(joint, at - range[1]);
        let unit = Parameter::JointPosition(joint).unit(machine);
        slider(name, unit, range, &offset)
    };
    let mut joints: Vec<Slider> = joints.into_iter().filter_map(of_joint).collect();
    let effect_n = |of: &Slider| {
        let otf = of.simulated.iter().map(|it| it.otf_n);
        let [least, most] = otf.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], n| {
            [least.min(n), most.max(n)]
        });
        most - least
    };
    joints.sort_by(|a, b| effect_n(b).total_cmp(&effect_n(a)));
    changes.extend(joints);
    if changes.is_empty() {
        return Err(word!("No change that is tried moves the load.").into());
    }
    Ok(Sliders {
        kind: event.kind,
        subject: event.subject.clone(),
        logged,
        changes,
    })
}

/// The joints of the arm, with their names and how far they are moved: as far as the advice does, too.
fn joints(analysis: &Analysis, event: &Event) -> Vec<(usize, String, [f64; 3])> {
    let advice = &analysis.advice;
    let mut state = State::zero(&analysis.machine);
    (analysis.rows).state(analysis.rows.at(event.worst_ns), &mut state);
    let named = analysis.machine.joints().iter().enumerate();
    let named = named.filter(|(joint, _)| {
        moves_arm_alone(&analysis.machine, *joint) && state.joints[*joint].position.is_finite()
    });
    let range = |(index, joint): (usize, &tipwatch_mechanics::machine::MeasuredJoint)| {
        let now = state.joints[index].position;
        let mut changes = advice.iter().flat_map(|advice| &advice.changes);
        let advised = changes.find(|change| change.of == Change::JointOffset(index));
        let at = advised.map_or(now, |advised| now + advised.change);
        let [least, most] = joint.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let range = [
            (now - JOINT_REACH).min(at).max(least.min(now)),
            now,
            (now + JOINT_REACH).max(at).min(most.max(now)),
        ];
        (index, say!("Joint {}", joint.name), range)
    };
    named.map(range).collect()
}

/// The sliders as a part of a page, with the numbers that the script reads.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let found = match sliders(analysis) {
        Ok(found) => found,
        Err(why) => {
            return html! { p.hint { (say!("There are no sliders to try a change. {}", why)) } };
        }
    };
    let scene = Scene::of(analysis);
    let event = Event::blank(found.kind, 0, found.subject.clone());
    let what = match found.kind {
        EventKind::WheelLift => scene.support(&event),
        _ => say!(
            "the {} off the {} edge",
            scene.word.many,
            scene.subject(&event)
        ),
    };
    html! {
        div.screen id="what-if" {
            h3 { (word!("Try a change")) }
            p.hint {
                (say!("The smallest overturning force (OTF) of {what} over the event. The values under the \
                sliders were simulated; between them, and with several changes together, it is first order: straight lines."))
            }
            @for (place, it) in found.changes.iter().enumerate() {
                @if let (Some(first), Some(last)) = (it.simulated.first(), it.simulated.last()) {
                    p.slider {
                        label for=(format_args!("what-if-{place}")) { (it.name) ": " }
                        output id=(format_args!("what-if-{place}-value")) { (number(it.logged)) " " (it.unit) }
                        input type="range" id=(format_args!("what-if-{place}")) min=(first.at) max=(last.at) value=(it.logged)
                            step=((last.at - first.at) / STEPS) disabled[it.simulated.len() < 2];
                        span.hint { (say!("simulated: {}", simulated_in_words(it))) }
                    }
                }
            }
            p.lead {
                output id="what-if-result" aria-live="polite"
                    data-result=(say!("OTF of {what}: {{otf}} N (logged: {{logged}} N): {{lifts}}."))
                    data-open=(word!("open whether it lifts")) data-lifts=(word!("it lifts"))
                    data-stays=(word!("it stays on the ground")) {}
            }
            p { button type="button" id="what-if-reset" { (word!("As logged")) } }
            (json_script("what-if-data", &found))
        }
    }
}

/// The simulated values of a slider, but the logged one.
fn simulated_in_words(of: &Slider) -> String {
    let others = of.simulated.iter().filter(|it| it.at != of.logged);
    let one = |it: &Simulated| {
        let with = |sigma_n: f64| with_sure_band(it.otf_n, sigma_n);
        let otf = it.sigma_n.map_or_else(|| number(it.otf_n), with);
        let chance = it.probability.map_or(word!("unknown").into(), probability);
        say!("{} {}: {otf} N, chance {chance}", number(it.at), of.unit)
    };
    let unknown = of.not_simulated.iter().map(|it| {
        let at = number(it.at);
        say!("{at} {}: not simulated ({})", of.unit, it.why)
    });
    others
        .map(one)
        .chain(unknown)
        .collect::<Vec<_>>()
        .join("; ")
}

#[cfg(test)]
mod tests {
    use super::values;

    /// A joint at its lower limit moves upwards only; what is at two places between straight lines has no slope.
    #[test]
    fn a_side_without_width_is_left_out() {
        assert_eq!(values([0.25, 0.25, 0.75]), [0.5, 0.75]);
        assert_eq!(values([-0.25, 0.25, 0.25]), [-0.25, 0.0]);
        assert!(values([0.25; 3]).is_empty());
    }
}
