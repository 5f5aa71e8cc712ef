//! Answers at the terminal: their types, and how they are read.

use tipwatch_datasheet::{Angle, Length, Mass, Stiffness, parts, refusal};

/// Type of an answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// As many numbers as units.
    Numbers {
        units: &'static [Unit],
        range: Range,
        /// Expected answer, for the message on a wrong one.
        expected: &'static str,
    },
    /// A position of a joint, or the name of one of these signals with its table.
    Position {
        slides: bool,
        signals: Vec<(String, String)>,
    },
    /// Some of these names, or "all".
    Names(Vec<String>),
}

/// Quantity of a number; each has the unit of a plain number that the data sheet's dialogue has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Mass,
    Length,
    Angle,
    Stiffness,
    Percent,
    Plain,
}

/// Range of possible numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Range {
    Any,
    Positive,
    NotNegative,
    /// 0 to 1.
    Share,
}

/// An answer, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    Numbers(Vec<f64>),
    /// The table of a signal.
    Signal(String),
    Names(Vec<String>),
}

impl Kind {
    /// Reads an answer; an empty one is `None`.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub(super) fn read(&self, text: &str) -> Result<Option<Answer>, String> {
        if text.is_empty() {
            return Ok(None);
        }
        let (answer, expected) = match self {
            Self::Numbers {
                units,
                range,
                expected,
            } => {
                let numbers = numbers(text, units).filter(|all| all.iter().all(|&n| range.has(n)));
                (numbers.map(Answer::Numbers), (*expected).to_owned())
            }
            Self::Position { slides, signals } => position(text, *slides, signals),
            Self::Names(names) => (
                some_of(text, names).map(Answer::Names),
                format!("names out of {}, \"all\" or \"none\"", names.join(", ")),
            ),
        };
        answer.map(Some).ok_or_else(|| refusal(&expected, text))
    }
}

fn numbers(text: &str, units: &[Unit]) -> Option<Vec<f64>> {
    let parts: Vec<&str> = parts(text).collect();
    let numbers = parts.iter().zip(units).map(|(part, unit)| unit.read(part));
    let numbers: Option<Vec<f64>> = numbers.collect();
    numbers.filter(|_| parts.len() == units.len())
}

fn position(text: &str, slides: bool, signals: &[(String, String)]) -> (Option<Answer>, String) {
    let unit = if slides { Unit::Length } else { Unit::Angle };
    let signal = signals.iter().find(|(name, _)| name == text);
    let answer = match signal {
        Some((_, table)) => Some(Answer::Signal(table.clone())),
        None => unit.read(text).map(|number| Answer::Numbers(vec![number])),
    };
    let number = if slides { "a length" } else { "an angle" };
    let names: Vec<&str> = signals.iter().map(|(name, _)| name.as_str()).collect();
    let expected = match names.is_empty() {
        true => number.to_owned(),
        false => format!("{number}, or one of the signals {}", names.join(", ")),
    };
    (answer, expected)
}

fn some_of(text: &str, names: &[String]) -> Option<Vec<String>> {
    match text {
        "all" => return Some(names.to_vec()),
        "none" => return Some(Vec::new()),
        _ => {}
    }
    let chosen: Vec<String> = parts(text).map(str::to_owned).collect();
    chosen
        .iter()
        .all(|name| names.contains(name))
        .then_some(chosen)
}

impl Unit {
    fn read(self, text: &str) -> Option<f64> {
        let plain = |text: &str| {
            let number = text.parse::<f64>().ok();
            number.filter(|number| number.is_finite())
        };
        match self {
            Self::Mass => Mass::parse(text).map(|it| it.si),
            Self::Length => Length::parse(text).map(|it| it.si),
            Self::Angle => Angle::parse(text).map(|it| it.si),
            Self::Stiffness => Stiffness::parse(text).map(|it| it.si),
            Self::Percent => plain(text.trim_end_matches('%').trim_end()).map(|it| it / 100.0),
            Self::Plain => plain(text),
        }
    }
}

impl Range {
    fn has(self, number: f64) -> bool {
        match self {
            Self::Any => true,
            Self::Positive => number > 0.0,
            Self::NotNegative => number >= 0.0,
            Self::Share => (0.0..=1.0).contains(&number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: Kind = Kind::Numbers {
        units: &[Unit::Length; 3],
        range: Range::Any,
        expected: "three lengths",
    };

    #[test]
    fn answers_have_units() {
        let read = PLACE.read("100 mm, 0, -5 cm").unwrap();
        assert_eq!(read, Some(Answer::Numbers(vec![0.1, 0.0, -0.05])));
        let tilt = Kind::Position {
            slides: false,
            signals: vec![("Angle".into(), "{ pgn = 1 }".into())],
        };
        let radians = 30.0 * std::f64::consts::PI / 180.0;
        assert_eq!(
            tilt.read("30").unwrap(),
            Some(Answer::Numbers(vec![radians]))
        );
        assert_eq!(
            tilt.read("0.5 rad").unwrap(),
            Some(Answer::Numbers(vec![0.5]))
        );
        assert_eq!(
            tilt.read("Angle").unwrap(),
            Some(Answer::Signal("{ pgn = 1 }".into()))
        );
    }

    #[test]
    fn wrong_answers_are_refused_and_empty_ones_are_none() {
        assert_eq!(PLACE.read(""), Ok(None));
        for wrong in ["1, 2", "1, 2, 3, 4", "a, b, c", "1, 2, 3 kg", "nan, 0, 0"] {
            assert!(PLACE.read(wrong).is_err(), "{wrong}");
        }
        let share = Kind::Numbers {
            units: &[Unit::Plain],
            range: Range::Share,
            expected: "0 to 1",
        };
        assert!(share.read("1.2").is_err());
        let names = Kind::Names(vec!["a".into(), "b".into()]);
        assert!(names.read("a, c").is_err());
        let all = names.read("all").unwrap();
        assert_eq!(all, Some(Answer::Names(vec!["a".into(), "b".into()])));
    }
}
