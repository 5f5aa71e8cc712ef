//! Findings about a log without an event, and about the wheels without one.

use std::collections::BTreeMap;

use tipwatch_language::{say, word};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;

use super::incident::Incident;
use super::scene::Scene;
use crate::analysis::Analysis;
use crate::events::split_rule::is_open;
use crate::events::support_words::SupportWord;
use crate::events::{Finding, SHORTEST_NS};
use crate::page::{capital, number, readable, with_sure_band};
use crate::report::in_band;
use crate::report::open_split::{self, OpenWheel};

/// The smallest load compared with that at rest.
struct LightestLoad {
    wheel: usize,
    load_n: f64,
    /// Its standard deviation (N), NaN without one.
    sigma_n: f64,
    time_ns: i64,
    /// Whether equilibrium leaves the load open.
    is_split_open: bool,
}

impl Scene {
    /// The first finding of a log without an event: the smallest load compared with that at rest, or why there is none.
    pub(super) fn without_event(&self, open: &[OpenWheel], analysis: &Analysis) -> Finding {
        let Some(lightest) = LightestLoad::of(analysis) else {
            return Finding {
                headline: say!("{} loads cannot be computed in any row", self.word.head),
                evidence: reasons(analysis),
            };
        };
        let wheel = &self.wheels[lightest.wheel];
        let digest = &analysis.digest;
        let seconds = SHORTEST_NS as f64 * 1e-9;
        let least_n = digest.wheels.iter().zip(&self.wheels);
        let brief = least_n.filter_map(|(found, wheel)| {
            let (lowest, limit_n) = found.lowest.zip(wheel.limit_n)?;
            (lowest.load_n < limit_n).then(|| {
                say!(
                    "{}: {} N at t = {:.2} s, below its load limit of {} N for less than {seconds} s",
                    capital(&wheel.named()),
                    number(lowest.load_n),
                    self.seconds(analysis.rows.times_ns[lowest.row]),
                    number(limit_n)
                )
            })
        });
        let brief: Vec<String> = brief.collect();
        let claim = match wheel.limit_n {
            Some(_) if !brief.is_empty() => {
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
        let claim = match digest.doubted_rows {
            0 => claim,
            doubted => say!(
                "{claim} by the computed loads, which signals contradict in {doubted} of their {} rows",
                digest.valid_rows
            ),
        };
        let split = match (open.is_empty(), lightest.is_split_open) {
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
        let (rows, valid) = (analysis.rows.len(), digest.valid_rows);
        let scope = (valid < rows)
            .then(|| say!("Based on the {valid} valid rows of {rows}; the others are unknown"));
        let ranges = self.ranges(open);
        Finding {
            headline: say!(
                "{claim}{split}{between}{band}; the smallest load compared with that at rest was {} N ({}) on {} at t = {:.2} s",
                lightest.in_words(),
                wheel.share(lightest.load_n),
                wheel.named(),
                self.seconds(lightest.time_ns)
            ),
            evidence: ([limit].into_iter().chain(brief))
                .chain(ranges)
                .chain(scope)
                .collect(),
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

impl LightestLoad {
    fn of(analysis: &Analysis) -> Option<Self> {
        let (row, wheel) = analysis.digest.lightest?;
        let found = analysis.rows.window(row..row + 1);
        Some(Self {
            wheel,
            load_n: found.value(Quantity::Load(wheel), 0),
            sigma_n: found.value(Quantity::LoadSigma(wheel), 0),
            time_ns: analysis.rows.times_ns[row],
            is_split_open: is_open(&found, wheel, 0),
        })
    }

    /// The load with its band; the number alone without one.
    fn in_words(&self) -> String {
        match self.sigma_n.is_finite() {
            true => with_sure_band(self.load_n, self.sigma_n),
            false => number(self.load_n),
        }
    }
}
