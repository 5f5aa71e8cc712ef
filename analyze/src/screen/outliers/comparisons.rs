//! Comparisons of machines, and the criteria by which one stands out.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use strum::{EnumIter, IntoEnumIterator, IntoStaticStr};
use tipwatch_language::{say, word};

use super::statistics::{
    Change, LEAST_SEGMENT, Sorted, discovery_rates, fall, least_chance, mean, median, of_one_more,
};
use crate::base::frame::Day;
use crate::base::shared::Shared;
use crate::screen::data_set::{FleetComparison, contradicts_margin, lifted};
use crate::screen::merge::LogRow;
use crate::screen::record::Record;

/// Share of the machines that are called outliers that may be so by chance.
pub(in crate::screen) const MOST_FALSE: f64 = 0.05;
/// Most false alarms in comparisons with the machines of a type, whose scatter is known from few of them.
const MOST_FALSE_OF_TYPE: f64 = 0.005;
/// Fewest logs of a machine, and fewest other machines of its type.
const LEAST_LOGS: usize = 5;
const LEAST_OTHERS: usize = 8;
/// Longer logs reach smaller margins: their margins are not compared with those of logs shorter by more.
const MOST_LONGER: f64 = 2.0;

/// Quantity of a log that describes its machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, EnumIter, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(in crate::screen) enum ComparedQuantity {
    /// The worst margin (share of the static load); smaller is worse.
    WorstMargin,
    /// Share of the computable time below the notice level; larger is worse.
    ExposedShare,
    /// Share of the computable time with a wheel off the ground; larger is worse.
    LiftedShare,
}

impl ComparedQuantity {
    /// The least difference that matters.
    fn relevant(self) -> f64 {
        match self {
            Self::WorstMargin => 0.05,
            Self::ExposedShare => 0.01,
            Self::LiftedShare => 0.001,
        }
    }

    fn is_worse(self, difference: f64) -> bool {
        match self {
            Self::WorstMargin => difference < 0.0,
            Self::ExposedShare | Self::LiftedShare => difference > 0.0,
        }
    }
}

/// Reference of a machine's comparison.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(in crate::screen) enum Against {
    /// Its days since they changed most with those before.
    History,
    /// Its logs with those of the other machines of this type.
    Type { machine_type: String },
}

/// Result of a comparison.
#[derive(Debug, Clone, PartialEq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(in crate::screen) enum Verdict {
    /// The machine stands out.
    Outlier { is_worse: bool },
    /// The machine does not stand out, or not surely enough.
    Inconspicuous,
    /// Nothing can be said.
    NotComparable { reason: String },
}

/// One machine compared in one quantity.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::screen) struct Comparison {
    pub(in crate::screen) machine: String,
    pub(in crate::screen) against: Against,
    pub(in crate::screen) quantity: ComparedQuantity,
    pub(in crate::screen) verdict: Verdict,
    /// First day after the change, for a comparison with its history.
    pub(in crate::screen) since: Option<Day>,
    /// Median of the machine, or of its days since then.
    pub(in crate::screen) value: Option<f64>,
    /// Median of the other machines, or of the days before.
    pub(in crate::screen) usual: Option<f64>,
    /// Confidence that the difference is no chance: 1 minus the share of false ones to expect among all machines that are
    /// at least as conspicuous.
    pub(in crate::screen) confidence: Option<f64>,
    /// Number of its logs, or of its days since the change.
    pub(in crate::screen) count: usize,
    /// Number of other machines, or of earlier days.
    pub(in crate::screen) usual_count: usize,
}

impl From<Comparison> for FleetComparison {
    fn from(comparison: Comparison) -> Self {
        Self {
            machine: comparison.machine,
            compared_with: (&comparison.against).into(),
            quantity: comparison.quantity.into(),
            verdict: (&comparison.verdict).into(),
            is_worse: match comparison.verdict {
                Verdict::Outlier { is_worse } => Some(is_worse),
                _ => None,
            },
            reason: match comparison.verdict {
                Verdict::NotComparable { reason } => Some(reason),
                _ => None,
            },
            machine_type: match comparison.against {
                Against::Type { machine_type } => Some(machine_type),
                Against::History => None,
            },
            since: comparison.since,
            value: comparison.value,
            usual: comparison.usual,
            confidence: comparison.confidence,
            count: comparison.count as u64,
            usual_count: comparison.usual_count as u64,
        }
    }
}

/// A log that can be compared.
struct Log<'a> {
    record: &'a Record,
    day: Option<Day>,
    duration_s: f64,
    sigma: Option<f64>,
    values: BTreeMap<ComparedQuantity, f64>,
}

impl<'a> Log<'a> {
    fn of(row: &'a LogRow, min_valid: f64) -> Option<Self> {
        let (facts, events) = row.record.analysed()?;
        if facts.undecided(min_valid).is_some() {
            return None;
        }
        let worst = facts.worst.as_ref();
        let worst = worst.filter(|_| !contradicts_margin(facts, events));
        let computable_s = facts.coverage.computable_s;
        let exposed = (facts.exposure.exposed_s).filter(|_| computable_s > 0.0);
        let values = [
            (
                ComparedQuantity::WorstMargin,
                worst.map(|worst| worst.margin),
            ),
            (
                ComparedQuantity::ExposedShare,
                exposed.map(|s| s / computable_s),
            ),
            (
                ComparedQuantity::LiftedShare,
                exposed.map(|_| lifted(events).0 / computable_s),
            ),
        ];
        let known = |(quantity, value): (ComparedQuantity, Option<f64>)| {
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
    let histories: BTreeMap<&str, Vec<Days<'_>>> = machines
        .iter()
        .map(|(machine, logs)| (*machine, days_of(logs)))
        .collect();
    let few = |days: &&Vec<Days<'_>>| days.len() >= 2 * LEAST_SEGMENT;
    let needed = days_needed(histories.values().filter(few).count());
    let quantities: Vec<ComparedQuantity> = ComparedQuantity::iter().collect();
    let mut history: Vec<Family> = histories
        .par_iter()
        .flat_map_iter(|(machine, days)| {
            let quantities = quantities.iter();
            let both = quantities.map(|&quantity| with_history(machine, days, quantity, needed));
            let (worse, better): (Vec<_>, Vec<_>) = both.unzip();
            [worse, better]
        })
        .collect();
    judge_changes(&mut history);
    let typical: BTreeMap<&str, Typical<'_>> = machines
        .par_iter()
        .map(|(machine, logs)| (*machine, Typical::of(logs)))
        .collect();
    let types = types(&typical);
    let of_type: Vec<Family> = typical
        .par_iter()
        .map(|(machine, own)| {
            let quantities = quantities.iter();
            let compared = quantities.map(|&quantity| with_type(machine, own, &types, quantity));
            compared.flatten().collect()
        })
        .collect();
    let is_worse = |family: &Family| family.iter().all(|raw| raw.direction == Some(true));
    let (worse, better): (Vec<_>, Vec<_>) = history.into_iter().partition(is_worse);
    let mut found = judge(worse, MOST_FALSE);
    let better = judge(better, MOST_FALSE).into_iter();
    // what is no outlier is told once
    found.extend(better.filter(|c| matches!(c.verdict, Verdict::Outlier { .. })));
    found.extend(judge(of_type, MOST_FALSE_OF_TYPE));
    found.sort_by(|a, b| {
        let key = |c: &Comparison| (c.machine.clone(), c.against.clone(), c.quantity);
        key(a).cmp(&key(b))
    });
    found
}

/// A comparison with the probability that the difference is chance, or the reason why there is none.
struct Raw {
    comparison: Comparison,
    chance: Result<f64, String>,
    /// Whether only a worse or only a better machine was looked for.
    direction: Option<bool>,
    /// The change in its history, which the others help to judge.
    change: Option<Change>,
}

/// The comparisons of one machine, one for each quantity.
type Family = Vec<Raw>;

/// Gives each change in a history its probability. How much days resemble each other is hardly known from those of one machine:
/// it is taken to be at least as much as in the fleet, of the same quantity and direction.
fn judge_changes(history: &mut [Family]) {
    let mut of_each: BTreeMap<(ComparedQuantity, Option<bool>), Vec<f64>> = BTreeMap::new();
    for raw in history.iter().flatten() {
        let found = of_each.entry((raw.comparison.quantity, raw.direction));
        found
            .or_default()
            .extend(raw.change.map(|change| change.correlation));
    }
    for raw in history.iter_mut().flatten() {
        let usual = mean(&of_each[&(raw.comparison.quantity, raw.direction)]);
        if let (Ok(chance), Some(change)) = (&mut raw.chance, &raw.change) {
            *chance = change.chance(usual.unwrap_or(0.0));
        }
    }
}

/// Judges the machines: of those called outliers at most `most_false` are expected to be so by chance (Benjamini and
/// Hochberg over the machines). The quantities of a machine are corrected among themselves (Bonferroni), and those of an
/// outlier are told that are as sure as the machine must be (Benjamini and Bogomolov, 2014).
fn judge(families: Vec<Family>, most_false: f64) -> Vec<Comparison> {
    let least_of = |family: &Family| {
        let known: Vec<f64> = family
            .iter()
            .filter_map(|raw| raw.chance.as_ref().ok().copied())
            .collect();
        let least = known.iter().copied().reduce(f64::min)?;
        Some((least * known.len() as f64).min(1.0))
    };
    let known: Vec<f64> = families.iter().filter_map(least_of).collect();
    let rates = discovery_rates(&known);
    let called = rates.iter().filter(|rate| **rate <= most_false).count();
    let of_each = known.len() as f64 / called.max(1) as f64;
    let judged = families.into_iter().flat_map(|family| {
        let quantities = family.iter().filter(|raw| raw.chance.is_ok()).count();
        family.into_iter().map(move |raw| {
            let mut comparison = raw.comparison;
            comparison.verdict = match raw.chance {
                Err(reason) => Verdict::NotComparable { reason },
                Ok(chance) => {
                    let false_share = (chance * quantities as f64 * of_each).min(1.0);
                    comparison.confidence = Some(1.0 - false_share);
                    let difference = comparison.value.zip(comparison.usual).map(|(a, b)| a - b);
                    let difference = difference.unwrap_or(0.0);
                    let is_relevant = difference.abs() >= comparison.quantity.relevant();
                    match false_share <= most_false && is_relevant {
                        true => Verdict::Outlier {
                            is_worse: comparison.quantity.is_worse(difference),
                        },
                        false => Verdict::Inconspicuous,
                    }
                }
            };
            comparison
        })
    });
    judged.collect()
}

/// The logs of a day.
type Days<'a> = (Day, Vec<&'a Log<'a>>);

/// The logs of a machine by day.
fn days_of<'a>(logs: &[&'a Log<'a>]) -> Vec<Days<'a>> {
    let mut days: BTreeMap<Day, Vec<&Log<'_>>> = BTreeMap::new();
    for log in logs {
        if let Some(day) = log.day {
            days.entry(day).or_default().push(log);
        }
    }
    days.into_iter().collect()
}

/// Combines the values of logs: the middle of their margins, but the share of all their time.
fn together<'a>(
    quantity: ComparedQuantity,
    middle: fn(&[f64]) -> Option<f64>,
    logs: impl Iterator<Item = &'a &'a Log<'a>> + Clone,
) -> Option<f64> {
    let known = logs.filter_map(|log| Some((log.duration_s, *log.values.get(&quantity)?)));
    match quantity {
        ComparedQuantity::WorstMargin => middle(&known.map(|(_, value)| value).collect::<Vec<_>>()),
        ComparedQuantity::ExposedShare | ComparedQuantity::LiftedShare => {
            let (all_s, share_s) = known.fold((0.0, 0.0), |(all_s, share_s), (log_s, value)| {
                (all_s + log_s, share_s + log_s * value)
            });
            (all_s > 0.0).then(|| share_s / all_s)
        }
    }
}

/// Whether a change came with another machine file or program: too few of the days before it have logs of a version of the
/// analysis that those since then have.
fn came_with_the_analysis(earlier: &[DayValue<'_>], since: &[DayValue<'_>]) -> bool {
    let versions = |logs: &[&Log<'_>]| -> BTreeSet<Option<Shared<str>>> {
        let versions = logs.iter().map(|log| log.record.analysis_version.clone());
        versions.collect()
    };
    let known: BTreeSet<_> = since.iter().flat_map(|day| versions(day.logs)).collect();
    let alike = earlier
        .iter()
        .filter(|day| !known.is_disjoint(&versions(day.logs)));
    alike.count() < LEAST_SEGMENT
}

/// Fewest days in which a complete change of one machine in one quantity would be sure among this many machines.
fn days_needed(machines: usize) -> usize {
    let corrected = (ComparedQuantity::iter().count() * machines.max(1)) as f64;
    let is_enough = |days: &usize| least_chance(*days) * corrected <= MOST_FALSE;
    (2 * LEAST_SEGMENT..1000).find(is_enough).unwrap_or(1000)
}

/// Combined value of the logs of a day.
struct DayValue<'a> {
    day: Day,
    logs: &'a [&'a Log<'a>],
    value: f64,
}

/// The days of a machine since they changed most with the days before: logs of one day are of one site and one driver, and
/// count once. One comparison looks for worse days, one for better ones.
fn with_history(
    machine: &str,
    days: &[Days<'_>],
    quantity: ComparedQuantity,
    needed: usize,
) -> (Raw, Raw) {
    let known = days.iter().filter_map(|(day, logs)| {
        Some(DayValue {
            day: *day,
            logs,
            // a median would not see one shift of several that changes
            value: together(quantity, mean, logs.iter())?,
        })
    });
    let known: Vec<DayValue<'_>> = known.collect();
    // of the margin small values are bad, of the shares large ones
    let sign = if quantity.is_worse(-1.0) { 1.0 } else { -1.0 };
    let compare = |is_worse: bool| {
        let sign = if is_worse { sign } else { -sign };
        let mut comparison = empty(machine, Against::History, quantity);
        let series: Vec<f64> = known.iter().map(|day| sign * day.value).collect();
        let mut change = None;
        let chance = if series.len() < needed {
            comparison.usual_count = series.len();
            Err(say!(
                "too few days: {} of at least {needed}; in fewer no change could be sure",
                series.len()
            ))
        } else {
            match fall(&series) {
                // constant
                None => Ok(1.0),
                Some(found) => {
                    let (earlier, since) = known.split_at(found.before);
                    let middle = |days: &[DayValue<'_>]| {
                        median(&days.iter().map(|day| day.value).collect::<Vec<_>>())
                    };
                    change = Some(found);
                    comparison.since = since.first().map(|day| day.day);
                    comparison.value = middle(since);
                    comparison.usual = middle(earlier);
                    comparison.count = since.len();
                    comparison.usual_count = earlier.len();
                    let durations = |days: &[DayValue<'_>]| {
                        let all = days.iter().flat_map(|day| day.logs.iter());
                        median(&all.map(|log| log.duration_s).collect::<Vec<_>>())
                    };
                    comparable(quantity, durations(since), durations(earlier)).and_then(|()| {
                        match came_with_the_analysis(earlier, since) {
                            true => Err(word!(
                                "the machine file or the program changed at the same time; analysing the logs before it anew \
                                 would tell"
                            )
                            .into()),
                            // judged with those of the fleet
                            false => Ok(1.0),
                        }
                    })
                }
            }
        };
        Raw {
            comparison,
            chance,
            direction: Some(is_worse),
            change,
        }
    };
    (compare(true), compare(false))
}

/// A machine by all its logs.
struct Typical<'a> {
    kind: Option<&'a str>,
    /// Number of logs with a value, and what they say together.
    values: BTreeMap<ComparedQuantity, (usize, Option<f64>)>,
    /// Of the uncertainties of the margins; `None` if one is unknown.
    sigma: Option<f64>,
    duration_s: Option<f64>,
}

impl<'a> Typical<'a> {
    fn of(logs: &[&'a Log<'a>]) -> Self {
        let machine = (logs.first()).and_then(|log| log.record.machine.as_ref());
        let values = ComparedQuantity::iter().map(|quantity| {
            let known = logs.iter().filter(|log| log.values.contains_key(&quantity));
            (
                quantity,
                (known.count(), together(quantity, median, logs.iter())),
            )
        });
        let with_margin = |log: &&&Log<'_>| log.values.contains_key(&ComparedQuantity::WorstMargin);
        let sigmas: Option<Vec<f64>> = (logs.iter().filter(with_margin))
            .map(|log| log.sigma)
            .collect();
        let durations: Vec<f64> = logs.iter().map(|log| log.duration_s).collect();
        Self {
            kind: machine.and_then(|machine| machine.kind.as_deref()),
            values: values.collect(),
            sigma: sigmas.and_then(|sigmas| median(&sigmas)),
            duration_s: median(&durations),
        }
    }
}

/// Combined values of the machines of a type that have enough logs, in a quantity.
#[derive(Default)]
struct OfType {
    values: Sorted,
    durations: Sorted,
}

fn types<'a>(
    machines: &BTreeMap<&str, Typical<'a>>,
) -> BTreeMap<(&'a str, ComparedQuantity), OfType> {
    let mut types: BTreeMap<_, (Vec<f64>, Vec<f64>)> = BTreeMap::new();
    for machine in machines.values() {
        for (&quantity, &(count, value)) in &machine.values {
            if let Some(kind) = machine.kind.filter(|_| count >= LEAST_LOGS) {
                let (values, durations) = types.entry((kind, quantity)).or_default();
                values.extend(value);
                durations.extend(machine.duration_s);
            }
        }
    }
    let sorted = types.into_iter().map(|(of, (values, durations))| {
        let (values, durations) = (Sorted::of(values), Sorted::of(durations));
        (of, OfType { values, durations })
    });
    sorted.collect()
}

/// A machine with the medians of the others of its type; `None` if its type is unknown.
fn with_type(
    machine: &str,
    own: &Typical<'_>,
    types: &BTreeMap<(&str, ComparedQuantity), OfType>,
    quantity: ComparedQuantity,
) -> Option<Raw> {
    let own_type = own.kind?;
    let (count, mine) = own.values[&quantity];
    let none = OfType::default();
    let all = types.get(&(own_type, quantity)).unwrap_or(&none);
    let is_one_of_them = count >= LEAST_LOGS;
    let usual = all.values.without(mine.filter(|_| is_one_of_them));
    let against = Against::Type {
        machine_type: own_type.into(),
    };
    let mut comparison = empty(machine, against, quantity);
    comparison.count = count;
    comparison.usual_count = usual.len();
    comparison.value = mine;
    comparison.usual = usual.median();
    if !is_one_of_them {
        let reason = say!("too few logs: {count} of at least {LEAST_LOGS}");
        return Some(Raw {
            comparison,
            chance: Err(reason),
            direction: None,
            change: None,
        });
    }
    if usual.len() < LEAST_OTHERS {
        let reason = say!(
            "too few other machines of the type with {LEAST_LOGS} logs or more: {} of at least {LEAST_OTHERS}",
            usual.len()
        );
        return Some(Raw {
            comparison,
            chance: Err(reason),
            direction: None,
            change: None,
        });
    }
    // the uncertainty of a margin is that of the machine file, which all logs of the machine share
    let sigma = match quantity {
        ComparedQuantity::WorstMargin => own.sigma,
        // A share has no stated uncertainty. It is known no better than the least difference that matters, also where the
        // others do not differ at all, as machines that never lift a wheel.
        ComparedQuantity::ExposedShare | ComparedQuantity::LiftedShare => Some(quantity.relevant()),
    };
    let durations = all.durations.without(own.duration_s);
    let chance = comparable(quantity, own.duration_s, durations.median()).and_then(|()| {
        if comparison.value == comparison.usual {
            return Ok(1.0);
        }
        let sigma = sigma.ok_or("the uncertainty of its margins is unknown")?;
        of_one_more(mine.unwrap_or(f64::NAN), sigma, &usual)
            .ok_or_else(|| "the other machines do not differ at all".to_string())
    });
    Some(Raw {
        comparison,
        chance,
        direction: None,
        change: None,
    })
}

/// Whether logs of these durations (s) can be compared in a quantity.
fn comparable(quantity: ComparedQuantity, a: Option<f64>, b: Option<f64>) -> Result<(), String> {
    let (Some(a), Some(b)) = (a, b) else {
        return Err(word!("no durations").into());
    };
    let is_similar = a <= MOST_LONGER * b && b <= MOST_LONGER * a;
    match quantity != ComparedQuantity::WorstMargin || is_similar {
        true => Ok(()),
        false => Err(say!(
            "the logs last {a:.0} s and {b:.0} s (medians): longer logs reach smaller margins"
        )),
    }
}

fn empty(machine: &str, against: Against, quantity: ComparedQuantity) -> Comparison {
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
        since: None,
    }
}
