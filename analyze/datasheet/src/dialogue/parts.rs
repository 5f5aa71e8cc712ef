//! The arm of each kind of machine, and the questions about axles, arm and outriggers.

use super::question::{Kind, Question, ask, ask_after};
use crate::prior::Template;
use crate::sheet::SegmentKind;

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

/// Name of the tool of a kind of machine.
pub(super) fn tool(template: Template) -> &'static str {
    match template {
        Template::MobileManipulator => "gripper",
        Template::Forwarder => "grapple",
        Template::Harvester => "head",
        Template::WheelLoader | Template::WheeledExcavator | Template::CrawlerExcavator => "bucket",
        Template::Telehandler | Template::Forklift => "forks",
        Template::TruckCrane | Template::MobileCrane => "hook",
    }
}

/// Pairs of outriggers that a kind of machine may have.
pub(super) fn outriggers(template: Template) -> usize {
    match template {
        Template::TruckCrane | Template::MobileCrane | Template::WheeledExcavator => 2,
        Template::Telehandler => 1,
        _ => 0,
    }
}

pub(super) fn outrigger_questions(list: &mut Vec<Question>, pair: usize) {
    let name = ["Outriggers, first pair", "Outriggers, second pair"][pair.min(1)];
    let key = |key: &str| format!("outriggers.{pair}.{key}");
    let text = format!(
        "{name}: distance behind the front axle, negative ahead of it; none if it has none [m]"
    );
    match pair {
        0 => ask(list, key("behind"), &text, false),
        _ => ask_after(list, "outriggers.0.behind", key("behind"), &text, false),
    }
    let text = format!("{name}: from the middle of the left pad to that of the right [m]");
    ask_after(list, key("behind"), key("base"), &text, true);
}

pub(super) fn axle_questions(
    list: &mut Vec<Question>,
    template: Template,
    axle: usize,
    axles: usize,
) {
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
        after: None,
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

pub(super) fn arm_questions(list: &mut Vec<Question>, template: Template, has_slew: bool) {
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
            after: None,
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
    ask_after(
        list,
        "rated_load.mass",
        "rated_load.centre",
        "Rated load: its centre ahead of the tool's frame [m]",
        true,
    );
}
