//! Share of a log's time that could be computed.
//!
//! Rows exist only where joint states do, so a hole in them loses no row. Time is counted instead:
//!
//! ```text
//!     valid share = computable time / covered time
//! ```
//! The computable time lies between neighbouring rows that both have loads, without the holes of the
//! signals that the loads need. The covered time is that of the signals that the loads need, and goes on while messages
//! of any other topic come regularly: [`RecordingSpan`](crate::load::RecordingSpan).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::estimation::sorted_stamps;
use tipwatch_mechanics::state::{NumberKind, Sensor};

use super::quasi_static::Exclusion;
use crate::base::options::Options;
use crate::base::table::Table;
use crate::events::FoundRotation;
use crate::load::{LoadedLog, Signal};

/// Messages of other topics that are farther from the used ones do not belong to the recording: their
/// log time is wrong (ns).
const FARTHEST_NS: i64 = 86_400_000_000_000;

/// Share of the time from which on the whole log counts as known.
const WHOLE: f64 = 0.99;

/// How much of a log's time could be computed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Coverage {
    /// Time that the log covers, within the requested time range (s): from the first to the last message of the topics
    /// that the analysis needs, and of others that come regularly.
    pub covered_s: f64,
    /// Time of it in which the wheel loads could be computed (s).
    pub computable_s: f64,
    /// `computable_s` over the covered time in which the machine did not lie on its side; null where there is none.
    pub valid_share: Option<f64>,
    /// Time in which the machine lay on its side, and no wheel carried it (s); absent if it did not.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub on_side_s: f64,
    /// Time that the log goes on after the last row (s): a joint ends before it. Absent if that is no longer than the
    /// estimator bridges.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub after_rows_s: f64,
    /// Rows with wheel loads: the valid ones, and those of a machine that tips.
    pub computable_rows: u64,
    /// Time in it in which signals that the loads rest on contradict each other (s).
    #[serde(default)]
    pub doubted_s: f64,
    /// Measured forces of actuators and supports that were used in no row, because their samples are too far apart; absent if there are none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unused_forces: usize,
    /// What is known between the rows; absent for a log that is not sparse.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between_rows: Option<Exclusion>,
}

impl Coverage {
    /// Counts the time of `rows`.
    pub(crate) fn of(
        loaded: &LoadedLog,
        rows: &Table,
        rotations: &[FoundRotation],
        options: &Options,
    ) -> Self {
        let [first_ns, last_ns] = covered_ns(loaded, options).unwrap_or_default();
        let covered_s = last_ns.saturating_sub(first_ns).max(0) as f64 * 1e-9;
        let last_row_ns = rows.times_ns.last().copied().unwrap_or(last_ns);
        let after_rows_ns = last_ns.saturating_sub(last_row_ns);
        let goes_on = after_rows_ns > loaded.machine.longest_known_gap_ns();
        let on_side_s = on_side_s(rows, rotations).min(covered_s);
        let on_wheels_s = covered_s - on_side_s;
        let [computable_s, doubted_s] =
            computable_s(rows, &holes(loaded)).map(|s| s.min(on_wheels_s));
        let computable = rows.reasons.iter().filter(|reasons| reasons.leave_loads());
        Self {
            covered_s,
            computable_s,
            valid_share: (on_wheels_s > 0.0).then(|| (computable_s / on_wheels_s).min(1.0)),
            on_side_s,
            after_rows_s: if goes_on {
                after_rows_ns as f64 * 1e-9
            } else {
                0.0
            },
            computable_rows: computable.count() as u64,
            doubted_s,
            unused_forces: unused_forces(loaded),
            between_rows: None,
        }
    }

    /// Whether the whole log counts as known: all of its time but the moment that the estimator needs at each end.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.valid_share.is_some_and(|share| share >= WHOLE)
    }
}

impl Coverage {
    /// Time between rows in which a lift cannot be excluded, if there is any (s).
    #[must_use]
    pub fn lift_not_excluded_s(&self) -> Option<f64> {
        let known = self
            .between_rows
            .filter(|it| it.lift_not_excluded_s > 0.0)?;
        Some(known.lift_not_excluded_s)
    }
}

impl std::fmt::Display for Coverage {
    /// "7.3 of 20.0 s (36.5 %)", and "before it lay on its side" where it did; rounded down, so that only a whole log reads
    /// 100 %, or the same time twice.
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (computable_s, on_wheels_s) = (self.computable_s, self.covered_s - self.on_side_s);
        let reads_whole = format!("{computable_s:.1}") == format!("{on_wheels_s:.1}");
        formatter.write_str(&match reads_whole && computable_s < on_wheels_s {
            true => {
                let on_wheels_ms = (1e3 * on_wheels_s).round();
                let computable_ms = (1e3 * computable_s).floor().min(on_wheels_ms - 1.0);
                let [computable_s, on_wheels_s] =
                    [computable_ms, on_wheels_ms].map(|time_ms| 1e-3 * time_ms);
                say!("{computable_s:.3} of {on_wheels_s:.3} s")
            }
            false => say!("{computable_s:.1} of {on_wheels_s:.1} s"),
        })?;
        if self.on_side_s > 0.0 {
            formatter.write_str(word!(" on its wheels"))?;
        }
        match self.valid_share {
            Some(share) => formatter.write_str(&decimals(format!(
                " ({:.1} %)",
                (1000.0 * share).floor() / 10.0
            ))),
            None => Ok(()),
        }
    }
}

fn is_zero<N: Default + PartialEq>(number: &N) -> bool {
    *number == N::default()
}

/// Returns the number of measured forces with several samples, no two of which are close enough for the estimator to bridge the
/// time between them.
fn unused_forces(loaded: &LoadedLog) -> usize {
    let max_gap_ns = loaded.machine.longest_known_gap_ns();
    let is_unused = |signal: &&Signal| {
        let stamps = sorted_stamps(&signal.recording.stamps_ns);
        let mut steps = stamps
            .windows(2)
            .map(|pair| pair[1].saturating_sub(pair[0]));
        matches!(signal.sensor, Sensor::Number(NumberKind::Actuator, _))
            && stamps.len() > 1
            && steps.all(|step| step > max_gap_ns)
    };
    loaded.signals.iter().filter(is_unused).count()
}

/// Time of the rows in which the machine lay on its side (s).
fn on_side_s(rows: &Table, rotations: &[FoundRotation]) -> f64 {
    let Some((&first, &last)) = rows.times_ns.first().zip(rows.times_ns.last()) else {
        return 0.0;
    };
    let spans = rotations.iter().filter_map(FoundRotation::on_side_ns);
    let within = spans.map(|[from, to]| to.min(last).saturating_sub(from.max(first)).max(0));
    within.map(|ns| ns as f64 * 1e-9).sum()
}

/// The time that the log covers, first and last (ns), on the clock of the stamps; `None` without a sample. Before the first and after the last used
/// sample, it is the log time that counts: other topics have no stamps on this clock.
fn covered_ns(loaded: &LoadedLog, options: &Options) -> Option<[i64; 2]> {
    let needed = |signal: &&Signal| is_needed(loaded, signal.sensor);
    let recordings = || (loaded.signals.iter().filter(needed)).map(|signal| &signal.recording);
    let (mut first, mut last) = ends(recordings().flat_map(|r| &r.stamps_ns))?;
    let used = recordings().filter_map(|r| r.log_span_ns);
    let used = used.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (used_first, used_last) = used.unwrap_or((first, last));
    let log_first = loaded.span.first_ns.unwrap_or(used_first);
    let log_last = loaded.span.last_ns.unwrap_or(used_last);
    let plausible = |ns: i64| {
        Some(ns)
            .filter(|ns| (0..=FARTHEST_NS).contains(ns))
            .unwrap_or(0)
    };
    let before_ns = plausible(used_first.saturating_sub(log_first));
    let after_ns = plausible(log_last.saturating_sub(used_last));
    let used_ns = used_last.saturating_sub(used_first);
    let is_stamp_wrong = last.saturating_sub(first).saturating_sub(used_ns) > FARTHEST_NS;
    if is_stamp_wrong && used_ns > 0 {
        // single stamps years away: only the log time tells how long the recording was
        last = first.saturating_add(used_ns);
    }
    first = first.saturating_sub(before_ns);
    last = last.saturating_add(after_ns);
    // the requested range counts from the first row
    let rows_from = first_joint_stamp(loaded).unwrap_or(first);
    let at = |seconds: f64| rows_from.saturating_add((seconds * 1e9).round() as i64);
    let first = options.from_s.map_or(first, |from| at(from).max(first));
    let last = options.to_s.map_or(last, |to| at(to).min(last));
    Some([first, last])
}

fn ends<'a>(times: impl Iterator<Item = &'a i64>) -> Option<(i64, i64)> {
    let spans = times.map(|&time| (time, time));
    spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn first_joint_stamp(loaded: &LoadedLog) -> Option<i64> {
    let rows = (loaded.signals.iter()).find(|signal| signal.sensor == Sensor::Joints(0))?;
    rows.recording.stamps_ns.iter().min().copied()
}

/// Whether every row needs a signal, whatever acts on the tool.
fn is_needed(loaded: &LoadedLog, sensor: Sensor) -> bool {
    loaded.matched.sensors.need(sensor) && sensor != Sensor::ToolWrench
}

/// The holes of the signals that every row needs, longer than the estimator bridges: sorted, disjoint.
fn holes(loaded: &LoadedLog) -> Vec<(i64, i64)> {
    let max_gap_ns = loaded.machine.longest_known_gap_ns();
    let mut holes: Vec<(i64, i64)> = Vec::new();
    for signal in loaded
        .signals
        .iter()
        .filter(|signal| is_needed(loaded, signal.sensor))
    {
        let stamps = sorted_stamps(&signal.recording.stamps_ns);
        let pairs = stamps.windows(2).map(|pair| (pair[0], pair[1]));
        holes.extend(pairs.filter(|(from, to)| to.saturating_sub(*from) > max_gap_ns));
    }
    holes.sort_unstable();
    let mut disjoint: Vec<(i64, i64)> = Vec::new();
    for hole in holes {
        match disjoint.last_mut() {
            Some(last) if hole.0 <= last.1 => last.1 = last.1.max(hole.1),
            _ => disjoint.push(hole),
        }
    }
    disjoint
}

/// Time between neighbouring rows with loads, without the holes: all, and that with a doubted row at either end.
fn computable_s(rows: &Table, holes: &[(i64, i64)]) -> [f64; 2] {
    let mut next = 0;
    let (mut sum_ns, mut doubted_ns) = (0.0, 0.0);
    for row in 1..rows.len() {
        let (from, to) = (rows.times_ns[row - 1], rows.times_ns[row]);
        while holes.get(next).is_some_and(|hole| hole.1 <= from) {
            next += 1;
        }
        let reasons = [rows.reasons[row - 1], rows.reasons[row]];
        if !reasons.iter().all(|reasons| reasons.leave_loads()) {
            continue;
        }
        let within = holes[next..].iter().take_while(|hole| hole.0 < to);
        let lost = within.map(|hole| hole.1.min(to).saturating_sub(hole.0.max(from)) as f64);
        let step_ns = to.saturating_sub(from) as f64 - lost.sum::<f64>();
        sum_ns += step_ns;
        if reasons.iter().any(|reasons| reasons.have_doubt()) {
            doubted_ns += step_ns;
        }
    }
    [sum_ns * 1e-9, doubted_ns * 1e-9]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_whole_log_reads_the_same_time_twice() {
        let told = |computable_s: f64| {
            let coverage = Coverage {
                covered_s: 18.0,
                computable_s,
                valid_share: Some(computable_s / 18.0),
                on_side_s: 0.0,
                after_rows_s: 0.0,
                computable_rows: 0,
                doubted_s: 0.0,
                unused_forces: 0,
                between_rows: None,
            };
            coverage.to_string()
        };
        assert_eq!(told(18.0), "18.0 of 18.0 s (100.0 %)");
        assert_eq!(told(17.9855), "17.985 of 18.000 s (99.9 %)");
        assert_eq!(told(17.9999), "17.999 of 18.000 s (99.9 %)");
        assert_eq!(told(7.35), "7.3 of 18.0 s (40.8 %)");
    }
}
