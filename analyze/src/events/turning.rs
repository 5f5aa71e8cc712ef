//! A platform that still turns outwards about an edge when the log ends: whether a fall has begun.
//!
//! What tyres and ground explain is in [`OutwardTurn`]. Where the computed loads leave hardly anything off the edge, it is not the
//! ground; where they leave nothing, the tyres have no way left, and one lean counts.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::say;
use tipwatch_mechanics::estimation::rotation::{OutwardTurn, PlatformRotation};

use super::event::{Event, EventKind};
use super::support_words::edge_word;

/// Rotation that tyres do not allow a platform without load off the edge, in their largest lean.
const UNLOADED_TRAVELS: f64 = 1.0;

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

impl Turning {
    /// Returns the rotation about each edge at the last sample, with stamp `at_ns`, the farthest first; none where tyres explain
    /// it.
    pub(super) fn at_end(watch: &PlatformRotation, at_ns: i64) -> Vec<Self> {
        let turns = watch.outward_turns(at_ns);
        let mut turns: Vec<OutwardTurn> = turns
            .filter(|turn| turn.ahead() > UNLOADED_TRAVELS * turn.lean_sigma)
            .collect();
        let leans = |turn: &OutwardTurn| turn.ahead() / turn.lean_sigma;
        turns.sort_by(|a, b| leans(b).total_cmp(&leans(a)));
        let of_turn = |turn: OutwardTurn| Self {
            edge: watch.edge_name(turn.edge).to_lowercase(),
            since_ns: turn.since_ns,
            at_ns,
            rotation_rad: turn.angle,
            rate_rad_per_s: turn.rate,
            lean_rad: turn.lean_sigma,
            is_beyond_tyres: turn.is_beyond_tyres(),
            is_beyond_ground: turn.is_beyond_ground(),
        };
        turns.into_iter().map(of_turn).collect()
    }

    /// Whether an event tells of the same fall: one about this edge that lasts until the log ends and is more likely than not.
    pub(crate) fn is_known(&self, events: &[Event]) -> bool {
        events.iter().any(|event| {
            let is_tipping = matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver);
            let lasts = event.end_ns.is_none();
            is_tipping && lasts && event.subject == self.edge && event.is_fact()
        })
    }

    /// Describes the rotation, to follow "the log ends while".
    pub(crate) fn in_words(&self) -> String {
        say!(
            "the platform turns outwards about the {} edge at {:.1}°/s, {:.1}° so far; whether it fell is not known",
            edge_word(&self.edge),
            self.rate_rad_per_s.to_degrees(),
            self.rotation_rad.to_degrees()
        )
    }
}
