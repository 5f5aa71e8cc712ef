//! Numbers in cells.

use std::borrow::Cow;

/// The minus of typography, which programs write in some languages.
const MINUS: char = '\u{2212}';

/// The number in a cell; `None` for anything else.
pub(crate) fn number(cell: &str, has_decimal_comma: bool) -> Option<f64> {
    let cell = cell.trim();
    let number: f64 = match with_point(cell, has_decimal_comma).parse() {
        Ok(number) => number,
        Err(_) => {
            let rest = cell.strip_prefix(MINUS)?;
            with_point(&format!("-{rest}"), has_decimal_comma)
                .parse()
                .ok()?
        }
    };
    number.is_finite().then_some(number)
}

/// The number of a cell and the unit behind it: `12.3 deg`, `45°`. Digits of hexadecimal numbers and exponents are no units.
pub(crate) fn with_unit(cell: &str, has_decimal_comma: bool) -> Option<(f64, &str)> {
    const MOST_CHARACTERS: usize = 12;
    let is_mark = |c: char| matches!(c, '°' | '%' | '/' | '²' | '³' | '^' | '·' | '2' | '3');
    let is_of_unit = |c: char| c.is_alphabetic() || is_mark(c);
    let is_first = |c: char| c.is_alphabetic() || matches!(c, '°' | '%');
    let cell = cell.trim();
    let (before, unit) = match cell.rsplit_once([' ', '\u{a0}', '\u{202f}']) {
        Some(parts) => parts,
        None => {
            let (before, unit) = cell.split_at(cell.find(is_first)?);
            let is_of_number = |c: char| c.is_ascii_hexdigit() || matches!(c, 'x' | 'X');
            if unit.chars().all(is_of_number) {
                return None;
            }
            (before, unit)
        }
    };
    let is_unit = unit.starts_with(is_first)
        && unit.chars().all(is_of_unit)
        && unit.chars().count() <= MOST_CHARACTERS;
    // the mark of such a number may stand between groups of digits, which no other cell tells
    let is_unclear =
        grouped_once(before).is_some_and(|(_, mark)| has_decimal_comma || mark == Mark::Comma);
    let found = number(before, has_decimal_comma).filter(|_| is_unit && !is_unclear);
    found.map(|number| (number, unit))
}

/// A number with a point where a comma may stand for it, and without marks between groups of three digits where they can be
/// nothing else: a mark beside the decimal one, several marks, an apostrophe or a narrow blank.
pub(super) fn with_point(text: &str, has_decimal_comma: bool) -> Cow<'_, str> {
    // of two marks the last one is the decimal one
    let is_comma = has_decimal_comma && text.rfind('.') < text.rfind(',').or(Some(text.len()));
    let decimal = if is_comma { ',' } else { '.' };
    if let Some(plain) = without_groups(text, decimal) {
        return plain.replace(',', ".").into();
    }
    match has_decimal_comma && text.contains(',') && !text.contains('.') {
        true => text.replace(',', ".").into(),
        false => text.into(),
    }
}

/// Decimal mark, or separator between groups of digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Point,
    Comma,
}

impl Mark {
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Point => Self::Comma,
            Self::Comma => Self::Point,
        }
    }

    fn symbol(self) -> char {
        match self {
            Self::Point => '.',
            Self::Comma => ',',
        }
    }
}

/// The whole number of a cell like `1.002` or `1,002`, if its mark stands between groups of digits. Only other cells can tell.
pub(crate) fn grouped_once(cell: &str) -> Option<(f64, Mark)> {
    [Mark::Point, Mark::Comma].into_iter().find_map(|mark| {
        let (first, second) = cell.trim().split_once(mark.symbol())?;
        let digits = || format!("{first}{second}").replace(MINUS, "-");
        let whole = is_grouped(first, &[second]).then(|| digits().parse());
        Some((whole?.ok()?, mark))
    })
}

/// The mark before the decimals of a number; `None` without one, and where it may stand between groups of digits.
pub(crate) fn decimal_mark(number: &str) -> Option<Mark> {
    let number = number.trim();
    let at = number.rfind(['.', ','])?;
    let mark = match &number[at..=at] {
        "." => Mark::Point,
        _ => Mark::Comma,
    };
    let is_single = number.matches(mark.symbol()).count() == 1;
    (is_single && grouped_once(number).is_none()).then_some(mark)
}

/// The number without the marks between its groups of digits; `None` if it has none, or one that may be a decimal mark.
fn without_groups(text: &str, decimal: char) -> Option<String> {
    let is_mark = |c: char| {
        c != decimal && matches!(c, '.' | ',' | '\'' | '\u{2019}' | '\u{a0}' | '\u{202f}')
    };
    let mark = text.chars().find(|c| is_mark(*c))?;
    let (whole, rest) = match text.find(decimal) {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    let mut groups = whole.split(mark);
    let first = groups.next().unwrap_or_default();
    let following: Vec<&str> = groups.collect();
    let may_be_decimal = matches!(mark, '.' | ',') && rest.is_empty() && following.len() == 1;
    let is_plain = is_grouped(first, &following) && !may_be_decimal && !rest.contains(mark);
    is_plain.then(|| whole.replace(mark, "") + rest)
}

/// Whether the digits are grouped: groups of three digits behind one of one to three that does not begin with zero.
fn is_grouped(first: &str, following: &[&str]) -> bool {
    let is_group = |group: &str, least: usize| {
        (least..=3).contains(&group.len()) && group.bytes().all(|byte| byte.is_ascii_digit())
    };
    let first = first.trim_start_matches(['+', '-', MINUS]);
    let is_first = is_group(first, 1) && !first.starts_with('0');
    is_first && !following.is_empty() && following.iter().all(|group| is_group(group, 3))
}

#[cfg(test)]
mod tests {
    use super::{Mark, decimal_mark, number, with_unit};

    #[test]
    fn a_unit_may_stand_behind_a_number() {
        for (cell, found) in [
            ("12.3 deg", Some((12.3, "deg"))),
            ("-0.4 m/s", Some((-0.4, "m/s"))),
            ("9.81 m/s^2", Some((9.81, "m/s^2"))),
            ("1.5e-3 rad", Some((1.5e-3, "rad"))),
            ("45°", Some((45.0, "°"))),
            ("10deg", Some((10.0, "deg"))),
            ("80 %", Some((80.0, "%"))),
            ("0x1F", None),
            ("1F", None),
            ("1.5e-3m", None),
            ("5 of 10", None),
            ("12-Mar", None),
            ("1.2.3", None),
            ("1,002 kg", None),
            ("deg", None),
            ("12 ", None),
        ] {
            assert_eq!(with_unit(cell, false), found, "{cell}");
        }
        assert_eq!(with_unit("1,5 deg", true), Some((1.5, "deg")));
        assert_eq!(with_unit("1.002 kg", true), None);
    }

    #[test]
    fn a_mark_that_may_stand_between_groups_of_digits_tells_nothing_of_decimals() {
        for (text, mark) in [
            ("0.125", Some(Mark::Point)),
            ("-1.294417", Some(Mark::Point)),
            ("1,5", Some(Mark::Comma)),
            ("1.556,949", Some(Mark::Comma)),
            ("1,556.949", Some(Mark::Point)),
            ("1.250", None),
            ("2,942", None),
            ("1,234,567", None),
            ("998", None),
        ] {
            assert_eq!(decimal_mark(text), mark, "{text}");
        }
    }

    #[test]
    fn groups_of_digits_are_read_where_they_can_be_nothing_else() {
        for (text, has_decimal_comma, value) in [
            ("1.556,949", true, Some(1556.949)),
            ("-1,556.949", false, Some(-1556.949)),
            ("-1,556.949", true, Some(-1556.949)),
            ("\u{2212}1,5", true, Some(-1.5)),
            ("\u{2212}1.556,949", true, Some(-1556.949)),
            ("\u{2212}", true, None),
            ("1'556.5", false, Some(1556.5)),
            ("1\u{a0}556,5", true, Some(1556.5)),
            ("12.345.678", true, Some(12_345_678.0)),
            ("1,234,567", false, Some(1_234_567.0)),
            // may be a decimal mark
            ("1.002", true, Some(1.002)),
            ("1,002", false, None),
            ("1,5.2", false, None),
            ("0,998.1", false, None),
            ("1,5", true, Some(1.5)),
        ] {
            assert_eq!(number(text, has_decimal_comma), value, "{text}");
        }
    }
}
