//! The identification: from data to a machine, with what they tell and what not.

use serde::Serialize;
use tipwatch_mechanics::machine::{Identified, Machine};

use crate::identification::bands::BandCheck;
use crate::identification::data::Data;
use crate::identification::directions::{Combination, named};
use crate::identification::fit::{SourceUse, fit};
use crate::identification::held_back::split;
use crate::identification::model::Changed;
use crate::identification::posterior::Posterior;
use crate::identification::prior::Prior;

/// Remaining share of a prior standard deviation below which a parameter is determined, and above which it is not.
const DETERMINED: f64 = 0.5;
const UNDETERMINED: f64 = 0.9;

/// Result of an identification.
#[derive(Debug)]
pub struct Identification {
    /// The changes and their joint uncertainty, as the machine file states them.
    pub identified: Identified,
    /// Every parameter.
    pub estimates: Vec<Estimate>,
    /// Combinations that the data determine at least as well as the prior, by index of the estimate.
    pub determined: Vec<Combination>,
    /// Parameters that the data do not determine, alone or together, by index of the estimate.
    pub undetermined: Vec<usize>,
    /// Combinations of parameters that the data cannot tell apart.
    pub indistinguishable: Vec<Combination>,
    /// Use of each log and weighing.
    pub sources: Vec<SourceUse>,
    /// Errors of the readings that were fitted.
    pub fitted: Vec<ChannelError>,
    /// Error on the data that were held back; `None` if there were too few.
    pub held_back: Option<HeldBack>,
    /// The readings of loads against the bands of the identified machine; `None` without any.
    pub bands: Option<BandCheck>,
}

/// A parameter after the identification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Its name.
    #[serde(rename = "parameter")]
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Its value before, where it has one.
    pub nominal: Option<f64>,
    /// Its change.
    pub change: f64,
    /// Standard deviation before, in the parameter's unit.
    pub prior_sigma: f64,
    /// Standard deviation after, in the parameter's unit.
    pub sigma: f64,
    /// Extent to which the data determine the parameter by itself.
    #[serde(rename = "told")]
    pub knowledge: Knowledge,
}

/// Extent to which the data determine a parameter by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Knowledge {
    /// Its standard deviation at least halved.
    #[serde(rename = "yes")]
    Determined,
    /// Something.
    #[serde(rename = "partly")]
    Partly,
    /// Nothing: its standard deviation is that of the prior.
    #[serde(rename = "no")]
    Undetermined,
}

/// Errors of the readings of a channel: measured minus computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelError {
    /// Name of the channel.
    #[serde(rename = "sensor")]
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Whether the channel measures loads of supports.
    #[serde(skip)]
    pub is_load: bool,
    /// Number of readings.
    pub readings: usize,
    /// Mean error before.
    pub bias_before: f64,
    /// Root mean square error before.
    pub rms_before: f64,
    /// Mean error after.
    pub bias_after: f64,
    /// Root mean square error after.
    pub rms_after: f64,
}

/// Errors on the data that were held back.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldBack {
    /// Errors of each channel.
    pub channels: Vec<ChannelError>,
    /// Root mean square error of all loads before (N); NaN without loads.
    pub loads_before: f64,
    /// Root mean square error of all loads after (N).
    pub loads_after: f64,
    /// Number of instants.
    pub instants: usize,
}

impl HeldBack {
    /// Whether the identified machine predicts the data that were held back no worse than the machine before.
    #[must_use]
    pub fn is_no_worse(&self) -> bool {
        // loads, forces and specific forces: each kind by itself, with room for rounding only
        let kind = |of: &ChannelError| (of.is_load, of.unit);
        self.channels.iter().all(|first| {
            let of_kind = self.channels.iter().filter(|of| kind(of) == kind(first));
            let [before, after] = of_kind.fold([0.0; 2], |[before, after], of| {
                let readings = of.readings as f64;
                [
                    before + readings * of.rms_before.powi(2),
                    after + readings * of.rms_after.powi(2),
                ]
            });
            after <= before * (1.0 + 1e-6) + 1e-12
        })
    }
}

/// Error of an identification that lacks data or unknowns.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NothingToIdentify {
    /// No usable instant.
    #[error(
        "expected measured loads, actuator forces or specific forces of a machine with all wheels on the ground, found \
         none that can be used"
    )]
    NoData,
    /// No uncertain parameter.
    #[error("expected a parameter with an uncertainty in [uncertainty], found none")]
    NoUnknown,
}

/// Identifies the parameters of `machine`, which must be without identified parameters; `earlier` are those of an
/// earlier identification, whose result is then the prior. The states of the data must not be corrected by it.
///
/// # Errors
/// [`NothingToIdentify`]: no data or no unknown.
pub fn identify(
    machine: &Machine,
    earlier: Option<&Identified>,
    data: &Data,
) -> Result<Identification, NothingToIdentify> {
    let prior = Prior::new(machine, earlier);
    if prior.unknowns.is_empty() {
        return Err(NothingToIdentify::NoUnknown);
    }
    let (fitted, held) = split(data);
    let found = fit(machine, &prior, &fitted).ok_or(NothingToIdentify::NoData)?;
    let posterior = Posterior::of(&prior, &found);
    let mut identified = posterior.identified(&prior, &found);
    let bands = BandCheck::of(machine, &identified, [&fitted, &held]);
    identified.model_share = (bands.as_ref())
        .filter(|bands| bands.model_share > bands.stated_share)
        .map(|bands| bands.model_share);
    let sets = data.sets();
    let before = Changed::new(machine, &sets, &prior.unknowns, &prior.changes(&prior.mean));
    let after = Changed::new(machine, &sets, &prior.unknowns, &identified.change);
    let names = named(&posterior);
    Ok(Identification {
        estimates: estimates(machine, &prior, &identified),
        determined: names.determined,
        undetermined: names.undetermined,
        indistinguishable: names.indistinguishable,
        sources: found.sources,
        fitted: errors(&fitted, &before, &after).0,
        held_back: held_back(&held, &before, &after),
        bands,
        identified,
    })
}

fn estimates(machine: &Machine, prior: &Prior, identified: &Identified) -> Vec<Estimate> {
    let unknowns = prior.unknowns.iter().enumerate();
    let estimate = |(place, &unknown): (usize, _)| {
        let prior_sigma = stated(prior, place);
        let sigma = identified.sigma(unknown).unwrap_or(prior_sigma);
        Estimate {
            name: unknown.name(machine),
            unit: unknown.unit(machine),
            nominal: unknown.nominal(machine),
            change: identified.change[place],
            prior_sigma,
            sigma,
            knowledge: match sigma / prior_sigma {
                share if share <= DETERMINED => Knowledge::Determined,
                share if share <= UNDETERMINED => Knowledge::Partly,
                _ => Knowledge::Undetermined,
            },
        }
    };
    unknowns.map(estimate).collect()
}

/// Standard deviation of an unknown by the machine file.
fn stated(prior: &Prior, place: usize) -> f64 {
    prior.sigmas[place]
}

fn held_back(held: &Data, before: &Changed, after: &Changed) -> Option<HeldBack> {
    let (channels, loads, instants) = errors(held, before, after);
    let [loads_before, loads_after] = loads;
    (instants > 0).then_some(HeldBack {
        channels,
        loads_before,
        loads_after,
        instants,
    })
}

/// Errors by channel, root mean square errors of all loads, and the number of instants.
fn errors(data: &Data, before: &Changed, after: &Changed) -> (Vec<ChannelError>, [f64; 2], usize) {
    use rayon::prelude::*;

    let instants: Vec<_> = data
        .sources
        .iter()
        .flat_map(|source| &source.instants)
        .collect();
    let predicted = instants.par_iter().map(|instant| {
        let predict = |by: &Changed| by.predict(instant, [0.0; 2]);
        (*instant, predict(before), predict(after))
    });
    let predicted: Vec<_> = predicted.collect();
    let mut sums = vec![[0.0_f64; 5]; data.channels.len()];
    let mut used = 0;
    for (instant, before, after) in &predicted {
        if !(before.iter().chain(after)).all(|value| value.is_finite()) {
            continue;
        }
        used += 1;
        for (place, reading) in instant.readings.iter().enumerate() {
            let errors = [before, after].map(|of| reading.value - of[place]);
            let sum = &mut sums[reading.channel];
            sum[0] += 1.0;
            for (k, error) in errors.into_iter().enumerate() {
                sum[1 + 2 * k] += error;
                sum[2 + 2 * k] += error * error;
            }
        }
    }
    let pairs = || data.channels.iter().zip(&sums);
    let channels = pairs()
        .filter(|(_, sum)| sum[0] > 0.0)
        .map(|(channel, sum)| {
            let mean = |k: usize| sum[k] / sum[0];
            ChannelError {
                name: channel.name.clone(),
                unit: channel.unit,
                is_load: channel.is_load,
                readings: sum[0] as usize,
                bias_before: mean(1),
                rms_before: mean(2).sqrt(),
                bias_after: mean(3),
                rms_after: mean(4).sqrt(),
            }
        });
    let of_loads = |k: usize| {
        let loads = pairs()
            .filter(|(channel, _)| channel.is_load)
            .map(|(_, sum)| sum);
        let (squares, count) = loads.fold((0.0, 0.0), |(a, b), sum| (a + sum[k], b + sum[0]));
        (squares / count).sqrt()
    };
    (channels.collect(), [of_loads(2), of_loads(4)], used)
}
