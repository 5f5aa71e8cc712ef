//! The order of the logs: how close each machine came to tipping over, as far as the data tell.

use std::cmp::Ordering;

use super::seen::Seen;
use crate::events::EventKind;
use crate::screen::data_set::lifted_s;

/// What a log is ranked by first. What happened comes first, the worst before the rest; then what nobody knows, then what is
/// harmless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Group {
    TipOver,
    EdgeTipping,
    WheelLift,
    /// Too little time is computable, or between the rows of a sparse log a lift cannot be excluded.
    Undecided,
    /// No wheel lifted by the stated split of the load. By another one a wheel may have: more than three wheels always have a
    /// split that leaves one of them no load, so that tells no log from another.
    NoLift,
}

impl Group {
    pub(super) const ALL: [(Self, &'static str); 5] = [
        (Self::TipOver, "tipped over"),
        (Self::EdgeTipping, "tipped about an edge"),
        (Self::WheelLift, "a wheel or support lifted"),
        (Self::Undecided, "not decided"),
        (Self::NoLift, "no lift by the stated split"),
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

    pub(super) fn of(log: &Seen<'_>) -> Self {
        let facts = log.facts;
        let worst = facts.worst.as_ref();
        let lifted = worst.is_some_and(|worst| worst.margin <= 0.0);
        if facts.has_event(EventKind::TipOver) {
            Self::TipOver
        } else if facts.has_event(EventKind::EdgeTipping) {
            Self::EdgeTipping
        } else if facts.has_event(EventKind::WheelLift) || lifted {
            Self::WheelLift
        } else if log.is_undecided || worst.is_none() {
            Self::Undecided
        } else {
            Self::NoLift
        }
    }
}

/// A ranked log. Logs of the same `rank` cannot be told apart.
pub(super) struct Ranked<'a> {
    pub(super) log: Seen<'a>,
    pub(super) group: Group,
    /// Time with a wheel off the ground (s).
    pub(super) lifted_s: f64,
    /// Number of the first log that it cannot be told from, and of the last.
    pub(super) rank: (usize, usize),
}

impl Ranked<'_> {
    /// Margin, infinite if unknown.
    fn margin(&self) -> f64 {
        let worst = self.log.facts.worst.as_ref();
        worst.map_or(f64::INFINITY, |worst| worst.margin)
    }

    /// Two standard deviations of the margin; 0 if unknown.
    fn band(&self) -> f64 {
        let worst = self.log.facts.worst.as_ref();
        2.0 * worst.and_then(|worst| worst.sigma).unwrap_or(0.0)
    }
}

/// Logs by group; those with a lift by how long and then by how deep, the others by margin. Logs whose margins are within two
/// standard deviations of the first of them share a rank.
pub(super) fn ranked<'a>(seen: &[Seen<'a>]) -> Vec<Ranked<'a>> {
    let ranked = seen.iter().map(|log| Ranked {
        log: *log,
        group: Group::of(log),
        lifted_s: lifted_s(log.events),
        rank: (0, 0),
    });
    let mut ranked: Vec<Ranked<'a>> = ranked.collect();
    ranked.sort_by(order);
    let mut first = 0;
    while first < ranked.len() {
        let is_tied = |other: &Ranked<'_>| cannot_be_told_apart(&ranked[first], other);
        let tied = ranked[first + 1..]
            .iter()
            .take_while(|log| is_tied(log))
            .count();
        let rank = (first + 1, first + 1 + tied);
        ranked[first..=first + tied]
            .iter_mut()
            .for_each(|log| log.rank = rank);
        first += tied + 1;
    }
    ranked
}

fn order(a: &Ranked<'_>, b: &Ranked<'_>) -> Ordering {
    let by_time = match a.group {
        Group::TipOver | Group::EdgeTipping | Group::WheelLift => b.lifted_s.total_cmp(&a.lifted_s),
        _ => Ordering::Equal,
    };
    a.group
        .cmp(&b.group)
        .then(by_time)
        .then_with(|| a.margin().total_cmp(&b.margin()))
        .then_with(|| a.log.record.path.cmp(&b.log.record.path))
}

/// Whether two neighbours of the ranking may as well have the other order: equal times lifted, and margins within their bands.
fn cannot_be_told_apart(a: &Ranked<'_>, b: &Ranked<'_>) -> bool {
    let band = (a.band().powi(2) + b.band().powi(2)).sqrt();
    let (x, y) = (a.margin(), b.margin());
    a.group == b.group && a.lifted_s == b.lifted_s && (x == y || (x - y).abs() <= band)
}
