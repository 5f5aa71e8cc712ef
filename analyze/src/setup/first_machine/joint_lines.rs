//! The joints of `[signals.joints]`: guessed, held still, stated, or left open.

use super::can::Candidate;
use super::guesses::{Guesses, StatedPosition};
use super::text::{Text, key, number};

/// Keys of guessed positions that nobody has confirmed.
pub(super) fn doubted(guesses: &Guesses) -> Vec<String> {
    let joints = guesses.joints.iter().filter(|joint| joint.is_doubtful);
    let joints = joints.map(|joint| &joint.joint);
    let frozen = guesses.frozen.iter();
    let frozen = frozen.filter(|joint| !guesses.stated.contains_key(*joint));
    joints
        .chain(frozen)
        .map(|joint| format!("signals.joints.{joint}"))
        .collect()
}

/// Writes the tables of joints that the joint states do not have by their names.
pub(super) fn write_joints(text: &mut Text, guesses: &Guesses) {
    for guess in &guesses.joints {
        text.gap()
            .comment(&format!("{}: {}.", guess.joint, guess.why));
        text.line(&format!("[signals.joints.{}]", key(&guess.joint)));
        for field in &guess.fields {
            text.line(&field.line());
        }
    }
    for joint in &guesses.frozen {
        if let Some(stated) = guesses.stated.get(joint) {
            text.gap()
                .comment(&format!("{joint}: stated at the terminal."));
            text.line(&format!("[signals.joints.{}]", key(joint)));
            text.line(&match stated {
                StatedPosition::Constant(position) => format!("position = {}", number(*position)),
                StatedPosition::Signal(table) => format!("position = {table}"),
            });
            continue;
        }
        let [mass, share] = guesses.carried_mass(joint);
        text.gap().comment(&format!(
            "Held still: joint {joint} is in no message. It carries {mass:.1} kg, {:.1} % of the mass.",
            100.0 * share
        ));
        text.line(&format!("[signals.joints.{}]", key(joint)));
        text.line(&format!("position = {}", number(guesses.rest(joint))));
    }
    for joint in &guesses.unknown {
        let [mass, share] = guesses.carried_mass(joint);
        text.gap().comment(&format!(
            "Needed: the position of joint {joint} (rad or m), which is in no message and carries {mass:.1} kg, {:.1} % of the \
             mass: a field, or a constant if it never moves, such as position = 0.0 (--freeze-passive writes that).",
            100.0 * share
        ));
        let candidates = guesses
            .candidates
            .get(joint)
            .map(Vec::as_slice)
            .unwrap_or_default();
        let position = match candidates {
            [] => r#"position = { topic = "/topic", field = "field", scale = 1.0, offset = 0.0 }"#
                .to_owned(),
            _ => {
                text.comment(&format!(
                    "By name, unit and motion it may be: {}. CHECK which, its sign and its zero.",
                    of_candidates(candidates)
                ));
                let lines = candidates
                    .iter()
                    .map(|it| format!("position = {}", it.text));
                lines.collect::<Vec<_>>().join("\n")
            }
        };
        text.open(&format!("[signals.joints.{}]\n{position}", key(joint)));
    }
}

fn of_candidates(candidates: &[Candidate]) -> String {
    let all = candidates.iter().map(|it| {
        let [least, most] = it.span;
        format!("{} ({least:.3} to {most:.3})", it.signal)
    });
    all.collect::<Vec<_>>().join(", ")
}
