//! The order of the logs: how close each machine came to tipping over, as far as the data tell.

use tipwatch_language::message;
use tipwatch_mechanics::number::SURE_SIGMAS;

use super::analysed_log::AnalysedLog;
use crate::events::EventKind;
use crate::screen::data_set::{contradicts_margin, lifted};

/// Group of a log, by which logs are ranked first. Events come first, the worst before the rest; then undecided logs, then
/// harmless ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Group {
    TipOver,
    EdgeTipping,
    WheelLift,
    /// Too little time is computable, between the rows of a sparse log a lift cannot be excluded, or what was found is less
    /// probable than not, or may as well be ground that gave way.
    Undecided,
    /// No wheel lifted by the stated split of the load. By another one a wheel may have: more than three wheels always have a
    /// split that leaves one of them no load, so that tells no log from another.
    NoLift,
}

impl Group {
    /// With their names, which are told in the language of the process.
    pub(super) const ALL: [(Self, &'static str); 5] = [
        (Self::TipOver, message!("tipped over")),
        (Self::EdgeTipping, message!("tipped about an edge")),
        (Self::WheelLift, message!("a wheel or support lifted")),
        (Self::Undecided, message!("not decided")),
        (Self::NoLift, message!("no lift by the stated split")),
    ];

    /// The event that a log is in the group for.
    pub(super) fn event(self) -> Option<EventKind> {
        match self {
            Self::TipOver => Some(EventKind::TipOver),
            Self::EdgeTipping => Some(EventKind::EdgeTipping),
            Self::WheelLift => Some(EventKind::WheelLift),
            Self::Undecided | Self::NoLift => None,
        }
    }

    pub(super) fn of(log: &AnalysedLog<'_>) -> Self {
        let facts = log.facts;
        let worst = facts.worst.as_ref();
        let mut gravest_first = [Self::TipOver, Self::EdgeTipping, Self::WheelLift].into_iter();
        if let Some(found) = gravest_first.find(|group| {
            let mut events = log.events.iter();
            events.any(|event| group.event() == Some(event.kind) && event.is_fact())
        }) {
            return found;
        }
        let may_have_lifted = log.events.iter().any(|event| event.kind.is_lift());
        match worst {
            Some(worst) if worst.margin <= 0.0 && !may_have_lifted => Self::WheelLift,
            Some(_) if !log.is_undecided && !may_have_lifted && facts.open_fall.is_none() => {
                Self::NoLift
            }
            _ => Self::Undecided,
        }
    }
}

/// A ranked log. Logs of the same `rank` cannot be told apart.
pub(super) struct Ranked<'a> {
    pub(super) log: AnalysedLog<'a>,
    pub(super) group: Group,
    /// Time with a wheel off the ground (s).
    pub(super) lifted_s: f64,
    /// Its standard deviation (s).
    lifted_sigma_s: f64,
    /// Number of the first log that it cannot be told from, and of the last.
    pub(super) rank: (usize, usize),
}

/// Key by which logs are ordered: a value, the smallest first, and its standard deviation, 0 if unknown.
type Key = fn(&Ranked<'_>) -> (f64, f64);

/// One after the other.
const ORDER: [Key; 3] = [
    |log| (f64::from(log.group as u8), 0.0),
    |log| match log.group.event() {
        Some(_) => (-log.lifted_s, log.lifted_sigma_s),
        None => (0.0, 0.0),
    },
    |log| {
        let (facts, events) = (log.log.facts, log.log.events);
        facts.worst.as_ref().map_or((f64::INFINITY, 0.0), |worst| {
            let sigma = worst.sigma.unwrap_or(0.0);
            match contradicts_margin(facts, events) {
                // at most: how far below is not known
                true => (0.0, sigma),
                false => (worst.margin, sigma),
            }
        })
    },
];

/// Logs by group; those with a lift by how long and then by how deep, the others by margin. What is within two standard deviations
/// of the first of several cannot be told from it: the next quantity orders these, and logs that none tells apart share a rank.
pub(super) fn ranked<'a>(seen: &[AnalysedLog<'a>]) -> Vec<Ranked<'a>> {
    let ranked = seen.iter().map(|log| {
        let (lifted_s, lifted_sigma_s) = lifted(log.events);
        Ranked {
            log: *log,
            group: Group::of(log),
            lifted_s,
            lifted_sigma_s,
            rank: (0, 0),
        }
    });
    let mut ranked: Vec<Ranked<'a>> = ranked.collect();
    rank(&mut ranked, 0, &ORDER);
    ranked
}

/// Orders and ranks logs behind `before` others.
fn rank(logs: &mut [Ranked<'_>], before: usize, order: &[Key]) {
    let Some((value, finer)) = order.split_first() else {
        let last = before + logs.len();
        logs.iter_mut()
            .for_each(|log| log.rank = (before + 1, last));
        return;
    };
    logs.sort_by(|a, b| value(a).0.total_cmp(&value(b).0));
    let mut first = 0;
    while let Some(leader) = logs.get(first) {
        let (least, sigma) = value(leader);
        let cannot_be_told_apart = |log: &&Ranked<'_>| {
            let (other, of_other) = value(log);
            other == least || other - least <= SURE_SIGMAS * sigma.hypot(of_other)
        };
        let tied = logs[first..].iter().take_while(cannot_be_told_apart);
        let end = first + tied.count();
        rank(&mut logs[first..end], before + first, finer);
        first = end;
    }
}
