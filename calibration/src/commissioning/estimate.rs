//! Results of comparing signals: a figure, its standard deviation and its expected value.

use std::fmt;

/// Standard deviations that count as certain.
pub(super) const CERTAIN: f64 = 5.0;

/// Standard deviations within which an agreement must stay clear of what is wrong.
const SURE: f64 = 3.0;

/// Largest slope on which a machine is commissioned (rad).
const STEEP: f64 = 0.2;

/// Compared quantity, with its joints, wheels or axes where there are several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Relation {
    /// Mean specific force at rest, over gravity.
    Gravity,
    /// Angle between the specific force at rest and the platform's up direction on level ground (rad).
    Up,
    /// Specific force per acceleration by the odometry or the wheels: row (forward, left) and column.
    Drive(usize, usize),
    /// Direction of that specific force, about z (rad).
    DriveDirection,
    /// Tilt of the IMU about x and y (rad), apart from the slope of the ground.
    Mount(usize),
    /// Tilt by the attitude per tilt by the specific force, about y and x.
    AttitudeTilt(usize),
    /// Angle between the up direction by the attitude and the specific force at rest (rad).
    AttitudeUp,
    /// Angular velocity about an axis per yaw rate by another sensor.
    Turn(Yaw, usize),
    /// Roll or pitch rate by the orientation, per roll or pitch rate by the gyroscope: row and column.
    Rocking(usize, usize),
    /// Speed of a wheel's circumference per speed of its centre.
    Wheel(usize),
    /// The part of that speed due to a curve, likewise: on which side the wheel is.
    WheelSide(usize),
    /// Root mean square deviation of a wheel's speed in curves, as a share of it.
    WheelCurve(usize),
    /// Difference of the speeds of two wheels of one side in curves, over that of their paths.
    WheelOrder(usize, usize),
    /// Angle of a steering joint per angle by the motion of its wheels.
    Steer(usize),
    /// Root mean square deviation of that angle, as a share of it.
    SteerOff(usize),
    /// Logarithm of the platform's lean per lean that a joint's motion predicts, over that of the other joints.
    Lean(usize),
    /// Share of the platform's lean that a joint's motion does not predict.
    LeanUnexplained(usize),
    /// Lean of the platform (rad) while no joint moves, in the direction in which this joint, which never does, would
    /// lean it.
    Still(usize),
    /// Measured velocity of a joint per change of its position.
    Rate(usize),
    /// Positions of a joint beyond its limits, as a share of their span.
    Range(usize),
}

/// Sensors that measure the yaw rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Yaw {
    Odometry,
    Wheels,
    Attitude,
}

/// A comparison's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimate {
    pub(super) relation: Relation,
    pub(super) value: f64,
    pub(super) sigma: f64,
    pub(super) expected: f64,
    /// Deviation that a good machine may show.
    pub(super) tolerance: f64,
    /// Deviation from which something is wrong.
    pub(super) wrong: f64,
}

/// Outcome of an estimate against its expected value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    /// The value is as expected, and certain enough to say so.
    Agrees,
    /// The value is not as expected.
    Contradicts,
    /// The motion shows too little.
    Open,
}

impl Relation {
    /// Returns the expected value where nothing is wrong, the largest deviation of a good machine, and the least deviation from
    /// which something is wrong.
    fn limits(self) -> [f64; 3] {
        match self {
            Self::Gravity => [1.0, 0.03, 0.08],
            Self::Up => [0.0, STEEP, 0.45],
            Self::Drive(row, column) if row == column => [1.0, 0.2, 0.4],
            Self::Drive(..) => [0.0, 0.2, 0.4],
            Self::DriveDirection => [0.0, 0.07, 0.14],
            Self::Mount(_) => [0.0, 0.035, 0.06],
            Self::AttitudeTilt(_) => [1.0, 0.4, 0.8],
            Self::AttitudeUp => [0.0, 0.035, 0.09],
            Self::Turn(Yaw::Wheels, 2) => [1.0, 0.15, 0.4],
            Self::Turn(_, 2) => [1.0, 0.1, 0.3],
            Self::Turn(..) => [0.0, 0.1, 0.3],
            Self::Rocking(row, column) if row == column => [1.0, 0.5, 1.2],
            Self::Rocking(..) => [0.0, 0.3, 0.4],
            Self::Wheel(_) => [1.0, 0.2, 0.4],
            Self::WheelSide(_) => [1.0, 0.25, 0.5],
            Self::WheelCurve(_) => [0.0, 0.12, 0.25],
            Self::WheelOrder(..) => [1.0, 0.6, 1.0],
            Self::Steer(_) => [1.0, 0.15, 0.25],
            Self::SteerOff(_) => [0.0, 0.15, 0.3],
            Self::Lean(_) => [0.0, 0.25, 0.6],
            // Other things move a platform, too: by itself that is no fault of a sensor.
            Self::LeanUnexplained(_) => [0.0, 0.35, f64::INFINITY],
            Self::Still(_) => [0.0, 3e-4, 1e-3],
            Self::Rate(_) => [1.0, 0.1, 0.3],
            Self::Range(_) => [0.0, 0.05, 0.15],
        }
    }
}

impl Estimate {
    /// A value and its standard deviation.
    pub(super) fn of(relation: Relation, [value, sigma]: [f64; 2]) -> Self {
        let [expected, tolerance, wrong] = relation.limits();
        Self {
            relation,
            value,
            sigma,
            expected,
            tolerance,
            wrong,
        }
    }

    /// Returns the estimate with other limits: the deviation that a good machine may show, and the one from which something is
    /// wrong.
    pub(super) fn within(self, [tolerance, wrong]: [f64; 2]) -> Self {
        Self {
            tolerance,
            wrong,
            ..self
        }
    }

    pub(super) fn standing(&self) -> Standing {
        let off = (self.value - self.expected).abs();
        if !(off.is_finite() && self.sigma.is_finite()) {
            return Standing::Open;
        }
        if off > self.wrong + CERTAIN * self.sigma {
            Standing::Contradicts
        } else if off <= self.tolerance && off + SURE * self.sigma <= self.wrong.min(self.largest())
        {
            Standing::Agrees
        } else {
            Standing::Open
        }
    }

    /// Deviation beyond which an agreement would say nothing.
    fn largest(&self) -> f64 {
        2.0 * self.tolerance + 0.2
    }

    /// Returns by how many standard deviations the estimate is off beyond what is probable on this machine by `before`, the same
    /// relation of the signals as they are: the deviation of `before`, and a third of the tolerance.
    pub(super) fn sigmas_worse(&self, before: &Self) -> f64 {
        let shown = (before.value - before.expected).abs() + self.tolerance / 3.0;
        let off = (self.value - self.expected).abs() - shown.min(self.tolerance);
        (off / self.sigma.max(1e-9)).clamp(0.0, 999.0)
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} ± {:.3}", self.value, self.sigma)
    }
}

impl Yaw {
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Odometry => "the odometry",
            Self::Wheels => "the wheels",
            Self::Attitude => "the orientation",
        }
    }
}
