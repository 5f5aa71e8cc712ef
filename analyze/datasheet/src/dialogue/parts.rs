//! Arm, tool and outriggers of each kind of machine.

use crate::prior::Template;
use crate::sheet::SegmentKind;

/// Working equipment of a kind of machine.
pub(super) struct Equipment {
    /// Name and kind of each segment of the arm, and whether it telescopes.
    pub(super) segments: &'static [(&'static str, SegmentKind, bool)],
    /// Name of the tool.
    pub(super) tool: &'static str,
    /// Pairs of outriggers that it may have.
    pub(super) outriggers: usize,
}

pub(super) fn equipment(template: Template) -> Equipment {
    use SegmentKind::{Lift, Mast, Roll};
    const ROBOT: &[(&str, SegmentKind, bool)] = &[
        ("shoulder", Lift, false),
        ("elbow", Lift, false),
        ("wrist", Lift, false),
        ("flange", Roll, false),
    ];
    const CRANE: &[(&str, SegmentKind, bool)] = &[("lift", Lift, false), ("jib", Lift, true)];
    const DIGGER: &[(&str, SegmentKind, bool)] = &[("boom", Lift, false), ("stick", Lift, false)];
    let (segments, tool, outriggers): (&[_], _, _) = match template {
        Template::MobileManipulator => (ROBOT, "gripper", 0),
        Template::Forwarder => (CRANE, "grapple", 0),
        Template::Harvester => (CRANE, "head", 0),
        Template::WheelLoader => (&[("boom", Lift, false)], "bucket", 0),
        Template::Telehandler => (&[("boom", Lift, true)], "forks", 1),
        Template::Forklift => (&[("mast", Mast, true)], "forks", 0),
        Template::TruckCrane | Template::MobileCrane => (&[("boom", Lift, true)], "hook", 2),
        Template::WheeledExcavator => (DIGGER, "bucket", 2),
        Template::CrawlerExcavator => (DIGGER, "bucket", 0),
    };
    Equipment {
        segments,
        tool,
        outriggers,
    }
}

/// Keys of the sheet that the kind of machine answers by itself.
pub(super) fn fixed_answers(template: Template) -> Vec<(String, String)> {
    let equipment = equipment(template);
    let mut list = vec![
        ("template".to_owned(), template.to_string()),
        ("arm.tool.name".into(), equipment.tool.into()),
    ];
    for (index, (name, kind, _)) in equipment.segments.iter().enumerate() {
        list.push((format!("arm.segments.{index}.name"), (*name).into()));
        if *kind != SegmentKind::Lift {
            list.push((format!("arm.segments.{index}.kind"), kind.to_string()));
        }
    }
    list
}
