//! The questions of each kind of machine.

use super::parts::{arm_questions, axle_questions, outrigger_questions, outriggers};
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
    /// The key without whose answer it is not asked.
    pub after: Option<String>,
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

pub(super) fn ask(list: &mut Vec<Question>, key: impl Into<String>, text: &str, is_required: bool) {
    list.push(Question {
        key: key.into(),
        text: text.into(),
        is_required,
        after: None,
        kind: Kind::Number,
    });
}

/// A question that is asked if another one was answered; its own answer is then needed, or not.
pub(super) fn ask_after(
    list: &mut Vec<Question>,
    after: impl Into<String>,
    key: impl Into<String>,
    text: &str,
    is_required: bool,
) {
    ask(list, key, text, is_required);
    if let Some(question) = list.last_mut() {
        question.after = Some(after.into());
    }
}

/// Name, kind and telescope of the segments of a kind of machine.
pub(super) fn segments(template: Template) -> &'static [(&'static str, SegmentKind, bool)] {
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
        after: None,
        kind: Kind::Text,
    });
    list.push(Question {
        key: "sources.0".into(),
        text: "Source of the numbers (maker, document, year)".into(),
        is_required: false,
        after: None,
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
