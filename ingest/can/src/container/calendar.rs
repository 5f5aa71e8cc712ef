//! Dates as the headers of files state them.

/// Nanoseconds since 1970 of a year, month and day, an hour and minute, and nanoseconds of the minute; `None` if it is
/// no date.
pub(super) fn unix_ns(date: [i64; 3], clock: [i64; 2], second_ns: i64) -> Option<i64> {
    let ([year, month, day], [hour, minute]) = (date, clock);
    let is_date = (1970..2200).contains(&year)
        && (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && (0..24).contains(&hour)
        && (0..60).contains(&minute)
        && (0..61_000_000_000).contains(&second_ns);
    is_date.then(|| {
        let minutes = (days_since_1970(year, month, day) * 24 + hour) * 60 + minute;
        minutes * 60_000_000_000 + second_ns
    })
}

/// Days from 1 January 1970 in the Gregorian calendar: years are counted from March, so that the leap day is the
/// last of a year.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 {
        (year, month - 3)
    } else {
        (year - 1, month + 9)
    };
    let leap_days = year / 4 - year / 100 + year / 400;
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_days_are_those_of_the_calendar() {
        assert_eq!(days_since_1970(1970, 1, 1), 0);
        assert_eq!(days_since_1970(2000, 2, 29), 11_016);
        // `date -u -d "2023-11-14 22:13:20" +%s`
        let found = unix_ns([2023, 11, 14], [22, 13], 20_000_000_000);
        assert_eq!(found, Some(1_700_000_000_000_000_000));
        assert_eq!(unix_ns([2023, 13, 14], [22, 13], 0), None);
    }
}
