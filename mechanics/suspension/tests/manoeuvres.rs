//! Random manoeuvres: an arm that works while the machine drives, turns and brakes, as states row by row.

use crate::problems::Draws;
use nalgebra::Vector3;
use tipwatch_mechanics::machine::SuspensionControl;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{Machine, Motion, State, StateColumns};
use tipwatch_suspension::replay::{Comparison, RecordedRows, Replay, SuspensionMotion, Track};
use tipwatch_suspension::{Controller, Status};

/// Rows per second.
pub(crate) const RATE: usize = 50;
const SECONDS: usize = 8;

/// States of a manoeuvre.
pub(crate) struct Manoeuvre {
    times_ns: Vec<i64>,
    reasons: Vec<Reasons>,
    states: StateColumns,
}

/// A motion with its rate and acceleration: middle + amplitude sin(w t + phase).
#[derive(Clone, Copy)]
struct Sine {
    middle: f64,
    amplitude: f64,
    w: f64,
    phase: f64,
}

impl Sine {
    /// Draws a sine with at most this rate and acceleration.
    fn draw(draws: &mut Draws, middle: f64, amplitude: f64, rate: f64, acceleration: f64) -> Self {
        let mut share = || 0.5 + 0.5 * draws.signed();
        let w = 0.2 + 1.2 * share();
        let amplitude = (amplitude * share())
            .min(rate / w)
            .min(acceleration / (w * w));
        let phase = std::f64::consts::TAU * share();
        Self {
            middle,
            amplitude,
            w,
            phase,
        }
    }

    fn at(&self, t: f64) -> Motion<f64> {
        let (sin, cos) = (self.w * t + self.phase).sin_cos();
        Motion {
            position: self.middle + self.amplitude * sin,
            rate: self.amplitude * self.w * cos,
            acceleration: -self.amplitude * self.w * self.w * sin,
        }
    }
}

/// Smooth pulse of height 1 between two times, with continuous slope.
fn pulse(t: f64, start: f64, length: f64) -> f64 {
    let s = ((t - start) / length).clamp(0.0, 1.0);
    (std::f64::consts::PI * s).sin().powi(2)
}

impl Manoeuvre {
    /// Creates a manoeuvre without states.
    fn unknown(machine: &Machine, rows: usize) -> Self {
        Self {
            times_ns: (0..rows)
                .map(|row| (row * (1_000_000_000 / RATE)) as i64)
                .collect(),
            reasons: vec![Reasons::default(); rows],
            states: StateColumns::unknown(machine, rows),
        }
    }

    /// The arm swings about a random posture, the machine accelerates, brakes and turns on a slope.
    pub(crate) fn draw(draws: &mut Draws, machine: &Machine) -> Self {
        let joint = |name: &str| {
            machine
                .joints()
                .iter()
                .position(|j| j.name == name)
                .unwrap()
        };
        let between =
            |draws: &mut Draws, a: f64, b: f64| 0.5 * (a + b) + 0.5 * (b - a) * draws.signed();
        let middle = [
            between(draws, -1.5, 1.5),
            between(draws, -1.5, -1.1),
            between(draws, -1.9, -1.3),
            between(draws, 0.1, 0.6),
        ];
        let arm = [
            (joint("slew"), Sine::draw(draws, middle[0], 1.4, 1.2, 1.2)),
            (joint("lift"), Sine::draw(draws, middle[1], 0.15, 0.15, 0.2)),
            (joint("tilt"), Sine::draw(draws, middle[2], 0.2, 0.2, 0.3)),
            (
                joint("extension"),
                Sine::draw(draws, middle[3], 0.15, 0.2, 0.3),
            ),
        ];
        let rods = ["suspension_right", "suspension_left"].map(joint);
        let rod = between(draws, -0.17, -0.03);
        let up = (Vector3::z() + Vector3::new(0.06 * draws.signed(), 0.06 * draws.signed(), 0.0))
            .normalize();
        let pulses: Vec<(f64, f64, f64)> = (0..4)
            .map(|k| {
                let start = f64::from(k) * 3.0 + between(draws, 0.0, 2.0);
                (start, between(draws, 0.6, 2.0), 1.5 * draws.signed())
            })
            .collect();
        let (yaw, speed) = (
            Sine::draw(draws, 0.0, 0.2, 1.0, 0.3),
            between(draws, 0.0, 1.2),
        );
        let rows = RATE * SECONDS;
        let mut manoeuvre = Self::unknown(machine, rows);
        let mut state = State::zero(machine);
        for row in 0..rows {
            let t = row as f64 / RATE as f64;
            for (joint, sine) in arm {
                state.joints[joint] = sine.at(t);
            }
            for rod_joint in rods {
                state.joints[rod_joint] = Motion::at_rest(rod);
            }
            let turn = yaw.at(t);
            let forward: f64 = pulses
                .iter()
                .map(|&(start, length, height)| height * pulse(t, start, length))
                .sum();
            state.base.up = up;
            state.imu.specific_force =
                up * machine.gravity() + Vector3::new(forward, speed * turn.rate, 0.0);
            state.imu.angular_velocity = Vector3::new(0.0, 0.0, turn.rate);
            state.imu.angular_acceleration = Vector3::new(0.0, 0.0, turn.acceleration);
            manoeuvre.states.set(row, &mut state);
        }
        manoeuvre
    }

    /// The second paper's manoeuvre: the arm, folded over the platform, is raised and lowered a little.
    pub(crate) fn folded(machine: &Machine, rows: usize) -> Self {
        let sine = |middle: f64, amplitude: f64, w: f64| Sine {
            middle,
            amplitude,
            w,
            phase: 0.0,
        };
        let arm = [
            ("slew", sine(0.0, 0.1, 0.3)),
            ("lift", sine(-0.154, 0.07, 0.4)),
            ("tilt", sine(-3.082, 0.0, 0.4)),
            ("suspension_right", sine(-0.1, 0.0, 0.4)),
            ("suspension_left", sine(-0.1, 0.0, 0.4)),
        ];
        let mut manoeuvre = Self::unknown(machine, rows);
        let mut state = State::zero(machine);
        state.base.up = Vector3::z();
        state.imu.specific_force = Vector3::z() * machine.gravity();
        for row in 0..rows {
            for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
                if let Some((_, sine)) = arm.iter().find(|(name, _)| *name == joint.name) {
                    *motion = sine.at(row as f64 / RATE as f64);
                }
            }
            manoeuvre.states.set(row, &mut state);
        }
        manoeuvre
    }

    /// The second paper's comparison on this machine, its (32): the arm swings to both sides and reaches out and back, so
    /// that a rear wheel is light again and again; the rods at a stroke (m).
    pub(crate) fn paper(machine: &Machine, rods: f64, rows: usize) -> Self {
        Self::swinging(machine, rods, rows, |name, swing, _| match name {
            "slew" => 1.2 * swing,
            "lift" => 0.5 - 2.0736 + 0.6 * swing,
            "tilt" => -1.15 - 0.4116 - 0.4 * swing,
            "extension" => 0.3 + 0.2 * swing,
            _ => 0.0,
        })
    }

    /// The swing of the closed loop with MuJoCo: the arm swings from side to side in front and reaches out and back faster.
    pub(crate) fn in_front(machine: &Machine, rods: f64, rows: usize) -> Self {
        Self::swinging(machine, rods, rows, |name, swing, reach| match name {
            "slew" => 0.8 * swing,
            "lift" => 50_f64.to_radians() - 2.0736,
            "tilt" => -85_f64.to_radians() - 0.4116,
            "extension" => 0.15 + 0.1 * reach,
            _ => 0.0,
        })
    }

    /// The arm moves by position of each joint (rad or m) as a function of sines of 0.5 and 0.7 rad/s, which rise within 2 s;
    /// the rods at a stroke (m).
    fn swinging(
        machine: &Machine,
        rods: f64,
        rows: usize,
        arm: impl Fn(&str, f64, f64) -> f64,
    ) -> Self {
        const STEP_S: f64 = 1e-3;
        let arm = |name: &str, t: f64| {
            let s = (t / 2.0).clamp(0.0, 1.0);
            let start = s * s * s * (10.0 + s * (6.0 * s - 15.0));
            match name {
                "suspension_right" | "suspension_left" => rods,
                _ => arm(name, start * (0.5 * t).sin(), start * (0.7 * t).sin()),
            }
        };
        let mut manoeuvre = Self::unknown(machine, rows);
        let mut state = State::zero(machine);
        state.base.up = Vector3::z();
        state.imu.specific_force = Vector3::z() * machine.gravity();
        for row in 0..rows {
            let t = row as f64 / RATE as f64;
            for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
                let [before, now, after] =
                    [-1.0, 0.0, 1.0].map(|k| arm(&joint.name, t + k * STEP_S));
                *motion = Motion {
                    position: now,
                    rate: (after - before) / (2.0 * STEP_S),
                    acceleration: (after - 2.0 * now + before) / (STEP_S * STEP_S),
                };
            }
            manoeuvre.states.set(row, &mut state);
        }
        manoeuvre
    }

    /// The arm reaches out to one side in front and stands still, the rods at a stroke (m); the platform pitches at a frequency (Hz) with a
    /// swing of its specific force (m/s^2).
    pub(crate) fn standing(machine: &Machine, rods: f64, [frequency, swing]: [f64; 2]) -> Self {
        let rows = RATE * SECONDS;
        let mut manoeuvre = Self::unknown(machine, rows);
        let posture = [
            ("slew", 0.7),
            ("lift", -1.2),
            ("tilt", -1.9),
            ("extension", 0.25),
            ("suspension_right", rods),
            ("suspension_left", rods),
        ];
        let mut state = State::zero(machine);
        for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
            let known = posture.iter().find(|(name, _)| *name == joint.name);
            motion.position = known.map_or(0.0, |(_, position)| *position);
        }
        state.base.up = Vector3::z();
        for row in 0..rows {
            let phase = std::f64::consts::TAU * frequency * row as f64 / RATE as f64;
            state.imu.specific_force =
                Vector3::z() * machine.gravity() + Vector3::x() * (swing * phase.sin());
            manoeuvre.states.set(row, &mut state);
        }
        manoeuvre
    }

    /// The machine stands in the posture of the first row but for its slew (rad), the rods at a stroke (m).
    pub(crate) fn still(mut self, machine: &Machine, slew: f64, rods: f64) -> Self {
        let mut state = State::zero(machine);
        self.states.get(0, &mut state);
        for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
            *motion = Motion::at_rest(match joint.name.as_str() {
                "suspension_right" | "suspension_left" => rods,
                "slew" => slew,
                _ => motion.position,
            });
        }
        (0..self.times_ns.len()).for_each(|row| self.states.set(row, &mut state));
        self
    }

    pub(crate) fn compared(&self, machine: &Machine, motion: &SuspensionMotion) -> Comparison {
        let rows = RecordedRows {
            times_ns: &self.times_ns,
            reasons: &self.reasons,
            states: &self.states,
        };
        Comparison::of(machine, rows, motion).unwrap()
    }
}

/// Loads of rods that follow their reference at once, beside those of locked rods.
pub(crate) struct Ideal {
    /// Least signed load by row: locked, controlled (N).
    pub(crate) least: Vec<[f64; 2]>,
    /// Load spread by row: locked, controlled (N).
    pub(crate) spread: Vec<[f64; 2]>,
    /// Smallest stability angle by row: locked, controlled (rad).
    pub(crate) angle: Vec<[f64; 2]>,
    /// Status by row.
    pub(crate) status: Vec<Status>,
    /// Stroke (m) and velocity (m/s) of the first rod by row.
    pub(crate) rod: Vec<[f64; 2]>,
    /// Signed loads by row: locked, controlled without the acceleration of the rods, with it (N).
    pub(crate) loads: Vec<[Vec<f64>; 3]>,
}

impl Manoeuvre {
    /// Controls rods that follow their reference at once.
    pub(crate) fn ideal(&self, machine: &Machine, control: &SuspensionControl) -> Ideal {
        let mut state = State::zero(machine);
        self.states.get(0, &mut state);
        let posture: Vec<f64> = state.joints.iter().map(|joint| joint.position).collect();
        let mut controller = Controller::new(machine, control, &posture).unwrap();
        let mut replay = Replay::new(machine).unwrap();
        let home = replay.rods(&state);
        let mut rods = home;
        let (mut least, mut spread, mut angle, mut status) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut rod, mut loads) = (Vec::new(), Vec::new());
        let of = |replay: &Replay| {
            let outcome = replay.outcome();
            let least = outcome.otf.iter().copied().fold(f64::INFINITY, f64::min);
            let angles = outcome.indicators.stability_angle.iter().copied();
            let angle = angles.fold(f64::INFINITY, f64::min);
            (least, outcome.indicators.spread, angle)
        };
        for row in 0..self.times_ns.len() {
            self.states.get(row, &mut state);
            replay.moved(&state, &home);
            let locked = of(&replay);
            let locked_loads = replay.outcome().otf.clone();
            let expected = replay.moved(&state, &rods);
            let positions = rods.map(|rod| rod.position);
            let command = controller.tick(expected, &positions);
            for (rod, acceleration) in rods.iter_mut().zip(command.acceleration) {
                rod.acceleration = acceleration;
            }
            let steady = rods.map(|rod| Motion {
                acceleration: 0.0,
                ..rod
            });
            replay.moved(&state, &steady);
            let steady_loads = replay.outcome().otf.clone();
            replay.moved(&state, &rods);
            let moved = of(&replay);
            loads.push([locked_loads, steady_loads, replay.outcome().otf.clone()]);
            least.push([locked.0, moved.0]);
            spread.push([locked.1, moved.1]);
            angle.push([locked.2, moved.2]);
            status.push(command.status);
            rod.push([rods[0].position, rods[0].rate]);
            controller.follow(&positions, 1.0 / RATE as f64);
            let (position, velocity) = controller.reference().unwrap();
            for k in 0..rods.len() {
                rods[k] = Motion {
                    position: position[k],
                    rate: velocity[k],
                    acceleration: 0.0,
                };
            }
        }
        Ideal {
            least,
            spread,
            angle,
            status,
            rod,
            loads,
        }
    }
}

impl Ideal {
    /// Controlled loads by row on a platform that swings on its tyres at a frequency (Hz), damped to a tenth: it answers
    /// y'' = w^2 (u - y) - 2 z w y' to the loads u of the rods' acceleration (N).
    pub(crate) fn on_tyres(&self, frequency: f64) -> Vec<Vec<f64>> {
        const STEPS: usize = 20;
        const DAMPING: f64 = 0.1;
        let w = std::f64::consts::TAU * frequency;
        let dt = 1.0 / (RATE * STEPS) as f64;
        let mut swing = vec![[0.0; 2]; self.loads[0][0].len()];
        let mut found = Vec::with_capacity(self.loads.len());
        for [_, steady, moved] in &self.loads {
            for ((steady, moved), [y, rate]) in steady.iter().zip(moved).zip(&mut swing) {
                for _ in 0..STEPS {
                    *rate += dt * w * (w * (moved - steady - *y) - 2.0 * DAMPING * *rate);
                    *y += dt * *rate;
                }
            }
            let loads = steady.iter().zip(&swing);
            found.push(loads.map(|(steady, [y, _])| steady + y).collect());
        }
        found
    }
}

/// Sum of the load differences over all pairs of wheels (N).
pub(crate) fn load_spread(loads: &[f64]) -> f64 {
    let pairs = loads.iter().enumerate();
    pairs
        .map(|(k, a)| loads[..k].iter().map(|b| (a - b).abs()).sum::<f64>())
        .sum()
}

/// Least signed load of a row (N).
pub(crate) fn least_load(track: &Track, row: usize) -> f64 {
    track
        .otf
        .iter()
        .map(|otf| otf[row])
        .fold(f64::INFINITY, f64::min)
}
