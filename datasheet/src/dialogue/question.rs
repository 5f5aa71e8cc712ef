//! The questions of each kind of machine.

use crate::prior::Template;
use crate::sheet::SegmentKind;

/// A question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// The key of the sheet that the answer becomes, such as `axles.0.load`.
    pub key: String,
    /// The question.
    pub text: String,
    /// Whether an empty answer is none.
    pub is_required: bool,
    /// What an answer is.
    pub(super) kind: Kind,
}

/// What an answer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A number, perhaps with its unit.
    Number,
    /// Two numbers.
    Range,
    Text,
}

fn ask(list: &mut Vec<Question>, key: impl Into<String>, text: &str, is_required: bool) {
    list.push(Question {
        key: key.into(),
        text: text.into(),
        is_required,
        kind: Kind::Number,
    });
}

/// Name, kind and telescope of the segments of a kind of machine.
fn segments(template: Template) -> &'static [(&'static str, SegmentKind, bool)] {
    use SegmentKind::{Lift, Mast, Roll};
    match template {
        Template::MobileManipulator => &[
            ("shoulder", Lift, false),
            ("elbow", Lift, false),
            ("wrist", Lift, false),
            ("flange", Roll, false),
        ],
        Template::Forwarder | Template::Harvester => &[("lift", Lift, false), ("jib", Lift, true)],
        Template::WheelLoader => &[("boom", Lift, false)],
        Template::Telehandler | Template::TruckCrane | Template::MobileCrane => {
            &[("boom", Lift, true)]
        }
        Template::Forklift => &[("mast", Mast, true)],
        Template::WheeledExcavator | Template::CrawlerExcavator => {
            &[("boom", Lift, false), ("stick", Lift, false)]
        }
    }
}

fn tool(template: Template) -> &'static str {
    match template {
        Template::MobileManipulator => "gripper",
        Template::Forwarder => "grapple",
        Template::Harvester => "head",
        Template::WheelLoader | Template::WheeledExcavator | Template::CrawlerExcavator => "bucket",
        Template::Telehandler | Template::Forklift => "forks",
        Template::TruckCrane | Template::MobileCrane => "hook",
    }
}

/// Keys of the sheet that the kind of machine answers by itself.
pub(super) fn fixed_answers(template: Template) -> Vec<(String, String)> {
    let mut list = vec![
        ("template".to_owned(), template.to_string()),
        ("arm.tool.name".into(), tool(template).into()),
    ];
    for (index, (name, kind, _)) in segments(template).iter().enumerate() {
        list.push((format!("arm.segments.{index}.name"), (*name).into()));
        let kind = match kind {
            SegmentKind::Lift => continue,
            SegmentKind::Yaw => "yaw",
            SegmentKind::Roll => "roll",
            SegmentKind::Mast => "mast",
        };
        list.push((format!("arm.segments.{index}.kind"), kind.into()));
    }
    list
}

/// The questions of a kind of machine with this many axles.
#[must_use]
pub fn questions(template: Template, axles: usize) -> Vec<Question> {
    let prior = template.prior();
    let mut list = Vec::new();
    list.push(Question {
        key: "name".into(),
        text: "Name of the machine".into(),
        is_required: true,
        kind: Kind::Text,
    });
    list.push(Question {
        key: "sources.0".into(),
        text: "Source of the numbers (maker, document, year)".into(),
        is_required: false,
        kind: Kind::Text,
    });
    ask(&mut list, "mass", "Operating mass [kg]", true);
    for (key, text) in [
        ("length", "Overall length without the arm [m]"),
        ("width", "Overall width [m]"),
        ("height", "Overall height [m]"),
    ] {
        ask(&mut list, key, text, false);
    }
    ask(
        &mut list,
        "centre_of_mass_height",
        "Height of its centre of mass over the ground, if known [m]",
        false,
    );
    if prior.has_tracks {
        ask(
            &mut list,
            "tracks.gauge",
            "Track gauge, middle to middle [m]",
            true,
        );
        ask(
            &mut list,
            "tracks.length",
            "Length of the tracks on the ground, sprocket to idler [m]",
            true,
        );
        ask(&mut list, "tracks.shoe", "Width of the shoes [m]", true);
        ask(&mut list, "tracks.height", "Height of the tracks [m]", true);
    }
    for axle in 0..if prior.has_tracks { 0 } else { axles } {
        axle_questions(&mut list, template, axle, axles);
    }
    if prior.is_articulated {
        ask(
            &mut list,
            "articulation.behind",
            "Distance of the frame joint behind the front axle [m]",
            true,
        );
        ask(
            &mut list,
            "articulation.angle",
            "Largest articulation angle [degrees]",
            true,
        );
        ask(
            &mut list,
            "articulation.roll",
            "Largest angle of the frame roll joint, if it has one [degrees]",
            false,
        );
    }
    let has_slew = prior.has_superstructure
        || matches!(
            template,
            Template::Forwarder | Template::Harvester | Template::MobileManipulator
        );
    if has_slew {
        let from = if prior.has_tracks {
            "the middle of the tracks"
        } else {
            "the front axle"
        };
        ask(
            &mut list,
            "slew.behind",
            &format!("Distance of the slew's axis behind {from} [m]"),
            true,
        );
        ask(
            &mut list,
            "slew.height",
            "Height of the slew over the ground [m]",
            true,
        );
    }
    if prior.has_superstructure {
        ask(
            &mut list,
            "superstructure.tail",
            "Tail swing radius [m]",
            true,
        );
        ask(
            &mut list,
            "superstructure.mass",
            "Mass of the superstructure with counterweight, without arm, if known [kg]",
            false,
        );
    }
    arm_questions(&mut list, template, has_slew);
    for pair in 0..outriggers(template) {
        outrigger_questions(&mut list, pair);
    }
    list
}

/// Pairs of outriggers that a kind of machine may have.
fn outriggers(template: Template) -> usize {
    match template {
        Template::TruckCrane | Template::MobileCrane | Template::WheeledExcavator => 2,
        Template::Telehandler => 1,
        _ => 0,
    }
}

fn outrigger_questions(list: &mut Vec<Question>, pair: usize) {
    let name = ["Outriggers, first pair", "Outriggers, second pair"][pair.min(1)];
    let key = |key: &str| format!("outriggers.{pair}.{key}");
    ask(
        list,
        key("behind"),
        &format!(
            "{name}: distance behind the front axle, negative ahead of it; none if it has none [m]"
        ),
        false,
    );
    ask(
        list,
        key("base"),
        &format!("{name}: from the middle of the left pad to that of the right [m]"),
        false,
    );
}

fn axle_questions(list: &mut Vec<Question>, template: Template, axle: usize, axles: usize) {
    let name = match (axle, axles) {
        (0, _) => "Front axle".to_owned(),
        (axle, axles) if axle + 1 == axles => "Rear axle".to_owned(),
        (axle, _) => format!("Axle {}", axle + 1),
    };
    let key = |key: &str| format!("axles.{axle}.{key}");
    if axle > 0 {
        ask(
            list,
            key("behind"),
            &format!("{name}: distance behind the axle before it [m]"),
            true,
        );
    }
    let is_truck = template == Template::Forklift && axle == 1;
    let text = match is_truck {
        true => format!("{name}: track [m]; none for a single wheel in the middle"),
        false => format!("{name}: track [m]"),
    };
    ask(list, key("track"), &text, !is_truck);
    ask(
        list,
        key("load"),
        &format!("{name}: load, without payload [kg]"),
        false,
    );
    list.push(Question {
        key: key("tyre"),
        text: format!("{name}: tyre, such as 20.5R25; none to state the radius"),
        is_required: false,
        kind: Kind::Text,
    });
    ask(
        list,
        key("tyre_radius"),
        &format!("{name}: radius of the unloaded tyre; none to take it from the tyre [m]"),
        false,
    );
    if matches!(template, Template::Forwarder | Template::Harvester) {
        ask(
            list,
            key("bogie"),
            &format!("{name}: distance between the wheels of a bogie, if it has bogies [m]"),
            false,
        );
    }
    let pendulum = matches!(template, Template::WheelLoader | Template::Forklift) && axle == 1
        || template == Template::WheeledExcavator && axle == 0
        || template == Template::Telehandler
        || template == Template::Harvester && axle == 1;
    if pendulum {
        ask(
            list,
            key("pendulum"),
            &format!("{name}: largest angle of its oscillation, if it hangs on a pivot [degrees]"),
            false,
        );
    }
}

fn arm_questions(list: &mut Vec<Question>, template: Template, has_slew: bool) {
    let from = match (template, has_slew) {
        (Template::Forklift, _) => "of the fork's face ahead of the front axle",
        (_, true) => "of its first pin ahead of the slew's axis",
        (_, false) => "of its first pin ahead of the front axle",
    };
    ask(
        list,
        "arm.ahead",
        &format!("Arm: distance {from} [m]"),
        true,
    );
    ask(
        list,
        "arm.height",
        "Arm: height of its first pin over the ground [m]",
        true,
    );
    ask(
        list,
        "arm.mass",
        "Arm: mass with its tool, if known [kg]",
        false,
    );
    ask(
        list,
        "arm.reach",
        "Arm: largest horizontal reach [m]",
        false,
    );
    for (index, (name, kind, telescopes)) in segments(template).iter().enumerate() {
        let key = |key: &str| format!("arm.segments.{index}.{key}");
        ask(
            list,
            key("length"),
            &format!("Arm, {name}: length [m]"),
            true,
        );
        list.push(Question {
            key: key("range"),
            text: format!("Arm, {name}: smallest and largest angle, such as -30, 60 [degrees]"),
            is_required: false,
            kind: Kind::Range,
        });
        ask(
            list,
            key("at"),
            &format!("Arm, {name}: angle when the machine was weighed [degrees]"),
            false,
        );
        if *telescopes {
            let what = if *kind == SegmentKind::Mast {
                "lift height"
            } else {
                "telescopic extension"
            };
            ask(
                list,
                key("extension"),
                &format!("Arm, {name}: {what} [m]"),
                *kind == SegmentKind::Mast,
            );
        }
    }
    ask(list, "arm.tool.mass", "Tool: mass, if known [kg]", false);
    ask(list, "arm.tool.length", "Tool: length [m]", false);
    ask(list, "rated_load.mass", "Rated load [kg]", false);
    ask(
        list,
        "rated_load.centre",
        "Rated load: its centre ahead of the tool's frame [m]",
        false,
    );
}
