//! Builds the summary of an analysis.

use std::collections::BTreeMap;

use tipwatch_mechanics::machine::Payload;
use tipwatch_mechanics::studies::monte_carlo::Band;
use tipwatch_mechanics::{ColumnNames, State};

use super::document::*;
use super::events::groups;
use crate::analysis::measured_loads::TOTAL;
use crate::analysis::model_comparison::ModelComparison;
use crate::analysis::{Analysis, Input};
use crate::base::number::known;
use crate::events::Finding;
use crate::events::split_rule::split_rule;

impl<'a> Summary<'a> {
    /// Builds the document.
    #[must_use]
    pub fn of(analysis: &'a Analysis, findings: Vec<Finding>) -> Self {
        let (findings, evidence) = (findings.into_iter())
            .map(|finding| (finding.headline, finding.evidence))
            .unzip();
        let wheels = analysis.machine.wheels().iter().enumerate();
        Self {
            schema: SCHEMA,
            findings,
            evidence,
            gross_inputs: &analysis.gross_inputs,
            events: groups(&analysis.events, analysis.rows.times_ns[0]),
            wheels: wheels
                .map(|(i, wheel)| (wheel.name.to_lowercase(), wheel_summary(analysis, i)))
                .collect(),
            machine: MachineSummary {
                name: analysis.machine.name(),
                mass_kg: analysis.machine.mass(),
                largest_mass_kg: largest_mass_kg(analysis),
                gravity_m_s2: analysis.machine.gravity(),
                base_link: analysis.machine.base_link(),
            },
            rows: row_summary(analysis),
            coverage: analysis.coverage,
            specific_force_source: specific_force_source(&analysis.inputs),
            inputs: analysis.inputs.iter().map(input_summary).collect(),
            health: &analysis.health,
            clock: ClockSummary {
                findings: &analysis.clock_findings,
                offsets: &analysis.clock,
            },
            notes: analysis.notes.iter().map(|note| &**note).collect(),
            losses: &analysis.losses,
            model: model_summary(analysis),
            sensitivity: sensitivity_summary(analysis),
            advice: analysis.advice.as_ref(),
            explained_falls: &analysis.explained_falls,
            turning_at_end: analysis.turning.as_ref(),
            estimated_payloads: &analysis.payloads,
            measured_loads: measured_loads(analysis),
            monte_carlo: monte_carlo_summary(analysis),
            clips: analysis.clips.as_deref(),
            uncertainty: analysis
                .machine
                .uncertainty()
                .by_key()
                .into_iter()
                .collect(),
            options: analysis.options,
            provenance: &analysis.provenance,
        }
    }
}

fn specific_force_source(inputs: &[Input]) -> &'static str {
    let has = |signal: &str| inputs.iter().any(|input| input.signal == signal);
    match (has("imu"), has("odometry")) {
        (true, _) => "imu",
        (false, true) => "odometry",
        (false, false) => "none",
    }
}

fn wheel_summary(analysis: &Analysis, wheel: usize) -> WheelSummary {
    let found = &analysis.digest.wheels[wheel];
    WheelSummary {
        static_load_n: known(analysis.machine.reference().static_load[wheel]),
        min_load_limit_n: analysis.min_loads_n.as_ref().map(|loads| loads[wheel]),
        mean_load_n: known(found.mean_load_n),
        least_load_n: found.least_load_n,
        least_otf_n: found.least_otf.map(|(_, otf_n)| otf_n),
        least_otf_s: found.least_otf.map(|(row, _)| analysis.rows.seconds(row)),
        largest_load_n: found.largest_load_n,
        median_load_sigma_n: found.median_load_sigma_n,
    }
}

fn model_summary(analysis: &Analysis) -> ModelSummary {
    let wheels = analysis.machine.wheels();
    let by_wheel = |comparison: &ModelComparison| {
        let differences = comparison.wheels.iter().zip(wheels);
        differences
            .map(|(difference, wheel)| (wheel.name.to_lowercase(), *difference))
            .collect()
    };
    let known = analysis.comparisons.iter().flatten();
    let others = known.map(|comparison| OtherModelSummary {
        name: comparison.other.name(),
        rows_compared: comparison.rows,
        difference: by_wheel(comparison),
    });
    ModelSummary {
        name: analysis.options.model.name(),
        split_rule: split_rule(&analysis.machine),
        others: others.collect(),
        other_notes: (analysis.comparisons.iter())
            .filter_map(|comparison| comparison.as_ref().err().cloned())
            .collect(),
    }
}

/// Mass of the machine with the payloads of the row in which they are heaviest (kg).
fn largest_mass_kg(analysis: &Analysis) -> f64 {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    let payloads = machine.payloads();
    if payloads.iter().all(Payload::is_always) {
        return machine.mass();
    }
    let mut state = State::zero(machine);
    let carried_kg = |row: usize| -> f64 {
        rows.state(row, &mut state);
        let of_row = state.payload_share.iter().zip(payloads);
        let of_row = of_row.filter(|(_, payload)| !payload.is_always());
        of_row
            .map(|(share, payload)| share * payload.inertia.mass)
            .sum()
    };
    machine.mass() + (0..rows.len()).map(carried_kg).fold(0.0, f64::max)
}

fn measured_loads(analysis: &Analysis) -> Vec<MeasuredLoadSummary<'_>> {
    let comparison = &analysis.load_comparison;
    let sensors = comparison.sensors.iter().map(|statistics| {
        let spans = comparison.contradictions.iter();
        let own = spans.filter(|span| span.sensor == statistics.sensor || span.sensor == TOTAL);
        MeasuredLoadSummary {
            statistics,
            contradictions_ns: own.map(|span| [span.start_ns, span.end_ns]).collect(),
        }
    });
    sensors.collect()
}

fn monte_carlo_summary(analysis: &Analysis) -> Option<MonteCarloSummary> {
    let found = analysis.monte_carlo.as_ref()?;
    let half_band = |band: &Band| {
        let widths = band
            .low
            .iter()
            .zip(&band.high)
            .map(|(low, high)| 0.5 * (high - low));
        let known: Vec<f64> = widths.filter(|width| width.is_finite()).collect();
        Some(known.iter().sum::<f64>() / known.len() as f64).filter(|mean| mean.is_finite())
    };
    let names = ColumnNames::of(&analysis.machine);
    let left_out = |band: &Band| band.left_out.iter().map(|&n| u64::from(n)).sum();
    Some(MonteCarloSummary {
        draws: found.study.draws,
        spread: found.study.spread,
        seed: found.study.seed,
        mean_half_band: (found.bands.iter())
            .map(|band| (band.quantity.column(&names), half_band(band)))
            .collect(),
        left_out: found.bands.iter().map(left_out).max().unwrap_or(0),
    })
}

/// Number of parameters in the summary.
const NAMED_PARAMETERS: usize = 10;

fn sensitivity_summary(analysis: &Analysis) -> Option<SensitivitySummary> {
    let (machine, table) = (&analysis.machine, analysis.sensitivity.as_ref()?);
    let rows = table.ranked();
    let first = rows.first()?;
    Some(SensitivitySummary {
        wheel: machine.wheels()[table.worst_wheel].name.to_lowercase(),
        worst_ns: first.worst_ns,
        worst_otf_n: first.worst_otf_n,
        parameters: (rows.iter().take(NAMED_PARAMETERS))
            .map(|row| ParameterSummary {
                parameter: row.parameter.name(machine),
                unit: row.parameter.unit(machine),
                nominal: row.nominal,
                sigma: row.sigma,
                derivative_n_per_unit: row.derivative,
                change_to_zero: row.change_to_zero,
                variance_share: row.variance_share,
            })
            .collect(),
    })
}

fn row_summary(analysis: &Analysis) -> RowSummary {
    let rows = &analysis.rows;
    let mut invalid_by_reason = BTreeMap::new();
    let invalid = (rows.reasons.iter()).filter(|reasons| !reasons.leave_valid());
    for reason in invalid.flat_map(|reasons| reasons.iter()) {
        *invalid_by_reason.entry(reason.name()).or_default() += 1;
    }
    RowSummary {
        count: rows.len(),
        valid: rows
            .reasons
            .iter()
            .filter(|reasons| reasons.leave_valid())
            .count(),
        doubted: (rows.reasons.iter())
            .filter(|reasons| reasons.have_doubt())
            .count(),
        first_ns: rows.times_ns[0],
        last_ns: rows.times_ns[rows.len() - 1],
        duration_s: rows.seconds(rows.len() - 1),
        invalid_by_reason,
    }
}

fn input_summary(input: &Input) -> InputSummary<'_> {
    InputSummary {
        signal: input.signal,
        topic: &input.topic,
        type_name: &input.type_name,
        why: &input.why,
        samples_used: input.counts.used,
        samples_not_later: input.counts.not_later,
        samples_not_finite: input.counts.not_finite,
        samples_implausible: input.counts.implausible,
        messages_undecodable: input.undecodable,
        noise: (input.noise.iter())
            .map(|noise| NoiseSummary {
                key: noise.key,
                stated: noise.stated,
                shown: noise.shown,
            })
            .collect(),
        timing: &input.timing,
        correction: input.correction,
    }
}
