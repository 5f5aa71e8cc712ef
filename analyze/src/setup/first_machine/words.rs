//! Splits names into words.

/// Words for the rate of a position.
pub(super) const VELOCITY: [&str; 4] = ["velocity", "vel", "rate", "speed"];
/// Words that exclude a joint position.
pub(super) const OTHER: [&str; 19] = [
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
    "cmd",
    "demand",
    "desired",
    "request",
    "requested",
    "joystick",
    "lever",
    "pedal",
    "valve",
];

/// Words for supports of a machine besides its wheels.
pub(super) const SUPPORT: [&str; 9] = [
    "outrigger",
    "stabiliser",
    "stabilizer",
    "jack",
    "leg",
    "foot",
    "blade",
    "spade",
    "support",
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

/// The distinctive words of a joint, without those that any joint may have, in the singular and in one spelling.
pub(super) fn own_words(name: &str) -> Vec<String> {
    const COMMON: [&str; 10] = [
        "joint", "link", "jnt", "state", "states", "status", "sensor", "encoder", "actual",
        "measured",
    ];
    const SPELLINGS: [(&str, &[&str]); 4] = [
        (
            "extension",
            &[
                "telescope",
                "telescopic",
                "telescoping",
                "tele",
                "extend",
                "extender",
            ],
        ),
        ("steer", &["steering", "steered"]),
        ("slew", &["slewing", "swing"]),
        ("stick", &["dipper"]),
    ];
    let mut own = words(name);
    own.retain(|word| !COMMON.contains(&word.as_str()));
    for word in &mut own {
        singular(word);
        let known = SPELLINGS
            .iter()
            .find(|(_, all)| all.contains(&word.as_str()));
        if let Some((one, _)) = known {
            *word = (*one).into();
        }
    }
    own.sort();
    own
}

/// Takes the s of a plural away: forks and fork are the same part.
fn singular(word: &mut String) {
    let is_plural = word.len() > 3 && word.ends_with('s');
    if is_plural && !["ss", "us", "is"].iter().any(|end| word.ends_with(end)) {
        word.pop();
    }
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
        assert_eq!(own_words("forks"), own_words("Fork"));
        assert_eq!(own_words("Steering_FL"), own_words("steer_fl"));
        assert_ne!(own_words("chassis"), own_words("chassi"));
        assert!(words("").is_empty() && words("//__").is_empty());
    }
}
