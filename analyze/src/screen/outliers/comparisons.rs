//! What is compared with what, and when it is said that a machine stands out.

use std::collections::BTreeMap;

use serde::Serialize;
use strum::{EnumIter, IntoEnumIterator};

use super::statistics::{corrected, median, of_one_more, of_two_groups};
use crate::screen::merge::LogRow;
use crate::screen::record::Record;

/// Confidence from which a difference is a finding, over all comparisons of a fleet together.
pub(in crate::screen) const LEAST_CONFIDENCE: f64 = 0.95;
/// Fewest days before the recent ones, and fewest recent days.
const LEAST_EARLIER: usize = 9;
const LEAST_RECENT: usize = 3;
/// Fewest logs of a machine, and fewest other machines of its type.
const LEAST_LOGS: usize = 5;
const LEAST_OTHERS: usize = 8;
/// Longer logs reach smaller margins: their margins are not compared with those of logs shorter by more.
const MOST_LONGER: f64 = 2.0;

/// What a log says about its machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub(in crate::screen) enum Quantity {
    /// The worst margin (share of the static load); smaller is worse.
    WorstMargin,
    /// Share of the computable time below the notice level; larger is worse.
    ExposedShare,
}

impl Quantity {
    /// The least difference that matters.
    fn relevant(self) -> f64 {
        match self {
            Self::WorstMargin => 0.05,
            Self::ExposedShare => 0.01,
        }
    }

    fn is_worse(self, difference: f64) -> bool {
        match self {
            Self::WorstMargin => difference < 0.0,
            Self::ExposedShare => difference > 0.0,
        }
    }
}

/// What a machine is compared with.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(tag = "with", rename_all = "snake_case")]
pub(in crate::screen) enum Against {
    /// Its recent days with those before.
    History,
    /// Its logs with those of the other machines of this type.
    Type { machine_type: String },
}

/// What a comparison says.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub(in crate::screen) enum Verdict {
    /// The machine stands out.
    Outlier { is_worse: bool },
    /// It does not, or not surely enough.
    Inconspicuous,
    /// Nothing can be said.
    NotComparable { reason: String },
}

/// One machine compared in one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(in crate::screen) struct Comparison {
    pub(in crate::screen) machine: String,
    pub(in crate::screen) against: Against,
    pub(in crate::screen) quantity: Quantity,
    #[serde(flatten)]
    pub(in crate::screen) verdict: Verdict,
    /// Median of the machine, or of its recent days.
    pub(in crate::screen) value: Option<f64>,
    /// Median of the other machines, or of the days before.
    pub(in crate::screen) usual: Option<f64>,
    /// Confidence that the difference is no chance, corrected for all comparisons of the fleet.
    pub(in crate::screen) confidence: Option<f64>,
    /// Number of its logs, or of its recent days.
    pub(in crate::screen) count: usize,
    /// Number of other machines, or of earlier days.
    pub(in crate::screen) usual_count: usize,
}

/// A log that can be compared.
struct Log<'a> {
    record: &'a Record,
    day: Option<String>,
    duration_s: f64,
    sigma: Option<f64>,
    values: BTreeMap<Quantity, f64>,
}

impl<'a> Log<'a> {
    fn of(row: &'a LogRow, min_valid: f64) -> Option<Self> {
        let (facts, _) = row.record.analysed()?;
        if facts.undecided(min_valid).is_some() {
            return None;
        }
        let worst = facts.worst.as_ref();
        let computable_s = facts.coverage.computable_s;
        let exposed = (facts.exposure.exposed_s).filter(|_| computable_s > 0.0);
        let values = [
            (Quantity::WorstMargin, worst.map(|worst| worst.margin)),
            (Quantity::ExposedShare, exposed.map(|s| s / computable_s)),
        ];
        let known = |(quantity, value): (Quantity, Option<f64>)| {
            Some((quantity, value.filter(|value| value.is_finite())?))
        };
        Some(Self {
            record: &row.record,
            day: row.record.day(),
            duration_s: computable_s,
            sigma: worst.and_then(|worst| worst.sigma),
            values: values.into_iter().filter_map(known).collect(),
        })
    }
}

/// All comparisons of a fleet, by machine. Logs that decide nothing take no part.
pub(in crate::screen) fn comparisons(rows: &[LogRow], min_valid: f64) -> Vec<Comparison> {
    let logs: Vec<Log<'_>> = rows
        .iter()
        .filter_map(|row| Log::of(row, min_valid))
        .collect();
    let mut machines: BTreeMap<&str, Vec<&Log<'_>>> = BTreeMap::new();
    for log in &logs {
        if let Some(machine) = &log.record.machine {
            machines.entry(&machine.name).or_default().push(log);
        }
    }
    let mut found = Vec::new();
    for machine in machines.keys() {
        for quantity in Quantity::iter() {
            found.push(with_history(machine, &machines, quantity));
            found.extend(with_type(machine, &machines, quantity));
        }
    }
    judge(found)
}

/// A comparison with the probability that the difference is chance, or the reason why there is none.
type Raw = (Comparison, Result<f64, String>);

/// Corrects the probabilities for the number of comparisons, and judges.
fn judge(found: Vec<Raw>) -> Vec<Comparison> {
    let known: Vec<f64> = found
        .iter()
        .filter_map(|(_, chance)| chance.as_ref().ok().copied())
        .collect();
    let mut corrected = corrected(&known).into_iter();
    let judged = found.into_iter().map(|(mut comparison, chance)| {
        comparison.verdict = match chance {
            Err(reason) => Verdict::NotComparable { reason },
            Ok(_) => {
                let confidence = 1.0 - corrected.next().unwrap_or(1.0);
                comparison.confidence = Some(confidence);
                let difference = comparison.value.zip(comparison.usual).map(|(a, b)| a - b);
                let difference = difference.unwrap_or(0.0);
                let is_relevant = difference.abs() >= comparison.quantity.relevant();
                match confidence >= LEAST_CONFIDENCE && is_relevant {
                    true => Verdict::Outlier {
                        is_worse: comparison.quantity.is_worse(difference),
                    },
                    false => Verdict::Inconspicuous,
                }
            }
        };
        comparison
    });
    judged.collect()
}

/// The recent quarter of the days of a machine with the days before, by the medians of the days: logs of
/// one day are of one site and one driver, and count once.
fn with_history(
    machine: &str,
    machines: &BTreeMap<&str, Vec<&Log<'_>>>,
    quantity: Quantity,
) -> Raw {
    let logs = &machines[machine];
    let mut raw = empty(machine, Against::History, quantity);
    // another machine file or program is no other history
    let versions = count_by(logs, |log| log.record.analysis_version.clone());
    let most = versions
        .iter()
        .max_by_key(|(_, logs)| logs.len())
        .map(|(_, logs)| logs.as_slice());
    let dated = most.unwrap_or_default().iter();
    let dated = dated.filter(|log| log.values.contains_key(&quantity));
    let dated: Vec<&Log<'_>> = dated.copied().collect();
    let days = count_by(&dated, |log| log.day.clone());
    let days: Vec<Vec<&Log<'_>>> = days.into_values().collect();
    let recent_days = (days.len() / 4).max(LEAST_RECENT).min(days.len());
    let (earlier, recent) = days.split_at(days.len() - recent_days);
    let by_day = |days: &[Vec<&Log<'_>>]| -> Vec<f64> {
        let of_day = |logs: &Vec<&Log<'_>>| {
            median(
                &logs
                    .iter()
                    .map(|log| log.values[&quantity])
                    .collect::<Vec<_>>(),
            )
        };
        days.iter().filter_map(of_day).collect()
    };
    let (before, now) = (by_day(earlier), by_day(recent));
    raw.count = now.len();
    raw.usual_count = before.len();
    if before.len() < LEAST_EARLIER {
        let reason = format!(
            "too few days: {} of at least {} with logs of one analysis",
            days.len(),
            LEAST_EARLIER + LEAST_RECENT
        );
        return (raw, Err(reason));
    }
    raw.value = median(&now);
    raw.usual = median(&before);
    let durations = |days: &[Vec<&Log<'_>>]| {
        let all = days.iter().flatten().map(|log| log.duration_s);
        median(&all.collect::<Vec<_>>())
    };
    let chance = comparable(quantity, durations(recent), durations(earlier))
        .and_then(|()| of_two_groups(&now, &before).ok_or_else(|| "no values".to_string()));
    (raw, chance)
}

/// The median of a machine with the medians of the others of its type; `None` if its type is unknown.
fn with_type(
    machine: &str,
    machines: &BTreeMap<&str, Vec<&Log<'_>>>,
    quantity: Quantity,
) -> Option<Raw> {
    let type_of = |logs: &[&Log<'_>]| logs.first()?.record.machine.as_ref()?.kind.clone();
    let own_type = type_of(&machines[machine])?;
    let values = |logs: &[&Log<'_>]| -> Vec<f64> {
        let values = logs.iter().filter_map(|log| log.values.get(&quantity));
        values.copied().collect()
    };
    let same_type = machines
        .iter()
        .filter(|(name, logs)| **name != machine && type_of(logs).as_ref() == Some(&own_type));
    let others: Vec<&Vec<&Log<'_>>> = same_type
        .map(|(_, logs)| logs)
        .filter(|logs| values(logs).len() >= LEAST_LOGS)
        .collect();
    let own = &machines[machine];
    let against = Against::Type {
        machine_type: own_type,
    };
    let mut raw = empty(machine, against, quantity);
    let mine = values(own);
    let usual: Vec<f64> = others
        .iter()
        .filter_map(|logs| median(&values(logs)))
        .collect();
    raw.count = mine.len();
    raw.usual_count = usual.len();
    raw.value = median(&mine);
    raw.usual = median(&usual);
    if mine.len() < LEAST_LOGS {
        let reason = format!("too few logs: {} of at least {LEAST_LOGS}", mine.len());
        return Some((raw, Err(reason)));
    }
    if usual.len() < LEAST_OTHERS {
        let reason = format!(
            "too few other machines of the type with {LEAST_LOGS} logs or more: {} of at least {LEAST_OTHERS}",
            usual.len()
        );
        return Some((raw, Err(reason)));
    }
    // the uncertainty of a margin is that of the machine file, which all logs of the machine share
    let sigmas: Option<Vec<f64>> = own.iter().map(|log| log.sigma).collect();
    let sigma = match quantity {
        Quantity::WorstMargin => sigmas.and_then(|sigmas| median(&sigmas)),
        // the share has no stated uncertainty: that of the margin moves it, too, by an unknown amount
        Quantity::ExposedShare => Some(0.0),
    };
    let duration = |logs: &[&Log<'_>]| {
        let all: Vec<f64> = logs.iter().map(|log| log.duration_s).collect();
        median(&all)
    };
    let durations: Vec<f64> = others.iter().filter_map(|logs| duration(logs)).collect();
    let chance = comparable(quantity, duration(own), median(&durations)).and_then(|()| {
        let sigma = sigma.ok_or("the uncertainty of its margins is unknown")?;
        of_one_more(mine_median(&mine), sigma, &usual)
            .ok_or_else(|| "the other machines do not differ at all".to_string())
    });
    Some((raw, chance))
}

fn mine_median(mine: &[f64]) -> f64 {
    median(mine).unwrap_or(f64::NAN)
}

/// Whether logs of these durations (s) can be compared in a quantity.
fn comparable(quantity: Quantity, a: Option<f64>, b: Option<f64>) -> Result<(), String> {
    let (Some(a), Some(b)) = (a, b) else {
        return Err("no durations".into());
    };
    let is_similar = a <= MOST_LONGER * b && b <= MOST_LONGER * a;
    match quantity != Quantity::WorstMargin || is_similar {
        true => Ok(()),
        false => Err(format!(
            "the logs last {a:.0} s and {b:.0} s (medians): longer logs reach smaller margins"
        )),
    }
}

/// The logs by a key; those without one are left out.
fn count_by<'a, 'b, K: Ord>(
    logs: &[&'b Log<'a>],
    key: impl Fn(&Log<'a>) -> Option<K>,
) -> BTreeMap<K, Vec<&'b Log<'a>>> {
    let mut found: BTreeMap<K, Vec<&'b Log<'a>>> = BTreeMap::new();
    for log in logs {
        if let Some(key) = key(log) {
            found.entry(key).or_default().push(log);
        }
    }
    found
}

fn empty(machine: &str, against: Against, quantity: Quantity) -> Comparison {
    Comparison {
        machine: machine.into(),
        against,
        quantity,
        verdict: Verdict::Inconspicuous,
        value: None,
        usual: None,
        confidence: None,
        count: 0,
        usual_count: 0,
    }
}
