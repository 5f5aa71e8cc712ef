//! Units of DBC files in SI units, where the text is unambiguous.

use std::f64::consts::PI;

/// A unit and its SI unit: `si = factor * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiUnit {
    /// The symbol of the SI unit; empty for a number without one.
    pub symbol: &'static str,
    /// SI units in one of the unit.
    pub factor: f64,
    /// Added after the factor.
    pub offset: f64,
}

/// Speed of the mile per hour (m/s).
const MPH: f64 = 0.447_04;
/// Pressure of the pound per square inch (Pa).
const PSI: f64 = 6_894.757_293_168;

impl SiUnit {
    /// The unit of a number that stays as it is.
    pub const NONE: Self = Self {
        symbol: "",
        factor: 1.0,
        offset: 0.0,
    };

    /// The SI unit of a unit as DBC files write it. `None` if the text is unknown or ambiguous: `g` may be a gram or
    /// the acceleration of gravity, `T` a tesla; `%` is a part of anything.
    #[must_use]
    pub fn of(text: &str) -> Option<Self> {
        let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        // superscripts, the several ways to write a power, and characters that look the same
        let text = text
            .replace(['º', '˚'], "°")
            .replace('\u{3bc}', "µ")
            .replace('²', "2")
            .replace("^2", "2")
            .replace("**2", "2")
            .replace('³', "3");
        let (symbol, factor) = match text.as_str() {
            "" => ("", 1.0),
            "rad" => ("rad", 1.0),
            "mrad" => ("rad", 1e-3),
            "µrad" | "urad" => ("rad", 1e-6),
            "deg" | "°" | "Deg" | "DEG" | "Grad" => ("rad", PI / 180.0),
            "degree" | "degrees" | "Degree" | "Degrees" => ("rad", PI / 180.0),
            "rad/s" | "rad/sec" => ("rad/s", 1.0),
            "mrad/s" => ("rad/s", 1e-3),
            "µrad/s" | "urad/s" => ("rad/s", 1e-6),
            "deg/s" | "°/s" | "Deg/s" | "deg/sec" | "°/sec" | "degree/s" | "degrees/s" | "dps" => {
                ("rad/s", PI / 180.0)
            }
            "rpm" | "RPM" | "1/min" | "U/min" | "r/min" | "rev/min" => ("rad/s", PI / 30.0),
            "deg/s2" | "°/s2" => ("rad/s^2", PI / 180.0),
            "rad/s2" => ("rad/s^2", 1.0),
            "m" => ("m", 1.0),
            "dm" => ("m", 0.1),
            "cm" => ("m", 1e-2),
            "mm" => ("m", 1e-3),
            "µm" | "um" => ("m", 1e-6),
            "km" => ("m", 1e3),
            "m/s" | "m/sec" => ("m/s", 1.0),
            "mm/s" => ("m/s", 1e-3),
            "cm/s" => ("m/s", 1e-2),
            "km/h" | "kph" | "kmh" | "km/hr" | "KPH" => ("m/s", 1.0 / 3.6),
            "mph" => ("m/s", MPH),
            "m/s2" | "m/s/s" | "m/sec2" => ("m/s^2", 1.0),
            "Pa" => ("Pa", 1.0),
            "hPa" | "mbar" => ("Pa", 1e2),
            "kPa" => ("Pa", 1e3),
            "MPa" => ("Pa", 1e6),
            "bar" | "Bar" => ("Pa", 1e5),
            "psi" => ("Pa", PSI),
            "N" => ("N", 1.0),
            "daN" => ("N", 10.0),
            "kN" => ("N", 1e3),
            "Nm" | "N.m" | "N*m" | "N·m" => ("N m", 1.0),
            "kNm" | "kN.m" | "kN*m" => ("N m", 1e3),
            "kg" => ("kg", 1.0),
            "t" | "ton" | "tonne" | "tonnes" => ("kg", 1e3),
            "s" | "sec" => ("s", 1.0),
            "ms" => ("s", 1e-3),
            "us" | "µs" => ("s", 1e-6),
            "min" => ("s", 60.0),
            "h" => ("s", 3600.0),
            _ => return None,
        };
        Some(Self {
            symbol,
            factor,
            offset: 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_units_become_si_units() {
        let si = |text: &str| SiUnit::of(text).map(|unit| (unit.symbol, unit.factor));
        assert_eq!(si("bar"), Some(("Pa", 1e5)));
        assert_eq!(si("km/h"), Some(("m/s", 1.0 / 3.6)));
        assert_eq!(si(" m/s² "), Some(("m/s^2", 1.0)));
        assert_eq!(si("°/s").map(|(_, factor)| factor.to_degrees()), Some(1.0));
        // the micro sign and the Greek letter, the degree sign and an ordinal
        assert_eq!(si("µm"), Some(("m", 1e-6)));
        assert_eq!(si("\u{3bc}m"), si("µm"));
        assert_eq!(si("º/s"), si("°/s"));
        for ambiguous in ["g", "%", "T", "A", "raw"] {
            assert_eq!(si(ambiguous), None, "{ambiguous}");
        }
    }
}
