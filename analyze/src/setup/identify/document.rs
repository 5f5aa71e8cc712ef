//! The result of an identification as JSON.

use serde::Serialize;
use tipwatch_calibration::identification::{
    Agreement, ChannelError, Combination, Knowledge, SourceUse,
};

use super::run::Identified;
use crate::base::number::known;

/// Most correlations listed.
const MOST_CORRELATIONS: usize = 20;
/// Smallest correlation listed.
const LEAST_CORRELATION: f64 = 0.3;

/// The document.
#[derive(Debug, Serialize)]
pub struct IdentificationDocument {
    schema: u32,
    from: Vec<String>,
    notes: Vec<String>,
    sources: Vec<SourceRow>,
    parameters: Vec<ParameterRow>,
    /// Correlations of the estimates, the largest first.
    pub(super) correlations: Vec<CorrelationRow>,
    /// Combinations that the data tell, the best first.
    told: Vec<CombinationRow>,
    /// Parameters of which the data tell nothing.
    not_told: Vec<String>,
    /// Combinations of parameters that the data cannot tell apart.
    not_told_apart: Vec<CombinationRow>,
    fitted: Vec<ErrorRow>,
    held_back: Option<HeldBackRow>,
    /// Readings of loads against the bands of the identified machine.
    bands: Option<BandRow>,
    /// Weighings against each other.
    weighings: Option<AgreementRow>,
    /// Why this is no result, and nothing is written.
    refused: Option<String>,
}

#[derive(Debug, Serialize)]
struct SourceRow {
    name: String,
    instants: usize,
    left_out: usize,
    outliers: usize,
    independent_instants: f64,
    residuals_over_stated: f64,
}

#[derive(Debug, Serialize)]
struct ParameterRow {
    parameter: String,
    unit: &'static str,
    nominal: Option<f64>,
    change: f64,
    prior_sigma: f64,
    sigma: f64,
    told: &'static str,
}

/// Correlation of two estimates.
#[derive(Debug, Serialize)]
pub(super) struct CorrelationRow {
    pub(super) parameters: [String; 2],
    pub(super) correlation: f64,
}

#[derive(Debug, Serialize)]
struct CombinationRow {
    singular_value: Option<f64>,
    /// Parts in prior standard deviations.
    parts: Vec<(String, f64)>,
}

#[derive(Debug, Serialize)]
struct ErrorRow {
    sensor: String,
    unit: &'static str,
    readings: usize,
    bias_before: Option<f64>,
    rms_before: Option<f64>,
    bias_after: Option<f64>,
    rms_after: Option<f64>,
}

#[derive(Debug, Serialize)]
struct HeldBackRow {
    instants: usize,
    loads_rms_before_n: Option<f64>,
    loads_rms_after_n: Option<f64>,
    is_no_worse: bool,
    sensors: Vec<ErrorRow>,
}

#[derive(Debug, Serialize)]
struct BandRow {
    readings: usize,
    inside_two_sigma: f64,
    residuals_over_stated: Option<f64>,
    stated_model_share: f64,
    model_share: f64,
}

/// Weighings against each other.
#[derive(Debug, Serialize)]
pub struct AgreementRow {
    pub(in crate::setup) chi_square: f64,
    /// Degrees of freedom of chi-square.
    pub(in crate::setup) redundant_readings: usize,
    pub(in crate::setup) contradict_each_other: bool,
    /// The readings that disagree most with all others; several are equally suspect.
    pub(in crate::setup) suspects: Vec<SuspectRow>,
}

/// A reading that disagrees with all others.
#[derive(Debug, Serialize)]
pub(in crate::setup) struct SuspectRow {
    pub(in crate::setup) weighing: String,
    pub(in crate::setup) reading: String,
    /// The reading minus what the others say of it.
    pub(in crate::setup) difference_n: f64,
    pub(in crate::setup) difference_sigma_n: f64,
}

impl AgreementRow {
    /// "most front axle in empty: +1442 N from what the others say, expected 0 ± 170 N".
    pub(in crate::setup) fn suspects_text(&self) -> String {
        let each = self.suspects.iter().map(|suspect| {
            format!(
                "{} in {} ({:+.0} N from what the others say, expected 0 ± {:.0} N)",
                suspect.reading, suspect.weighing, suspect.difference_n, suspect.difference_sigma_n
            )
        });
        let each: Vec<String> = each.collect();
        match each.len() {
            1 => format!("most {}", each[0]),
            count => format!(
                "and one of these {count} is wrong, all equally suspect: {}",
                each.join("; ")
            ),
        }
    }
}

impl From<Agreement> for AgreementRow {
    fn from(agreement: Agreement) -> Self {
        Self {
            contradict_each_other: agreement.is_contradicted(),
            chi_square: agreement.chi_square,
            redundant_readings: agreement.redundant,
            suspects: (agreement.suspects.into_iter())
                .map(|suspect| SuspectRow {
                    weighing: suspect.weighing,
                    reading: suspect.channel,
                    difference_n: suspect.difference,
                    difference_sigma_n: suspect.sigma,
                })
                .collect(),
        }
    }
}

impl IdentificationDocument {
    /// The document of a result.
    #[must_use]
    pub fn of(found: &Identified) -> Self {
        let result = &found.result;
        let name = |index: usize| result.estimates[index].name.clone();
        let combination = |c: &Combination| CombinationRow {
            singular_value: (c.singular_value > 0.0).then_some(c.singular_value),
            parts: c
                .terms
                .iter()
                .map(|t| (name(t.unknown), t.weight))
                .collect(),
        };
        let source = |source: &SourceUse| SourceRow {
            name: source.name.clone(),
            instants: source.instants,
            left_out: source.left_out,
            outliers: source.outliers,
            independent_instants: source.effective,
            residuals_over_stated: source.scale,
        };
        Self {
            schema: 1,
            from: found.from.clone(),
            notes: found.notes.clone(),
            sources: result.sources.iter().map(source).collect(),
            parameters: (result.estimates.iter())
                .map(|e| ParameterRow {
                    parameter: e.name.clone(),
                    unit: e.unit,
                    nominal: e.nominal,
                    change: e.change,
                    prior_sigma: e.prior_sigma,
                    sigma: e.sigma,
                    told: knowledge(e.knowledge),
                })
                .collect(),
            correlations: correlations(found),
            told: result.told.iter().map(combination).collect(),
            not_told: result.untold.iter().map(|&index| name(index)).collect(),
            not_told_apart: result.indistinguishable.iter().map(combination).collect(),
            fitted: result.fitted.iter().map(error).collect(),
            held_back: result.held_back.as_ref().map(|held| HeldBackRow {
                instants: held.instants,
                loads_rms_before_n: known(held.loads_before),
                loads_rms_after_n: known(held.loads_after),
                is_no_worse: held.is_no_worse(),
                sensors: held.channels.iter().map(error).collect(),
            }),
            bands: result.bands.map(|bands| BandRow {
                readings: bands.readings,
                inside_two_sigma: bands.inside_two_sigma,
                residuals_over_stated: bands.excess,
                stated_model_share: bands.stated_share,
                model_share: bands.model_share,
            }),
            weighings: found.agreement.clone().map(AgreementRow::from),
            refused: found.refusal().map(|refusal| refusal.to_string()),
        }
    }
}

fn knowledge(of: Knowledge) -> &'static str {
    match of {
        Knowledge::Told => "yes",
        Knowledge::Partly => "partly",
        Knowledge::Untold => "no",
    }
}

fn error(of: &ChannelError) -> ErrorRow {
    ErrorRow {
        sensor: of.name.clone(),
        unit: of.unit,
        readings: of.readings,
        bias_before: known(of.bias_before),
        rms_before: known(of.rms_before),
        bias_after: known(of.bias_after),
        rms_after: known(of.rms_after),
    }
}

/// The largest correlations.
pub(super) fn correlations(found: &Identified) -> Vec<CorrelationRow> {
    let result = &found.result;
    let size = result.estimates.len();
    let pairs = (0..size).flat_map(|a| (0..a).map(move |b| (a, b)));
    let mut found: Vec<(usize, usize, f64)> = pairs
        .map(|(a, b)| (a, b, result.identified.correlation(a, b)))
        .filter(|(.., correlation)| correlation.abs() >= LEAST_CORRELATION)
        .collect();
    found.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
    let name = |index: usize| result.estimates[index].name.clone();
    (found.into_iter().take(MOST_CORRELATIONS))
        .map(|(a, b, correlation)| CorrelationRow {
            parameters: [name(b), name(a)],
            correlation,
        })
        .collect()
}
