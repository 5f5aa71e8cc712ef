//! Faults of a signal, each stated as the correction that would remove it.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use tipwatch_mechanics::machine::Machine;

/// A correction of the signals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Correction {
    /// The signals are right.
    None,
    /// The IMU is mounted turned: its vectors, in base axes, are turned back by this rotation.
    TurnImu(Matrix3<f64>),
    /// The axes of the gyroscope alone are in another order or of another sign (base axes).
    GyroAxes(Matrix3<f64>),
    /// The axes of the accelerometer alone are in another order or of another sign (base axes).
    ForceAxes(Matrix3<f64>),
    /// The angular velocity is multiplied by this factor.
    ScaleGyro(f64),
    /// The specific force is multiplied by this factor.
    ScaleForce(f64),
    /// The velocity of the odometry is turned about z by so many quarter turns.
    TurnOdometry(u8),
    /// The velocity of the odometry is multiplied by this factor.
    ScaleOdometry(f64),
    /// Positions and velocities of a joint are multiplied by this factor.
    ScaleJoint(usize, f64),
    /// Positions and velocities of several joints are of the opposite sign.
    FlipJoints(JointSet),
    /// Two joints change places.
    SwapJoints(usize, usize),
    /// Forward is backward for odometry, wheels and IMU alike.
    Reverse,
    /// The odometry's angular velocity is wrong in some way: it is left out.
    WithoutOdometryTurning,
    /// The IMU's attitude is wrong in some way: it is left out.
    WithoutAttitude,
    /// The signs of roll and pitch of the attitude.
    AttitudeSigns(f64, f64),
}

/// Several joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct JointSet(u128);

impl JointSet {
    /// `None` for fewer than two joints, and beyond the first 128.
    pub(super) fn of(joints: &[usize]) -> Option<Self> {
        let bits = joints.iter().try_fold(0, |bits: u128, &joint| {
            Some(bits | 1_u128.checked_shl(u32::try_from(joint).ok()?)?)
        });
        bits.filter(|bits| bits.count_ones() > 1).map(Self)
    }

    pub(super) fn joints(self) -> impl Iterator<Item = usize> {
        (0..u128::BITS as usize).filter(move |joint| self.0 >> joint & 1 == 1)
    }

    pub(super) fn contains(self, joint: usize) -> bool {
        self.joints().any(|other| other == joint)
    }
}

/// The sensor whose signal a correction changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Subject {
    Mounting,
    Force,
    Gyro,
    Odometry,
    Joint(usize),
    Travel,
    OdometryTurning,
    Attitude,
    /// Force on the tool or of an actuator, mass of a payload, or which supports are on the ground.
    Reaction,
}

/// Degrees in a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Names of the base axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Units and factors that a signal may be wrong by: how much too large it is, and what that means.
const FACTORS: [(f64, &str); 11] = [
    (-1.0, "of the opposite sign"),
    (DEGREES, "in degrees instead of radians"),
    (
        1.0 / DEGREES,
        "scaled as if from degrees, though in radians",
    ),
    (1000.0, "in thousandths of its unit"),
    (0.001, "in thousands of its unit"),
    (3.6, "in kilometres per hour instead of metres per second"),
    (
        30.0 / std::f64::consts::PI,
        "in revolutions per minute instead of radians per second",
    ),
    (
        std::f64::consts::FRAC_1_PI / 2.0,
        "in revolutions instead of radians",
    ),
    (1.0 / 9.806_65, "in units of g instead of m/s²"),
    (2.0, "twice as large as it should be"),
    (0.5, "half as large as it should be"),
];

/// Describes the fault of a signal that is too large by a factor, such as "twice as large as it should be".
pub(super) fn factor_text(factor: f64) -> String {
    let known = FACTORS
        .iter()
        .find(|(known, _)| (factor / known - 1.0).abs() < 0.06);
    let turned = FACTORS[1..]
        .iter()
        .find(|(known, _)| (-factor / known - 1.0).abs() < 0.06);
    match (known, turned) {
        (Some((_, text)), _) => (*text).into(),
        (None, Some((_, text))) => format!("of the opposite sign and {text}"),
        (None, None) => format!("{factor:.3} times what it should be"),
    }
}

impl Correction {
    /// The sensors that it changes.
    pub(super) fn subjects(&self) -> Vec<Subject> {
        match *self {
            Self::None => Vec::new(),
            Self::TurnImu(_) => vec![Subject::Mounting],
            Self::GyroAxes(_) | Self::ScaleGyro(_) => vec![Subject::Gyro],
            Self::ScaleForce(_) | Self::ForceAxes(_) => vec![Subject::Force],
            Self::FlipJoints(set) => set.joints().map(Subject::Joint).collect(),
            Self::TurnOdometry(_) | Self::ScaleOdometry(_) => vec![Subject::Odometry],
            Self::ScaleJoint(joint, _) => vec![Subject::Joint(joint)],
            Self::SwapJoints(a, b) => vec![Subject::Joint(a), Subject::Joint(b)],
            Self::Reverse => vec![Subject::Travel],
            Self::WithoutOdometryTurning => vec![Subject::OdometryTurning],
            Self::WithoutAttitude | Self::AttitudeSigns(..) => vec![Subject::Attitude],
        }
    }

    /// The fault that it corrects, as a sentence without its full stop.
    pub(super) fn fault(&self, machine: &Machine) -> String {
        let name = |joint: usize| &machine.joints()[joint].name;
        match *self {
            Self::None => "nothing is wrong".into(),
            Self::TurnImu(turn) => format!("the IMU is mounted turned by {}", turn_text(&turn)),
            Self::GyroAxes(axes) => format!("the gyroscope's {}", axes_text(&axes)),
            Self::ForceAxes(axes) => format!("the accelerometer's {}", axes_text(&axes)),
            Self::FlipJoints(set) => {
                let names = set.joints().map(|joint| format!("\"{}\"", name(joint)));
                let names: Vec<String> = names.collect();
                format!("joints {} are of the opposite sign", names.join(" and "))
            }
            Self::ScaleGyro(factor) => format!("the angular velocity is {}", factor_text(1.0 / factor)),
            Self::ScaleForce(factor) => format!("the specific force is {}", factor_text(1.0 / factor)),
            Self::TurnOdometry(2) => "the odometry's velocity is of the opposite sign".into(),
            Self::TurnOdometry(_) => "forward and lateral velocity of the odometry are exchanged".into(),
            Self::ScaleOdometry(factor) => {
                format!("the odometry's velocity is {}", factor_text(1.0 / factor))
            }
            Self::ScaleJoint(joint, factor) => {
                format!("joint \"{}\" is {}", name(joint), factor_text(1.0 / factor))
            }
            Self::SwapJoints(a, b) => {
                format!("joints \"{}\" and \"{}\" are exchanged", name(a), name(b))
            }
            Self::Reverse => "forward is backward for IMU, odometry and wheels alike".into(),
            Self::WithoutOdometryTurning => {
                "the odometry's angular velocity has another sign, axis or scale".into()
            }
            Self::WithoutAttitude => {
                "the IMU's orientation is in another convention (frames, order of the quaternion, or inverted)".into()
            }
            Self::AttitudeSigns(roll, pitch) => match (roll < 0.0, pitch < 0.0) {
                (true, true) => "roll and pitch of the IMU's orientation are of the opposite sign".into(),
                (true, false) => "the roll of the IMU's orientation is of the opposite sign".into(),
                _ => "the pitch of the IMU's orientation is of the opposite sign".into(),
            },
        }
    }
}

/// Describes a rotation that is to be undone, by axis and angle in base axes.
fn turn_text(back: &Matrix3<f64>) -> String {
    // A quaternion has an axis for half a turn, too.
    let turn = Rotation3::from_matrix_unchecked(back.transpose());
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let Some((axis, angle)) = turn.axis_angle() else {
        return "nothing".into();
    };
    let degrees = angle.to_degrees();
    let axis = axis.into_inner();
    let largest = axis.iamax();
    if axis[largest].abs() > 0.999 {
        let sign = if axis[largest] < 0.0 && degrees < 179.5 {
            "-"
        } else {
            ""
        };
        return format!(
            "{sign}{degrees:.0} degrees about {} of the machine",
            AXES[largest]
        );
    }
    format!(
        "{degrees:.0} degrees about the axis ({:.2}, {:.2}, {:.2}) of the machine",
        axis.x, axis.y, axis.z
    )
}

/// Describes which axis is which in a permutation with signs.
fn axes_text(back: &Matrix3<f64>) -> String {
    // Row i: the right component i is this sign times this wrong component.
    let source = |i: usize| {
        let row = Vector3::new(back[(i, 0)], back[(i, 1)], back[(i, 2)]);
        (row.iamax(), row[row.iamax()])
    };
    let parts = (0..3).filter_map(|i| {
        let (from, sign) = source(i);
        match (from == i, sign > 0.0) {
            (true, true) => None,
            (true, false) => Some(format!("{} axis is of the opposite sign", AXES[i])),
            (false, true) => Some(format!("{} axis is delivered as {}", AXES[i], AXES[from])),
            (false, false) => Some(format!(
                "{} axis is delivered as minus {}",
                AXES[i], AXES[from]
            )),
        }
    });
    parts.collect::<Vec<_>>().join(", its ")
}

/// Every permutation of the axes with signs but the identity: 47, of which 23 are rotations.
pub(super) fn signed_permutations() -> Vec<Matrix3<f64>> {
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let mut all = Vec::new();
    for order in orders {
        for signs in 0..8_u8 {
            let mut matrix = Matrix3::zeros();
            for (row, column) in order.into_iter().enumerate() {
                matrix[(row, column)] = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            }
            if matrix != Matrix3::identity() {
                all.push(matrix);
            }
        }
    }
    all
}

/// The rotations among them: right angles about any axis.
pub(super) fn right_angles() -> Vec<Matrix3<f64>> {
    let mut all = signed_permutations();
    all.retain(|matrix| matrix.determinant() > 0.0);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_and_permutations_are_complete() {
        assert_eq!(signed_permutations().len(), 47);
        assert_eq!(right_angles().len(), 23);
        let half = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
        assert!(right_angles().contains(&half));
        assert_eq!(turn_text(&half), "180 degrees about z of the machine");
    }

    #[test]
    fn a_set_holds_its_joints() {
        let set = JointSet::of(&[3, 127]).unwrap();
        assert_eq!(set.joints().collect::<Vec<_>>(), [3, 127]);
        assert!(set.contains(3) && !set.contains(4));
        for joints in [&[][..], &[5], &[1, 128]] {
            assert_eq!(JointSet::of(joints), None);
        }
    }

    #[test]
    fn factors_are_named() {
        assert_eq!(factor_text(57.3), "in degrees instead of radians");
        assert_eq!(factor_text(-1.0), "of the opposite sign");
        assert_eq!(
            factor_text(-57.3),
            "of the opposite sign and in degrees instead of radians"
        );
        assert_eq!(factor_text(1.25), "1.250 times what it should be");
    }
}
