//! Spans in which measured and computed loads contradict each other beyond what both uncertainties allow.
//!
//! At a row all sensors are judged together, d = r' S^-1 r with S the covariance of the differences: the joint band of
//! the computed loads, the sensors' own errors, and the split between diagonals that uneven ground leaves open. A row is
//! off where the root of d exceeds that of the number of sensors by 3.5, which chance makes once in some thousand rows.
//! A contradiction needs rows that are off for two seconds on end.

use tipwatch_mechanics::machine::LoadSensor;

use super::compared_row::ComparedRow;
use super::excess::{EXCESS, shows};
use super::unstated::UnstatedLoad;

/// Name of the total beside those of the sensors.
pub const TOTAL: &str = "total";
/// Shortest contradiction (ns), and the fewest rows of one.
const LEAST_NS: i64 = 2_000_000_000;
const FEWEST_ROWS: usize = 4;

/// A span in which measured and computed loads contradict each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// Time of the first row (ns).
    pub start_ns: i64,
    /// Time of the last row (ns).
    pub end_ns: i64,
    /// The sensor that is furthest off.
    pub sensor: String,
    /// Its mean of measured minus computed load (N).
    pub difference_n: f64,
    /// Mean standard deviation of that difference (N).
    pub sigma_n: f64,
    /// The load that would explain it; `None` where single sensors contradict each other, or no load would.
    pub unstated: Option<UnstatedLoad>,
    /// The supports whose sensors explain it if they are exchanged.
    pub exchanged: Option<[String; 2]>,
}

impl Contradiction {
    /// Whether the loads of these rows follow the measured loads of all supports.
    #[must_use]
    pub fn is_followed(&self) -> bool {
        self.unstated.is_some_and(|load| load.followed)
    }

    /// Whether it is explained: by a load on the tool, which the loads include.
    #[must_use]
    pub fn is_explained(&self) -> bool {
        self.is_followed() && self.unstated.is_some_and(|load| load.at_tool)
    }

    /// What it means for these rows.
    #[must_use]
    pub fn consequence(&self) -> &'static str {
        match (self.is_explained(), self.is_followed()) {
            (true, _) => {
                "The loads of these rows follow the measured ones, and so include it; those of all other rows do not"
            }
            (false, true) => {
                "The loads of these rows follow the measured ones, but either may be wrong, so nothing is concluded from them"
            }
            (false, false) => "Either may be wrong, so nothing is concluded from these rows",
        }
    }

    /// "; a load of 2500 kg ... would explain it", or nothing. A sum that does not show it alone is said to act elsewhere, too.
    #[must_use]
    pub fn explanation(&self) -> String {
        let elsewhere = match self.sensor == TOTAL && !shows(self.difference_n, self.sigma_n) {
            true => ", and they act elsewhere",
            false => "",
        };
        let sensors =
            (self.exchanged.as_ref()).map(|[a, b]| format!("exchanged sensors of {a} and {b}"));
        let explained = match (self.unstated, sensors) {
            (Some(load), Some(sensors)) => format!("; {load}; and so would {sensors}"),
            (Some(load), None) => format!("; {load}"),
            (None, Some(sensors)) => format!("; {sensors} would explain it"),
            (None, None) => String::new(),
        };
        format!("{elsewhere}{explained}")
    }
}

pub(super) fn contradictions(sensors: &[&LoadSensor], rows: &[ComparedRow]) -> Vec<Contradiction> {
    let is_off = |row: &ComparedRow| row.distance.sqrt() > (row.sensors as f64).sqrt() + EXCESS;
    // rows without a number say nothing and end nothing
    let judged: Vec<&ComparedRow> = rows.iter().filter(|row| row.distance.is_finite()).collect();
    let long = lasting(&judged, |row| is_off(row), |row| (row.time_ns, row.set));
    long.map(|span| worst(sensors, span)).collect()
}

/// The spans of rows that are off long enough: without a hole, on the same supports.
pub(super) fn lasting<'r, 's, R>(
    rows: &'s [&'r R],
    is_off: impl Fn(&R) -> bool + Copy + 's,
    place: impl Fn(&R) -> (i64, Option<usize>) + Copy + 's,
) -> impl Iterator<Item = &'s [&'r R]> {
    let mut steps: Vec<i64> = rows
        .windows(2)
        .map(|pair| place(pair[1]).0.saturating_sub(place(pair[0]).0))
        .collect();
    steps.sort_unstable();
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0);
    let hole_ns = LEAST_NS.max(step.saturating_mul(3));
    let spans = rows.chunk_by(move |a, b| {
        let ((from_ns, on), (to_ns, next)) = (place(a), place(b));
        is_off(a) == is_off(b) && on == next && to_ns.saturating_sub(from_ns) < hole_ns
    });
    spans.filter(move |span| {
        let (first, last) = (place(span[0]).0, place(span[span.len() - 1]).0);
        is_off(span[0]) && last.saturating_sub(first) >= LEAST_NS && span.len() >= FEWEST_ROWS
    })
}

fn worst(sensors: &[&LoadSensor], span: &[&ComparedRow]) -> Contradiction {
    let mean = |k: usize| {
        let known = span
            .iter()
            .filter(|row| (row.measured[k] - row.computed[k] + row.sigma[k]).is_finite());
        let sum = known.fold([0.0; 3], |[count, error, sigma], row| {
            let own = row.sigma[k].hypot(sensors[k].sigma);
            [
                count + 1.0,
                error + row.measured[k] - row.computed[k],
                sigma + own,
            ]
        });
        (sum[1] / sum[0], sum[2] / sum[0])
    };
    let all = (0..sensors.len()).map(|k| (k, mean(k)));
    let known = all.filter(|(_, (error, _))| error.is_finite());
    let worst = known.max_by(|(_, a), (_, b)| (a.0 / a.1).abs().total_cmp(&(b.0 / b.1).abs()));
    let (sensor, (difference_n, sigma_n)) = worst.unwrap_or((0, (f64::NAN, f64::NAN)));
    Contradiction {
        start_ns: span[0].time_ns,
        end_ns: span[span.len() - 1].time_ns,
        sensor: sensors
            .get(sensor)
            .map_or(String::new(), |sensor| sensor.name.clone()),
        difference_n,
        sigma_n,
        unstated: None,
        exchanged: None,
    }
}
