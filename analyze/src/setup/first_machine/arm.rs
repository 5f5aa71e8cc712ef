//! Guesses the manipulator and its tool.

use tipwatch_mechanics::machine::Outline;

use super::wheels::Wheel;
use super::words::has_word;

const ARM: [&str; 12] = [
    "arm",
    "crane",
    "boom",
    "slew",
    "swing",
    "manipulator",
    "mast",
    "turret",
    "turntable",
    "shoulder",
    "loader",
    "excavator",
];
/// Words for a manipulator, the most specific first.
const TOOL: [&[&str]; 3] = [
    &["tool", "tcp", "tool0"],
    &["flange", "effector", "ee", "eef"],
    &[
        "gripper", "grapple", "bucket", "fork", "forks", "hand", "hook",
    ],
];
/// Fewest moving joints of an arm without a descriptive name.
const FEWEST_JOINTS: usize = 3;

/// A guess and its reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Guess {
    pub(super) link: String,
    pub(super) why: String,
}

/// Guesses the root: the first moving link of the manipulator.
pub(super) fn root(outline: &Outline, wheels: &[Wheel]) -> Option<Guess> {
    let has_wheels = |link: usize| wheels.iter().any(|w| outline.is_below(w.link, link));
    let is_candidate = |link: usize| outline.links[link].moves() && !has_wheels(link);
    let mut candidates: Vec<usize> = Vec::new();
    for link in 0..outline.links.len() {
        let inside = candidates.iter().any(|&c| outline.is_below(link, c));
        let in_wheel = wheels.iter().any(|w| outline.is_below(link, w.link));
        if is_candidate(link) && !inside && !in_wheel {
            candidates.push(link);
        }
    }
    let below = |root: usize| -> Vec<usize> {
        (0..outline.links.len())
            .filter(|&link| outline.is_below(link, root))
            .collect()
    };
    let joints = |root: usize| {
        let moving = below(root).into_iter();
        moving.filter(|&link| outline.links[link].moves()).count()
    };
    let matching_name = |root: usize| {
        let link = below(root).into_iter().map(|link| &outline.links[link]);
        let mut names = link.flat_map(|l| {
            let joint = l.joint.as_ref().map_or("", |joint| &joint.name);
            [l.name.as_str(), joint]
        });
        names.find(|name| has_word(name, &ARM)).map(str::to_owned)
    };
    let score = |root: usize| (matching_name(root).is_some(), joints(root));
    let best = candidates.into_iter().max_by_key(|&root| score(root))?;
    let count = joints(best);
    let why = match matching_name(best) {
        Some(name) => format!(
            "the distal subtree contains \"{name}\" and no wheel, and has {count} moving joints"
        ),
        None if count >= FEWEST_JOINTS => {
            format!("a chain of {count} moving joints without wheels")
        }
        None => return None,
    };
    Some(Guess {
        link: outline.links[best].name.clone(),
        why,
    })
}

/// Guesses the tool: the frame of the wrench messages, else the link with a matching name nearest to the
/// root.
pub(super) fn tool(outline: &Outline, root: &str, wrench_frame: Option<&str>) -> Option<Guess> {
    let root = outline.link(root)?;
    let inside = |link: &usize| outline.is_below(*link, root);
    if let Some(frame) =
        wrench_frame.filter(|frame| outline.link(frame).is_some_and(|l| inside(&l)))
    {
        return Some(Guess {
            link: frame.into(),
            why: "frame of the wrench messages".into(),
        });
    }
    TOOL.iter().find_map(|wanted| {
        let link = (0..outline.links.len())
            .filter(inside)
            .find(|&link| has_word(&outline.links[link].name, wanted))?;
        Some(Guess {
            link: outline.links[link].name.clone(),
            why: "its name matches".into(),
        })
    })
}
