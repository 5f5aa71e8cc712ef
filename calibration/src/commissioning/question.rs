//! Questions that a commissioning has to answer, signal by signal.

use std::f64::consts::PI;

use nalgebra::Matrix3;

use super::correction::{Correction, Subject, right_angles, signed_permutations};
use super::estimate::{Relation, Yaw};
use super::roles::{Role, Roles};
use super::travel::Source;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Sensors;

/// Factors by which a joint may be wrong without being absurd: degrees, and twice.
const JOINT_SCALES: [f64; 4] = [2.0, 0.5, 180.0 / PI, PI / 180.0];

/// Question by which a person can confirm the sign and order of a joint.
const MOVED: &str = "When this joint was asked for, did it and no other one move, and does its reading grow in the direction that the URDF calls positive?";
const READS: &str = "Does its reading agree with the position measured at the machine, in two positions far apart, both in this recording?";

const PULLS: &str = "With a known load on the tool, and with a known pull sideways, does the measured force have that size, and does it point as the frame of the sensor in the machine file says?";
const PUSHES: &str = "With the load of this actuator measured otherwise (weighed wheels, or a known load), does its force have that size, positive when it pushes the rod out?";
const WEIGHS: &str = "With a known load taken up, and again with it set down, do the signals of this payload tell its mass, directly or by the force that lifts it?";
const TELLS: &str = "When this support was set and raised, each time with the others as they were, did its signal tell so both times?";

/// A property of a signal, what shows it, and what else could be the case.
#[derive(Debug)]
pub(super) struct Question {
    /// Stable name, like `joint.lift.sign`.
    pub(super) key: String,
    /// The signal, for people.
    pub(super) signal: String,
    /// The property, for people.
    pub(super) property: &'static str,
    pub(super) subject: Subject,
    /// Relations that must agree: one of each group.
    pub(super) needed: Vec<Vec<Relation>>,
    /// Faults that must be excluded, as their corrections.
    pub(super) alternatives: Vec<Correction>,
    /// Motion that shows it.
    pub(super) motion: String,
    /// Question by which a person can confirm the property where no signal shows it.
    pub(super) asks: Option<&'static str>,
}

/// Machine, sensors and roles of the joints, on which the questions depend.
#[derive(Debug)]
pub(super) struct Setting<'a> {
    pub(super) machine: &'a Machine,
    pub(super) sensors: &'a Sensors,
    pub(super) roles: &'a Roles,
    pub(super) source: Source,
    /// The joints that the sensors measure.
    pub(super) measured: Vec<usize>,
    /// Whether the wheels slip sideways in curves, because none is steered.
    pub(super) skids: bool,
}

/// All questions about a machine with these sensors.
pub(super) fn questions(setting: &Setting<'_>) -> Vec<Question> {
    let mut all = Vec::new();
    if setting.sensors.imu {
        all.extend(imu(setting));
    }
    if setting.sensors.odometry {
        all.extend(odometry());
    }
    for &joint in &setting.measured {
        all.extend(of_joint(setting, joint));
    }
    if setting.source != Source::Nothing && setting.sensors.imu {
        all.push(travel());
    }
    all.extend(forces(setting));
    all
}

/// Measured forces, masses of payloads, and supports. No motion without a known load shows the first two: what they do to the
/// platform is what the masses do, too; and a support that bears little leaves the platform where it is.
fn forces(setting: &Setting<'_>) -> Vec<Question> {
    let told = |key: String, signal: String, property, motion: &str, asks| Question {
        key,
        signal,
        property,
        subject: Subject::Reaction,
        // No comparison of this recording shows it.
        needed: vec![Vec::new()],
        alternatives: Vec::new(),
        motion: motion.into(),
        asks: Some(asks),
    };
    let question = |key, signal, motion: &str, asks| {
        told(
            key,
            signal,
            "size, sign and axes of the force",
            motion,
            asks,
        )
    };
    let mut all = Vec::new();
    if setting.sensors.tool_wrench {
        all.push(question(
            "tool_wrench".into(),
            "force on the tool".into(),
            "stand, take a known load with the tool, hold it, and put it down; compare the measured force with its weight",
            PULLS,
        ));
    }
    let contact = setting.machine.contact();
    let mut joints: Vec<usize> = setting
        .sensors
        .actuators
        .iter()
        .map(|it| it.joint)
        .collect();
    joints.dedup();
    for joint in joints {
        let name = contact.actuated_joints[joint].name(setting.machine.linkages());
        all.push(question(
            format!("actuator.{name}"),
            format!("force of actuator {name}"),
            "stand, and compare the measured force with that by weighed wheels or a known load",
            PUSHES,
        ));
    }
    for payload in setting
        .machine
        .payloads_by_signals()
        .map(|payload| payload + 1)
    {
        all.push(told(
            format!("payload.{payload}"),
            format!("signals of payload {payload}"),
            "size of the mass",
            "stand, take a known load up, hold it, and set it down; compare the mass that is told with it both times",
            WEIGHS,
        ));
    }
    for support in setting.machine.supports().told_by_signals() {
        let name = &setting.machine.supports().support(support).name;
        all.push(told(
            format!("support.{name}"),
            format!("signal of support {name}"),
            "whether it is on the ground",
            "set this support alone and raise it again; compare what its signal tells both times",
            TELLS,
        ));
    }
    all
}

fn imu(setting: &Setting<'_>) -> Vec<Question> {
    let keeps_up = |turn: &Matrix3<f64>| turn[(2, 2)] > 0.5;
    let turns = |keep: bool| -> Vec<Correction> {
        let turns = right_angles()
            .into_iter()
            .filter(|turn| keeps_up(turn) == keep);
        turns.map(Correction::TurnImu).collect()
    };
    let axes = |keep: bool| -> Vec<Correction> {
        let axes = signed_permutations()
            .into_iter()
            .filter(|axes| keeps_up(axes) == keep);
        axes.map(Correction::GyroAxes).collect()
    };
    let yaw = |axis: usize| {
        vec![
            Relation::Turn(Yaw::Odometry, axis),
            Relation::Turn(Yaw::Wheels, axis),
            Relation::Turn(Yaw::Attitude, axis),
        ]
    };
    let lean = setting.roles.joints(|role| matches!(role, Role::Mass));
    let question = |key: &str, property, subject, needed, alternatives, motion: &str| Question {
        key: key.into(),
        signal: "IMU".into(),
        property,
        subject,
        needed,
        alternatives,
        motion: motion.into(),
        asks: None,
    };
    let factors = |make: fn(f64) -> Correction, factors: &[f64]| -> Vec<Correction> {
        factors.iter().map(|&factor| make(factor)).collect()
    };
    vec![
        question(
            "imu.specific_force.scale",
            "scale and sign of the specific force",
            Subject::Force,
            vec![vec![Relation::Gravity]],
            factors(
                Correction::ScaleForce,
                &[-1.0, 2.0, 0.5, 9.806_65, 1.0 / 9.806_65],
            ),
            "stand still for two seconds",
        ),
        question(
            "imu.specific_force.axes",
            "signs and axes of the specific force",
            Subject::Force,
            vec![
                vec![Relation::Up],
                vec![Relation::DriveDirection],
                vec![
                    Relation::Drive(1, 1),
                    Relation::AttitudeTilt(0),
                    Relation::AttitudeTilt(1),
                ],
            ],
            signed_permutations()
                .into_iter()
                .map(Correction::ForceAxes)
                .collect(),
            "drive forward and brake firmly, several times, then a circle to the left and to the right",
        ),
        question(
            "imu.mounting.up",
            "mounting: which axis points up",
            Subject::Mounting,
            vec![vec![Relation::Up]],
            turns(false),
            "stand still for two seconds on nearly level ground",
        ),
        question(
            "imu.mounting.forward",
            "mounting: which axis points forward",
            Subject::Mounting,
            vec![vec![Relation::DriveDirection]],
            turns(true),
            "drive forward and brake firmly, several times",
        ),
        question(
            "imu.mounting.tilt",
            "mounting: tilt about x and y",
            Subject::Mounting,
            vec![vec![Relation::Mount(0)], vec![Relation::Mount(1)]],
            Vec::new(),
            "drive a full circle on plane ground, after driving forward and braking",
        ),
        question(
            "imu.angular_velocity.yaw",
            "sign and scale of the yaw rate, and which axis it is",
            Subject::Gyro,
            vec![yaw(2), yaw(0), yaw(1)],
            [
                factors(
                    Correction::ScaleGyro,
                    &[-1.0, 2.0, 0.5, PI / 180.0, 180.0 / PI],
                ),
                axes(false),
            ]
            .concat(),
            "drive a circle, to the left and to the right",
        ),
        question(
            "imu.angular_velocity.roll_pitch",
            "signs and axes of roll and pitch rate",
            Subject::Gyro,
            vec![lean.iter().map(|&joint| Relation::Lean(joint)).collect()],
            axes(true),
            "stand, and move single joints that lean the machine sideways and lengthways",
        ),
        question(
            "imu.orientation",
            "convention of the orientation",
            Subject::Attitude,
            vec![
                vec![Relation::AttitudeUp],
                vec![Relation::Turn(Yaw::Attitude, 2)],
                vec![Relation::AttitudeTilt(0)],
                vec![Relation::AttitudeTilt(1)],
            ],
            vec![
                Correction::AttitudeSigns(-1.0, 1.0),
                Correction::AttitudeSigns(1.0, -1.0),
                Correction::AttitudeSigns(-1.0, -1.0),
            ],
            "drive a circle on ground that falls by a degree or more",
        ),
    ]
}

fn odometry() -> Vec<Question> {
    vec![
        Question {
            key: "odometry.velocity".into(),
            signal: "odometry".into(),
            property: "sign, axis and scale of the velocity",
            subject: Subject::Odometry,
            needed: vec![vec![Relation::Drive(0, 0)], vec![Relation::Drive(1, 0)]],
            alternatives: [1, 2, 3]
                .map(Correction::TurnOdometry)
                .into_iter()
                .chain([2.0, 0.5, 3.6, 1.0 / 3.6].map(Correction::ScaleOdometry))
                .collect(),
            motion: "drive forward and brake firmly, several times".into(),
            asks: None,
        },
        Question {
            key: "odometry.angular_velocity".into(),
            signal: "odometry".into(),
            property: "sign and scale of the yaw rate",
            subject: Subject::OdometryTurning,
            needed: vec![vec![Relation::Turn(Yaw::Odometry, 2)]],
            alternatives: Vec::new(),
            motion: "drive a circle, to the left and to the right".into(),
            asks: None,
        },
    ]
}

/// Corrections by which a joint changes its place with others.
fn swaps(setting: &Setting<'_>, joint: usize, with: impl Fn(usize) -> bool) -> Vec<Correction> {
    let others = setting
        .measured
        .iter()
        .filter(|&&other| other != joint && with(other));
    others
        .map(|&other| Correction::SwapJoints(joint.min(other), joint.max(other)))
        .collect()
}

fn of_joint(setting: &Setting<'_>, joint: usize) -> Vec<Question> {
    let name = &setting.machine.joints()[joint].name;
    let question = |part: &str, property, needed, alternatives, motion: String| Question {
        key: format!("joint.{name}.{part}"),
        signal: format!("joint {name}"),
        property,
        subject: Subject::Joint(joint),
        needed,
        alternatives,
        motion,
        asks: None,
    };
    let scales = |factors: &[f64]| -> Vec<Correction> {
        factors
            .iter()
            .map(|&factor| Correction::ScaleJoint(joint, factor))
            .collect()
    };
    let flip = Correction::ScaleJoint(joint, -1.0);
    let mut all = match setting.roles.of(joint) {
        Role::Constant => return Vec::new(),
        Role::Wheel { .. } => {
            let mut alternatives = [vec![flip], scales(&JOINT_SCALES)].concat();
            alternatives.extend(swaps(setting, joint, |other| {
                rolls_otherwise(setting, joint, other)
            }));
            vec![question(
                "rotation",
                "sign, scale and side of the wheel's rotation",
                match setting.skids {
                    true => vec![
                        vec![Relation::Wheel(joint)],
                        vec![Relation::WheelSide(joint)],
                    ],
                    false => vec![
                        vec![Relation::Wheel(joint)],
                        vec![Relation::WheelSide(joint)],
                        vec![Relation::WheelCurve(joint)],
                    ],
                },
                alternatives,
                "drive forward, then a circle".into(),
            )]
        }
        Role::Steer { .. } => {
            let mut alternatives = [vec![flip], scales(&JOINT_SCALES)].concat();
            alternatives.extend(swaps(setting, joint, |other| {
                matches!(setting.roles.of(other), Role::Steer { .. })
            }));
            vec![question(
                "steering",
                "sign, scale and order of the steering angle",
                vec![
                    vec![Relation::Steer(joint)],
                    vec![Relation::SteerOff(joint)],
                ],
                alternatives,
                "drive a circle, to the left and to the right".into(),
            )]
        }
        Role::Mass => {
            let order = swaps(setting, joint, |other| {
                matches!(setting.roles.of(other), Role::Mass)
            });
            let lean = || {
                vec![
                    vec![Relation::Lean(joint)],
                    vec![Relation::LeanUnexplained(joint)],
                ]
            };
            let motion = || {
                format!(
                    "stand, and move {name} alone, up and down (or to both sides), over the range in which it works"
                )
            };
            vec![
                Question {
                    asks: Some(MOVED),
                    ..question(
                        "sign",
                        "sign and order of the position",
                        lean(),
                        [vec![flip], order].concat(),
                        motion(),
                    )
                },
                Question {
                    asks: Some(READS),
                    ..question(
                        "scale",
                        "scale of the position",
                        lean(),
                        scales(&JOINT_SCALES),
                        format!("{}, and at least one other joint likewise", motion()),
                    )
                },
            ]
        }
    };
    all.push(question(
        "velocity",
        "velocity against position",
        vec![vec![Relation::Rate(joint)]],
        Vec::new(),
        format!("move {name}"),
    ));
    all
}

/// Whether exchanging two wheels changes the signals: they run on different sides, or one of them is steered.
fn rolls_otherwise(setting: &Setting<'_>, joint: usize, other: usize) -> bool {
    let wheel = |joint: usize| match setting.roles.of(joint) {
        Role::Wheel { wheel, .. } => Some(*wheel),
        _ => None,
    };
    let (Some(a), Some(b)) = (wheel(joint), wheel(other)) else {
        return false;
    };
    let side = |wheel: usize| setting.machine.wheels()[wheel].centre_at_zero.y;
    (side(a) - side(b)).abs() > 0.1 || setting.roles.is_steered(a) != setting.roles.is_steered(b)
}

/// Returns the question whether forward is forward for all sensors together.
fn travel() -> Question {
    Question {
        key: "travel.forward".into(),
        signal: "all of travel".into(),
        property: "forward is forward",
        subject: Subject::Travel,
        needed: vec![vec![Relation::DriveDirection]],
        alternatives: vec![Correction::Reverse],
        motion: "stand, and move single joints of the arm: its lean shows which end is the front"
            .into(),
        asks: Some(
            "Did the machine drive forward, as its operator calls it, when this program asked for it?",
        ),
    }
}
