//! Collects the data, identifies, and writes the machine file.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_calibration::identification::{
    Agreement, Data, Disagreement, Estimate, HeldBack, Identification, agreement,
};
use tipwatch_mechanics::machine::Machine;

use super::{collect, weighings};
use crate::analysis::MeasuredLog;
use crate::base::options::Options;

/// Request for an identification.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The logs.
    pub logs: Vec<PathBuf>,
    /// Standard deviation of the slope of the logs' ground, where that is level (rad).
    pub level: Option<f64>,
    /// Factor by which the stated standard deviations of the measurements are widened; 1 if `None`.
    pub sigma_factor: Option<f64>,
}

/// The result, and the data it rests on.
#[derive(Debug)]
pub struct Identified {
    /// The machine without identified parameters.
    pub machine: Machine,
    /// The identification.
    pub result: Identification,
    /// Logs and weighings, with the hashes of the files.
    pub from: Vec<String>,
    /// Notes for the reader.
    pub notes: Vec<String>,
    /// Agreement of the weighings with each other; `None` if no reading is redundant.
    pub agreement: Option<Agreement>,
    /// Whether parts of a log were lost.
    pub has_losses: bool,
}

/// Residuals more than this many times as large as stated are no errors of measurement: the result explains nothing.
const MOST_EXCESS: f64 = 3.0;
/// A parameter that must change by more than this many of its stated standard deviations is not the one that is wrong.
const MOST_CHANGE: f64 = 6.0;
/// Two standard deviations of a load are its mean at twice this model share: no split is so open.
const MOST_MODEL_SHARE: f64 = 0.5;

/// Reason why a result does not count.
#[derive(Debug, Clone, PartialEq)]
pub enum NoResult {
    /// The weighings contradict each other, whatever the machine weighs.
    WeighingsDisagree(Vec<Disagreement>),
    /// The residuals are beyond the stated standard deviations.
    BeyondStated {
        /// Ratio of the residuals to those stated.
        excess: f64,
        /// The factor of `--widen-sigmas` that would be enough.
        wanted: f64,
    },
    /// The readings differ from the computed loads by more than any split of the load between the supports explains.
    BeyondSplit {
        /// The model share that would be needed.
        model_share: f64,
    },
    /// A parameter would have to be far beyond its stated standard deviation.
    BeyondMachine {
        /// Its name.
        parameter: String,
        /// Deviation, in standard deviations stated for the parameter.
        sigmas: f64,
    },
    /// Nothing of a log could be used.
    Unused {
        /// Its name.
        log: String,
    },
    /// Loads were read, and the band of none of them could be computed.
    Unjudged,
    /// The result predicts data that were held back worse than the machine before.
    WorseOnHeldBack,
}

impl NoResult {
    /// Whether the data decide nothing, rather than contradict the stated values.
    #[must_use]
    pub fn is_undecided(&self) -> bool {
        matches!(
            self,
            Self::WorseOnHeldBack | Self::Unused { .. } | Self::Unjudged
        )
    }
}

impl std::fmt::Display for NoResult {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::WeighingsDisagree(suspects) => {
                let suspects = suspects.iter().map(|suspect| {
                    let Disagreement {
                        weighing,
                        channel,
                        difference,
                        sigma,
                    } = suspect;
                    format!(
                        "{channel} in {weighing} differs by {difference:+.0} N from what the others say, expected 0 ± {sigma:.0} N"
                    )
                });
                let suspects: Vec<String> = suspects.collect();
                write!(
                    formatter,
                    "the weighings contradict each other: {}. Correct the reading, state its true standard deviation in \
                     [weighed], or widen all by --widen-sigmas FACTOR",
                    suspects.join(", or ")
                )
            }
            Self::BeyondStated { excess, wanted } => write!(
                formatter,
                "the residuals of the loads are {excess:.1} times as large as stated, expected at most {MOST_EXCESS}. \
                 Something else is wrong: a sensor, the posture, the supports, a payload that is not stated. If the stated \
                 standard deviations are too small, widen them by --widen-sigmas {wanted:.0}"
            ),
            Self::BeyondSplit { model_share } => write!(
                formatter,
                "the measured loads differ from the computed ones by a model_share of {model_share:.2}, expected at most \
                 {MOST_MODEL_SHARE}: no split of the load between the supports explains that. A sensor, its place or its unit is \
                 wrong, or the posture, the supports or a payload"
            ),
            Self::BeyondMachine { parameter, sigmas } => write!(
                formatter,
                "{parameter} would have to change by {sigmas:.1} of its stated standard deviations, expected at most \
                 {MOST_CHANGE}: the readings contradict the machine as stated. A reading, its place or its posture is wrong, or \
                 the machine is less known than [uncertainty] says: then state larger standard deviations there"
            ),
            Self::Unused { log } => write!(
                formatter,
                "{log}: none of its instants could be used: wheels off the ground, or loads that cannot be computed"
            ),
            Self::Unjudged => formatter.write_str(
                "by the identified machine a wheel is off the ground wherever loads were read, so nothing tests the result: \
                 correct the readings or their posture",
            ),
            Self::WorseOnHeldBack => {
                formatter.write_str("the result does not hold on the data that were held back")
            }
        }
    }
}

impl Identified {
    /// Whether the result predicts data that were held back no worse than before; `None` if none were held back.
    #[must_use]
    pub fn holds(&self) -> Option<bool> {
        self.result.held_back.as_ref().map(HeldBack::is_no_worse)
    }

    /// Returns the reason why the result does not count; `None` if it does.
    #[must_use]
    pub fn refusal(&self) -> Option<NoResult> {
        if let Some(agreement) = self.agreement.as_ref().filter(|a| a.is_contradicted()) {
            return Some(NoResult::WeighingsDisagree(agreement.suspects.clone()));
        }
        let factor = self.result.identified.sigma_factor.unwrap_or(1.0);
        let mut sources = self.result.sources.iter();
        if let Some(unused) = sources.find(|source| source.instants == 0) {
            return Some(NoResult::Unused {
                log: unused.name.clone(),
            });
        }
        let bands = self.result.bands.as_ref();
        if bands.is_none() && self.result.fitted.iter().any(|channel| channel.is_load) {
            return Some(NoResult::Unjudged);
        }
        let excess = bands.and_then(|bands| bands.excess);
        if let Some(excess) = excess.filter(|excess| !(*excess <= MOST_EXCESS)) {
            return Some(NoResult::BeyondStated {
                excess,
                wanted: (factor * excess).ceil(),
            });
        }
        let share = bands.map(|bands| bands.model_share);
        let beyond = |share: &f64| !(*share <= MOST_MODEL_SHARE);
        if let Some(model_share) = share.filter(beyond) {
            return Some(NoResult::BeyondSplit { model_share });
        }
        let sigmas = |of: &Estimate| (of.change / of.prior_sigma).abs();
        let changed = self
            .result
            .estimates
            .iter()
            .filter(|of| of.prior_sigma > 0.0);
        let farthest = changed.max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)));
        if let Some(of) = farthest.filter(|of| sigmas(of) > MOST_CHANGE) {
            return Some(NoResult::BeyondMachine {
                parameter: of.name.clone(),
                sigmas: sigmas(of),
            });
        }
        (self.holds() == Some(false)).then_some(NoResult::WorseOnHeldBack)
    }
}

/// Identifies the parameters of the machine of a machine file.
///
/// # Errors
/// A log cannot be read or does not fit the machine, or there is nothing to identify from.
pub fn identify(file: &MachineFile, request: &Request) -> Result<Identified> {
    // An earlier identification is the prior, not a correction of the signals.
    let mut plain = file.clone();
    plain.spec.identified = None;
    // One constant bias of the accelerometer is identified, not one that its estimator changes from row to row.
    let mut reading = plain.clone();
    reading.spec.uncertainty.accelerometer_bias = 0.0;
    let (mut notes, mut from, mut has_losses) = (Vec::new(), Vec::new(), false);
    let mut data = Data::default();
    let mut machine: Option<Machine> = None;
    for path in &request.logs {
        let log = MeasuredLog::read(path, &reading, &Options::default())?;
        let name = file_name(path);
        let known = log
            .loaded
            .machine
            .clone()
            .with_uncertainty(plain.spec.uncertainty);
        match &machine {
            None => machine = Some(known),
            Some(first) if joints(first) != joints(&known) => bail!(
                "{}: expected the joints of the first log ({}), found {}",
                path.display(),
                joints(first).join(", "),
                joints(&known).join(", ")
            ),
            Some(_) => {}
        }
        if let Some(input) = log.gross_inputs.first() {
            bail!(
                "{}: expected plausible inputs, found: {}",
                path.display(),
                input.headline
            );
        }
        notes.extend(log.loads.notes.iter().cloned());
        let unreadable = log
            .forces
            .iter()
            .filter_map(|force| force.series.as_ref().err());
        notes.extend(
            unreadable.map(|error| format!("{name}: a cylinder force is not used: {error}.")),
        );
        has_losses |= !log.loaded.losses.is_empty();
        collect::add(&log, &name, &plain.spec, request.level, &mut data);
        let files = log.files.iter();
        from.extend(files.map(|file| format!("{} sha256 {}", file.path, file.hash_text())));
    }
    let machine = match machine {
        Some(machine) => machine,
        None => plain.check_alone()?,
    };
    if let Some(weighed) = &file.spec.weighed {
        let before = data.sources.len();
        let evaluated = &machine.reference().posture.positions;
        notes.extend(weighings::add(&machine, weighed, evaluated, &mut data));
        let added = data.sources.len() - before;
        from.push(format!("{added} weighings of the machine file"));
    }
    if let Some(factor) = request.sigma_factor {
        widen(&mut data, factor);
        notes.push(format!(
            "The stated standard deviations of all scales and sensors were widened by the factor {factor}."
        ));
    }
    let earlier = earlier(file, &machine)?;
    if earlier.is_some() {
        notes.push(
            "The machine file was identified before; that result is the prior. Data that it used must not be used again: \
             they would count twice."
                .into(),
        );
    }
    let mut result =
        tipwatch_calibration::identification::identify(&machine, earlier.as_ref(), &data)
            .with_context(|| format!("{}: nothing to identify from", file.path.display()))?;
    result.identified.sigma_factor = request.sigma_factor;
    Ok(Identified {
        agreement: agreement(&machine, &data),
        machine,
        result,
        from,
        notes,
        has_losses,
    })
}

/// Widens the standard deviations of everything that was measured.
fn widen(data: &mut Data, factor: f64) {
    for channel in &mut data.channels {
        channel.bias_sigma *= factor;
    }
    let instants = data.sources.iter_mut().flat_map(|of| &mut of.instants);
    for reading in instants.flat_map(|instant| &mut instant.readings) {
        reading.sigma *= factor;
    }
}

/// The parameters of an earlier identification, of this machine.
fn earlier(
    file: &MachineFile,
    machine: &Machine,
) -> Result<Option<tipwatch_mechanics::machine::Identified>> {
    Ok(file.spec.identified_of(machine)?)
}

fn joints(machine: &Machine) -> Vec<&str> {
    machine
        .joints()
        .iter()
        .map(|joint| joint.name.as_str())
        .collect()
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}
