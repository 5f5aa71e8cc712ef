//! Present outward rotation of a platform about its edges, before it is certain that the platform rotates.
//!
//! Tyres have a bounded travel. A platform on its wheels turns from the largest lean to one side to that to the other at most,
//! and slower again on the second half of that way. One that falls turns on, faster and faster:
//! ```text
//!     angle + AHEAD_S rate > 2 lean + ground,    rate >= UNDIMINISHED (largest rate since it turns outwards)
//! ```
//! with the angle since it turns outwards, without that of its suspension. One that comes back from a rotation the other way counts from
//! where its tyres carry again. Wheels that roll climb or leave a step of the ground, all on one side at most; after a distance s
//! ```text
//!     sin(angle) = (sqrt(radius^2 - (along - s)^2) - (radius - height)) / width,    along = sqrt(radius^2 - (radius - height)^2)
//! ```

use nalgebra::{Vector2, Vector3};

use super::edges::Edges;
use super::spell::RotationSpell;

/// Slower than this a platform does not turn (rad/s).
const LEAST_RATE: f64 = 1.0 * DEGREE;
/// Time over which the rate is smoothed (s).
const SMOOTHED_S: f64 = 0.03;
/// Time for which the rate is taken to go on (s).
pub(super) const AHEAD_S: f64 = 0.3;
/// Rotation that tyres do not allow, in their largest lean: from one side to the other.
pub(super) const TRAVELS: f64 = 2.0;
/// Share of its largest rate at which a platform still turns on.
const UNDIMINISHED: f64 = 0.5;
/// Share of the rotation that an attitude must show as well.
const AGREES: f64 = 0.5;
/// Ratio of the rate to the mean rate from which a gyro does not drift, whatever the attitude shows, and after which time (s): that of
/// a fall is 3, that of a gyro that jumps falls to 1 in it.
const GROWN: f64 = 1.5;
const GROWN_S: f64 = 5.0 * SMOOTHED_S;
/// Distance below which the rolling of the wheels, so far and soon, has not taken a turning machine onto a slope (m).
const ROLLED_M: f64 = 0.1;
/// Highest step that a wheel climbs, as a share of its radius.
const STEP: f64 = 0.6;
/// Longest time between two samples over which a rotation is followed (ns).
const GAP_NS: i64 = 200_000_000;
/// Time over which a lean of the suspension is spread (s): its joints are sampled more slowly than the gyro, and have noise.
const SUSPENSION_S: f64 = 0.1;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Attitude and motion of the platform by one source at a time, all in base axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownUp {
    /// Up direction.
    pub up: Vector3<f64>,
    /// Up direction of the platform on its wheels at that time, from which a rotation is counted.
    pub reference_up: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub rate: Vector3<f64>,
}

/// An outward rotation about an edge that goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutwardTurn {
    /// The edge, by its index.
    pub edge: usize,
    /// Start of the outward rotation (ns).
    pub since_ns: i64,
    /// Duration since then (s).
    pub lasts_s: f64,
    /// Rotation of the platform since then (rad), outwards positive.
    pub angle: f64,
    /// Rate of the rotation (rad/s), outwards positive.
    pub rate: f64,
    /// Standard deviation of the lean about the edge while the machine stands on its supports (rad).
    pub lean_sigma: f64,
    /// Largest rotation by the ground since then, extrapolated as in [`OutwardTurn::ahead`] (rad).
    pub by_ground: f64,
}

impl OutwardTurn {
    /// Returns the rotation extrapolated by `AHEAD_S` at the present rate (rad).
    #[must_use]
    pub fn ahead(&self) -> f64 {
        self.angle + AHEAD_S * self.rate
    }

    /// Whether the extrapolated rotation exceeds the travel of tyres that carry.
    #[must_use]
    pub fn is_beyond_tyres(&self) -> bool {
        self.ahead() > TRAVELS * self.lean_sigma
    }

    /// Whether the extrapolated rotation exceeds what tyres and ground together explain.
    #[must_use]
    pub fn is_beyond_ground(&self) -> bool {
        self.ahead() > TRAVELS * self.lean_sigma + self.by_ground
    }

    /// Whether the rotation exceeds what tyres and ground together explain: the extrapolated rotation once it has lasted for
    /// `AHEAD_S`, before that the rotation so far. A platform that rocks on its tyres turns back sooner.
    #[must_use]
    pub fn has_left_ground(&self) -> bool {
        let lasting = if self.lasts_s >= AHEAD_S {
            self.ahead()
        } else {
            self.angle
        };
        lasting > TRAVELS * self.lean_sigma + self.by_ground
    }
}

/// Outward rotation about each edge by the gyro, or by the attitude.
#[derive(Debug, Clone)]
pub(super) struct Outward {
    runs: Vec<Run>,
    last_ns: Option<i64>,
    /// Rotation of the platform by the suspension that was not yet taken off, about x and y (rad).
    leant: Vector2<f64>,
    /// Rolling speed of the wheels (m/s).
    rolling: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Run {
    since: Option<Since>,
    angle: f64,
    rate: f64,
    fastest: f64,
    /// Rolled distance of the wheels (m).
    rolled: f64,
}

/// Start of an outward rotation.
#[derive(Debug, Clone, Copy)]
struct Since {
    at_ns: i64,
    attitude: Option<Vector3<f64>>,
    /// Rotation by soft ground under the standing machine until then (rad).
    settled: f64,
}

impl Outward {
    pub(super) fn new(edges: &Edges) -> Self {
        Self {
            runs: vec![Run::default(); edges.all.len()],
            last_ns: None,
            leant: Vector2::zeros(),
            rolling: 0.0,
        }
    }

    /// Takes a rotation of the platform by its suspension (rad).
    pub(super) fn lean(&mut self, by: &Vector2<f64>) {
        self.leant += by;
    }

    /// Takes the motion by the source; `attitude` is that by the attitude at the same time, `rolling` the rolling speed of the
    /// wheels (m/s), `settled` the rotation by the ground under the standing machine (rad).
    pub(super) fn take(
        &mut self,
        edges: &Edges,
        now_ns: i64,
        shown: &ShownUp,
        attitude: Option<&ShownUp>,
        rolling: f64,
        settled: f64,
    ) {
        if self.last_ns.is_some_and(|last_ns| now_ns <= last_ns) {
            return;
        }
        let last_ns = self.last_ns.replace(now_ns);
        let step_ns = last_ns.map_or(i64::MAX, |last_ns| now_ns.saturating_sub(last_ns));
        self.rolling = rolling;
        let step_s = step_ns as f64 * 1e-9;
        let leant = match step_ns > GAP_NS {
            true => self.leant,
            false => self.leant * (1.0 - (-step_s / SUSPENSION_S).exp()),
        };
        self.leant -= leant;
        for (run, edge) in self.runs.iter_mut().zip(&edges.all) {
            let rate = edge.axis.dot(&shown.rate);
            if step_ns > GAP_NS {
                *run = Run::at(rate);
                continue;
            }
            let rate = rate - edge.axis.xy().dot(&leant) / step_s;
            run.rate += (rate - run.rate) * (1.0 - (-step_s / SMOOTHED_S).exp());
            if run.rate <= LEAST_RATE {
                *run = Run::at(run.rate);
                continue;
            }
            let is_back = || {
                let (from, to) = (&shown.reference_up, &shown.up);
                RotationSpell::rotation_between(&edge.axis, from, to) > -edge.lean_sigma
            };
            if run.since.is_none() && !is_back() {
                continue;
            }
            run.since.get_or_insert(Since {
                at_ns: now_ns,
                attitude: attitude.map(|shown| shown.up),
                settled,
            });
            run.angle += run.rate * step_s;
            run.rolled += rolling * step_s;
            run.fastest = run.fastest.max(run.rate);
        }
    }

    /// Returns the rotations that go on and are no drift of the source. `by_ground` gives the largest rotation of the platform by
    /// the ground about an edge, for a distance (m), a rotation by a step (rad), the rotation by soft ground at the start (rad),
    /// and the distance of the farthest wheel from the edge (m).
    pub(super) fn turns<'o>(
        &'o self,
        edges: &'o Edges,
        attitude: Option<ShownUp>,
        is_gyro: bool,
        by_ground: impl Fn(f64, f64, f64, f64) -> f64 + 'o,
    ) -> impl Iterator<Item = OutwardTurn> + 'o {
        let now_ns = self.last_ns.unwrap_or_default();
        let of_edges = self.runs.iter().zip(&edges.all).enumerate();
        of_edges.filter_map(move |(index, (run, edge))| {
            let since = run.since?;
            let goes_on = run.rate >= UNDIMINISHED * run.fastest;
            if !(goes_on
                && (!is_gyro || run.is_shown(&since, now_ns, attitude.as_ref(), &edge.axis)))
            {
                return None;
            }
            let rolled = run.rolled + AHEAD_S * self.rolling;
            let driven = if rolled < ROLLED_M { 0.0 } else { rolled };
            let by_step = (climbed(rolled, edges.radius) / edge.width).min(1.0).asin();
            Some(OutwardTurn {
                edge: index,
                since_ns: since.at_ns,
                lasts_s: now_ns.saturating_sub(since.at_ns) as f64 * 1e-9,
                angle: run.angle,
                rate: run.rate,
                lean_sigma: edge.lean_sigma,
                by_ground: by_ground(driven, by_step, since.settled, edge.width),
            })
        })
    }
}

/// Returns the height of a wheel above or below the ground on the highest step (m), after rolling so far on to it or off it (m).
fn climbed(rolled: f64, radius: f64) -> f64 {
    let corner = (1.0 - STEP) * radius;
    let left = ((radius * radius - corner * corner).sqrt() - rolled).max(0.0);
    (radius * radius - left * left).sqrt() - corner
}

impl Run {
    fn at(rate: f64) -> Self {
        Self {
            rate,
            ..Self::default()
        }
    }

    /// Whether the rotation is no drift of the gyro: an attitude shows it as well, or it grows as no drift does.
    fn is_shown(
        &self,
        since: &Since,
        now_ns: i64,
        attitude: Option<&ShownUp>,
        axis: &Vector3<f64>,
    ) -> bool {
        let seconds = now_ns.saturating_sub(since.at_ns) as f64 * 1e-9;
        let agrees = since.attitude.zip(attitude).is_some_and(|(from, to)| {
            RotationSpell::rotation_between(axis, &from, &to.up) >= AGREES * self.angle
        });
        let grows = seconds >= GROWN_S && self.rate * seconds >= GROWN * self.angle;
        agrees || grows
    }
}
