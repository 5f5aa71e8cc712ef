//! Numbers with a unit, as data sheets print them: `18600`, `"18.6 t"`, `"3300 mm"`, `"35 deg"`.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, Visitor};

/// Physical quantity of a number.
pub trait Dimension {
    /// Its name, with the unit of a plain number.
    const NAME: &'static str;
    /// An example with a unit.
    const EXAMPLE: &'static str;
    /// Its units, in SI units.
    const UNITS: &'static [(&'static str, f64)];
    /// One unit of a plain number, in SI units.
    const PLAIN: f64;
}

macro_rules! dimension {
    ($(#[$doc:meta] $name:ident, $what:literal, $example:literal, $plain:expr, $units:expr;)*) => {$(
        #[$doc]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name;
        impl Dimension for $name {
            const NAME: &'static str = $what;
            const EXAMPLE: &'static str = $example;
            const UNITS: &'static [(&'static str, f64)] = $units;
            const PLAIN: f64 = $plain;
        }
    )*};
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const POUND: f64 = 0.453_592_37;

dimension! {
    /// The dimension of [`Mass`].
    OfMass, "a mass [kg]", "18.6 t", 1.0, &[("kg", 1.0), ("t", 1000.0), ("g", 1e-3), ("lb", POUND), ("lbs", POUND)];
    /// The dimension of [`Length`].
    OfLength, "a length [m]", "3300 mm", 1.0,
        &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048)];
    /// The dimension of [`Angle`].
    OfAngle, "an angle [degrees]", "35 deg", DEGREE, &[("deg", DEGREE), ("°", DEGREE), ("rad", 1.0)];
    /// The dimension of [`Stiffness`].
    OfStiffness, "a stiffness [N/m]", "800 kN/m", 1.0, &[("N/m", 1.0), ("kN/m", 1e3), ("N/mm", 1e3)];
}

/// A number with its dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity<D> {
    /// The value in SI units (kg, m, rad, N/m).
    pub si: f64,
    dimension: PhantomData<D>,
}

/// A mass; a plain number is in kg.
pub type Mass = Quantity<OfMass>;
/// A length; a plain number is in m.
pub type Length = Quantity<OfLength>;
/// An angle; a plain number is in degrees.
pub type Angle = Quantity<OfAngle>;
/// A stiffness; a plain number is in N/m.
pub type Stiffness = Quantity<OfStiffness>;

impl<D: Dimension> Quantity<D> {
    /// Returns the quantity with a value in SI units.
    #[must_use]
    pub fn from_si(si: f64) -> Self {
        Self {
            si,
            dimension: PhantomData,
        }
    }

    /// Parses a plain number, or a number with its unit; `None` where the text is neither, or not finite.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let is_unit = |c: char| c.is_alphabetic() || c == '°';
        // the exponent of 1e3 is no unit
        let start = text.char_indices().find(|&(at, c)| {
            let is_exponent = matches!(c, 'e' | 'E')
                && text[at + 1..].starts_with(|next: char| next.is_ascii_digit() || next == '-');
            is_unit(c) && !is_exponent
        });
        let (number, unit) = text.split_at(start.map_or(text.len(), |(at, _)| at));
        let number: f64 = number.trim().replace(['_', '\u{a0}'], "").parse().ok()?;
        let factor = match unit.trim() {
            "" => D::PLAIN,
            unit => D::UNITS.iter().find(|(name, _)| *name == unit)?.1,
        };
        let si = number * factor;
        si.is_finite().then(|| Self::from_si(si))
    }

    fn expected() -> String {
        let units: Vec<&str> = D::UNITS.iter().map(|(name, _)| *name).collect();
        format!(
            "{} as a number, or as text with its unit ({}), such as \"{}\"",
            D::NAME,
            units.join(", "),
            D::EXAMPLE
        )
    }
}

impl<'de, D: Dimension> Deserialize<'de> for Quantity<D> {
    fn deserialize<R: Deserializer<'de>>(deserializer: R) -> Result<Self, R::Error> {
        struct OfText<D>(PhantomData<D>);
        impl<D: Dimension> OfText<D> {
            fn plain<E: Error>(value: f64) -> Result<Quantity<D>, E> {
                match (value * D::PLAIN).is_finite() {
                    true => Ok(Quantity::from_si(value * D::PLAIN)),
                    false => Err(E::custom(format!(
                        "expected {}, found {value}",
                        Quantity::<D>::expected()
                    ))),
                }
            }
        }
        impl<D: Dimension> Visitor<'_> for OfText<D> {
            type Value = Quantity<D>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&Quantity::<D>::expected())
            }
            fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
                Self::plain(value)
            }
            fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
                // exact up to 2^53, far beyond any sheet
                Self::plain(value as f64)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                Quantity::parse(text).ok_or_else(|| {
                    E::custom(format!(
                        "expected {}, found \"{text}\"",
                        Quantity::<D>::expected()
                    ))
                })
            }
        }
        deserializer.deserialize_any(OfText(PhantomData))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_units_convert_to_si() {
        let mass = |text: &str| Mass::parse(text).map(|mass| mass.si);
        assert_eq!(mass("18.6 t"), Some(18_600.0));
        assert_eq!(mass("18600"), Some(18_600.0));
        assert_eq!(mass("1e3kg"), Some(1000.0));
        assert_eq!(mass("100 lb"), Some(45.359_237));
        let length = Length::parse("3300 mm").unwrap().si;
        assert!((length - 3.3).abs() < 1e-15, "{length}");
        assert_eq!(Length::parse("13 in").map(|l| l.si), Some(13.0 * 0.0254));
        assert_eq!(
            Angle::parse("180").map(|a| a.si),
            Some(std::f64::consts::PI)
        );
        assert_eq!(Angle::parse("0.5 rad").map(|a| a.si), Some(0.5));
        assert_eq!(Stiffness::parse("8e2 kN/m").map(|k| k.si), Some(8e5));
        for wrong in ["", "t", "3 m", "nan", "inf kg", "1e999", "1 2", "--3", "°"] {
            assert_eq!(mass(wrong), None, "{wrong}");
        }
    }
}
