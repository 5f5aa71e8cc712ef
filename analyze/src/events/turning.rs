//! A platform that still turns outwards about an edge when the log ends: whether a fall has begun.
//!
//! Tyres have a bounded travel. A platform on its wheels turns from the largest lean to one side to that to the other at most,
//! and slower again on the second half of that way. One that falls turns on, faster and faster:
//! ```text
//!     angle + AHEAD_S rate > 2 lean + ground,    rate >= UNDIMINISHED (largest rate since it turns outwards)
//! ```
//! with the angle since it turns outwards. The ground turns a machine that drives; where the computed loads leave hardly
//! anything off the edge, it is not the ground. Where they leave nothing, the tyres have no way left: one lean counts.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::estimation::rotation::{PlatformRotation, RotationSpell, ShownUp};

use super::event::{Event, EventKind};

/// Slower than this a platform does not turn (rad/s).
const LEAST_RATE: f64 = 1.0 * DEGREE;
/// Time over which the rate is smoothed (s).
const SMOOTHED_S: f64 = 0.03;
/// Time for which the rate is taken to go on (s).
const AHEAD_S: f64 = 0.3;
/// Rotation that tyres do not allow, in their largest lean: from one side to the other, and of a platform without load off the
/// edge.
const TRAVELS: f64 = 2.0;
const UNLOADED_TRAVELS: f64 = 1.0;
/// Share of its largest rate at which a platform still turns on.
const UNDIMINISHED: f64 = 0.5;
/// Share of the rotation that an attitude must show as well.
const AGREES: f64 = 0.5;
/// Ratio of the rate to the mean rate from which a gyro does not drift, whatever the attitude shows: that of a fall is 3.
const GROWN: f64 = 1.5;
/// Wheels roll by less than this while a platform that stands tilts over them (m).
const ROLLED_M: f64 = 0.1;
/// Longer than this between two samples, what happened is not known (ns).
const GAP_NS: i64 = 200_000_000;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// What gyro and attitude show at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub(super) at_ns: i64,
    pub(super) shown: [Option<ShownUp>; 2],
    /// Distance since the first sample (m).
    pub(super) travelled: f64,
}

/// How the platform turns at the end of the log.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Turning {
    /// The edge.
    pub edge: String,
    /// Since when it turns outwards (ns).
    pub since_ns: i64,
    /// The last sample that shows it (ns).
    pub at_ns: i64,
    /// How far it has turned since then (rad).
    pub rotation_rad: f64,
    /// How fast it turns (rad/s).
    pub rate_rad_per_s: f64,
    /// How far its tyres let it lean (rad).
    pub lean_rad: f64,
    /// Whether tyres do not explain it even if they carry.
    pub is_beyond_tyres: bool,
    /// Whether the ground under a machine that drives does not explain it either.
    pub is_beyond_ground: bool,
}

/// An outward rotation about an edge that goes on.
#[derive(Default)]
struct Run {
    since: Option<Point>,
    angle: f64,
    rate: f64,
    fastest: f64,
}

impl Turning {
    /// What the last samples show about each edge, the farthest first; none where tyres explain it.
    pub(super) fn at_end(recent: &VecDeque<Point>, watch: &PlatformRotation) -> Vec<Self> {
        let last = recent.back();
        let source = last.and_then(|last| last.shown.iter().position(Option::is_some));
        let Some((last, source)) = last.zip(source) else {
            return Vec::new();
        };
        let edges = 0..watch.edge_count();
        let found = edges.filter_map(|edge| Self::about(recent, watch, edge, source, last));
        let mut found: Vec<(f64, Self)> = found.collect();
        found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        found.into_iter().map(|(_, turning)| turning).collect()
    }

    /// The rotation about an edge, and how far it goes, in the largest lean.
    fn about(
        recent: &VecDeque<Point>,
        watch: &PlatformRotation,
        edge: usize,
        source: usize,
        last: &Point,
    ) -> Option<(f64, Self)> {
        let axis = watch.axis(edge);
        let mut run = Run::default();
        let mut before_ns: Option<i64> = None;
        for point in recent {
            let Some(shown) = &point.shown[source] else {
                continue;
            };
            let rate = axis.dot(&shown.rate);
            let step_ns = before_ns.map_or(i64::MAX, |before| point.at_ns.saturating_sub(before));
            before_ns = Some(point.at_ns);
            if step_ns > GAP_NS {
                run = Run {
                    rate,
                    ..Run::default()
                };
                continue;
            }
            let step_s = step_ns as f64 * 1e-9;
            run.rate += (rate - run.rate) * (1.0 - (-step_s / SMOOTHED_S).exp());
            if run.rate <= LEAST_RATE {
                run = Run {
                    rate: run.rate,
                    ..Run::default()
                };
                continue;
            }
            run.since.get_or_insert(*point);
            run.angle += run.rate * step_s;
            run.fastest = run.fastest.max(run.rate);
        }
        let since = run.since?;
        // so much farther as the rate is taken to go on
        let ahead_ns = (AHEAD_S * 1e9) as i64;
        let from_ns = since.at_ns.saturating_sub(ahead_ns);
        let before = recent.iter().find(|point| point.at_ns >= from_ns);
        let travelled = last.travelled - before.unwrap_or(&since).travelled;
        let travelled = if travelled < ROLLED_M { 0.0 } else { travelled };
        let sound = watch.sound_rotation(edge, travelled, source == 0);
        let ahead = run.angle + AHEAD_S * run.rate;
        let beyond_tyres = ahead - TRAVELS * sound.lean;
        let is_open = ahead > UNLOADED_TRAVELS * sound.lean
            && run.rate >= UNDIMINISHED * run.fastest
            && run.is_shown(&since, last, source, &axis);
        is_open.then(|| {
            let turning = Self {
                edge: watch.edge_name(edge).to_lowercase(),
                since_ns: since.at_ns,
                at_ns: last.at_ns,
                rotation_rad: run.angle,
                rate_rad_per_s: run.rate,
                lean_rad: sound.lean,
                is_beyond_tyres: beyond_tyres > 0.0,
                is_beyond_ground: beyond_tyres > sound.by_ground,
            };
            (ahead / sound.lean, turning)
        })
    }

    /// Whether an event about its edge that lasts until the log ends says as much, more likely than not.
    pub(crate) fn is_known(&self, events: &[Event]) -> bool {
        events.iter().any(|event| {
            let is_tipping = matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver);
            let lasts = event.end_ns.is_none();
            is_tipping && lasts && event.subject == self.edge && event.is_fact()
        })
    }

    /// What was seen, to follow "the log ends while".
    pub(crate) fn in_words(&self) -> String {
        format!(
            "the platform turns outwards about the {} edge at {:.1}°/s, {:.1}° so far; whether it fell is not known",
            self.edge,
            self.rate_rad_per_s.to_degrees(),
            self.rotation_rad.to_degrees()
        )
    }
}

impl Run {
    /// Whether it is no drift of the source: an attitude shows it as well, or it grows as no drift does.
    fn is_shown(
        &self,
        since: &Point,
        last: &Point,
        source: usize,
        axis: &nalgebra::Vector3<f64>,
    ) -> bool {
        if source != 0 {
            return true;
        }
        let seconds = last.at_ns.saturating_sub(since.at_ns) as f64 * 1e-9;
        let attitudes = since.shown[1].zip(last.shown[1]);
        let agrees = attitudes.is_some_and(|(from, to)| {
            RotationSpell::rotation_between(axis, &from.up, &to.up) >= AGREES * self.angle
        });
        agrees || self.rate * seconds >= GROWN * self.angle
    }
}
