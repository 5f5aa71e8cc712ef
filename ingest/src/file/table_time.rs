//! The column of time: its name, its unit, its values.

use jiff::{Timestamp, civil::DateTime, tz::TimeZone};

/// Separators of tables in text.
const SEPARATORS: [u8; 3] = [b',', b';', b'\t'];
/// Names of columns of time, without a unit.
const NAMES: [&str; 9] = [
    "t",
    "time",
    "timestamp",
    "stamp",
    "datetime",
    "date_time",
    "elapsed",
    "utc",
    "zeit",
];
/// Far above any header.
const MOST_HEADER_BYTES: usize = 4096;

/// The unit of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Decimal numbers of 10 to this power of nanoseconds.
    PowerOfTen(u32),
    /// Date and time of day by ISO 8601.
    Text,
}

/// What a name says: whether it is that of a time, and of which unit.
pub(crate) fn unit_in_name(name: &str) -> Option<Unit> {
    let name = name.trim().to_lowercase();
    let is_end = |c: char| matches!(c, ']' | ')' | '_' | ' ');
    let open = |c: char| matches!(c, '[' | '(' | '_' | ' ' | '/');
    let bare = name.trim_end_matches(is_end);
    let (base, unit) = match bare.rsplit_once(open) {
        Some((base, unit)) if unit_of(unit).is_some() => {
            (base.trim_end_matches(open), unit_of(unit))
        }
        _ => (bare, Some(Unit::Text)),
    };
    NAMES.contains(&base).then_some(unit)?
}

fn unit_of(text: &str) -> Option<Unit> {
    Some(Unit::PowerOfTen(match text {
        "s" | "sec" | "secs" | "second" | "seconds" => 9,
        "ms" | "msec" | "millisecond" | "milliseconds" => 6,
        "us" | "µs" | "usec" | "microsecond" | "microseconds" => 3,
        "ns" | "nsec" | "nanosecond" | "nanoseconds" => 0,
        _ => return None,
    }))
}

/// The separator and the cells of a header; `None` if no cell names a time.
pub(crate) fn header(line: &str) -> Option<u8> {
    SEPARATORS.into_iter().find(|&separator| {
        let cells: Vec<&str> = line.split(char::from(separator)).collect();
        cells.len() > 1
            && cells
                .iter()
                .any(|cell| unit_in_name(unquoted(cell)).is_some())
    })
}

fn unquoted(cell: &str) -> &str {
    cell.trim().trim_matches('"')
}

/// The separator in the first line of a table, comments aside.
pub(crate) fn separator(beginning: &[u8]) -> Option<u8> {
    let beginning = beginning.strip_prefix(b"\xef\xbb\xbf").unwrap_or(beginning);
    let lines = beginning.split(|&byte| byte == b'\n');
    let mut lines = lines.filter(|line| !line.trim_ascii().is_empty() && !line.starts_with(b"#"));
    let line = lines.next()?;
    let text = std::str::from_utf8(line.get(..line.len().min(MOST_HEADER_BYTES))?).ok()?;
    header(text.trim())
}

/// Whether the beginning of a file is that of a table with a column of time.
pub(crate) fn is_csv(beginning: &[u8]) -> bool {
    separator(beginning).is_some()
}

/// A time in nanoseconds.
pub(crate) fn parse(text: &str, unit: Unit) -> Option<i64> {
    let text = text.trim();
    match unit {
        Unit::PowerOfTen(power) => decimal_ns(text, power).or_else(|| float_ns(text, power)),
        Unit::Text => {
            let with_zone = || text.parse::<Timestamp>().ok();
            let in_utc = || {
                let civil: DateTime = text.parse().ok()?;
                Some(civil.to_zoned(TimeZone::UTC).ok()?.timestamp())
            };
            let stamp = with_zone().or_else(in_utc)?;
            i64::try_from(stamp.as_nanosecond()).ok()
        }
    }
}

/// Whether a date has no time zone.
pub(crate) fn lacks_zone(text: &str) -> bool {
    text.trim().parse::<Timestamp>().is_err()
}

/// A decimal number times 10 to `power`, exactly.
fn decimal_ns(text: &str, power: u32) -> Option<i64> {
    let (is_negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !are_digits(whole) || !are_digits(fraction) {
        return None;
    }
    let mut number = whole.parse::<i64>().ok()?.checked_mul(10_i64.pow(power))?;
    let mut unit = 10_i64.pow(power);
    for digit in fraction.bytes() {
        unit /= 10;
        number = number.checked_add(i64::from(digit - b'0') * unit)?;
    }
    Some(if is_negative { -number } else { number })
}

fn float_ns(text: &str, power: u32) -> Option<i64> {
    from_float(text.parse().ok()?, power)
}

/// A number times 10 to `power`.
pub(crate) fn from_float(number: f64, power: u32) -> Option<i64> {
    let nanos = number * 10_f64.powi(power as i32);
    (nanos.is_finite() && nanos.abs() < 9.2e18).then_some(nanos.round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_state_the_unit() {
        let cases = [
            ("time_s", Some(Unit::PowerOfTen(9))),
            ("Time [ms]", Some(Unit::PowerOfTen(6))),
            ("timestamp(us)", Some(Unit::PowerOfTen(3))),
            ("t_ns", Some(Unit::PowerOfTen(0))),
            ("t/s", Some(Unit::PowerOfTen(9))),
            ("timestamp", Some(Unit::Text)),
            ("boom_angle", None),
            ("lift_time_s", None),
        ];
        for (name, expected) in cases {
            assert_eq!(unit_in_name(name), expected, "{name}");
        }
        assert!(is_csv(b"\xef\xbb\xbf# made by hand\n\"Time [s]\";angle\n"));
        assert!(!is_csv(b"time flies\n") && !is_csv(b"angle,load\n1,2\n") && !is_csv(b"\xff,\n"));
    }

    #[test]
    fn val_times_are_exact() {
        assert_eq!(
            parse("1700000000.123456789", Unit::PowerOfTen(9)),
            Some(1_700_000_000_123_456_789)
        );
        assert_eq!(parse("-1.5", Unit::PowerOfTen(6)), Some(-1_500_000));
        assert_eq!(parse("1e3", Unit::PowerOfTen(0)), Some(1000));
        let expected = Some(1_700_000_000_500_000_000);
        assert_eq!(parse("2023-11-14T22:13:20.5Z", Unit::Text), expected);
        assert_eq!(parse("2023-11-14 23:13:20.5+01:00", Unit::Text), expected);
        assert_eq!(parse("2023-11-14 22:13:20.5", Unit::Text), expected);
        for wrong in ["", "nan", "yesterday", "99999999999999999999"] {
            assert_eq!(parse(wrong, Unit::PowerOfTen(9)), None, "{wrong}");
        }
    }
}
