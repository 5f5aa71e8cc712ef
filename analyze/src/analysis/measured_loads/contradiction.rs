//! Spans in which measured and computed loads contradict each other beyond what both uncertainties allow.
//!
//! At a row all sensors are judged together, d = r' S^-1 r with S the covariance of the differences: the joint band of
//! the computed loads, the sensors' own errors, and the split between diagonals that uneven ground leaves open. A row is
//! off where the root of d exceeds that of the number of sensors by 3.5, which chance makes once in some thousand rows.
//! A contradiction needs rows that are off for two seconds on end.

use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{LoadSensor, Machine};
use tipwatch_mechanics::studies::measured_loads::{
    ComparedRow, FEWEST_ROWS, LEAST_NS, TotalRow, UnstatedLoad, exchanged, shows,
};

use crate::load::Standing;

/// Name of the total beside those of the sensors.
pub const TOTAL: &str = "total";

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

    /// Whether a load on the tool, which the loads include, explains the contradiction.
    #[must_use]
    pub fn is_explained(&self) -> bool {
        self.is_followed() && self.unstated.is_some_and(|load| load.at_tool)
    }

    /// Returns the consequence of the contradiction for the loads of these rows.
    #[must_use]
    pub fn consequence(&self) -> &'static str {
        match (self.is_explained(), self.is_followed()) {
            (true, _) => {
                word!(
                    "The loads of these rows follow the measured ones, and so include it; those of all other rows do not"
                )
            }
            (false, true) => {
                word!(
                    "The loads of these rows follow the measured ones, but either may be wrong, so nothing is concluded from them"
                )
            }
            (false, false) => word!("Either may be wrong, so nothing is concluded from these rows"),
        }
    }

    /// "; a load of 2500 kg ... would explain it", or nothing. A sum that does not show it alone is said to act elsewhere, too.
    #[must_use]
    pub fn explanation(&self) -> String {
        let elsewhere = match self.sensor == TOTAL && !shows(self.difference_n, self.sigma_n) {
            true => word!(", and they act elsewhere"),
            false => "",
        };
        let sensors =
            (self.exchanged.as_ref()).map(|[a, b]| say!("exchanged sensors of {a} and {b}"));
        let explained = match (self.unstated, sensors) {
            (Some(load), Some(sensors)) => say!("; {load}; and so would {sensors}"),
            (Some(load), None) => format!("; {load}"),
            (None, Some(sensors)) => say!("; {sensors} would explain it"),
            (None, None) => String::new(),
        };
        format!("{elsewhere}{explained}")
    }
}

/// The spans in which the loads of single sensors contradict the computed ones.
pub(super) fn of_sensors(sensors: &[&LoadSensor], rows: &[ComparedRow]) -> Vec<Contradiction> {
    let long = lasting(rows, ComparedRow::is_off, |row| (row.time_ns, row.set));
    long.iter().map(|span| worst(sensors, span)).collect()
}

/// The spans in which the totals contradict each other.
pub(super) fn in_total(rows: &[TotalRow], standing: &Standing<'_>) -> Vec<Contradiction> {
    let spans = lasting(rows, TotalRow::is_off, |row| (row.time_ns, row.set));
    let of_span = |span: &Vec<&TotalRow>| {
        let mean = |value: fn(&TotalRow) -> f64| {
            span.iter().map(|row| value(row)).sum::<f64>() / span.len() as f64
        };
        let name = |machine: &Machine, place: usize| machine.wheels()[place].name.clone();
        let exchanged = exchanged(span);
        let unstated = UnstatedLoad::of(span, exchanged.is_some());
        let exchanged = exchanged.zip(standing.at(span[0].time_ns));
        Contradiction {
            start_ns: span[0].time_ns,
            end_ns: span[span.len() - 1].time_ns,
            sensor: TOTAL.into(),
            difference_n: mean(|row| row.difference),
            sigma_n: mean(|row| row.sigma),
            unstated,
            exchanged: exchanged.map(|(pair, machine)| pair.map(|place| name(machine, place))),
        }
    };
    spans.iter().map(of_span).collect()
}

/// The spans of rows that are off long enough: without a hole, on the same supports. Rows without a number say nothing and end
/// nothing.
fn lasting<R>(
    rows: &[R],
    is_off: impl Fn(&R) -> Option<bool>,
    place: impl Fn(&R) -> (i64, Option<usize>),
) -> Vec<Vec<&R>> {
    let judged = rows.iter().filter_map(|row| Some((row, is_off(row)?)));
    let judged: Vec<(&R, bool)> = judged.collect();
    let time_ns = |row: &R| place(row).0;
    let mut steps: Vec<i64> = (judged.windows(2))
        .map(|pair| time_ns(pair[1].0).saturating_sub(time_ns(pair[0].0)))
        .collect();
    steps.sort_unstable();
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0);
    let hole_ns = LEAST_NS.max(step.saturating_mul(3));
    let spans = judged.chunk_by(|(a, a_off), (b, b_off)| {
        let ((from_ns, on), (to_ns, next)) = (place(a), place(b));
        a_off == b_off && on == next && to_ns.saturating_sub(from_ns) < hole_ns
    });
    let lasts = |span: &&[(&R, bool)]| {
        let (first, last) = (time_ns(span[0].0), time_ns(span[span.len() - 1].0));
        span[0].1 && last.saturating_sub(first) >= LEAST_NS && span.len() >= FEWEST_ROWS
    };
    let spans = spans.filter(lasts);
    spans
        .map(|span| span.iter().map(|(row, _)| *row).collect())
        .collect()
}

fn worst(sensors: &[&LoadSensor], span: &[&ComparedRow]) -> Contradiction {
    let (sensor, difference_n, sigma_n) = ComparedRow::furthest_off(span, sensors);
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
