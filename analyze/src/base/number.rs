//! Numbers for documents, and names and numbers as text with as many digits as a reader can use.

use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::number::SURE_SIGMAS;

/// The number if it is finite: documents hold no infinity and no NaN.
pub(crate) fn known(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

/// A number with as many digits as a reader needs.
pub(crate) fn number(value: f64) -> String {
    match value.is_finite() {
        true => decimals(in_english(value)),
        false => word!("not computable").into(),
    }
}

/// Formats a finite number with a point in every language: for text that programs read, too.
pub(crate) fn in_english(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.1}"),
        size if size < 0.0005 => "0".into(),
        _ => format!("{value:.3}"),
    }
}

/// A name of a table as words.
pub(crate) fn readable(name: &str) -> String {
    tipwatch_language::named(name)
}

/// The text with a large first letter.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// An input of events in words: "imu.specific_force" is "IMU specific force".
pub(crate) fn input_in_words(subject: &str) -> String {
    let words = readable(&subject.replace('.', " "));
    match words.strip_prefix("imu") {
        Some(rest) if rest.is_empty() || rest.starts_with(' ') => format!("IMU{rest}"),
        _ => words,
    }
}

/// Four digits.
#[must_use]
pub fn short(value: f64) -> String {
    match value.is_finite() {
        true => decimals(four_digits(value)),
        false => word!("not computable").into(),
    }
}

/// Four digits, as programs read them.
pub(crate) fn four_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => {
            let digits = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.3e}"),
    }
}

/// A value and the half width of its band, by its standard deviation, with no digit that the band makes worthless: two digits of the
/// band, and the value to the same place.
pub(crate) fn with_sure_band(value: f64, sigma: f64) -> String {
    let half_width = SURE_SIGMAS * sigma;
    let place = last_place(half_width);
    let value = match value.is_finite() {
        true => place.map_or_else(|| short(value), |place| to_place(value, place)),
        false => word!("not computable").into(),
    };
    format!("{value} ± {}", band(half_width))
}

/// The half width of a band: two digits.
pub(crate) fn band(half_width: f64) -> String {
    last_place(half_width).map_or_else(|| short(half_width), |place| to_place(half_width, place))
}

/// The decimal place of the second digit, after the point where positive; `None` where no plain number shows it.
fn last_place(size: f64) -> Option<i32> {
    let is_plain = (1e-6..1e12).contains(&size);
    is_plain.then(|| {
        let place = 1 - size.log10().floor() as i32;
        // rounding may carry: of 9.96 the second digit is that of 10
        let rounded = (size * 10f64.powi(place)).round();
        if rounded >= 100.0 { place - 1 } else { place }
    })
}

fn to_place(value: f64, place: i32) -> String {
    let unit = 10f64.powi(-place);
    let digits = usize::try_from(place).unwrap_or(0);
    // plus zero: no sign before zero
    decimals(format!("{:.digits$}", (value / unit).round() * unit + 0.0))
}

/// Formats a value with so many digits after the point; a dash where there is no value.
pub(crate) fn or_dash(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".into(), |value| decimals(format!("{value:.digits$}")))
}

/// A share in per cent.
pub(crate) fn percent(share: f64) -> String {
    // plus zero: no sign before zero
    decimals(format!("{:.1} %", (share * 1000.0).round() / 10.0 + 0.0))
}

/// A probability in per cent: nothing is ever quite certain.
pub(crate) fn probability(value: f64) -> String {
    match 100.0 * value {
        percent if percent > 99.9 => word!("above 99.9 %").into(),
        percent if percent < 0.1 => word!("below 0.1 %").into(),
        // never a whole "100 %" or "0 %"
        percent if !(0.5..99.5).contains(&percent) => decimals(format!("{percent:.1} %")),
        percent => format!("{percent:.0} %"),
    }
}

/// Formats a number with its unit; "-" for none.
pub(crate) fn with_unit(value: f64, unit: &str) -> String {
    match unit {
        "-" => number(value),
        unit => format!("{} {unit}", number(value)),
    }
}

/// A number of things in English: "1 log", "2 logs".
#[must_use]
pub fn count_of(count: usize, one: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {one}{plural}")
}

/// "a", "a and b", "a, b and c".
pub(crate) fn enumerated(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => say!("{} and {last}", first.join(", ")),
    }
}

/// A number of logs, in the language of the process.
pub(crate) fn logs(count: usize) -> String {
    match count {
        1 => word!("1 log").into(),
        count => say!("{count} logs"),
    }
}

/// A time in the unit that suits it.
pub(crate) fn time(seconds: f64) -> String {
    // no sign before zero: the sum of nothing is -0.0
    let seconds = if seconds.abs() < 0.05 { 0.0 } else { seconds };
    decimals(match seconds {
        s if s >= 3600.0 => format!("{:.1} h", s / 3600.0),
        s if s >= 60.0 => format!("{:.1} min", s / 60.0),
        s => format!("{s:.1} s"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_probability_is_certain() {
        assert_eq!(probability(1.0), "above 99.9 %");
        assert_eq!(probability(0.974), "97 %");
        assert_eq!(probability(0.0), "below 0.1 %");
    }

    #[test]
    fn a_value_has_no_digit_that_its_band_makes_worthless() {
        assert_eq!(with_sure_band(17.6, 65.3), "20 ± 130");
        assert_eq!(with_sure_band(-3.009e-6, 0.014_995), "0.000 ± 0.030");
        assert_eq!(with_sure_band(1234.56, 0.15), "1234.56 ± 0.30");
        assert_eq!(with_sure_band(-0.0712, 0.006), "-0.071 ± 0.012");
        assert_eq!(with_sure_band(5.0, 0.5), "5.0 ± 1.0");
        assert_eq!(band(0.01), "0.010");
        assert_eq!(with_sure_band(123.4, 4.98), "123 ± 10");
        assert_eq!(with_sure_band(1234.0, 49.85), "1230 ± 100");
        assert_eq!(band(0.0998), "0.10");
        assert_eq!(band(0.0), "0");
    }

    #[test]
    fn no_time_has_a_sign_before_zero() {
        assert_eq!(time(-0.0), "0.0 s");
        assert_eq!(time(-0.01), "0.0 s");
        assert_eq!(time(90.0), "1.5 min");
    }

    #[test]
    fn one_thing_has_no_plural() {
        assert_eq!(count_of(1, "log"), logs(1));
        assert_eq!(count_of(0, "log"), logs(0));
    }
}
