//! The posture of the reference loads.

use super::guesses::Guesses;
use super::text::{Text, key, number};

/// Writes the posture that counts without the key, so that it is seen and can be replaced.
pub(super) fn write(text: &mut Text, guesses: &Guesses, logged: &[String]) {
    let positions = positions(guesses, logged);
    if positions.is_empty() {
        return;
    }
    text.gap().comment(
        "The reference of utilisation and load limits: wheel loads at rest on level ground in this posture. It is every \
         joint at zero, or at its limit next to zero. State the usual transport posture (rad or m).",
    );
    let pairs: Vec<String> = (positions.iter())
        .map(|(joint, position)| format!("{} = {}", key(joint), number(*position)))
        .collect();
    text.line("[limits]");
    text.line(&format!("reference_posture = {{ {} }}", pairs.join(", ")));
}

/// Each joint with a known position, other than wheels, and the position next to zero that its limits allow.
fn positions(guesses: &Guesses, logged: &[String]) -> Vec<(String, f64)> {
    let is_known = |name: &String| {
        logged.contains(name) || guesses.joints.iter().any(|guess| guess.joint == *name)
    };
    let follows = |name: &String| {
        let by = |l: &super::linkages::LinkageGuess| {
            l.cylinder == *name || (l.rod == *name && is_known(&l.pivot))
        };
        guesses.linkages.iter().any(by)
    };
    let links = guesses.outline.links.iter().enumerate();
    let joints = links.filter_map(|(index, link)| {
        let joint = link.joint.as_ref().filter(|_| link.moves())?;
        let is_wheel = guesses.wheels.iter().any(|wheel| wheel.link == index);
        let counts = is_known(&joint.name) && !joint.mimics && !is_wheel && !follows(&joint.name);
        let nearest = joint
            .limits
            .map_or(0.0, |[least, greatest]| 0.0_f64.max(least).min(greatest));
        counts.then(|| (joint.name.clone(), nearest))
    });
    joints.collect()
}
