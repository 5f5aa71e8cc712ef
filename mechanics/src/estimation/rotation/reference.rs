//! The up direction of a platform that stands on its wheels: what its rotation is measured from.

use nalgebra::{Vector2, Vector3};

use super::edges::Edges;

/// Standard deviation of the slope under the machine (rad), where it has travelled by several of its lengths.
const GROUND: f64 = 6.0 * DEGREE;
/// Number of these standard deviations beyond which slopes are rare.
const GROUND_SIGMAS: f64 = 2.0;
/// Standard deviation of the slope on which a log or a session begins (rad).
const FIRST_SLOPE: f64 = 10.0 * DEGREE;
/// Steepest ramp that a machine drives onto or off (rad). The ground under it does not bend by a normal distribution: ramps
/// for loading and dams have an edge.
const RAMP: f64 = 25.0 * DEGREE;
/// Steepest slope on which a machine is taken to stand (rad).
const STEEPEST: f64 = 35.0 * DEGREE;
/// Largest rate at which soft ground turns a standing machine (rad/s), and largest angle (rad). A machine that falls is faster,
/// and goes farther.
const SETTLES: f64 = 1.25 * DEGREE;
const SETTLES_MOST: f64 = 10.0 * DEGREE;
/// Slower than this a machine stands (m/s).
const STANDS: f64 = 0.1;
/// Share of the machine's length over which the reference follows.
const FOLLOWED: f64 = 0.5;
/// Standard deviations from which on the reference follows no longer.
const DOUBTED: f64 = 1.5;
/// Lengths of the machine after which a lasting tilt is that of the ground.
const GROUND_LENGTHS: f64 = 3.0;
/// Rate of rotation of a platform that the reference follows no longer (rad/s), and the time for which it lasts (s).
const STEADY: f64 = 2.0 * DEGREE;
const STEADY_S: f64 = 0.5;
/// Time for which the platform must be quiet on standing wheels to be a reference (s).
const STOOD_S: f64 = 1.0;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The reference of one source.
#[derive(Debug, Clone, Default)]
pub(super) struct Reference {
    up: Option<Vector3<f64>>,
    /// Distance travelled since the reference held (m).
    distance: f64,
    /// Variance of a reference that was only assumed (rad^2).
    assumed: f64,
    /// Largest rotation of the machine by soft ground while it stood (rad).
    settled: f64,
    /// Time for which the platform has been quiet on standing wheels, and time without rotation (s).
    quiet_s: f64,
    steady_s: f64,
    /// Stamp since which the platform has rotated farther than the reference follows (ns), and the distance of the last step that
    /// followed (m).
    pub(super) left_ns: Option<i64>,
    followed: f64,
    /// Largest outward rotation: its edge, angle and standard deviation (rad).
    pub(super) claim: Claim,
}

/// A rotation about an edge.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Claim {
    pub(super) edge: usize,
    pub(super) angle: f64,
    pub(super) sigma: f64,
    /// Largest rotation about this edge by a ramp on the machine's way and by soft ground under it (rad).
    pub(super) by_ground: f64,
}

impl Claim {
    /// The rotation in standard deviations.
    pub(super) fn sigmas(&self) -> f64 {
        self.in_sigmas(self.angle)
    }

    /// Returns the part of the rotation that neither ramp nor soft ground explains, in standard deviations.
    pub(super) fn sigmas_beyond_ground(&self) -> f64 {
        self.in_sigmas(self.beyond_ground())
    }

    /// Returns the part of the rotation that neither ramp nor soft ground explains (rad).
    pub(super) fn beyond_ground(&self) -> f64 {
        (self.angle - self.by_ground).max(0.0)
    }

    fn in_sigmas(&self, angle: f64) -> f64 {
        match self.sigma > 0.0 {
            true => angle / self.sigma,
            false => 0.0,
        }
    }
}

/// Inputs of a step of a reference.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) now_ns: i64,
    pub(super) dt: f64,
    /// The up direction of the source, its standard deviation (rad), and its rate of rotation (rad/s).
    pub(super) up: Vector3<f64>,
    pub(super) sigma: f64,
    pub(super) rate: f64,
    /// Speed of the machine (m/s).
    pub(super) speed: f64,
    /// Whether the platform is quiet on standing wheels by this source.
    pub(super) is_quiet: bool,
}

impl Reference {
    /// Turns the base about its own vertical, by which a plane under the wheels stays under them.
    pub(super) fn turn(&mut self, angle: f64) {
        if let Some(up) = &mut self.up {
            *up -= Vector3::z().cross(up) * angle;
            *up = up.normalize();
        }
    }

    /// Turns the platform by its suspension, about x and y.
    pub(super) fn lean(&mut self, by: &Vector2<f64>) {
        if let Some(up) = &mut self.up {
            *up -= Vector3::new(by.x, by.y, 0.0).cross(up);
            *up = up.normalize();
        }
    }

    /// Travels unseen; on a slope, the machine may have turned.
    pub(super) fn skip(&mut self, travelled: f64) {
        self.distance += travelled;
        if let Some(up) = self.up
            && travelled > 0.0
        {
            let slope = up.xy().norm().min(STEEPEST.sin());
            self.assumed += slope * slope;
        }
    }

    /// Takes a step; while a spell `stands`, the reference stays.
    pub(super) fn step(&mut self, step: &Step, edges: &Edges, stands: bool) {
        let travelled = step.speed * step.dt;
        let mut up = *self.up.get_or_insert_with(|| {
            self.assumed = FIRST_SLOPE * FIRST_SLOPE;
            Vector3::z()
        });
        if !stands && step.speed < STANDS {
            self.settle(step);
        }
        self.claim = self.largest(&up, step, edges);
        if stands {
            self.distance += travelled;
            return;
        }
        let was_quiet_s = self.quiet_s;
        self.quiet_s = if step.is_quiet {
            self.quiet_s + step.dt
        } else {
            0.0
        };
        self.steady_s = if step.rate < STEADY {
            self.steady_s + step.dt
        } else {
            0.0
        };
        // no ground is as steep as a machine that falls while it travels becomes
        let may_be_ground = step.up.z > STEEPEST.cos();
        if self.quiet_s >= STOOD_S && was_quiet_s > 0.0 && may_be_ground {
            self.begin(step.up);
            self.quiet_s = STOOD_S;
            return;
        }
        if self.claim.sigmas() < DOUBTED && may_be_ground {
            self.left_ns = None;
            let share = 1.0 - (-travelled / (FOLLOWED * edges.length)).exp();
            up += (step.up - up) * share;
            self.up = Some(up.normalize());
            self.assumed *= (1.0 - share) * (1.0 - share);
            self.distance = (self.distance + travelled) * (1.0 - share);
            self.followed = self.distance;
            return;
        }
        self.left_ns.get_or_insert(step.now_ns);
        self.distance += travelled;
        let is_far = self.distance > GROUND_LENGTHS * edges.length;
        if is_far && self.steady_s >= STEADY_S && may_be_ground {
            self.begin(step.up);
        }
    }

    /// Follows the rotation of a standing machine as fast as soft ground gives way.
    fn settle(&mut self, step: &Step) {
        let Some(turned) = self.apart(&step.up) else {
            return;
        };
        let most = SETTLES * step.dt;
        self.settled += (turned - self.settled).clamp(-most, most);
        self.settled = self.settled.min(SETTLES_MOST);
    }

    /// Makes an up direction the reference.
    pub(super) fn begin(&mut self, up: Vector3<f64>) {
        *self = Self {
            up: Some(up),
            ..Self::default()
        };
    }

    /// Whether the reference is only assumed: the log or the session began after the platform had left it.
    pub(super) fn is_assumed(&self) -> bool {
        self.assumed > 0.25 * FIRST_SLOPE * FIRST_SLOPE
    }

    /// The up direction, once there is one.
    pub(super) fn up(&self) -> Option<Vector3<f64>> {
        self.up
    }

    /// Rotation of an up direction about an edge (rad), outwards positive; `None` without a reference.
    pub(super) fn rotation(&self, up: &Vector3<f64>, axis: &Vector3<f64>) -> Option<f64> {
        Some(rotation(&self.up?, up, axis))
    }

    /// Angle between a direction and the reference (rad).
    pub(super) fn apart(&self, direction: &Vector3<f64>) -> Option<f64> {
        let up = self.up?;
        Some(up.cross(direction).norm().atan2(up.dot(direction)))
    }

    /// Returns the largest rotation of a machine about an edge (rad) by ramps and slopes on the distance travelled (m), or by a
    /// step, and by soft ground since it had turned the machine by `settled` (rad). All wheels on one side of the edge may drive
    /// onto a ramp while the others do not.
    pub(super) fn by_ground(
        &self,
        travelled: f64,
        by_step: f64,
        settled: f64,
        width: f64,
        length: f64,
    ) -> f64 {
        let slope = GROUND_SIGMAS * ground_variance(travelled, length).sqrt();
        let by_slope = by_ramp(travelled, width) + slope;
        by_slope.max(by_step) + (self.settled - settled).max(0.0)
    }

    /// Returns the largest rotation of the machine by soft ground while it stood (rad).
    pub(super) fn settled(&self) -> f64 {
        self.settled
    }

    fn largest(&self, up: &Vector3<f64>, step: &Step, edges: &Edges) -> Claim {
        let turned = -up.cross(&step.up);
        let obtuse = up.dot(&step.up) < 0.0;
        let ground = ground_variance(self.distance, edges.length);
        let others = ground + self.assumed + step.sigma * step.sigma;
        // what was followed before needs no other explanation
        let by_ramp = by_ramp(self.distance - self.followed, edges.length);
        let mut best = Claim::default();
        for (edge, of_edge) in edges.all.iter().enumerate() {
            let sine = turned.dot(&of_edge.axis);
            let lean = of_edge.lean_sigma;
            let sigma = (others + lean * lean).sqrt();
            // far below what is looked at, the sine is the angle
            let angle = match obtuse || sine > sigma {
                true => rotation(up, &step.up, &of_edge.axis),
                false => sine,
            };
            let claim = Claim {
                edge,
                angle,
                sigma,
                by_ground: by_ramp * of_edge.axis.y.abs() + self.settled,
            };
            let size = |claim: &Claim| (claim.sigmas_beyond_ground(), claim.sigmas());
            if angle > 0.0 && size(&claim) > size(&best) {
                best = claim;
            }
        }
        if best.sigma == 0.0 {
            best.sigma = others.sqrt();
        }
        best
    }
}

/// Variance of the slope under the machine after a distance (rad^2).
fn ground_variance(distance: f64, length: f64) -> f64 {
    let decay = -2.0 * distance / length;
    GROUND * GROUND * (1.0 - decay.exp())
}

/// Returns the largest rotation of a machine by a ramp (rad) that it has driven onto or off on a distance (m), about the edges
/// across its way. One axle climbs while the other is still on the ground before the ramp:
///
/// ```text
///     sin(angle) = min(distance, length) sin(ramp) / length
/// ```
fn by_ramp(distance: f64, length: f64) -> f64 {
    ((distance / length).min(1.0) * RAMP.sin()).asin()
}

/// Component about an axis of the base of the smallest rotation that takes it from one up direction to another. Base axes
/// rotate under a fixed direction, which therefore turns the other way in them. The angle between the directions across the
/// axis would do for a rotation about that axis alone: of a machine on its side it is large about every axis.
pub(super) fn rotation(from: &Vector3<f64>, to: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
    let turned = -from.cross(to);
    let sine = turned.norm();
    let angle = sine.atan2(from.dot(to));
    // of the same directions, the sine is the angle
    let per_sine = if sine > 1e-9 { angle / sine } else { 1.0 };
    axis.dot(&turned) * per_sine
}
