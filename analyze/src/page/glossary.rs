//! The terms and acronyms of the pages, each explained once.

use maud::{Markup, html};
use tipwatch_language::{is_english, message, told, word};

use super::elements::{facts, section};

/// Terms and their meaning, in the order of the glossary.
const TERMS: [(&str, &str); 16] = [
    (
        message!("Centre of mass"),
        message!("of the whole machine, load included"),
    ),
    (
        message!("Envelope"),
        message!(
            "the range of loads on a wheel that equilibrium allows, for any split of the load between the wheels"
        ),
    ),
    (
        message!("Force-Angle"),
        message!(
            "stability measure of Papadopoulos and Rey: the angle about an edge from the edge to the resulting \
         force at the centre of mass, inertia included; positive is stable"
        ),
    ),
    (
        message!("IMU"),
        message!("inertial measurement unit: measures angular velocity and specific force"),
    ),
    (
        message!("Input fault"),
        message!(
            "implausible input: a signal whose values are out of range, frozen, change too fast or contradict another signal"
        ),
    ),
    (
        message!("ITOM"),
        message!(
            "improved tip-over moment: TOM plus the inertia forces of the chassis; positive means tipping. ITOM \
         with wheels also includes the mass of the wheels"
        ),
    ),
    (
        message!("Margin"),
        message!(
            "overturning force of a wheel divided by its static load: 0 when the wheel is about to lift, 100 % at \
         rest on level ground. The margin of the machine is that of its worst wheel"
        ),
    ),
    (
        message!("MHS"),
        message!(
            "moment-height stability: overturning moment about an edge due to the arm and the force on the tool \
         alone"
        ),
    ),
    (
        message!("OTF"),
        message!(
            "overturning force: the load a wheel would carry if every wheel were held to the ground. It is \
         negative when the ground would have to pull the wheel down, so the wheel lifts"
        ),
    ),
    (
        message!("Row"),
        message!(
            "one instant at which loads are computed; a row is valid if all inputs it needs are there and \
         plausible"
        ),
    ),
    (
        message!("Stability angle"),
        message!("the same angle as Force-Angle for the weight alone; positive is stable"),
    ),
    (
        message!("Static load"),
        message!(
            "load of a wheel at rest on level ground, in the reference posture that the machine file states, else with all joints at zero, within \
         their limits"
        ),
    ),
    (
        message!("TOM"),
        message!("tip-over moment: MHS plus the weight of the chassis"),
    ),
    (
        message!("URDF"),
        message!(
            "Unified Robot Description Format: the file that describes links, joints and masses of the machine"
        ),
    ),
    (
        message!("ZMP"),
        message!(
            "zero moment point, also centre of pressure: the point where the resulting force of the ground acts. \
         The machine tips when it reaches an edge of the support polygon"
        ),
    ),
    (message!("σ"), message!("standard deviation")),
];

/// The section at the end of a page that explains the terms in its content.
pub(crate) fn glossary(content: &Markup) -> Markup {
    let text = content.0.to_lowercase();
    let terms = TERMS.map(|(term, meaning)| (told(term), told(meaning)));
    let is_used = |(term, _): &(&str, &str)| contains_word(&text, &term.to_lowercase());
    let mut used: Vec<_> = terms.into_iter().filter(is_used).collect();
    used.sort_by_key(|(term, _)| term.to_lowercase());
    html! { @if !used.is_empty() { (section(word!("Glossary"), facts(&used))) } }
}

/// Whether the text contains `word` as a whole word, singular or plural.
fn contains_word(text: &str, word: &str) -> bool {
    let endings: &[&str] = match is_english() {
        true => &["", "s"],
        false => &["", "s", "e", "n", "en"],
    };
    text.match_indices(word).any(|(at, _)| {
        let behind = &text[at + word.len()..];
        let ending = behind.split(|c: char| !c.is_alphanumeric()).next();
        !text[..at].ends_with(char::is_alphanumeric)
            && ending.is_some_and(|ending| endings.contains(&ending))
    })
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::machine::ReferencePosture;

    use super::*;

    #[test]
    fn static_loads_are_those_of_the_posture_that_the_notes_name() {
        let unstated = ReferencePosture {
            positions: Vec::new(),
            is_stated: false,
        };
        let posture = unstated.source().split(" (").next().unwrap();
        let (_, meaning) = TERMS
            .into_iter()
            .find(|(term, _)| *term == "Static load")
            .unwrap();
        assert!(meaning.contains(posture), "{posture}: {meaning}");
    }

    #[test]
    fn glossary_explains_exactly_the_terms_in_use() {
        let page = html! { p { "The OTF of two wheels; tomorrow." } };
        let glossary = glossary(&page).into_string();
        assert!(glossary.contains("overturning force") && !glossary.contains("tip-over moment"));
        assert_eq!(
            super::glossary(&html! { p { "Nothing." } }).into_string(),
            ""
        );
    }
}
