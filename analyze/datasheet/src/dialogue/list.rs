//! The questions of each kind of machine.

use super::parts::{
    arm_questions, axle_questions, outrigger_questions, outriggers, segments, tool,
};
use super::question::{Kind, Question, ask};
use crate::prior::Template;
use crate::sheet::SegmentKind;

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
