//! A value of the machine file that is open or assumed.

use tipwatch_mechanics::Parameter;
use tipwatch_mechanics::machine::Machine;

use super::answer::Kind;

/// Open and assumed values of a first machine file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OpenValues {
    /// Values that the loads depend on, the largest effect first; those without a computable effect are last.
    pub values: Vec<OpenValue>,
    /// Values that move the load of no wheel by more than [`Self::least_n`].
    pub minor: Vec<OpenValue>,
    /// The change of load below which a value is minor (N).
    pub least_n: f64,
    /// Reason why the effects are not known, if they are not.
    pub unranked: Option<String>,
}

/// A value of the machine file that is open or assumed.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenValue {
    /// The key of the machine file that the answer becomes, such as `wheels.FL.radius`, or several with commas between them.
    pub key: String,
    /// The question, with the unit.
    pub question: String,
    /// Value that holds without an answer.
    pub proposal: String,
    /// Effect on the wheel loads in this log; `None` where the loads have no derivative with respect to the value.
    pub effect: Option<Effect>,
    pub(super) subject: Subject,
    pub(super) kind: Kind,
}

/// Effect of the uncertainty of a value on a wheel load: to first order, two standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// The wheel that came closest to lifting, in words.
    pub wheel: String,
    /// Two standard deviations of the value, with their unit.
    pub doubt: String,
    /// The change of that wheel's load at its worst instant (N).
    pub change_n: f64,
    /// Its share of the variance of that load.
    pub variance_share: f64,
}

/// Subject of a question. Joints, links, wheels and linkages are named as in the machine file.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Subject {
    WheelRadius(String),
    FreeJoints,
    /// Supports besides the wheels on which the machine stood.
    Supports,
    /// Wheels that were off the ground because the machine stood on other supports.
    Raised,
    /// The eyes of the cylinder of a linkage, with the joints that it moves.
    Eyes {
        linkage: String,
        joints: [String; 2],
    },
    ImuPosition,
    ImuOrientation,
    /// A joint under a field whose unit, sign and zero are guesses.
    JointField(String),
    /// A joint that no message measures.
    JointPosition(String),
    Payload,
    TyreStiffness,
    RollMomentDistribution,
    ToolMass(String),
    /// The masses of all links but this one.
    OtherMasses(Option<String>),
    CentresOfMass,
    WheelPositions,
}

impl Subject {
    /// Names the subject within a sentence.
    pub(super) fn in_words(&self) -> String {
        match self {
            Self::WheelRadius(wheel) => format!("radius of wheel {wheel}"),
            Self::FreeJoints => "axles that swing".into(),
            Self::Supports => "supports besides the wheels".into(),
            Self::Raised => "wheels off the ground on supports".into(),
            Self::Eyes { linkage, .. } => format!("eyes of the cylinder of {linkage}"),
            Self::ImuPosition => "position of the IMU".into(),
            Self::ImuOrientation => "orientation of the IMU".into(),
            Self::JointField(joint) => format!("unit, sign and zero of joint {joint}"),
            Self::JointPosition(joint) => format!("position of joint {joint}"),
            Self::Payload => "payload".into(),
            Self::TyreStiffness => "stiffness of the tyres".into(),
            Self::RollMomentDistribution => "share of the front axle in the roll moment".into(),
            Self::ToolMass(link) => format!("mass of {link}"),
            Self::OtherMasses(_) => "masses of the bodies".into(),
            Self::CentresOfMass => "centres of mass".into(),
            Self::WheelPositions => "positions of the wheels".into(),
        }
    }

    pub(super) fn is_of_imu(&self) -> bool {
        matches!(self, Self::ImuPosition | Self::ImuOrientation)
    }

    /// Whether the loads depend on the subject through this parameter.
    pub(super) fn is_about(&self, parameter: Parameter, machine: &Machine) -> bool {
        let joint = |index: usize| &machine.joints()[index].name;
        let link = |index: usize| &machine.links()[index].name;
        match (self, parameter) {
            (Self::WheelRadius(wheel), Parameter::WheelRadius(id)) => {
                machine.supports().support(id).name == *wheel
            }
            (Self::Eyes { joints, .. }, Parameter::JointPosition(at)) => joints.contains(joint(at)),
            (Self::JointField(name) | Self::JointPosition(name), Parameter::JointPosition(at)) => {
                joint(at) == name
            }
            (Self::ToolMass(name), Parameter::LinkMass(at)) => link(at) == name,
            (Self::OtherMasses(tool), Parameter::LinkMass(at)) => tool.as_ref() != Some(link(at)),
            (Self::ImuPosition, Parameter::ImuPosition(_))
            | (Self::ImuOrientation, Parameter::ImuRotation(_))
            | (Self::Payload, Parameter::PayloadMass(_))
            | (
                Self::TyreStiffness | Self::RollMomentDistribution,
                Parameter::RollMomentDistribution | Parameter::TyreStiffness(_),
            )
            | (Self::CentresOfMass, Parameter::LinkCom(..))
            | (Self::WheelPositions, Parameter::WheelPosition(..)) => true,
            _ => false,
        }
    }
}
