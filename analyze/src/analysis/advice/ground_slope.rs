//! The slope of the ground under a machine, apart from how its platform rocks.
//!
//! A platform that brakes, rocks on its tyres or lifts a wheel turns while the ground stays. The slope is therefore taken where
//! the machine is calm, less the lean of the platform on its tyres there, and kept in between, turned by the yaw. With the
//! normal n of the contact plane and up u in base axes, the lean theta that n lacks and the angle psi of the yaw:
//! ```text
//!     tilt = (u + theta x u) x n,      kept = mean of R_z(psi) tilt,      tilt(t) = R_z(-psi(t)) kept
//! ```
//! With tyres of stated stiffness, n is that of the ground under the deflected tyres: it lacks no lean.
//!
//! Ground that cannot be told from level ground is level: a tilt below two standard deviations counts as none, and one above
//! three as it is.

use std::sync::Arc;

use nalgebra::{Rotation2, Vector2, Vector3};
use tipwatch_mechanics::estimation::plausibility::LeanOnTyres;
use tipwatch_mechanics::machine::{Axis, Machine, Parameter};
use tipwatch_mechanics::{
    BatchWorkspace, Model, Scope, State, StateColumns, Wrench, ground_forces,
};

use super::to_base::ToBase;
use crate::base::table::Table;
use crate::events::drives;

/// Time between the states that are looked at (ns).
const STEP_NS: i64 = 50_000_000;
/// Calm states that are evaluated at once.
const STATES_AT_ONCE: usize = 512;
/// Time constants (s): of the motion that must be calm, and of the mean of the tilt.
const SMOOTHED_S: f64 = 0.25;
const AVERAGED_S: f64 = 1.0;
/// Acceleration (m/s^2) and angular velocity (rad/s) below which a machine is calm.
const CALM_ACCELERATION: f64 = 0.3;
const CALM_RATE: f64 = 0.05;
/// Standard deviation by which ground changes its slope under a machine that drives one metre over it (rad).
const CHANGES_PER_METRE: f64 = 0.01;
/// Speed of a machine that may drive, where no speed is known (m/s).
const UNKNOWN_SPEED: f64 = 1.0;
/// Standard deviation of the lean where nothing determines it (rad).
const UNKNOWN_LEAN: f64 = 0.01;
/// Standard deviation of a computed lean, as a share of the lean: on tyres of stated stiffness, and on others.
const STATED_LEAN_SHARE: f64 = 0.3;
const USUAL_LEAN_SHARE: f64 = 1.0;
/// Standard deviations up to which a tilt counts as none, and from which it counts as it is.
const NONE_SIGMAS: f64 = 2.0;
const WHOLE_SIGMAS: f64 = 3.0;

/// The slope of the ground, by time.
#[derive(Debug, PartialEq)]
pub(crate) struct GroundSlope {
    /// Samples in the order of time; never empty.
    samples: Vec<SlopeSample>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct SlopeSample {
    time_ns: i64,
    slope: Slope,
}

/// The slope of the ground at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope {
    /// Tilt of a platform at rest on the ground, about x and y of the base (rad).
    pub(crate) tilt: Vector2<f64>,
    /// Standard deviation of either component (rad).
    pub(crate) sigma_rad: f64,
}

impl Slope {
    /// The share of the tilt that is no error: 0 of ground that cannot be told from level ground, 1 where it surely slopes.
    pub(crate) fn share(&self) -> f64 {
        let sigmas = self.tilt.norm() / self.sigma_rad;
        ((sigmas - NONE_SIGMAS) / (WHOLE_SIGMAS - NONE_SIGMAS)).clamp(0.0, 1.0)
    }
}

impl GroundSlope {
    /// `None` where the log has no attitude, or the machine was never calm.
    pub(crate) fn of(machine: &Machine, rows: &Table) -> Option<Arc<Self>> {
        let mut watched = Watched::new(machine);
        let mut state = State::zero(machine);
        let mut next_ns = i64::MIN;
        for (row, &time_ns) in rows.times_ns.iter().enumerate() {
            if time_ns < next_ns {
                continue;
            }
            next_ns = time_ns.saturating_add(STEP_NS);
            rows.state(row, &mut state);
            let may_count = rows.is_valid(row);
            let stands_on = match rows.supports() {
                Some(_) => rows.machine_at(row),
                None => Some(machine),
            };
            watched.take(stands_on, time_ns, may_count, &mut state);
        }
        watched.finish().map(Arc::new)
    }

    /// Returns the slope at a time (ns).
    pub(crate) fn at(&self, time_ns: i64) -> Slope {
        let after = self
            .samples
            .partition_point(|sample| sample.time_ns <= time_ns);
        self.samples[after.saturating_sub(1)].slope
    }

    /// Whether the ground can nowhere be told from level ground.
    pub(crate) fn is_level(&self) -> bool {
        self.samples
            .iter()
            .all(|sample| sample.slope.share() == 0.0)
    }

    /// The largest standard deviation (rad).
    pub(crate) fn largest_sigma_rad(&self) -> f64 {
        let sigmas = self.samples.iter().map(|sample| sample.slope.sigma_rad);
        sigmas.fold(0.0, f64::max)
    }
}

/// The tilt as it was when the machine was last calm, in axes that do not turn with the yaw.
#[derive(Debug, Clone, Copy)]
struct Kept {
    tilt: Vector2<f64>,
    /// Mean square deviation of a component from its mean (rad^2).
    scatter: f64,
    /// Standard deviation of the lean (rad).
    lean_sigma: f64,
    /// Way driven since (m).
    driven_m: f64,
}

/// A state that was looked at.
struct Step {
    time_ns: i64,
    /// Time since the one before (s).
    step_s: f64,
    yaw: f64,
    /// Way driven since the one before (m).
    driven_m: f64,
    /// Tilt of the ground under a calm machine (rad), and the standard deviation of its lean on the tyres (rad).
    ground: Option<(Vector2<f64>, f64)>,
}

impl Step {
    /// What is kept from this state on, of what was kept before it.
    fn follow(&self, kept: Option<Kept>) -> Option<Kept> {
        let kept = kept.map(|kept| Kept {
            driven_m: kept.driven_m + self.driven_m,
            ..kept
        });
        let Some((tilt, lean_sigma)) = self.ground else {
            return kept;
        };
        let tilt = Rotation2::new(self.yaw) * tilt;
        let Some(kept) = kept else {
            return Some(Kept {
                tilt,
                scatter: 0.0,
                lean_sigma,
                driven_m: 0.0,
            });
        };
        let share = 1.0 - (-self.step_s / AVERAGED_S).exp();
        let apart = tilt - kept.tilt;
        Some(Kept {
            tilt: kept.tilt + apart * share,
            scatter: kept.scatter + (0.5 * apart.norm_squared() - kept.scatter) * share,
            lean_sigma,
            driven_m: kept.driven_m * (1.0 - share),
        })
    }
}

/// A machine that is watched for calm. Its calm states are evaluated many at a time.
struct Watched<'a> {
    machine: &'a Machine,
    to_base: ToBase,
    lean: Option<LeanOnTyres>,
    last_ns: Option<i64>,
    yaw: f64,
    acceleration: Vector3<f64>,
    rate: Vector3<f64>,
    /// Standard deviation of the measured attitude (rad).
    attitude_sigma: f64,
    steps: Vec<Step>,
    /// The machine on its supports in the states that wait.
    on: Option<(&'a Machine, BatchWorkspace)>,
    /// The states that wait, and room for the next one.
    states: StateColumns,
    /// Their steps, and up in base axes.
    waiting: Vec<(usize, Vector3<f64>)>,
}

impl<'a> Watched<'a> {
    fn new(machine: &'a Machine) -> Self {
        Self {
            machine,
            to_base: ToBase::new(machine),
            lean: LeanOnTyres::of(machine),
            last_ns: None,
            yaw: 0.0,
            acceleration: Vector3::zeros(),
            rate: Vector3::zeros(),
            attitude_sigma: Parameter::ImuRotation(Axis::X).sigma(machine),
            steps: Vec::new(),
            on: None,
            states: StateColumns::unknown(machine, STATES_AT_ONCE),
            waiting: Vec::new(),
        }
    }

    /// The next state; `stands_on` is the machine on its supports, `None` where it is not known on which.
    fn take(
        &mut self,
        stands_on: Option<&'a Machine>,
        time_ns: i64,
        may_count: bool,
        state: &mut State<f64>,
    ) {
        let step_s = self
            .last_ns
            .map_or(0.0, |last_ns| time_ns.saturating_sub(last_ns) as f64 * 1e-9);
        let is_first = self.last_ns.replace(time_ns).is_none();
        if let Some(on) = stands_on {
            self.stand(on);
        }
        // as measured; it is overwritten unless it waits
        self.states.set(self.waiting.len(), state);
        self.to_base.apply(self.machine, state);
        let up = state.base.up;
        let rate = state.imu.angular_velocity;
        if rate.iter().all(|part| part.is_finite()) {
            self.yaw += up.dot(&rate) * step_s;
        }
        if !self.yaw.is_finite() {
            self.yaw = 0.0;
        }
        let acceleration = state.imu.specific_force - up * self.machine.gravity();
        let share = match is_first {
            true => 1.0,
            false => 1.0 - (-step_s / SMOOTHED_S).exp(),
        };
        for (mean, now) in [
            (&mut self.acceleration, acceleration),
            (&mut self.rate, rate),
        ] {
            // what was unknown does not stay so
            match mean.iter().all(|part| part.is_finite()) {
                true => *mean += (now - *mean) * share,
                false => *mean = now,
            }
        }
        let is_calm = self.acceleration.norm() < CALM_ACCELERATION && self.rate.norm() < CALM_RATE;
        if is_calm && may_count && stands_on.is_some() {
            self.waiting.push((self.steps.len(), up));
        }
        self.steps.push(Step {
            time_ns,
            step_s,
            yaw: self.yaw,
            driven_m: speed(self.machine, state) * step_s,
            ground: None,
        });
        if self.waiting.len() == STATES_AT_ONCE {
            self.look();
        }
    }

    /// The machine stands on these supports.
    fn stand(&mut self, on: &'a Machine) {
        let is_known = |(known, _): &(&Machine, BatchWorkspace)| std::ptr::eq(*known, on);
        if !self.on.as_ref().is_some_and(is_known) {
            self.look();
            let workspace = BatchWorkspace::new(on, Scope::LOADS, &Arc::new(Model::WholeBody));
            self.on = Some((on, workspace));
        }
    }

    /// Computes the tilt of the ground in the states that wait.
    fn look(&mut self) {
        let Some((on, workspace)) = &mut self.on else {
            return;
        };
        let deflect = on.contact().tyres_deflect;
        let grounds = ground_forces(on, &self.states, 0..self.waiting.len(), workspace);
        for ((step, up), (ground, normal)) in self.waiting.drain(..).zip(grounds) {
            let lean = self.lean.as_ref();
            let lean = lean.and_then(|lean| lean_of(lean, &ground));
            let (lean, lean_sigma) = lean.unwrap_or((Vector2::zeros(), UNKNOWN_LEAN));
            let lean = match deflect {
                true => Vector3::zeros(),
                false => Vector3::new(lean.x, lean.y, 0.0),
            };
            let tilt = (up + lean.cross(&up)).cross(&normal).xy();
            let is_known = tilt.iter().all(|part| part.is_finite());
            self.steps[step].ground = is_known.then_some((tilt, lean_sigma));
        }
    }

    fn finish(mut self) -> Option<GroundSlope> {
        self.look();
        let mut kept = None;
        let seen = self.steps.iter().map(|step| {
            kept = step.follow(kept);
            kept
        });
        let seen: Vec<Option<Kept>> = seen.collect();
        let first = seen.iter().find_map(|kept| *kept)?;
        let sample = |(step, kept): (&Step, Option<Kept>)| {
            // before it was calm for the first time, it stood where it then was
            let kept = kept.unwrap_or(first);
            let variance = self.attitude_sigma.powi(2)
                + kept.scatter
                + kept.lean_sigma.powi(2)
                + CHANGES_PER_METRE.powi(2) * kept.driven_m;
            let slope = Slope {
                tilt: Rotation2::new(-step.yaw) * kept.tilt,
                sigma_rad: variance.sqrt(),
            };
            SlopeSample {
                time_ns: step.time_ns,
                slope,
            }
        };
        let samples: Vec<SlopeSample> = self.steps.iter().zip(seen).map(sample).collect();
        let is_known = |sample: &SlopeSample| {
            sample.slope.sigma_rad > 0.0
                && sample.slope.sigma_rad.is_finite()
                && sample.slope.tilt.norm().is_finite()
        };
        samples
            .iter()
            .all(is_known)
            .then_some(GroundSlope { samples })
    }
}

/// Returns the driving speed of a machine (m/s); an assumed one if the machine may drive and the speed is unknown.
fn speed(machine: &Machine, state: &State<f64>) -> f64 {
    let speed = Some(state.base.velocity.norm()).filter(|speed| speed.is_finite());
    speed.unwrap_or(match drives(machine, state) {
        true => UNKNOWN_SPEED,
        false => 0.0,
    })
}

/// The lean of a calm machine on its tyres about x and y (rad) under the wrench of the ground, and its standard deviation; `None`
/// where the loads are unknown.
fn lean_of(on_tyres: &LeanOnTyres, ground: &Wrench<f64>) -> Option<(Vector2<f64>, f64)> {
    let lean = on_tyres.lean(ground);
    let share = match on_tyres.stiffness_is_stated() {
        true => STATED_LEAN_SHARE,
        false => USUAL_LEAN_SHARE,
    };
    (lean.iter().all(|part| part.is_finite())).then(|| (lean, share * lean.norm()))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tipwatch_binding::MachineFile;

    use super::GroundSlope;
    use crate::analysis::run::analyse;
    use crate::base::options::Options;
    use crate::events::EventKind;

    /// The ground slopes as much as the simulated one, however far the platform leans on tyres of stated stiffness. That lean
    /// was taken off twice, which made the slope half a degree too small.
    #[test]
    fn val_the_slope_of_the_ground_has_no_lean_of_the_tyres() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
        for (name, expected) in [("tip_over", 10.0), ("lift", 6.0), ("side_reach", 5.0)] {
            let log = data.join(format!("{name}.mcap"));
            let file = MachineFile::read(&log.with_extension("toml")).unwrap();
            let analysis = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
            let mut events = analysis.events.iter();
            let lift = events.find(|event| event.kind == EventKind::WheelLift);
            let ground = GroundSlope::of(&analysis.machine, &analysis.rows).unwrap();
            let slope = ground.at(lift.unwrap().start_ns);
            let degrees = slope.tilt.norm().to_degrees();
            assert!((degrees - expected).abs() < 0.2, "{name}: {degrees}");
            let sigmas = (degrees - expected).abs() / slope.sigma_rad.to_degrees();
            assert!(sigmas < 2.0, "{name}: {sigmas}");
        }
    }
}
