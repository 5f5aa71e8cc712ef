//! The range of every signal that unobserved motion allows.

use crate::machine::Machine;
use crate::state::State;

/// The values that a signal can have had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Span {
    /// Returns the range of one value.
    #[must_use]
    pub fn at(value: f64) -> Self {
        Self {
            low: value,
            high: value,
        }
    }

    /// Returns the width of the range.
    #[must_use]
    pub fn width(self) -> f64 {
        self.high - self.low
    }

    /// Largest distance from a value.
    #[must_use]
    pub fn farthest_from(self, value: f64) -> f64 {
        (self.high - value).max(value - self.low)
    }

    pub(super) fn add(&mut self, other: Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    pub(super) fn widened(self, by: f64) -> Self {
        Self {
            low: self.low - by,
            high: self.high + by,
        }
    }
}

/// The ranges of all signals, at an instant or over a time.
#[derive(Debug, Clone)]
pub struct MotionRange {
    /// Ranges of position, velocity and acceleration, by joint.
    pub joints: Vec<[Span; 3]>,
    /// Specific force in the IMU frame (m/s^2).
    pub specific_force: [Span; 3],
    /// Angular velocity in the IMU frame (rad/s).
    pub angular_velocity: [Span; 3],
    /// Angular acceleration in the IMU frame (rad/s^2).
    pub angular_acceleration: [Span; 3],
    /// Force and moment on the tool (N and N m).
    pub tool: [Span; 6],
    /// Whether any signal is not observed.
    pub is_unobserved: bool,
    /// Whether all ranges are known: no sample is older than the machine file allows.
    pub is_bounded: bool,
    /// Age of the oldest held sample (s).
    pub held_s: f64,
}

impl MotionRange {
    /// Returns the zero range of a machine, without unobserved motion.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        let zero = Span::at(0.0);
        Self {
            joints: vec![[zero; 3]; machine.joints().len()],
            specific_force: [zero; 3],
            angular_velocity: [zero; 3],
            angular_acceleration: [zero; 3],
            tool: [zero; 6],
            is_unobserved: false,
            is_bounded: true,
            held_s: 0.0,
        }
    }

    /// Begins with the values of a state.
    pub(super) fn restart(&mut self, state: &State<f64>) {
        for (range, joint) in self.joints.iter_mut().zip(&state.joints) {
            *range = [joint.position, joint.rate, joint.acceleration].map(Span::at);
        }
        self.specific_force = state.imu.specific_force.data.0[0].map(Span::at);
        self.angular_velocity = state.imu.angular_velocity.data.0[0].map(Span::at);
        self.angular_acceleration = state.imu.angular_acceleration.data.0[0].map(Span::at);
        let (force, moment) = (&state.tool_wrench.force, &state.tool_wrench.moment);
        for axis in 0..3 {
            self.tool[axis] = Span::at(force[axis]);
            self.tool[3 + axis] = Span::at(moment[axis]);
        }
        (self.is_unobserved, self.is_bounded, self.held_s) = (false, true, 0.0);
    }
}

/// A stated greatest rate or acceleration that the log itself exceeds. The larger one is used.
#[derive(Debug, Clone, PartialEq)]
pub struct Exceeded {
    /// Key in the machine file.
    pub key: String,
    /// Stated value, in the unit of the key.
    pub stated: f64,
    /// Least value that explains the samples, in the unit of the key.
    pub observed: f64,
}
