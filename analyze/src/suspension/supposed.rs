//! A log as recorded, and as it would have been: on level ground, at another speed, with another load.

use std::path::Path;

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{PayloadMass, PayloadSpec};

use crate::analysis::Analysis;
use crate::analysis::advice::Hypothesis;
use crate::analysis::run::{analyse, analyse_supposing};
use crate::base::options::Options;
use crate::events::{EventKind, ShownBy};

/// What is supposed instead of what was recorded, all of it together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Suppositions {
    /// Gravity is perpendicular to the ground under the wheels.
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
pub fn caveats(recorded: &Analysis) -> Vec<String> {
    let mut caveats = vec![
        "Everything else is as recorded: the path, the ground, the rocking of the platform. Nobody reacts.".to_string(),
        "A speed changes velocities by its factor and accelerations by its square, on the same path: times stay those of the log.".into(),
        "Measured forces of actuators are not used, and sensors are not compared with each other.".into(),
    ];
    let falls = recorded.events.iter().filter(|event| {
        event.kind == EventKind::EdgeTipping
            && matches!(event.shown_by, Some(ShownBy::Rotation | ShownBy::Both))
    });
    if let Some(first_ns) = falls.map(|event| event.start_ns).min() {
        let at_s = (first_ns - recorded.rows.times_ns[0]) as f64 * 1e-9;
        caveats.insert(0, format!(
            "The platform began to rotate about an edge at t = {at_s:.2} s. While it did, only what was recorded is known: whether the machine as supposed would have tipped then is open."
        ));
    }
    caveats
}

impl Suppositions {
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
            all.push("level ground".to_string());
        }
        all.extend(self.speed.map(|times| format!("{times} times the speed")));
        all.extend(self.payload_kg.map(|kg| format!("payload {kg:+} kg")));
        let joints = self.joints.iter();
        all.extend(joints.map(|(name, offset)| format!("joint {name} {offset:+}")));
        all.extend(self.split.map(|d| format!("roll moment distribution {d}")));
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
    hypotheses.extend(suppositions.level.then_some(Hypothesis::LevelGround));
    let file = suppositions.file(file)?;
    let supposed = analyse_supposing(log, &file, options, &hypotheses)?;
    Ok([recorded, supposed])
}
