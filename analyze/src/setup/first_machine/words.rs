//! Splits names into words.

/// Words for the rate of a position.
pub(super) const VELOCITY: [&str; 4] = ["velocity", "vel", "rate", "speed"];
/// Words that exclude a joint position.
pub(super) const OTHER: [&str; 10] = [
    "effort",
    "torque",
    "force",
    "pressure",
    "command",
    "target",
    "setpoint",
    "current",
    "acceleration",
    "temperature",
];

/// The words of a name in lower case, split where the kind of character changes: `frontWheel_2` gives
/// front, wheel, 2.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = None;
    for c in name.chars() {
        let goes_on = before.is_some_and(|before: char| {
            let same_kind = before.is_ascii_digit() == c.is_ascii_digit();
            let new_word = before.is_lowercase() && c.is_uppercase();
            before.is_alphanumeric() && same_kind && !new_word
        });
        if c.is_alphanumeric() {
            match words.last_mut().filter(|_| goes_on) {
                Some(word) => word.extend(c.to_lowercase()),
                None => words.push(c.to_lowercase().collect()),
            }
        }
        before = Some(c);
    }
    words
}

/// Whether a name contains one of these words, or a word that starts or ends with one.
pub(super) fn has_word(name: &str, wanted: &[&str]) -> bool {
    let has = |word: &String| {
        let long = wanted.iter().filter(|w| w.len() > 4);
        wanted.contains(&word.as_str()) || long.into_iter().any(|w| word.contains(w))
    };
    words(name).iter().any(has)
}

/// Whether a name says that it is no position of a joint.
pub(super) fn is_no_position(name: &str) -> bool {
    let is_other = |word: &String| {
        let word = word.as_str();
        OTHER.contains(&word) || VELOCITY.contains(&word)
    };
    words(name).iter().any(is_other)
}

/// The distinctive words of a joint, without those that any joint may have.
pub(super) fn own_words(name: &str) -> Vec<String> {
    const COMMON: [&str; 9] = [
        "joint", "link", "jnt", "state", "states", "sensor", "encoder", "actual", "measured",
    ];
    const TELESCOPE: [&str; 5] = ["telescope", "telescopic", "tele", "extend", "extender"];
    let mut own = words(name);
    own.retain(|word| !COMMON.contains(&word.as_str()));
    for word in &mut own {
        if TELESCOPE.contains(&word.as_str()) {
            *word = "extension".into();
        }
    }
    own.sort();
    own
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_split_into_words() {
        assert_eq!(words("frontWheel_2"), ["front", "wheel", "2"]);
        assert_eq!(words("/arm/BOOM-lift"), ["arm", "boom", "lift"]);
        assert!(has_word("leftwheel", &["wheel"]) && has_word("wheel_fl", &["wheel"]));
        assert!(has_word("tire", &["tire"]) && !has_word("entire", &["tire"]));
        assert_eq!(own_words("boom_joint"), own_words("Boom"));
        assert_eq!(own_words("BoomTelescope"), own_words("boom_extension"));
        assert!(words("").is_empty() && words("//__").is_empty());
    }
}
