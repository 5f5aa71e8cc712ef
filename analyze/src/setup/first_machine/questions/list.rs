//! Open and assumed values of a draft, and the questions about them.

use tipwatch_mechanics::machine::{JointMotion, UncertaintySpec};

use super::answer::{Kind, Range, Unit};
use super::open_value::{OpenValue, Subject};
use crate::base::number::four_digits;
use crate::setup::first_machine::draft::Draft;
use crate::setup::first_machine::guesses::Guesses;
use crate::setup::first_machine::linkages::LinkageGuess;

/// Wheels of a machine whose load split may follow from one number.
const WHEELS_OF_RULE: usize = 4;

/// A number with up to four digits.
pub(super) fn brief(value: f64) -> String {
    let text = four_digits(value);
    match text.contains('.') && !text.contains('e') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

fn number(unit: &'static [Unit], range: Range, expected: &'static str) -> Kind {
    Kind::Numbers {
        units: unit,
        range,
        expected,
    }
}

fn value(
    key: impl Into<String>,
    subject: Subject,
    question: impl Into<String>,
    proposal: impl Into<String>,
    kind: Kind,
) -> OpenValue {
    OpenValue {
        key: key.into(),
        question: question.into(),
        proposal: proposal.into(),
        effect: None,
        subject,
        kind,
    }
}

/// The guesses with every joint held still that no message measures.
pub(super) fn settled(draft: &Draft) -> Option<Guesses> {
    let mut guesses = draft.guesses.clone()?;
    guesses.freeze(&draft.topics.joints());
    Some(guesses)
}

/// Returns the values that must be known before any effect can be computed: without them there are no loads, or wrong ones.
pub(super) fn structure(draft: &Draft, guesses: Option<&Guesses>) -> Vec<OpenValue> {
    let Some(guesses) = guesses.filter(|_| draft.of_sheet.is_none()) else {
        return Vec::new();
    };
    let mut list = Vec::new();
    let without = guesses.wheels.iter().filter(|wheel| wheel.radius.is_none());
    list.extend(without.map(|wheel| radius(&wheel.name, None)));
    let open = guesses
        .linkages
        .iter()
        .filter(|linkage| linkage.eyes.is_none());
    list.extend(open.map(|linkage| {
        let needed = "left open: the loads need it";
        eyes(linkage, needed)
    }));
    let pivots = guesses.pivots();
    if !pivots.is_empty() && draft.stated.free_joints.is_empty() {
        list.push(value(
            "contact.free_joints",
            Subject::FreeJoints,
            format!(
                "Which of these joints carry no torque, such as bogies and a frame roll joint: {}",
                pivots.join(", ")
            ),
            "none",
            Kind::Names(pivots),
        ));
    }
    let feet = guesses.feet();
    if !feet.is_empty() && draft.stated.supports.is_empty() {
        list.push(value(
            "supports",
            Subject::Supports,
            format!("Which of these stood on the ground during this log, such as outriggers or a blade: {}", feet.join(", ")),
            "none",
            Kind::Names(feet),
        ));
        let wheels: Vec<String> = guesses
            .wheels
            .iter()
            .map(|wheel| wheel.name.clone())
            .collect();
        list.push(value(
            "wheels.NAME.raised",
            Subject::Raised,
            format!(
                "Which wheels did they keep off the ground: {}",
                wheels.join(", ")
            ),
            "none",
            Kind::Names(wheels),
        ));
    }
    list
}

/// Returns the values that the loads depend on, by differentiable parameters; no joint of the guesses is without a position.
pub(super) fn parameters(draft: &Draft, guesses: Option<&Guesses>) -> Vec<OpenValue> {
    let mut list = Vec::new();
    if draft.imu.is_doubtful {
        let height = draft.of_sheet.as_ref();
        imu(
            &mut list,
            height.map_or(0.0, |machine| machine.centre_of_mass[2]),
        );
    }
    let Some(guesses) = guesses else {
        return list;
    };
    if draft.of_sheet.is_some() {
        joints(&mut list, guesses);
        payload(&mut list, guesses);
        return list;
    }
    let doubtful = guesses.wheels.iter().filter(|wheel| wheel.is_doubtful);
    let doubtful = doubtful.filter_map(|wheel| Some((&wheel.name, wheel.radius.as_ref()?.0)));
    list.extend(doubtful.map(|(name, guess)| radius(name, Some(guess))));
    list.extend(
        guesses
            .held
            .iter()
            .map(|linkage| eyes(linkage, "held still")),
    );
    joints(&mut list, guesses);
    contact(&mut list, guesses);
    masses(&mut list, guesses);
    places(&mut list, guesses);
    list
}

fn radius(wheel: &str, guess: Option<f64>) -> OpenValue {
    value(
        format!("wheels.{wheel}.radius"),
        Subject::WheelRadius(wheel.into()),
        format!("Radius of the unloaded tyre of wheel {wheel} (m)"),
        guess.map_or("left open: the loads need it".into(), brief),
        number(
            &[Unit::Length],
            Range::Positive,
            "a length above zero, such as 0.35 or 350 mm",
        ),
    )
}

fn eyes(linkage: &LinkageGuess, proposal: &str) -> OpenValue {
    let joints = linkage.passive_joints().map(Clone::clone);
    value(
        format!("linkage.{}", linkage.name),
        Subject::Eyes {
            linkage: linkage.name.clone(),
            joints,
        },
        format!(
            "Cylinder of {}: x, y, z of the rod's eye in {} and of its pin in {} (m)",
            linkage.pivot, linkage.rod_link, linkage.pivot_link
        ),
        proposal,
        number(
            &[Unit::Length; 6],
            Range::Any,
            "six lengths, such as 0.745, 0, 0, 0.376, 0, 0",
        ),
    )
}

/// The mounting of the IMU, which is assumed so high above the origin of its link (m).
fn imu(list: &mut Vec<OpenValue>, height: f64) {
    list.push(value(
        "imu.xyz",
        Subject::ImuPosition,
        "Position of the IMU (inertial measurement unit) in its link: x, y, z (m)",
        format!("0, 0, {}", brief(height)),
        number(
            &[Unit::Length; 3],
            Range::Any,
            "three lengths, such as 0.1, 0, 50 mm",
        ),
    ));
    list.push(value(
        "imu.rpy",
        Subject::ImuOrientation,
        "Orientation of the IMU in its link: roll, pitch, yaw (degrees)",
        "0, 0, 0",
        number(
            &[Unit::Angle; 3],
            Range::Any,
            "three angles, such as 0, 0, 90",
        ),
    ));
}

fn joints(list: &mut Vec<OpenValue>, guesses: &Guesses) {
    for guess in guesses.joints.iter().filter(|guess| guess.is_doubtful) {
        let Some(position) = guess.fields.first() else {
            continue;
        };
        list.push(value(
            format!("signals.joints.{}.position", guess.joint),
            Subject::JointField(guess.joint.clone()),
            format!(
                "Joint {} is {}: factor to rad or m, negative if it counts the other way, and what is added then",
                guess.joint, position.source
            ),
            format!("{:?}, {:?}", position.scale, position.offset),
            number(
                &[Unit::Plain; 2],
                Range::Any,
                "two numbers, such as -0.0174533, 0",
            ),
        ));
    }
    let of_cylinder = |joint: &String| {
        let mut held = guesses.held.iter();
        held.any(|linkage| linkage.passive_joints().contains(&joint))
    };
    for joint in guesses.frozen.iter().filter(|joint| !of_cylinder(joint)) {
        let mut links = guesses
            .outline
            .links
            .iter()
            .filter_map(|link| link.joint.as_ref());
        let found = links.find(|it| it.name == *joint);
        let slides = found.is_some_and(|it| it.motion == JointMotion::Prismatic);
        let signals = guesses.candidates.get(joint).into_iter().flatten();
        let signals: Vec<_> = signals
            .map(|it| (it.signal.clone(), it.text.clone()))
            .collect();
        let names: Vec<&str> = signals.iter().map(|(name, _)| name.as_str()).collect();
        let either = match names.is_empty() {
            true => String::new(),
            false => format!(", or the name of its signal: {}", names.join(", ")),
        };
        let rest = guesses.rest(joint);
        let (unit, rest) = match slides {
            true => ("m", rest),
            false => ("degrees", rest.to_degrees()),
        };
        list.push(value(
            format!("signals.joints.{joint}.position"),
            Subject::JointPosition(joint.clone()),
            format!("Position at which joint {joint} stood, which no message has ({unit}){either}"),
            brief(rest),
            Kind::Position { slides, signals },
        ));
    }
}

fn contact(list: &mut Vec<OpenValue>, guesses: &Guesses) {
    list.push(value(
        "contact.ground, contact.tyre_stiffness",
        Subject::TyreStiffness,
        "Vertical stiffness of each tyre, if the ground was flat and firm: it splits the load between the axles (N/m)",
        "unknown, or uneven ground",
        number(
            &[Unit::Stiffness],
            Range::Positive,
            "a stiffness above zero, such as 800000 or 800 kN/m",
        ),
    ));
    if guesses.wheels.len() == WHEELS_OF_RULE {
        list.push(value(
            "contact.roll_moment_distribution",
            Subject::RollMomentDistribution,
            "Share of the front axle in the load difference between the sides (0 to 1)",
            "0.5",
            number(&[Unit::Plain], Range::Share, "a number from 0 to 1"),
        ));
    }
}

fn payload(list: &mut Vec<OpenValue>, guesses: &Guesses) {
    if let Some(tool) = &guesses.tool {
        list.push(value(
            "payload.mass",
            Subject::Payload,
            format!("Mass of a load on {} during this log (kg)", tool.link),
            "0",
            number(
                &[Unit::Mass],
                Range::NotNegative,
                "a mass, such as 450 or 0.45 t",
            ),
        ));
    }
}

fn masses(list: &mut Vec<OpenValue>, guesses: &Guesses) {
    payload(list, guesses);
    let default = UncertaintySpec::default();
    let tool = guesses.tool.as_ref().map(|tool| tool.link.clone());
    let links = guesses.outline.links.iter();
    let mass_of = |name: &String| {
        links
            .clone()
            .find(|link| link.name == *name)
            .map(|link| link.mass)
    };
    if let Some(tool) = &tool
        && let Some(mass) = mass_of(tool).filter(|mass| *mass > 0.0)
    {
        list.push(value(
            format!("links.{tool}.mass_sigma"),
            Subject::ToolMass(tool.clone()),
            format!(
                "{tool} weighs {} kg by the URDF (if that is wrong, correct it there): how far may it be off (kg)",
                brief(mass)
            ),
            brief(2.0 * default.mass_share * mass),
            number(&[Unit::Mass], Range::Positive, "a mass above zero, such as 20"),
        ));
    }
    list.push(value(
        "uncertainty.mass_share",
        Subject::OtherMasses(tool),
        "The bodies weigh what the URDF says: how far may each be off (%)",
        brief(200.0 * default.mass_share),
        number(
            &[Unit::Percent],
            Range::Positive,
            "a percentage above zero, such as 4",
        ),
    ));
}

fn places(list: &mut Vec<OpenValue>, guesses: &Guesses) {
    let default = UncertaintySpec::default();
    let lengths = |expected| number(&[Unit::Length], Range::Positive, expected);
    let expected = "a length above zero, such as 0.02 or 20 mm";
    list.push(value(
        "uncertainty.com",
        Subject::CentresOfMass,
        "The centres of mass are where the URDF says: how far may each be off, along each axis (m)",
        brief(2.0 * default.com),
        lengths(expected),
    ));
    let places = guesses.wheels.iter().map(|wheel| {
        let link = &guesses.outline.links[wheel.link];
        link.base_from_link.translation.vector
    });
    let extent = |axis: usize| {
        let along = places.clone().map(|place| place[axis]);
        let [least, most] = [
            along.clone().fold(f64::INFINITY, f64::min),
            along.fold(f64::NEG_INFINITY, f64::max),
        ];
        brief(most - least)
    };
    list.push(value(
        "uncertainty.wheel_position",
        Subject::WheelPositions,
        format!(
            "The wheels are where the URDF says, {} m from first to last axle and {} m from left to right (if that is \
             wrong, correct it there): how far may each be off, along each axis (m)",
            extent(0),
            extent(1)
        ),
        brief(2.0 * default.wheel_position),
        lengths(expected),
    ));
}
