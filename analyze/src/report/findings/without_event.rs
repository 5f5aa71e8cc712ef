//! Findings about a log without an event, and about the wheels without one.

use std::collections::BTreeMap;

use tipwatch_language::{say, word};
use tipwatch_mechanics::state::Reason;

use super::incident::Incident;
use super::scene::Scene;
use crate::analysis::Analysis;
use crate::events::support_words::SupportWord;
use crate::events::{Finding, SHORTEST_NS};
use crate::page::{number, readable};
use crate::report::in_band;
use crate::report::open_split::{self, OpenWheel};

struct LowestLoad {
    wheel: usize,
    load_n: f64,
    time_ns: i64,
    valid_rows: usize,
    /// Of these, rows whose signals contradict each other.
    doubted_rows: usize,
    /// Whether equilibrium leaves the load of a wheel open.
    is_split_open: bool,
}

impl Scene {
    /// The first finding of a log without an event: the minimum load, or why there is none.
    pub(super) fn without_event(&self, open: &[OpenWheel], analysis: &Analysis) -> Finding {
        let Some(lowest) = lowest_load(analysis) else {
            return Finding {
                headline: say!("{} loads cannot be computed in any row", self.word.head),
                evidence: reasons(analysis),
            };
        };
        let wheel = &self.wheels[lowest.wheel];
        let is_brief = wheel.limit_n.is_some_and(|limit_n| lowest.load_n < limit_n);
        let claim = match wheel.limit_n {
            Some(_) if is_brief => {
                let seconds = SHORTEST_NS as f64 * 1e-9;
                say!(
                    "{} fell below its load limit for {seconds} s or longer",
                    self.word.one
                )
            }
            Some(_) => say!("{} fell below its load limit", self.word.one),
            None => say!("{} left the ground", self.word.one),
        };
        let bound_n = |wheel: usize| self.wheels[wheel].limit_n.unwrap_or(0.0);
        let in_band = in_band::wheels(analysis, bound_n);
        let (claim, band) = match (in_band.is_empty(), in_band::are_known(analysis)) {
            (true, true) => (claim, String::new()),
            // without bands nothing is excluded
            (true, false) => (say!("{claim} as computed"), String::new()),
            (false, _) => (
                say!("{claim} as computed"),
                say!(
                    "; within the bands that cannot be excluded ({})",
                    in_band::all_in_words(analysis, &in_band)
                ),
            ),
        };
        let coverage = &analysis.coverage;
        let claim = match partly_known(analysis) {
            known if coverage.between_rows.is_some() => say!(
                "At the rows of this sparse log{}, no {claim}",
                known.map_or(String::new(), |known| say!(" (known in {known})"))
            ),
            Some(known) => say!(
                "In the {known} of the log with known {} loads, no {claim}",
                self.word.one
            ),
            None => say!("No {claim}"),
        };
        let claim = match lowest.doubted_rows {
            0 => claim,
            doubted => say!(
                "{claim} by the computed loads, which signals contradict in {doubted} of their {} rows",
                lowest.valid_rows
            ),
        };
        let split = match (open.is_empty(), lowest.is_split_open) {
            _ if self.is_split_stated => String::new(),
            (false, _) => say!(
                ", if {}; without knowing how the {} it cannot be excluded that {} lost its load",
                self.split_rule,
                self.sharing,
                self.names(open)
            ),
            (true, true) if open_split::is_known(analysis) => {
                say!(", however the {}", self.sharing)
            }
            (true, true) => say!(", if {}", self.split_rule),
            (true, false) => String::new(),
        };
        let between = match (coverage.between_rows, coverage.lift_not_excluded_s()) {
            (_, Some(seconds)) => say!(
                "; between them a lift cannot be excluded for {seconds:.1} of {:.1} s",
                coverage.covered_s
            ),
            (Some(_), None) => word!(
                "; between them the stated greatest rates and accelerations exclude a lift, too"
            )
            .into(),
            (None, None) => String::new(),
        };
        let limit = match wheel.limit_n {
            Some(limit_n) => say!("Load limit of {}: {} N", wheel.named(), number(limit_n)),
            None => word!("No load limit is set").into(),
        };
        let (rows, valid) = (analysis.rows.len(), lowest.valid_rows);
        let scope = (valid < rows)
            .then(|| say!("Based on the {valid} valid rows of {rows}; the others are unknown"));
        let ranges = self.ranges(open);
        Finding {
            headline: say!(
                "{claim}{split}{between}{band}; the minimum load was {} N ({}) on {} at t = {:.2} s",
                number(lowest.load_n),
                wheel.share(lowest.load_n),
                wheel.named(),
                self.seconds(lowest.time_ns)
            ),
            evidence: [limit].into_iter().chain(ranges).chain(scope).collect(),
        }
    }

    /// The wheels without an event of their own that another split could have unloaded.
    pub(super) fn other_wheels(
        &self,
        incidents: &[Incident<'_>],
        open: &[OpenWheel],
    ) -> Option<Finding> {
        let has_event = |open: &OpenWheel| {
            let name = self.wheels[open.wheel].name.to_lowercase();
            let mut events = incidents.iter().flat_map(|incident| &incident.events);
            events.any(|event| event.subject == name)
        };
        let others: Vec<OpenWheel> = open.iter().filter(|w| !has_event(w)).copied().collect();
        (!others.is_empty() && !self.is_split_stated).then(|| Finding {
            headline: say!(
                "Without knowing how the {} it cannot be excluded that {} lost its load, too",
                self.sharing,
                self.names(&others)
            ),
            evidence: self.ranges(&others),
        })
    }

    fn names(&self, open: &[OpenWheel]) -> String {
        let names: Vec<&str> = (open.iter())
            .map(|open| self.wheels[open.wheel].name.as_str())
            .collect();
        let word = SupportWord::of_all(open.iter().map(|open| self.wheels[open.wheel].kind));
        format!("{} {}", word.one, names.join(word!(" or ")))
    }

    /// Describes the range of the load that equilibrium allows each of these wheels, and the measurements that would decide it.
    fn ranges(&self, open: &[OpenWheel]) -> Vec<String> {
        let range = |open: &OpenWheel| {
            say!(
                "{} {}: {} N if {}, {} to {} N by equilibrium alone, at t = {:.2} s",
                SupportWord::of_kind(self.wheels[open.wheel].kind).head,
                self.wheels[open.wheel].name,
                number(open.load_n),
                self.split_rule,
                number(open.least_n),
                number(open.largest_n),
                self.seconds(open.time_ns)
            )
        };
        let wheels = open.iter().map(|open| &self.wheels[open.wheel]);
        let deciding = (!open.is_empty()).then(|| self.deciding(wheels));
        open.iter().map(range).chain(deciding).collect()
    }
}

/// The time with known loads, of a log of which more than a hundredth is unknown.
pub(super) fn partly_known(analysis: &Analysis) -> Option<String> {
    let coverage = &analysis.coverage;
    (!coverage.is_whole()).then(|| coverage.to_string())
}

/// Describes how often each reason makes a row invalid.
fn reasons(analysis: &Analysis) -> Vec<String> {
    if analysis.rows.is_empty() {
        return vec![word!("There are no rows").into()];
    }
    let counts = reason_counts(analysis).into_iter();
    counts
        .map(|(reason, rows)| say!("{} in {rows} rows", readable(reason.name())))
        .collect()
}

/// In how many rows each reason occurs.
pub(in crate::report) fn reason_counts(analysis: &Analysis) -> BTreeMap<Reason, usize> {
    let mut counts = BTreeMap::new();
    for reason in analysis
        .rows
        .reasons
        .iter()
        .flat_map(|reasons| reasons.iter())
    {
        *counts.entry(reason).or_default() += 1;
    }
    counts
}

/// The lowest load of the valid rows, the first of equal ones.
fn lowest_load(analysis: &Analysis) -> Option<LowestLoad> {
    let wheels = analysis.digest.wheels.iter().enumerate();
    let lowest = wheels.filter_map(|(wheel, found)| Some((wheel, found.lowest?)));
    let (wheel, lowest) = lowest.reduce(|least, next| match next.1.load_n < least.1.load_n {
        true => next,
        false => least,
    })?;
    Some(LowestLoad {
        wheel,
        load_n: lowest.load_n,
        time_ns: analysis.rows.times_ns[lowest.row],
        valid_rows: analysis.digest.valid_rows,
        doubted_rows: analysis.digest.doubted_rows,
        is_split_open: lowest.is_split_open,
    })
}
