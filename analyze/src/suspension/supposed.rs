//! A log as recorded, and as it would have been: on level ground, at another speed, with another load.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use tipwatch_binding::MachineFile;
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Split;

use crate::analysis::Analysis;
use crate::analysis::advice::{GroundSlope, Hypothesis, Question, asked_as};
use crate::analysis::run::{analyse, analyse_supposing};
use crate::analysis::standing_rows::StandingRows;
use crate::base::number::number;
use crate::base::options::{Options, positive, seconds, share};
use crate::events::split_rule::measured_forces;
use crate::events::{Event, EventKind, Reply, ShownBy};

/// Suppositions that replace recorded quantities, all of them together.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub struct Suppositions {
    /// Suppose that the ground had been level; the platform rocks on it as recorded.
    #[arg(long = "slope-level")]
    pub level: bool,
    /// Suppose that machine and arm had travelled the same path so many times as fast.
    #[arg(long, value_name = "TIMES", value_parser = positive)]
    pub speed: Option<f64>,
    /// Suppose so many kilograms more of the payloads, or on the tool where the machine file states none; less where negative.
    #[arg(long = "payload", value_name = "KG", allow_negative_numbers = true, value_parser = seconds)]
    pub payload_kg: Option<f64>,
    /// Suppose that a joint had been off by this constant (rad or m).
    #[arg(long = "joint", value_name = "NAME=OFFSET", value_parser = joint)]
    pub joints: Vec<(String, f64)>,
    /// Suppose another roll moment distribution.
    #[arg(long, value_name = "D", value_parser = share)]
    pub split: Option<f64>,
}

/// NAME=OFFSET.
fn joint(text: &str) -> Result<(String, f64), String> {
    let expected = || format!("expected NAME=OFFSET, such as lift=-0.3, found {text}");
    let (name, offset) = text.split_once('=').ok_or_else(expected)?;
    let offset: f64 = offset.parse().map_err(|_| expected())?;
    match offset.is_finite() && !name.is_empty() {
        true => Ok((name.into(), offset)),
        false => Err(expected()),
    }
}

/// Returns the limits of evaluating a supposition, beside the analysis of the log as recorded.
#[must_use]
pub fn caveats(
    recorded: &Analysis,
    supposed: &Analysis,
    suppositions: &Suppositions,
) -> Vec<String> {
    let slope = suppositions
        .level
        .then(|| GroundSlope::of(&recorded.machine, &recorded.rows))
        .flatten();
    let degrees = |slope: &GroundSlope| 2.0 * slope.largest_sigma_rad().to_degrees();
    let level = slope.as_ref().filter(|slope| slope.is_level()).map(|slope| {
        say!(
            "The log does not tell the ground from level ground (to ± {:.1}°, two standard deviations): to suppose it level moves nothing, but how far it may slope all the same is in the bands of the answers.",
            degrees(slope)
        )
    });
    if suppositions.is_only_level() && level.is_some() {
        return level.into_iter().collect();
    }
    let sloped = slope.as_ref().filter(|slope| !slope.is_level()).map(|slope| {
        say!(
            "The slope of the ground is what the platform showed where the machine was calm, known to ± {:.1}° or better (two standard \
             deviations, in the bands of B). Only this slope is levelled.",
            degrees(slope)
        )
    });
    let mut caveats = vec![
        word!("Everything else is as recorded: the path, the ground, the rocking of the platform. Nobody reacts.").to_string(),
    ];
    if suppositions.speed.is_some() {
        caveats.push(word!("A speed changes velocities by its factor and accelerations by its square, on the same path: times stay those of the log.").into());
    }
    caveats.push(word!("Sensors are not compared with each other.").into());
    if let Some(fall) = first_fall(recorded) {
        let at_s = recorded.rows.seconds_at(fall.start_ns);
        caveats.insert(0, match fall.hides_onset() {
            true => word!("The log does not show how the fall began: whether it would have as supposed cannot be told.").into(),
            false => say!(
                "The platform began to rotate about an edge at t = {at_s:.2} s. From there on the answers keep its motion from just before, and the joints move as recorded; rows and figures of B end there."
            ),
        });
    }
    caveats.extend(level.or(sloped));
    let rests = bases_rest(recorded);
    if suppositions.speed.is_some() && rests.contains(&true) && rests.contains(&false) {
        caveats.push(word!(
            "In some events the base rests: the answers to these change the speed of the arm alone, the rows, figures and curves of B that of machine and arm."
        ).into());
    }
    if suppositions.split.is_some() {
        caveats.extend(without_split_rule(recorded, supposed).map(str::to_owned));
    }
    let machine = &recorded.machine;
    caveats.extend(measured_forces(machine, recorded.torques.rows_by_forces).map(|forces| say!(
        "The measured forces of {forces} show how the load is shared in A. In B they are supposed to change by what the loads by the split rule change."
    )));
    let load = machine
        .load_on_tool()
        .filter(|_| machine.payloads().is_empty());
    caveats.extend(suppositions.payload_kg.and(load).map(|load| {
        let link = &machine.links()[load.link];
        say!(
            "The machine file states no payload: the supposed mass is more or less of link {}, which it states to weigh {} kg, at its centre of mass.",
            link.name,
            number(link.inertia.mass)
        )
    }));
    caveats
}

/// Answers whether each recorded lift and tipping would have happened as supposed, by the same evaluation as that of its
/// counterfactuals.
#[must_use]
pub fn replies<'a>(
    recorded: &'a Analysis,
    supposed: &Analysis,
    suppositions: &Suppositions,
) -> Vec<(&'a Event, Reply)> {
    let of_a = StandingRows::all(&recorded.machine, &recorded.rows, |_| None);
    let of_b = StandingRows::all(&supposed.machine, &supposed.rows, |_| None);
    let events = recorded.events.iter();
    let is_unseen =
        |event: &Event| event.kind.is_lift() && event.is_of_fall_under_way(&recorded.events);
    let asked = events.filter(|event| !event.counterfactuals.is_empty() || is_unseen(event));
    let reply = |event: &'a Event| {
        if is_unseen(event) {
            let open = Reply {
                from_ns: event.start_ns,
                to_ns: event.start_ns,
                why_not: Some(word!("the log does not show the onset")),
                ..Reply::default()
            };
            return Some((event, open));
        }
        let asked = asked_as(&recorded.events, event);
        let of_event = Question::about(&of_a, &recorded.rows, asked, |question| {
            let hypotheses = suppositions.hypotheses(recorded, question.base_rests());
            let hypotheses = hypotheses.ok()?;
            let machine = match suppositions.split {
                None => Hypothesis::machine(&hypotheses, question.machine()).ok()?,
                // the split is one of the machine file
                Some(_) => {
                    let row = supposed.rows.at(event.start_ns);
                    let place = StandingRows::place_of(row, &supposed.rows)?;
                    of_b.get(place)?.machine.measured_at_base()
                }
            };
            Some(question.reply(&machine, &hypotheses))
        });
        Some((event, of_event??))
    };
    asked.filter_map(reply).collect()
}

/// Returns the caveat that another roll moment distribution changes nothing: an outrigger crane stands on its feet, which are
/// springs. `None` where it may change something.
fn without_split_rule(recorded: &Analysis, supposed: &Analysis) -> Option<&'static str> {
    let events = recorded.events.iter();
    let asked = events.filter(|event| !event.counterfactuals.is_empty());
    let are_springs = asked.filter_map(|event| {
        let machine = supposed.rows.machine_at(supposed.rows.at(event.start_ns))?;
        Some(matches!(machine.contact().split, Split::Springs))
    });
    let are_springs: Vec<bool> = are_springs.collect();
    match (are_springs.contains(&true), are_springs.contains(&false)) {
        (true, false) => Some(word!(
            "The supposed roll moment distribution has no effect on the answers: at the recorded events the machine stood on supports that share the load as springs."
        )),
        (true, true) => Some(word!(
            "At some of the recorded events the machine stood on supports that share the load as springs: the supposed roll moment distribution has no effect on the answers to these."
        )),
        (false, _) => None,
    }
}

/// The first rotation about an edge that gyro and attitude show.
fn first_fall(analysis: &Analysis) -> Option<&Event> {
    let falls = analysis.events.iter().filter(|event| {
        event.kind == EventKind::EdgeTipping
            && matches!(event.shown_by, Some(ShownBy::Rotation | ShownBy::Both))
    });
    falls.min_by_key(|event| event.start_ns)
}

impl Suppositions {
    /// Whether level ground is the only supposition.
    fn is_only_level(&self) -> bool {
        let level = Self {
            level: true,
            ..Self::default()
        };
        *self == level
    }

    /// Whether there is no supposition.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Describes the suppositions; the meaning of a speed depends on what moved in the `recorded` log.
    #[must_use]
    pub fn in_words(&self, recorded: &Analysis) -> String {
        let mut all = Vec::new();
        if self.level {
            all.push(word!("level ground").to_string());
        }
        all.extend(self.speed.map(|times| {
            let rests = bases_rest(recorded);
            match (rests.contains(&true), rests.contains(&false)) {
                (true, false) => say!("{times} times the speed of the arm"),
                (false, true) => say!("{times} times the speed of machine and arm"),
                _ => say!("{times} times the speed"),
            }
        }));
        all.extend(self.payload_kg.map(|kg| say!("payload {kg:+} kg")));
        let machine = &recorded.machine;
        let unit = |name: &str| {
            let joint = machine.joints().iter().position(|it| it.name == name);
            let slides = joint.is_some_and(|joint| machine.joint_slides(joint));
            if slides { "m" } else { "rad" }
        };
        let joints = self.joints.iter();
        all.extend(joints.map(|(name, offset)| say!("joint {name} {offset:+} {}", unit(name))));
        all.extend(self.split.map(|d| say!("roll moment distribution {d}")));
        all.join(", ")
    }

    /// The machine file with the supposed split.
    fn file(&self, file: &MachineFile) -> MachineFile {
        let mut supposed = file.clone();
        if let Some(split) = self.split {
            supposed.spec.contact.roll_moment_distribution = Some(split);
        }
        supposed
    }

    /// Returns the hypotheses about the states and the machine.
    fn hypotheses(&self, recorded: &Analysis, base_rests: bool) -> Result<Vec<Hypothesis>> {
        let joints = recorded.machine.joints();
        let mut hypotheses = Vec::new();
        for (name, offset) in &self.joints {
            let joint = joints.iter().position(|joint| joint.name == *name);
            let Some(joint) = joint else {
                let known: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
                bail!("--joint {name}: expected one of {}", known.join(", "));
            };
            hypotheses.push(Hypothesis::Joint(joint, *offset));
        }
        let speed = |times| Hypothesis::speed(times, base_rests);
        hypotheses.extend(self.speed.map(speed));
        if self.level {
            let slope = GroundSlope::of(&recorded.machine, &recorded.rows).context(
                "--slope-level: expected an attitude and a machine that is calm at some time, found no slope of the ground",
            )?;
            hypotheses.push(Hypothesis::Slope(slope, 0.0));
        }
        if let Some(more_kg) = self.payload_kg {
            hypotheses.push(Hypothesis::Payload(more_kg));
            Hypothesis::machine(&hypotheses, &recorded.machine)
                .map_err(|why| anyhow!("--payload {more_kg}: {why}"))?;
        }
        Ok(hypotheses)
    }
}

/// Whether the base of a machine rests, for each recorded lift and tipping, or for the whole log without any.
fn bases_rest(recorded: &Analysis) -> Vec<bool> {
    let standing = StandingRows::all(&recorded.machine, &recorded.rows, |_| None);
    let rests = |event: &Event| {
        Question::about(&standing, &recorded.rows, event, |question| {
            question.base_rests()
        })
    };
    let events = recorded.events.iter();
    let asked = events.filter(|event| !event.counterfactuals.is_empty());
    let asked: Vec<bool> = asked.filter_map(rests).collect();
    if !asked.is_empty() {
        return asked;
    }
    let (first_ns, wheel) = (
        recorded.rows.times_ns.first(),
        recorded.machine.wheels().first(),
    );
    let whole = first_ns.zip(wheel).and_then(|(&first_ns, wheel)| {
        rests(&Event::blank(
            EventKind::WheelLift,
            first_ns,
            wheel.name.to_lowercase(),
        ))
    });
    vec![whole.unwrap_or(false)]
}

/// Analyses a log as recorded and as supposed.
///
/// # Errors
/// The log cannot be analysed, its inputs are grossly wrong, or what is supposed does not fit the machine.
pub fn suppose(
    log: &Path,
    file: &MachineFile,
    options: Options,
    suppositions: &Suppositions,
) -> Result<[Analysis; 2]> {
    let recorded = analyse(log, file, options, &mut |_| {})?;
    let supposed = supposing(log, file, options, suppositions, &recorded)?;
    Ok([recorded, supposed])
}

/// Analyses a log as supposed, beside its analysis as recorded.
///
/// # Errors
/// As [`suppose`].
pub fn supposing(
    log: &Path,
    file: &MachineFile,
    options: Options,
    suppositions: &Suppositions,
    recorded: &Analysis,
) -> Result<Analysis> {
    if let Some(gross) = recorded.gross_inputs.first() {
        bail!(
            "{}: expected plausible inputs. {}. Likely correction: {}",
            log.display(),
            gross.headline,
            gross.fix
        );
    }
    let hypotheses = suppositions.hypotheses(recorded, !bases_rest(recorded).contains(&false))?;
    let is_level = |hypothesis: &Hypothesis| matches!(hypothesis, Hypothesis::Slope(ground, _) if ground.is_level());
    if suppositions.is_only_level() && hypotheses.iter().any(is_level) {
        // what happened on level ground is what was recorded, with all that was measured of it
        return analyse(log, file, recorded.options, &mut |_| {});
    }
    let file = suppositions.file(file);
    analyse_supposing(log, &file, options, &hypotheses, recorded)
}
