//! Results of one motion of the suspension, row by row.

use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::Machine;

use super::moved_state::Replay;
use crate::control::Status;
use crate::hydraulics::Pressures;

/// Results of one motion of the suspension by row; NaN if unknown.
#[derive(Debug, Clone)]
pub struct Track {
    /// Wheel loads, by wheel (N).
    pub load: Vec<Vec<f64>>,
    /// OTF (overturning force, the signed load) by wheel (N).
    pub otf: Vec<Vec<f64>>,
    /// Load spread, (35) with each pair of wheels once (N).
    pub spread: Vec<f64>,
    /// Centre of mass relative to the middle of the contact points, forward and left (m).
    pub com: [Vec<f64>; 2],
    /// Smallest stability angle (rad).
    pub stability_angle: Vec<f64>,
    /// Motion of each actuator's rod.
    pub rods: Vec<RodTrack>,
    /// Status of the last command; `None` without a command.
    pub status: Vec<Option<Status>>,
}

/// Motion of one actuator, by row.
#[derive(Debug, Clone, Default)]
pub struct RodTrack {
    /// Cylinder stroke (m).
    pub position: Vec<f64>,
    /// Velocity of the cylinder (m/s).
    pub velocity: Vec<f64>,
    /// Acceleration of the cylinder (m/s^2).
    pub acceleration: Vec<f64>,
    /// Force needed for the motion, outwards positive (N).
    pub force_needed: Vec<f64>,
    /// Reference stroke (m).
    pub reference: Vec<f64>,
    /// Velocity of the reference (m/s).
    pub reference_velocity: Vec<f64>,
    /// Acceleration of the command (m/s^2).
    pub commanded_acceleration: Vec<f64>,
    /// Velocity limits of the reference at its stroke, (31c) (m/s).
    pub velocity_limits: [Vec<f64>; 2],
    /// Acceleration limits of the command there, (31d) (m/s^2).
    pub acceleration_limits: [Vec<f64>; 2],
    /// Valve command, -1 to 1.
    pub opening: Vec<f64>,
    /// Piston-side pressure (Pa).
    pub piston_pressure: Vec<f64>,
    /// Rod-side pressure (Pa).
    pub rod_pressure: Vec<f64>,
    /// Piston force, outwards positive (N).
    pub force: Vec<f64>,
}

/// Command, valve and hydraulics of an actuator at a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActuatorRow {
    pub(super) reference: f64,
    pub(super) reference_velocity: f64,
    pub(super) commanded_acceleration: f64,
    pub(super) velocity_limits: [f64; 2],
    pub(super) acceleration_limits: [f64; 2],
    pub(super) opening: f64,
    pub(super) pressures: Pressures<f64>,
    pub(super) force: f64,
}

impl RodTrack {
    /// Tracking error: reference minus stroke (m).
    #[must_use]
    pub fn tracking_error(&self) -> Vec<f64> {
        let pairs = self.reference.iter().zip(&self.position);
        pairs.map(|(wanted, found)| wanted - found).collect()
    }
}

impl Track {
    pub(super) fn new(machine: &Machine, actuators: usize) -> Self {
        let wheels = machine.wheels().len();
        Self {
            load: vec![Vec::new(); wheels],
            otf: vec![Vec::new(); wheels],
            spread: Vec::new(),
            com: [Vec::new(), Vec::new()],
            stability_angle: Vec::new(),
            rods: vec![RodTrack::default(); actuators],
            status: Vec::new(),
        }
    }

    /// Adds the state evaluated last by `replay`, with this motion of the rods.
    pub(super) fn push(
        &mut self,
        replay: &Replay,
        rods: &[Motion<f64>],
        by_actuator: Option<&[ActuatorRow]>,
        status: Option<Status>,
    ) {
        let outcome = replay.outcome();
        for (column, &load) in self.load.iter_mut().zip(&outcome.load) {
            column.push(load);
        }
        for (column, &otf) in self.otf.iter_mut().zip(&outcome.otf) {
            column.push(otf);
        }
        self.spread.push(outcome.indicators.spread);
        let com = replay.com_offset();
        self.com[0].push(com.x);
        self.com[1].push(com.y);
        let angles = &outcome.indicators.stability_angle;
        let least = angles.iter().copied().fold(f64::INFINITY, f64::min);
        let known = angles.iter().all(|angle| angle.is_finite());
        self.stability_angle
            .push(if known { least } else { f64::NAN });
        for (k, track) in self.rods.iter_mut().enumerate() {
            let by_actuator = by_actuator.map(|by_actuator| by_actuator[k]);
            let of = |value: fn(&ActuatorRow) -> f64| by_actuator.as_ref().map_or(f64::NAN, value);
            track.position.push(rods[k].position);
            track.velocity.push(rods[k].rate);
            track.acceleration.push(rods[k].acceleration);
            track.force_needed.push(replay.rod_force(k));
            track.reference.push(of(|d| d.reference));
            track.reference_velocity.push(of(|d| d.reference_velocity));
            track
                .commanded_acceleration
                .push(of(|d| d.commanded_acceleration));
            for end in 0..2 {
                let limits = by_actuator.map_or([f64::NAN; 2], |d| {
                    [d.velocity_limits[end], d.acceleration_limits[end]]
                });
                track.velocity_limits[end].push(limits[0]);
                track.acceleration_limits[end].push(limits[1]);
            }
            track.opening.push(of(|d| d.opening));
            track.piston_pressure.push(of(|d| d.pressures.piston));
            track.rod_pressure.push(of(|d| d.pressures.rod));
            track.force.push(of(|d| d.force));
        }
        self.status.push(status);
    }

    /// Adds a row of unknown values.
    pub(super) fn push_unknown(&mut self) {
        let unknown = f64::NAN;
        let by_wheel = self.load.iter_mut().chain(&mut self.otf);
        by_wheel.for_each(|column| column.push(unknown));
        self.spread.push(unknown);
        self.com.iter_mut().for_each(|column| column.push(unknown));
        self.stability_angle.push(unknown);
        for track in &mut self.rods {
            for column in track.columns_mut() {
                column.push(unknown);
            }
        }
        self.status.push(None);
    }

    /// Distance of the centre of mass from the middle of the contact points, by row (m).
    #[must_use]
    pub fn com_offset(&self) -> Vec<f64> {
        let [x, y] = &self.com;
        x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect()
    }

    /// Whether any command was given.
    #[must_use]
    pub fn is_controlled(&self) -> bool {
        self.status.iter().any(Option::is_some)
    }
}

impl RodTrack {
    fn columns_mut(&mut self) -> [&mut Vec<f64>; 15] {
        let [least_velocity, greatest_velocity] = &mut self.velocity_limits;
        let [least_acceleration, greatest_acceleration] = &mut self.acceleration_limits;
        [
            least_velocity,
            greatest_velocity,
            least_acceleration,
            greatest_acceleration,
            &mut self.position,
            &mut self.velocity,
            &mut self.acceleration,
            &mut self.force_needed,
            &mut self.reference,
            &mut self.reference_velocity,
            &mut self.commanded_acceleration,
            &mut self.opening,
            &mut self.piston_pressure,
            &mut self.rod_pressure,
            &mut self.force,
        ]
    }
}
