//! Parts of a summary that no single finding is: the machine, the rows, the model, the load sensors.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::Payload;

use crate::analysis::Analysis;
use crate::analysis::measured_loads::{LoadComparison, SensorStatistics, TOTAL};
use crate::analysis::model_comparison::ModelComparison;
use crate::base::built::built;
use crate::base::table::Table;
use crate::events::split_rule::split_rule;

built! {
    /// The machine.
    #[derive(Debug, Serialize, JsonSchema)]
    pub struct MachineSummary<'a>: pub(super) fn of(analysis: &'a Analysis) {
        let machine = &analysis.machine;
    } {
        name: &'a str = machine.name(),
        /// With the payloads that it always carries.
        mass_kg: f64 = machine.mass(),
        /// With the payloads of the row in which they are heaviest.
        largest_mass_kg: f64 = largest_mass_kg(analysis),
        gravity_m_s2: f64 = machine.gravity(),
        base_link: &'a str = machine.base_link(),
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

built! {
    /// The rows.
    #[derive(Debug, Serialize, JsonSchema)]
    pub struct RowSummary: pub(super) fn of(rows: &Table) {
        let all = || rows.reasons.iter();
        let valid = all().filter(|reasons| reasons.leave_valid());
        let mut invalid_by_reason = BTreeMap::new();
        let invalid = all().filter(|reasons| !reasons.leave_valid());
        for reason in invalid.flat_map(|reasons| reasons.iter()) {
            *invalid_by_reason.entry(reason.name()).or_default() += 1;
        }
    } {
        count: usize = rows.len(),
        valid: usize = valid.count(),
        /// Rows in which signals contradict each other; most are valid.
        doubted: usize = all().filter(|reasons| reasons.have_doubt()).count(),
        first_ns: i64 = rows.times_ns[0],
        last_ns: i64 = rows.times_ns[rows.len() - 1],
        duration_s: f64 = rows.seconds(rows.len() - 1),
        invalid_by_reason: BTreeMap<&'static str, usize> = invalid_by_reason,
    }
}

built! {
    /// The model of the ground wrench.
    #[derive(Debug, Serialize, JsonSchema)]
    pub struct ModelSummary<'a>: pub(super) fn of(analysis: &'a Analysis) {
        let others = || analysis.comparisons.iter();
        let why_not = others().filter_map(|other| other.as_ref().err());
    } {
        name: &'static str = analysis.options.model.name(),
        /// The assumption by which loads are split where equilibrium leaves it open.
        split_rule: String = split_rule(&analysis.machine),
        /// The other models over the same rows.
        others: Vec<&'a ModelComparison> = others().flatten().collect(),
        /// Why other models cannot be computed.
        other_notes: Vec<&'a str> = why_not.map(String::as_str).collect(),
    }
}

/// A load sensor.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MeasuredLoadSummary<'a> {
    #[serde(flatten)]
    statistics: &'a SensorStatistics,
    /// Spans in which measured and computed loads contradict each other and this sensor is furthest off, or in which the
    /// totals do: first and last row. Their rows are not valid.
    contradictions_ns: Vec<[i64; 2]>,
}

pub(super) fn measured_loads(comparison: &LoadComparison) -> Vec<MeasuredLoadSummary<'_>> {
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
