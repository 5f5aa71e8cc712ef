//! Names of a machine's supports: the one place that chooses the words, by the kind of support.

use std::borrow::Cow;

use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::machine::{Machine, SupportKind, Wheel};

use super::event::EventKind;
use crate::base::number::readable;

/// The word for a support.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SupportWord {
    /// Word for one support, within a sentence.
    pub(crate) one: &'static str,
    /// Word for several supports, within a sentence.
    pub(crate) many: &'static str,
    /// Word for one support, at the start of a sentence or as a head.
    pub(crate) head: &'static str,
    /// Word for several supports, at the start of a sentence or as a head.
    pub(crate) heads: &'static str,
}

const WHEEL: SupportWord = SupportWord {
    one: message!("wheel"),
    many: message!("wheels"),
    head: message!("Wheel"),
    heads: message!("Wheels"),
};
/// An outrigger, a blade or a fork: the machine file does not say which.
const SUPPORT: SupportWord = SupportWord {
    one: message!("support"),
    many: message!("supports"),
    head: message!("Support"),
    heads: message!("Supports"),
};
const TRACK_POINT: SupportWord = SupportWord {
    one: message!("track point"),
    many: message!("track points"),
    head: message!("Track point"),
    heads: message!("Track points"),
};

impl SupportWord {
    /// Word for the supports of any machine of a fleet.
    pub(crate) const OF_ANY_MACHINE: Self = Self {
        one: message!("wheel or support"),
        many: message!("wheels or supports"),
        head: message!("Wheel or support"),
        heads: message!("Wheels or supports"),
    };

    /// Names a kind of event of these supports: "wheel lift", "support light", "edge tipping".
    pub(crate) fn event(self, kind: EventKind) -> String {
        match kind {
            EventKind::WheelLight => say!("{} light", told(self.one)),
            EventKind::WheelLift => say!("{} lift", told(self.one)),
            EventKind::LiftNotExcluded
            | EventKind::EdgeTipping
            | EventKind::TipOver
            | EventKind::InputGap
            | EventKind::InputFault => readable(kind.name()),
        }
    }

    pub(crate) fn of_kind(kind: SupportKind) -> Self {
        match kind {
            SupportKind::Wheel => WHEEL,
            SupportKind::Foot => SUPPORT,
            SupportKind::TrackPoint => TRACK_POINT,
        }
        .said()
    }

    /// Translates the words to the language of the process.
    fn said(self) -> Self {
        Self {
            one: told(self.one),
            many: told(self.many),
            head: told(self.head),
            heads: told(self.heads),
        }
    }

    /// The word for all of some supports: that of their kind, or one that fits every kind.
    pub(crate) fn of_all(kinds: impl IntoIterator<Item = SupportKind>) -> Self {
        let mut words = kinds.into_iter().map(Self::of_kind);
        let first = words.next().unwrap_or(WHEEL.said());
        if words.all(|word| word == first) {
            first
        } else {
            SUPPORT.said()
        }
    }

    /// The word for any support of a machine.
    pub(crate) fn of(machine: &Machine) -> Self {
        Self::of_all(machine.wheels().iter().map(|wheel| wheel.kind))
    }

    /// A support with its name: "wheel FL", "support ORR".
    pub(crate) fn named(wheel: &Wheel) -> String {
        format!("{} {}", Self::of_kind(wheel.kind).one, wheel.name)
    }

    /// Names a support at the start of a sentence or as a head: "Wheel FL".
    pub(crate) fn headed(wheel: &Wheel) -> String {
        format!("{} {}", Self::of_kind(wheel.kind).head, wheel.name)
    }

    /// Whether the word stands for wheels alone, which have tyres.
    pub(crate) fn is_wheel(self) -> bool {
        self == WHEEL.said()
    }
}

/// A support by its name in tables, which is in lower case: "FL", "caster_left". Short names are initials.
pub(crate) fn support_word(name: &str) -> String {
    match name.len() {
        0..=3 => name.to_uppercase(),
        _ => name.to_owned(),
    }
}

/// The name of an edge, in lower case, as a reader sees it: that from one support to the next by both of them. An edge is named by
/// its side or by its two supports, and by nothing else.
pub(crate) fn edge_word(name: &str) -> Cow<'_, str> {
    let word = match name {
        "front" => word!("front"),
        "rear" => word!("rear"),
        "left" => word!("left"),
        "right" => word!("right"),
        name => {
            return match name.split_once('_') {
                Some((from, to)) if !to.contains('_') => {
                    format!("{}–{}", support_word(from), support_word(to)).into()
                }
                _ => name.into(),
            };
        }
    };
    word.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_named_by_its_supports() {
        assert_eq!(edge_word("left"), "left");
        assert_eq!(edge_word("fl_rl"), "FL–RL");
        assert_eq!(edge_word("caster_left_fl"), "caster_left_fl");
    }

    #[test]
    fn an_event_is_called_after_what_it_happens_to() {
        for kind in EventKind::ALL {
            assert_eq!(WHEEL.event(kind), readable(kind.name()));
            let of_a_support = SUPPORT.event(kind);
            assert!(
                !of_a_support.contains("wheel") && !of_a_support.contains('_'),
                "{of_a_support}"
            );
        }
        assert_eq!(SUPPORT.event(EventKind::WheelLift), "support lift");
    }

    #[test]
    fn short_names_of_supports_are_initials() {
        assert_eq!(["fl", "orr"].map(support_word), ["FL", "ORR"]);
        assert_eq!(support_word("caster_left"), "caster_left");
    }

    #[test]
    fn the_word_fits_every_support_that_it_stands_for() {
        use SupportKind::{Foot, TrackPoint, Wheel};
        assert_eq!(SupportWord::of_all([Wheel, Wheel]), WHEEL);
        assert_eq!(SupportWord::of_all([Foot, Foot]), SUPPORT);
        assert_eq!(SupportWord::of_all([TrackPoint]), TRACK_POINT);
        assert_eq!(SupportWord::of_all([Wheel, Foot]), SUPPORT);
    }
}
