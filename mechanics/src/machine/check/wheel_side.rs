//! The side and the end of the machine that the name of a wheel states.

/// The side that a name states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

/// The end that a name states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Front,
    Rear,
}

/// Side and end of the machine that a wheel's name states; `None` where the name says nothing, or may mean something else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NamedPlace {
    pub(super) side: Option<Side>,
    pub(super) end: Option<End>,
}

/// Common names of two letters. `rl` is the rear left wheel and `lr` the left rear one: no order of the
/// letters is needed.
const PAIRS: [(&str, Side, Option<End>); 14] = [
    ("fl", Side::Left, Some(End::Front)),
    ("lf", Side::Left, Some(End::Front)),
    ("fr", Side::Right, Some(End::Front)),
    ("rf", Side::Right, Some(End::Front)),
    ("rl", Side::Left, Some(End::Rear)),
    ("lr", Side::Left, Some(End::Rear)),
    ("bl", Side::Left, Some(End::Rear)),
    ("lb", Side::Left, Some(End::Rear)),
    ("rr", Side::Right, Some(End::Rear)),
    ("br", Side::Right, Some(End::Rear)),
    ("rb", Side::Right, Some(End::Rear)),
    ("ml", Side::Left, None),
    ("mr", Side::Right, None),
    ("rm", Side::Right, None),
];

/// Reads the name of a wheel; `names` are those of all wheels.
pub(super) fn place_in_name(name: &str, names: &[&str]) -> NamedPlace {
    let name = name.to_lowercase();
    let words: Vec<&str> = name
        .split(|c: char| !c.is_ascii_alphabetic())
        .filter(|word| !word.is_empty())
        .collect();
    let pair = words
        .iter()
        .find_map(|word| PAIRS.iter().find(|(pair, ..)| pair == word));
    let written = |front: &str| words.iter().any(|word| word.contains(front));
    let side = match (written("left"), written("right")) {
        (true, false) => Some(Side::Left),
        (false, true) => Some(Side::Right),
        (true, true) => None,
        (false, false) => pair
            .map(|(_, side, _)| *side)
            .or_else(|| numbered(&name, names)),
    };
    let is_rear = written("rear") || written("back") || written("hind");
    let end = match (written("front"), is_rear) {
        (true, false) => Some(End::Front),
        (false, true) => Some(End::Rear),
        (true, true) => None,
        (false, false) => pair.and_then(|(_, _, end)| *end),
    };
    NamedPlace { side, end }
}

/// The side in names such as L1 and R1. R1 alone may be a rear wheel: both letters must occur.
fn numbered(name: &str, names: &[&str]) -> Option<Side> {
    let letter = |name: &str| {
        let (letter, number) = name.split_at_checked(1)?;
        let is_number = !number.is_empty() && number.chars().all(|c| c.is_ascii_digit());
        is_number.then(|| letter.to_ascii_lowercase())
    };
    let occurs = |wanted: &str| names.iter().any(|n| letter(n).as_deref() == Some(wanted));
    if !(occurs("l") && occurs("r")) || occurs("f") {
        return None;
    }
    match letter(name)?.as_str() {
        "l" => Some(Side::Left),
        "r" => Some(Side::Right),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_state_side_and_end() {
        let side = |name: &str| place_in_name(name, &[name]).side;
        for left in ["FL", "rl", "wheel_left_2", "FrontLeft", "lr", "caster-left"] {
            assert_eq!(side(left), Some(Side::Left), "{left}");
        }
        for right in ["FR", "rr", "right", "wheel_rear_right", "mr"] {
            assert_eq!(side(right), Some(Side::Right), "{right}");
        }
        for unknown in ["w1", "R1", "a", "", "leftright", "frame", "ü1"] {
            assert_eq!(side(unknown), None, "{unknown}");
        }
        let numbered = place_in_name("R1", &["L1", "R1", "L2", "R2"]);
        assert_eq!(numbered.side, Some(Side::Right));
        assert_eq!(place_in_name("R1", &["F1", "R1", "R2"]).side, None);
        let end = |name: &str| place_in_name(name, &[name]).end;
        assert_eq!(end("fl"), Some(End::Front));
        assert_eq!(end("wheel_left_back"), Some(End::Rear));
        assert_eq!(end("ml"), None);
    }
}
