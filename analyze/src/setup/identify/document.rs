//! The result of an identification as JSON.

use serde::Serialize;
use tipwatch_calibration::identification::{
    Agreement, BandCheck, ChannelError, Combination, Disagreement, Estimate, SourceUse,
};

use super::run::Identified;
use crate::base::built::built;
use crate::base::number::known;

/// Most correlations listed.
const MOST_CORRELATIONS: usize = 20;
/// Smallest correlation listed.
const LEAST_CORRELATION: f64 = 0.3;

built! {
    /// The document.
    #[derive(Debug, Serialize)]
    pub struct IdentificationDocument: pub fn of(found: &Identified) {
        let result = &found.result;
        let name = |index: usize| result.estimates[index].name.clone();
        let combination = |c: &Combination| CombinationRow {
            singular_value: (c.singular_value > 0.0).then_some(c.singular_value),
            parts: c.terms.iter().map(|t| (name(t.unknown), t.weight)).collect(),
        };
    } {
        schema: u32 = 1,
        from: Vec<String> = found.from.clone(),
        notes: Vec<String> = found.notes.clone(),
        sources: Vec<SourceUse> = result.sources.clone(),
        parameters: Vec<Estimate> = result.estimates.clone(),
        /// Correlations of the estimates, the largest first.
        pub(super) correlations: Vec<CorrelationRow> = correlations(found),
        /// Combinations of parameters that the data determine, the best first.
        told: Vec<CombinationRow> = result.determined.iter().map(combination).collect(),
        /// Parameters that the data do not determine at all.
        not_told: Vec<String> = result.undetermined.iter().map(|&index| name(index)).collect(),
        /// Combinations of parameters that the data do not determine.
        not_told_apart: Vec<CombinationRow> = result.indistinguishable.iter().map(combination).collect(),
        fitted: Vec<ChannelError> = result.fitted.clone(),
        held_back: Option<HeldBackRow> = result.held_back.as_ref().map(|held| HeldBackRow {
            instants: held.instants,
            loads_rms_before_n: known(held.loads_before),
            loads_rms_after_n: known(held.loads_after),
            is_no_worse: held.is_no_worse(),
            sensors: held.channels.clone(),
        }),
        /// Readings of loads against the bands of the identified machine.
        bands: Option<BandCheck> = result.bands,
        /// Weighings against each other.
        weighings: Option<AgreementRow> = found.agreement.clone().map(AgreementRow::from),
        /// Reason why this is no result, and nothing is written.
        refused: Option<String> = found.refusal().map(|refusal| refusal.to_string()),
    }
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
struct HeldBackRow {
    instants: usize,
    loads_rms_before_n: Option<f64>,
    loads_rms_after_n: Option<f64>,
    is_no_worse: bool,
    sensors: Vec<ChannelError>,
}

/// Weighings against each other.
#[derive(Debug, Serialize)]
pub struct AgreementRow {
    pub(in crate::setup) chi_square: f64,
    /// Degrees of freedom of chi-square.
    pub(in crate::setup) redundant_readings: usize,
    pub(in crate::setup) contradict_each_other: bool,
    /// The readings that disagree most with all others; several are equally suspect.
    pub(in crate::setup) suspects: Vec<Disagreement>,
}

impl AgreementRow {
    /// Describes suspect readings: "most front axle in empty: +1442 N from what the others say, expected 0 ± 170 N".
    pub(in crate::setup) fn suspects_text(&self) -> String {
        let each = self.suspects.iter().map(|suspect| {
            format!(
                "{} in {} ({:+.0} N from what the others say, expected 0 ± {:.0} N)",
                suspect.channel, suspect.weighing, suspect.difference, suspect.sigma
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
            suspects: agreement.suspects,
        }
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
