//! Explanations of a violated relation: the alternatives that are weighed against "all sensors are sound".

use nalgebra::Matrix3;
use tipwatch_language::{say, word};

use crate::machine::{Axis, Machine};

/// Units in which speeds are logged where it is not metres per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SpeedUnit {
    /// km/h.
    KilometresPerHour,
    /// mph.
    MilesPerHour,
}

impl SpeedUnit {
    pub(super) const ALL: [Self; 2] = [Self::KilometresPerHour, Self::MilesPerHour];

    /// Metres per second in one of the unit.
    pub(super) fn in_si(self) -> f64 {
        match self {
            Self::KilometresPerHour => 1.0 / 3.6,
            Self::MilesPerHour => 0.447_04,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::KilometresPerHour => word!("kilometres per hour"),
            Self::MilesPerHour => word!("miles per hour"),
        }
    }
}

/// An explanation of a contradiction between sensors. Axes are those of the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Explanation {
    /// The sign about or along an axis.
    Sign(Axis),
    /// All signs.
    Signs,
    /// Two axes exchanged.
    Exchanged(Axis, Axis),
    /// Mounted turned by 90 degrees about an axis; `true`: in the positive sense.
    QuarterTurn(Axis, bool),
    /// Mounted turned by 180 degrees about an axis.
    HalfTurn(Axis),
    /// The housing of an IMU, with all that it measures, turned by 90 degrees about an axis; `true`: in the positive sense.
    HousingQuarterTurn(Axis, bool),
    /// The housing of an IMU, with all that it measures, turned by 180 degrees about an axis.
    HousingHalfTurn(Axis),
    /// A scale of one half or of two.
    Scale(bool),
    /// The value does not follow the motion.
    Stopped,
    /// An accelerometer that shows gravity alone.
    GravityOnly,
    /// A velocity of the odometry in another unit.
    Speed(SpeedUnit),
    /// The sign of a joint, by its index.
    JointSign(usize),
    /// A joint whose encoder has stopped, by its index.
    JointStopped(usize),
    /// A joint with a scale of one half or of two, by its index.
    JointScale(usize, bool),
    /// Two joints exchanged, by their indices.
    JointsExchanged(usize, usize),
    /// A joint whose encoder is off by a constant since its position jumped, by its index.
    JointOffset(usize),
    /// An attitude whose inclination jumped without the gyro, and stayed.
    AttitudeOffset,
    /// An accelerometer whose specific force stepped where no velocity changed as that requires, and stayed.
    AccelerometerOffset,
    /// A load on the tool that nothing states.
    UnstatedLoad,
    /// Stamps that are off by a constant time. Only a whole log shows it: with other stamps the signals agree.
    Late,
    /// None of the above.
    Other,
}

impl Explanation {
    /// Returns the matrix by which a true vector becomes the measured one (base axes) under an alternative about a sensor of
    /// vectors; `None` for other alternatives.
    pub(super) fn matrix(self) -> Option<Matrix3<f64>> {
        let flipped = |axis: Axis| {
            let mut flipped = Matrix3::identity();
            flipped[(axis as usize, axis as usize)] = -1.0;
            flipped
        };
        Some(match self {
            Self::Sign(axis) => flipped(axis),
            Self::Signs => -Matrix3::identity(),
            Self::Exchanged(a, b) => {
                let mut exchanged = Matrix3::identity();
                exchanged.swap_rows(a as usize, b as usize);
                exchanged
            }
            Self::HalfTurn(axis) | Self::HousingHalfTurn(axis) => -flipped(axis),
            Self::QuarterTurn(axis, positive) | Self::HousingQuarterTurn(axis, positive) => {
                // in the axes of a sensor that is turned, a vector turns the other way
                let angle = if positive { -1.0 } else { 1.0 } * std::f64::consts::FRAC_PI_2;
                let mut along = nalgebra::Vector3::zeros();
                along[axis as usize] = angle;
                nalgebra::Rotation3::from_scaled_axis(along).into_inner()
            }
            Self::Scale(double) => Matrix3::identity() * if double { 2.0 } else { 0.5 },
            Self::Stopped => Matrix3::zeros(),
            Self::GravityOnly
            | Self::Speed(_)
            | Self::JointSign(_)
            | Self::JointStopped(_)
            | Self::JointScale(..)
            | Self::JointsExchanged(..)
            | Self::JointOffset(_)
            | Self::AttitudeOffset
            | Self::AccelerometerOffset
            | Self::UnstatedLoad
            | Self::Late
            | Self::Other => return None,
        })
    }

    /// The alternatives of a sensor that measures vectors.
    pub(super) fn of_vectors() -> Vec<Self> {
        let [x, y, z] = Axis::ALL;
        let mut all = vec![Self::Signs];
        for axis in Axis::ALL {
            all.push(Self::Sign(axis));
            all.push(Self::HalfTurn(axis));
            all.push(Self::QuarterTurn(axis, true));
            all.push(Self::QuarterTurn(axis, false));
        }
        all.extend([
            Self::Exchanged(x, y),
            Self::Exchanged(x, z),
            Self::Exchanged(y, z),
        ]);
        all
    }

    /// An IMU whose housing is turned.
    pub(super) fn of_housings() -> impl Iterator<Item = Self> {
        Axis::ALL.into_iter().flat_map(|axis| {
            [
                Self::HousingHalfTurn(axis),
                Self::HousingQuarterTurn(axis, true),
                Self::HousingQuarterTurn(axis, false),
            ]
        })
    }

    /// Whether the fault is in the mounting, the wiring or the configuration of sensors: such a fault does not heal by itself.
    #[must_use]
    pub fn lasts(self) -> bool {
        matches!(
            self,
            Self::Sign(_)
                | Self::Signs
                | Self::Exchanged(..)
                | Self::QuarterTurn(..)
                | Self::HalfTurn(_)
                | Self::HousingQuarterTurn(..)
                | Self::HousingHalfTurn(_)
                | Self::Scale(_)
                | Self::GravityOnly
                | Self::Speed(_)
                | Self::JointSign(_)
                | Self::JointScale(..)
                | Self::JointsExchanged(..)
        )
    }

    /// Returns the explanation in words, to follow "as if".
    #[must_use]
    pub fn text(self, machine: &Machine) -> String {
        let joint = |joint: usize| machine.joints()[joint].name.as_str();
        let quarter = |positive: bool| if positive { 90 } else { -90 };
        let turned = |degrees: i32, axis: Axis| {
            let axis = axis.name();
            say!("the sensor were turned by {degrees} degrees about {axis}")
        };
        let housing_turned = |degrees: i32, axis: Axis| {
            let axis = axis.name();
            say!("the housing of the IMU were turned by {degrees} degrees about {axis}")
        };
        match self {
            Self::Sign(axis) => say!("the sign of {} were reversed", axis.name()),
            Self::Signs => word!("all signs were reversed").into(),
            Self::Exchanged(a, b) => say!("{} and {} were exchanged", a.name(), b.name()),
            Self::QuarterTurn(axis, positive) => turned(quarter(positive), axis),
            Self::HalfTurn(axis) => turned(180, axis),
            Self::HousingQuarterTurn(axis, positive) => housing_turned(quarter(positive), axis),
            Self::HousingHalfTurn(axis) => housing_turned(180, axis),
            Self::Scale(true) => word!("one showed twice the other").into(),
            Self::Scale(false) => word!("one showed half the other").into(),
            Self::Stopped => word!("one of them did not follow the motion").into(),
            Self::GravityOnly => word!("the accelerometer showed gravity alone").into(),
            Self::Speed(unit) => say!("the velocity were in {}", unit.name()),
            Self::JointSign(j) => say!("the sign of {} were reversed", joint(j)),
            Self::JointStopped(j) => say!("the encoder of {} had stopped", joint(j)),
            Self::JointScale(j, true) => {
                say!("{} moved twice as far as its encoder shows", joint(j))
            }
            Self::JointScale(j, false) => {
                say!("{} moved half as far as its encoder shows", joint(j))
            }
            Self::JointsExchanged(a, b) => say!("{} and {} were exchanged", joint(a), joint(b)),
            Self::JointOffset(j) => {
                say!(
                    "the encoder of {} were off since it jumped or lost counts",
                    joint(j)
                )
            }
            Self::AttitudeOffset => word!("the attitude were off since it jumped").into(),
            Self::AccelerometerOffset => {
                word!("the accelerometer were off since it stepped").into()
            }
            Self::UnstatedLoad => word!("a load that nothing states were on the tool").into(),
            Self::Late => word!("the clock of one of them were off").into(),
            Self::Other => word!("one of them were wrong in another way").into(),
        }
    }
}
