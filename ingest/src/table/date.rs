//! Dates and times of day as text: ISO 8601 and the forms that loggers and spreadsheets write.

use jiff::{
    Timestamp,
    civil::DateTime,
    tz::{Offset, TimeZone},
};

use super::options::DateOrder;

/// Most hours of a time since a beginning, without a date: more are no time.
const MOST_HOURS: i16 = 99;
/// English names of months, of which the first three letters count.
const MONTHS: [&str; 12] = [
    "jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
];
/// The same of German names where they differ.
const GERMAN_MONTHS: [(&str, i8); 6] = [
    ("jän", 1),
    ("mär", 3),
    ("mrz", 3),
    ("mai", 5),
    ("okt", 10),
    ("dez", 12),
];
const WEEKDAYS: [&str; 14] = [
    "monday",
    "tuesday",
    "wednesday",
    "thursday",
    "friday",
    "saturday",
    "sunday",
    "montag",
    "dienstag",
    "mittwoch",
    "donnerstag",
    "freitag",
    "samstag",
    "sonntag",
];
/// Names of zones that are those of one offset (hours); "CST", "IST" and "BST" are those of several.
const ZONES: [(&str, i32); 17] = [
    ("z", 0),
    ("utc", 0),
    ("gmt", 0),
    ("wet", 0),
    ("west", 1),
    ("cet", 1),
    ("mez", 1),
    ("cest", 2),
    ("mesz", 2),
    ("eet", 2),
    ("eest", 3),
    ("est", -5),
    ("edt", -4),
    ("mst", -7),
    ("mdt", -6),
    ("pst", -8),
    ("pdt", -7),
];

/// A date and time that was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Nanoseconds since 1970; of a time of day without a date, since midnight.
    pub(super) ns: i64,
    pub(super) has_zone: bool,
    pub(super) has_date: bool,
    pub(super) has_time: bool,
}

/// Reads a date, a time of day or both. An order of day and month that the text does not show must be stated.
pub(super) fn parse(text: &str, order: Option<DateOrder>) -> Option<Stamp> {
    let text = text.trim();
    iso(text).or_else(|| other(text, order))
}

/// Whether the order of day and month changes the meaning of a date.
pub(crate) fn is_ambiguous(text: &str) -> bool {
    let read = |order| parse(text, Some(order)).is_some();
    parse(text, None).is_none() && (read(DateOrder::Dmy) || read(DateOrder::Mdy))
}

fn iso(text: &str) -> Option<Stamp> {
    // digits alone are a number, not the date that ISO 8601 would make of eight of them
    if text.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let with_zone = text.parse::<Timestamp>().ok();
    let in_utc = || {
        let civil: DateTime = text.parse().ok()?;
        Some(civil.to_zoned(TimeZone::UTC).ok()?.timestamp())
    };
    let stamp = with_zone.or_else(in_utc)?;
    Some(Stamp {
        ns: i64::try_from(stamp.as_nanosecond()).ok()?,
        has_zone: with_zone.is_some(),
        has_date: true,
        has_time: text.contains([':', 'T', 't', ' ']),
    })
}

/// Hour, minute, second and nanosecond.
type TimeOfDay = (i16, i8, i8, i32);

fn other(text: &str, order: Option<DateOrder>) -> Option<Stamp> {
    let (mut date, mut time, mut offset_s, mut is_afternoon) = (Vec::new(), None, None, None);
    let joint = |c: char| c.is_whitespace() || c == ',';
    // a comma before digits is that of a decimal number
    let text = text.replace(", ", " ");
    let words = text.split_whitespace().enumerate();
    for (place, word) in words.filter(|(place, word)| *place > 0 || !is_weekday(word)) {
        let word = word.trim_matches(joint);
        let is_year = place > 0 && word.len() == 4 && word.bytes().all(|c| c.is_ascii_digit());
        match word.to_ascii_lowercase().as_str() {
            "am" | "pm" if time.is_some() => is_afternoon = Some(word.starts_with(['p', 'P'])),
            // as the function ctime of C writes dates: Tue Nov 14 22:13:20 2023
            _ if is_year && time.is_some() && date.len() == 2 => date.push(word.to_owned()),
            _ if word.contains(':') && time.is_none() => {
                let (before, clock) = before_t(word);
                date.extend(before.map(str::to_owned));
                let (clock, zone) = split_zone(clock)?;
                (time, offset_s) = (Some(time_of_day(clock)?), zone);
            }
            name if time.is_some() => offset_s = Some(named_zone_s(name).or_else(|| zone_s(word))?),
            _ => date.push(word.to_owned()),
        }
    }
    let time = match (time, is_afternoon) {
        (Some((1..=12, ..)) | None, _) | (_, None) => time,
        (Some(_), Some(_)) => return None,
    };
    let time = time.map(|(hour, minute, second, nanosecond)| {
        let hour = match is_afternoon {
            None => hour,
            Some(is_afternoon) => hour % 12 + 12 * i16::from(is_afternoon),
        };
        (hour, minute, second, nanosecond)
    });
    let day = match date.is_empty() {
        true => None,
        false => Some(date_of(&date.join(" "), order)?),
    };
    if day.is_none() && time.is_none() {
        return None;
    }
    let (year, month, of_month) = day.unwrap_or((1970, 1, 1));
    let (hour, minute, second, nanosecond) = time.unwrap_or_default();
    // a time since a beginning goes beyond a day
    let days = hour / 24;
    if days > 0 && (day.is_some() || offset_s.is_some()) {
        return None;
    }
    let (hour, of_month) = (
        i8::try_from(hour % 24).ok()?,
        of_month + i8::try_from(days).ok()?,
    );
    let civil = DateTime::new(year, month, of_month, hour, minute, second, nanosecond).ok()?;
    let zone = Offset::from_seconds(offset_s.unwrap_or(0)).ok()?;
    let stamp = zone.to_timestamp(civil).ok()?;
    Some(Stamp {
        ns: i64::try_from(stamp.as_nanosecond()).ok()?,
        has_zone: offset_s.is_some(),
        has_date: day.is_some(),
        has_time: time.is_some(),
    })
}

/// Splits `14.11.2023T22:13:20` at the T.
fn before_t(word: &str) -> (Option<&str>, &str) {
    match word.split_once(['T', 't']) {
        Some((date, clock)) => (Some(date), clock),
        None => (None, word),
    }
}

/// Splits a zone off a time of day, such as `+01:00`; its offset from UTC in seconds.
fn split_zone(clock: &str) -> Option<(&str, Option<i32>)> {
    if let Some(clock) = clock.strip_suffix(['Z', 'z']) {
        return Some((clock, Some(0)));
    }
    match clock.find(['+', '-']) {
        Some(at) => Some((&clock[..at], Some(zone_s(&clock[at..])?))),
        None => Some((clock, None)),
    }
}

/// The offset of a zone with a name (seconds), such as `CET`, `GMT+1` and `UTC+01:00`. The name is in lower case.
fn named_zone_s(name: &str) -> Option<i32> {
    let known = ZONES.iter().find(|(zone, _)| *zone == name);
    if let Some((_, hours)) = known {
        return Some(hours * 3600);
    }
    let offset = name.strip_prefix("utc").or(name.strip_prefix("gmt"))?;
    match offset.as_bytes() {
        [sign, hour] => zone_s(&format!("{}0{}", char::from(*sign), char::from(*hour))),
        _ => zone_s(offset),
    }
}

/// The last word of a date that would be read without it: a zone that is not known.
pub(super) fn unknown_zone(text: &str) -> Option<&str> {
    let (date, zone) = text.trim().rsplit_once(char::is_whitespace)?;
    let is_name = zone.chars().all(char::is_alphabetic) && parse(text, None).is_none();
    (is_name && parse(date, None).is_some_and(|stamp| stamp.has_time)).then_some(zone)
}

/// Whether a word is the day of the week that stands before a date, or its beginning.
fn is_weekday(word: &str) -> bool {
    let word = word.trim_end_matches(['.', ',']).to_ascii_lowercase();
    word.len() > 1 && WEEKDAYS.iter().any(|day| day.starts_with(&word))
}

fn zone_s(text: &str) -> Option<i32> {
    let digits: String = text.get(1..)?.chars().filter(|c| *c != ':').collect();
    if !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let (hours, minutes) = match digits.len() {
        2 => (digits.parse::<i32>().ok()?, 0),
        4 => (digits[..2].parse().ok()?, digits[2..].parse().ok()?),
        _ => return None,
    };
    let seconds = hours * 3600 + minutes * 60;
    match text.chars().next()? {
        '+' => Some(seconds),
        '-' => Some(-seconds),
        _ => None,
    }
}

fn time_of_day(clock: &str) -> Option<TimeOfDay> {
    let parts: Vec<&str> = clock.split(':').collect();
    let (hour, minute, second) = match parts.as_slice() {
        [hour, minute] => (hour, minute, "0"),
        [hour, minute, second] => (hour, minute, *second),
        // milliseconds; two digits would be frames of a video
        [hour, minute, second, fraction] if fraction.len() == 3 => (hour, minute, *second),
        _ => return None,
    };
    let (second, fraction) = match (parts.get(3), second.split_once(['.', ','])) {
        (Some(_), Some(_)) => return None,
        (Some(fraction), None) => (second, *fraction),
        (None, split) => split.unwrap_or((second, "")),
    };
    let mut nanosecond = 0;
    let mut unit = 1_000_000_000;
    for digit in fraction.chars() {
        unit /= 10;
        nanosecond += digit.to_digit(10)? as i32 * unit;
    }
    let digits = |text: &str| {
        let are_digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        are_digits.then(|| text.parse::<i16>().ok()).flatten()
    };
    let of_sixty = |text: &str| digits(text).filter(|number| *number < 60)?.try_into().ok();
    let hour = digits(hour).filter(|hour| *hour <= MOST_HOURS)?;
    Some((hour, of_sixty(minute)?, of_sixty(second)?, nanosecond))
}

/// Year, month and day.
fn date_of(text: &str, order: Option<DateOrder>) -> Option<(i16, i8, i8)> {
    let parts: Vec<&str> = text
        .split(|c: char| matches!(c, '.' | '/' | '-' | ',') || c.is_whitespace())
        .filter(|part| !part.is_empty())
        .collect();
    let parts: [&str; 3] = match parts.as_slice() {
        [digits] if digits.len() == 8 && digits.is_ascii() => {
            [&digits[..4], &digits[4..6], &digits[6..]]
        }
        [a, b, c] => [a, b, c],
        _ => return None,
    };
    let named = parts.iter().position(|part| month_named(part).is_some());
    let is_year = |part: &str| part.len() == 4;
    let has_dots = text.contains('.') && !text.contains(['/', '-']);
    let is_day_only = |part: &str| part.parse::<i8>().is_ok_and(|number| number > 12);
    let order = match (named, order) {
        (Some(0), _) => DateOrder::Mdy,
        (Some(1), _) if is_year(parts[0]) => DateOrder::Ymd,
        (Some(1), _) => DateOrder::Dmy,
        (Some(_), _) => return None,
        (None, _) if is_year(parts[0]) => DateOrder::Ymd,
        (None, _) if has_dots && is_year(parts[2]) => DateOrder::Dmy,
        (None, Some(order)) => order,
        (None, None) if !is_year(parts[2]) => return None,
        (None, None) if is_day_only(parts[0]) || parts[0] == parts[1] => DateOrder::Dmy,
        (None, None) if is_day_only(parts[1]) => DateOrder::Mdy,
        (None, None) => return None,
    };
    let [day, month, year] = match order {
        DateOrder::Dmy => parts,
        DateOrder::Mdy => [parts[1], parts[0], parts[2]],
        DateOrder::Ymd => [parts[2], parts[1], parts[0]],
    };
    let number = |text: &str| {
        let are_digits = text.bytes().all(|byte| byte.is_ascii_digit());
        are_digits.then(|| text.parse::<i16>().ok()).flatten()
    };
    let century = match year.len() {
        2 => 2000,
        4 => 0,
        _ => return None,
    };
    let month = match month_named(month) {
        Some(month) => month,
        None => i8::try_from(number(month)?).ok()?,
    };
    Some((
        century + number(year)?,
        month,
        i8::try_from(number(day)?).ok()?,
    ))
}

fn month_named(text: &str) -> Option<i8> {
    let start: String = text.to_lowercase().chars().take(3).collect();
    if !text.chars().all(char::is_alphabetic) {
        return None;
    }
    let english = MONTHS.iter().zip(1..).map(|(name, month)| (*name, month));
    let found = english
        .chain(GERMAN_MONTHS)
        .find(|(name, _)| *name == start);
    found.map(|(_, month)| month)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED: i64 = 1_700_000_000_500_000_000;

    #[test]
    fn val_every_unambiguous_form_is_the_same_time() {
        for text in [
            "2023-11-14T22:13:20.5Z",
            "2023-11-14 23:13:20.5+01:00",
            "2023-11-14 22:13:20.5",
            "2023-11-14 22:13:20,5",
            "14.11.2023 22:13:20.5",
            "14.11.2023 22:13:20,500",
            "14.11.2023, 22:13:20.5",
            "14/11/2023 22:13:20.5",
            "11/14/2023 10:13:20.5 PM",
            "11/14/2023 22:13:20.5 UTC",
            "14-Nov-2023 22:13:20.500",
            "14 November 2023 22:13:20.5",
            "Nov 14, 2023 22:13:20.5",
            "2023/11/14 22:13:20.5",
            "2023.11.14 22:13:20.5",
            "20231114 22:13:20.5",
            "14.11.2023T22:13:20.5",
            "14.11.2023 23:13:20.5 +0100",
            "2023-11-14 23:13:20.500 CET",
            "2023-11-15 00:13:20.5 CEST",
            "14.11.2023 23:13:20,500 MEZ",
            "2023-11-14 17:13:20.5 EST",
            "2023-11-14 23:13:20.5 UTC+01:00",
            "2023-11-14 21:13:20.5 GMT-1",
            "Tue Nov 14 22:13:20.5 2023",
            "Tue Nov 14 23:13:20.5 CET 2023",
            "Tue, 14 Nov 2023 23:13:20.5 +0100",
            "Di. 14.11.2023 22:13:20,500",
            "Dienstag, 14. November 2023 22:13:20,5",
        ] {
            let stamp = parse(text, None);
            assert_eq!(stamp.map(|stamp| stamp.ns), Some(EXPECTED), "{text}");
            assert!(!is_ambiguous(text), "{text}");
        }
    }

    #[test]
    fn german_months_are_read_and_zones_of_several_places_are_not() {
        for (text, month) in [
            ("1. März 2026 10:00", 3),
            ("1-Mrz-2026 10:00", 3),
            ("1. Mai 2026 10:00", 5),
            ("01-Okt-2026 10:00", 10),
            ("1. Dez 2026 10:00", 12),
        ] {
            let expected = parse(&format!("2026-{month:02}-01 10:00"), None);
            assert!(
                expected.is_some() && parse(text, None) == expected,
                "{text}"
            );
        }
        for zone in ["IST", "CST"] {
            let text = format!("2023-11-14 22:13:20.5 {zone}");
            assert_eq!(parse(&text, None), None, "{text}");
            assert_eq!(unknown_zone(&text), Some(zone));
        }
        assert_eq!(unknown_zone("2023-11-14 22:13:20 CET"), None);
        assert_eq!(unknown_zone("see below"), None);
    }

    #[test]
    fn what_the_text_does_not_show_must_be_stated() {
        for text in ["03/04/2026 10:00:00", "3-4-2026 10:00", "14.11.23 10:00:00"] {
            assert_eq!(parse(text, None), None, "{text}");
            assert!(is_ambiguous(text), "{text}");
        }
        let ns = |order| parse("03/04/2026", Some(order)).unwrap().ns;
        assert_eq!(
            ns(DateOrder::Mdy) - ns(DateOrder::Dmy),
            -30 * 86_400_000_000_000
        );
        assert_eq!(
            parse("14.11.23 22:13:20.5", Some(DateOrder::Dmy))
                .unwrap()
                .ns,
            EXPECTED
        );
        // the order is stated, and the date shows another
        assert_eq!(parse("14/11/2023", Some(DateOrder::Mdy)), None);
    }

    #[test]
    fn times_of_day_count_from_midnight() {
        let stamp = parse("00:00:01.25", None).unwrap();
        assert_eq!((stamp.ns, stamp.has_date), (1_250_000_000, false));
        assert_eq!(parse("00:00:01:250", None).unwrap().ns, 1_250_000_000);
        // of a time since a beginning there are more than 24 hours
        let stamp = parse("26:00:01.25", None).unwrap();
        assert_eq!(stamp.ns, (26 * 3600 + 1) * 1_000_000_000 + 250_000_000);
        let stamp = parse("14.11.2023", None).unwrap();
        assert!(stamp.has_date && !stamp.has_time);
    }

    #[test]
    fn other_texts_are_no_dates() {
        for text in [
            "",
            ":",
            "::",
            "14.11.2023 25:00:00",
            "25:00:00Z",
            "100:00:00",
            "12:60",
            "10:00:01:25",
            "10:00:01.5:250",
            "31.02.2023",
            "0.5",
            "1700000000",
            "yesterday",
            "+",
            "12:00+",
            "12:00+1",
            "14.11.2023 13:00 PM",
            "ä.ö.ü",
            "1.2.3.4",
            "Mon",
            "12:00 §",
            "12:00:00.0000000000001",
        ] {
            let order = Some(DateOrder::Dmy);
            let found = (parse(text, None), parse(text, order));
            let is_time = text.starts_with("12:00:00.0");
            assert_eq!(found.0.is_some(), is_time, "{text}: {found:?}");
        }
    }
}
