//! A log as recorded, and as it would have been: on level ground, at another speed, with another load.

use std::path::Path;

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{PayloadMass, PayloadSpec};

use crate::analysis::Analysis;
use crate::analysis::advice::{GroundSlope, Hypothesis};
use crate::analysis::run::{analyse, analyse_supposing};
use crate::base::options::Options;
use crate::events::support_words::edge_word;
use crate::events::{Event, EventKind, ShownBy};

/// What is supposed instead of what was recorded, all of it together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Suppositions {
    /// The ground has no slope; the platform rocks on it as recorded.
    pub level: bool,
    /// Machine and arm travel the same path so many times as fast.
    pub speed: Option<f64>,
    /// More mass on the tool (kg), negative for less of a stated payload.
    pub payload_kg: Option<f64>,
    /// Joints by name that are off by a constant (rad or m).
    pub joints: Vec<(String, f64)>,
    /// Another roll moment distribution.
    pub split: Option<f64>,
}

/// What the evaluation of a supposition cannot show, beside the analysis of what was recorded.
#[must_use]
pub fn caveats(recorded: &Analysis, suppositions: &Suppositions) -> Vec<String> {
    let slope = suppositions
        .level
        .then(|| GroundSlope::of(&recorded.machine, &recorded.rows))
        .flatten();
    let degrees = |slope: &GroundSlope| 2.0 * slope.largest_sigma_rad().to_degrees();
    let level = slope.as_ref().filter(|slope| slope.is_level()).map(|slope| {
        say!(
            "The log does not tell the ground from level ground (to ± {:.1}°, two standard deviations): to suppose it level changes nothing.",
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
        word!("A speed changes velocities by its factor and accelerations by its square, on the same path: times stay those of the log.").into(),
        word!("Measured forces of actuators are not used, and sensors are not compared with each other.").into(),
    ];
    if let Some(fall) = first_fall(recorded) {
        let at_s = recorded.rows.seconds_at(fall.start_ns);
        caveats.insert(0, say!(
            "The platform began to rotate about an edge at t = {at_s:.2} s. While it did, only what was recorded is known: whether the machine as supposed would have tipped then is open."
        ));
    }
    caveats.extend(level.or(sloped));
    caveats
}

/// What was measured of the first rotation about an edge, where the supposed analysis has none: it knows loads alone.
#[must_use]
pub fn measured_fall(recorded: &Analysis, supposed: &Analysis) -> Option<String> {
    let fall = first_fall(recorded).filter(|_| first_fall(supposed).is_none())?;
    let at_s = recorded.rows.seconds_at(fall.start_ns);
    let rotated = fall.rotation_rad.map_or(String::new(), |rotation_rad| {
        say!(" by {:.0}°", rotation_rad.to_degrees())
    });
    Some(say!(
        "As recorded, the platform rotated{rotated} about the {} edge from t = {at_s:.2} s; whether it would have as supposed is open",
        edge_word(&fall.subject)
    ))
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
    /// Whether level ground is all that is supposed.
    fn is_only_level(&self) -> bool {
        let level = Self {
            level: true,
            ..Self::default()
        };
        *self == level
    }

    /// Whether nothing is supposed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// In words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let mut all = Vec::new();
        if self.level {
            all.push(word!("level ground").to_string());
        }
        all.extend(self.speed.map(|times| say!("{times} times the speed")));
        all.extend(self.payload_kg.map(|kg| say!("payload {kg:+} kg")));
        let joints = self.joints.iter();
        all.extend(joints.map(|(name, offset)| say!("joint {name} {offset:+}")));
        all.extend(self.split.map(|d| say!("roll moment distribution {d}")));
        all.join(", ")
    }

    /// The machine file with what it states of the supposed payload and split.
    fn file(&self, file: &MachineFile) -> Result<MachineFile> {
        let mut supposed = file.clone();
        let place = file.path.display();
        if let Some(split) = self.split {
            supposed.spec.contact.roll_moment_distribution = Some(split);
        }
        let Some(more_kg) = self.payload_kg else {
            return Ok(supposed);
        };
        let more = match supposed.spec.payload.first_mut() {
            Some(payload) => match &mut payload.mass {
                PayloadMass::Known(mass) if *mass + more_kg < 0.0 => bail!(
                    "{place}: expected a payload that stays positive, found {mass} kg and {more_kg} kg more (--payload)"
                ),
                PayloadMass::Known(mass) if more_kg < 0.0 => {
                    *mass += more_kg;
                    return Ok(supposed);
                }
                PayloadMass::Known(_) => payload.clone(),
                PayloadMass::Word(word) => bail!(
                    "{place}: expected a payload of stated mass for --payload, found mass = \"{word}\""
                ),
                PayloadMass::Signal(mass) => bail!(
                    "{place}: expected a payload of stated mass for --payload, found one from the signal {}",
                    mass.signal.topic
                ),
            },
            None if more_kg < 0.0 => bail!(
                "{place}: expected a [[payload]] from which --payload {more_kg} takes, found none"
            ),
            None => {
                let arm = file.spec.arm.as_ref();
                let tool = arm.and_then(|arm| arm.tool.clone()).with_context(|| {
                    format!(
                        "{place}: expected [arm] tool or a [[payload]] for --payload, found neither"
                    )
                })?;
                PayloadSpec {
                    link: tool,
                    mass: PayloadMass::Known(0.0),
                    mass_sigma: None,
                    com: [0.0; 3],
                    inertia: [0.0; 6],
                    from: None,
                    to: None,
                }
            }
        };
        // With a begin it is no part of the reference: the limits stay those of the machine as recorded, also where it would
        // not stand in its reference posture with so much more.
        supposed.spec.payload.push(PayloadSpec {
            mass: PayloadMass::Known(more_kg),
            mass_sigma: Some(0.0),
            inertia: [0.0; 6],
            from: more.from.or(Some(0.0)),
            ..more
        });
        Ok(supposed)
    }
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
    if let Some(gross) = recorded.gross_inputs.first() {
        bail!(
            "{}: expected plausible inputs. {}. Likely correction: {}",
            log.display(),
            gross.headline,
            gross.fix
        );
    }
    let joints = recorded.machine.joints();
    let mut hypotheses = Vec::new();
    for (name, offset) in &suppositions.joints {
        let joint = joints.iter().position(|joint| joint.name == *name);
        let Some(joint) = joint else {
            let known: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
            bail!("--joint {name}: expected one of {}", known.join(", "));
        };
        hypotheses.push(Hypothesis::Joint(joint, *offset));
    }
    hypotheses.extend(suppositions.speed.map(Hypothesis::Speed));
    if suppositions.level {
        let slope = GroundSlope::of(&recorded.machine, &recorded.rows).with_context(|| {
            format!(
                "{}: expected an attitude and a machine that is calm at some time for --slope-level, found no slope of the ground",
                log.display()
            )
        })?;
        match slope.is_level() {
            // what happened on level ground is what was recorded, with all that was measured of it
            true if suppositions.is_only_level() => {
                let again = analyse(log, file, recorded.options, &mut |_| {})?;
                return Ok([recorded, again]);
            }
            true => {}
            false => hypotheses.push(Hypothesis::LevelGround(slope)),
        }
    }
    let file = suppositions.file(file)?;
    let supposed = analyse_supposing(log, &file, options, &hypotheses, &recorded)?;
    Ok([recorded, supposed])
}
