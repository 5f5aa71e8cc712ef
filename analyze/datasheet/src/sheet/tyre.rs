//! Size of a tyre from its designation.
//!
//! The overall diameter D follows from the rim diameter d and the section height h = a w of the width w:
//!
//! ```text
//!     D = d + 2 a w
//! ```
//!
//! Where the designation does not state the aspect ratio a (or D itself), the series does. The manuals of ETRTO (European
//! Tyre and Rim Technical Organisation) and TRA (Tire and Rim Association) list d, w and D by series; the ratios below
//! are those of their listed sizes, and every band holds the listed diameters of its series. Widths and rims are
//! in inches unless a width is 100 or more, which is in millimetres.

/// Unloaded radius and width of a tyre (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tyre {
    pub(crate) radius: f64,
    pub(crate) width: f64,
    /// Possible deviation of a real tyre's radius, as a share.
    pub(crate) band: f64,
}

const INCH: f64 = 0.0254;
/// Widths from here on are in millimetres.
const IN_MILLIMETRES: f64 = 100.0;

/// Proportions of the tyres of a series.
#[derive(Debug, Clone, Copy)]
struct Series {
    /// Section height by width.
    aspect: f64,
    /// Largest deviation of listed diameters, as a share.
    band: f64,
}

const fn series(aspect: f64, band: f64) -> Series {
    Series { aspect, band }
}

/// Width with two decimals, quarters of an inch (7.00-12, 10.00-20, 18.00-25): truck, industrial, grader and dumper tyres
/// of the first standard, whose section is about as high as wide.
const CONVENTIONAL: Series = series(1.04, 0.04);
/// Tyres of rigid dumpers of the same designation, on rims from 33 inches (18.00R33, 27.00R49, 40.00R57).
const DUMPER: Series = series(1.065, 0.04);
/// Other two decimals (8.15-15): the low industrial series.
const LOW_INDUSTRIAL: Series = series(0.8, 0.05);
/// Earth-mover tyres of odd rims from 25 inches (17.5-25, 33.25-29): wide base. The deepest treads are at the upper end of
/// the band.
const WIDE_BASE: Series = series(0.82, 0.04);
/// Agricultural drive wheels and implements for many purposes (9.5-24, 16.9-24, 24.5-32): the section is the lower the
/// wider it is.
const AGRICULTURAL_NARROW: Series = series(0.89, 0.04);
const AGRICULTURAL: Series = series(0.85, 0.04);
const AGRICULTURAL_BROAD: Series = series(0.81, 0.04);
/// Width with an L (11L-15, 30.5L-32): low section.
const LOW_SECTION: Series = series(0.7, 0.05);
/// Tubeless truck tyres: whole width, rim with half an inch (11R22.5).
const TUBELESS: Series = series(0.86, 0.04);
/// Tubeless truck tyres on one wide wheel (18R22.5), and skid-steer loaders with cross-ply tyres (12-16.5).
const TUBELESS_WIDE: Series = series(0.68, 0.05);
/// Whole width in inches on a whole rim (11-28): former names of conventional and agricultural tyres.
const WHOLE_INCHES: Series = series(1.02, 0.08);
/// Width in millimetres without a ratio, radial (195R14): ISO series 82, listed slightly lower.
const METRIC_RADIAL: Series = series(0.8, 0.04);
/// Width in millimetres without a ratio, on industrial rims (250-15, 300-15).
const METRIC_INDUSTRIAL: Series = series(0.73, 0.08);
/// Stated ratio (710/45-26.5): makers round D and grow with the tread.
const STATED_RATIO: f64 = 0.03;
/// Part that treads add to the stated ratio of height to width of earth-mover tyres on the largest rims (35/65R33, 59/80R63).
const TREAD: f64 = 0.015;
/// Rims of rigid dumpers and the largest loaders (inches); the largest there is.
const LARGE_RIM: f64 = 33.0;
const LARGEST_RIM: f64 = 63.0;
/// Width of the widest flotation tyre (66x43.00-25) as a share of its diameter, at most.
const WIDEST: f64 = 0.8;
/// Stated diameter (18x7-8): the name is a nominal one.
const STATED_DIAMETER: f64 = 0.04;
/// Stated diameter of a solid tyre without a rim (200x50, 16x7x10.5): moulded to size.
const SOLID: f64 = 0.02;

impl Tyre {
    /// Parses designations such as `710/45-26.5`, `20.5R25`, `7.00-12`, `16.9-24`, `18x7-8` and `200x50`; `None` for others.
    pub(crate) fn parse(designation: &str) -> Option<Self> {
        let text = designation.trim().to_ascii_uppercase().replace(',', ".");
        if text.starts_with(['-', '+']) {
            return None;
        }
        let text = text.trim_start_matches(|c: char| !c.is_ascii_digit());
        let (front, rim) = split_rim(text);
        let (radius, width, band) = match (front.split_once(['X', '×', '*']), rim) {
            (Some((first, second)), rim) => {
                let [first, second] = [number(first)?.value, number(second)?.value];
                match rim {
                    // 23.5x25 is another spelling of 23.5-25
                    None if first < second => return Self::by_series(front, second, false),
                    None => (half(first), length(second, first), SOLID),
                    Some(_) => (half(first), length(second, first), STATED_DIAMETER),
                }
            }
            (None, Some((rim, is_radial))) => match front.split_once('/') {
                Some((width, ratio)) => {
                    let (width, ratio) = (number(width)?.value, number(ratio)?.value);
                    // 4.10/3.50-4 states two widths
                    let is_ratio = (20.0..=100.0).contains(&ratio);
                    let is_large = rim >= LARGE_RIM && width < IN_MILLIMETRES;
                    let tread = if is_large { TREAD } else { 0.0 };
                    let width = length(width, width);
                    let radius = rim * INCH / 2.0 + (ratio / 100.0 + tread) * width;
                    is_ratio.then_some((radius, width, STATED_RATIO))?
                }
                None => return Self::by_series(front, rim, is_radial),
            },
            (None, None) => return None,
        };
        Self::checked(radius, width, band, rim.map(|(rim, _)| rim))
    }

    /// Width and rim alone.
    fn by_series(width: &str, rim: f64, is_radial: bool) -> Option<Self> {
        let width = number(width)?;
        let series = series_of(&width, rim, is_radial);
        let metres = length(width.value, width.value);
        let radius = rim * INCH / 2.0 + series.aspect * metres;
        Self::checked(radius, metres, series.band, Some(rim))
    }

    fn checked(radius: f64, width: f64, band: f64, rim: Option<f64>) -> Option<Self> {
        // a rim fits into its tyre
        let is_round = rim.is_none_or(|rim| {
            rim * INCH / 2.0 < 0.97 * radius && (3.0..=LARGEST_RIM).contains(&rim)
        });
        let is_tyre = (0.02..2.5).contains(&radius)
            && (0.01..2.0).contains(&width)
            && width <= WIDEST * 2.0 * radius
            && is_round;
        is_tyre.then_some(Self {
            radius,
            width,
            band,
        })
    }
}

fn series_of(width: &Number, rim: f64, is_radial: bool) -> Series {
    let value = width.value;
    let hundredths = (value * 100.0).round() as i64 % 100;
    let has_half_rim = rim.fract() != 0.0;
    let is_earth_mover = rim >= 25.0 && rim % 2.0 == 1.0 && value >= 15.0;
    if value >= IN_MILLIMETRES {
        return match is_radial {
            true => METRIC_RADIAL,
            false => METRIC_INDUSTRIAL,
        };
    }
    if width.is_low {
        return LOW_SECTION;
    }
    match width.decimals {
        0 if has_half_rim && is_radial && value < 15.0 => TUBELESS,
        0 if has_half_rim => TUBELESS_WIDE,
        0 => WHOLE_INCHES,
        _ if is_earth_mover && (hundredths == 50 || (value > 30.0 && hundredths == 25)) => {
            WIDE_BASE
        }
        _ if rim >= LARGE_RIM && hundredths == 0 && value >= 18.0 => DUMPER,
        // 10.0-20 and 6.5-10 are 10.00-20 and 6.50-10
        1 if hundredths == 0 || value < 8.0 => CONVENTIONAL,
        1 if value < 12.0 => AGRICULTURAL_NARROW,
        1 if value < 20.0 => AGRICULTURAL,
        1 => AGRICULTURAL_BROAD,
        _ if hundredths % 25 == 0 => CONVENTIONAL,
        _ => LOW_INDUSTRIAL,
    }
}

/// Splits a designation into the text before the rim, and the rim (inches) with whether the tyre is radial.
fn split_rim(text: &str) -> (&str, Option<(f64, bool)>) {
    let starts_number = |rest: &str| rest.trim_start().starts_with(|c: char| c.is_ascii_digit());
    let mut marks = text
        .char_indices()
        .filter(|&(at, c)| matches!(c, '-' | 'R' | 'B' | 'D') && starts_number(&text[at + 1..]));
    let Some((at, mark)) = marks.next() else {
        return (text, None);
    };
    let rim = number(&text[at + 1..]).map(|rim| (rim.value, mark == 'R'));
    // 16-1/4x7 and 16x7x10-1/2 have a fraction there, not a rim
    let goes_on = text[at..]
        .match_indices('X')
        .any(|(mark, _)| starts_number(&text[at + mark + 1..]));
    let after = text[at + 1..].trim_start_matches(|c: char| c.is_ascii_digit());
    match goes_on || after.starts_with('/') {
        true => (text, None),
        false => (text[..at].trim_end_matches(['Z', ' ', '-']), rim),
    }
}

/// Half a stated diameter (m).
fn half(diameter: f64) -> f64 {
    length(diameter, diameter) / 2.0
}

/// Converts a length to metres; the size of `largest` in the designation determines its unit.
fn length(value: f64, largest: f64) -> f64 {
    match largest >= IN_MILLIMETRES {
        true => value * 1e-3,
        false => value * INCH,
    }
}

/// A number as written.
struct Number {
    value: f64,
    /// Digits behind the point.
    decimals: usize,
    /// Whether the number is followed by an L for a low section.
    is_low: bool,
}

/// The number at the beginning of a text, with a fraction such as `16 1/4` or `16-1/4`.
fn number(text: &str) -> Option<Number> {
    let text = text.trim();
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let end = text.find(|c| !is_part(c)).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    let value: f64 = digits.parse().ok()?;
    let fraction = || {
        let (above, below) = rest.trim_start_matches([' ', '-']).split_once('/')?;
        let below = below.trim_end_matches(|c: char| !c.is_ascii_digit());
        let (above, below) = (above.parse::<u8>().ok()?, below.parse::<u8>().ok()?);
        let is_fraction = above < below && matches!(below, 2 | 4 | 8 | 16);
        is_fraction.then(|| f64::from(above) / f64::from(below))
    };
    let decimals = digits.split_once('.').map_or(0, |(_, after)| after.len());
    Some(Number {
        value: value + fraction().unwrap_or(0.0),
        decimals,
        is_low: rest.starts_with('L'),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Designations and overall diameters (mm) as standards and makers list them.
    const LISTED: [(&str, f64); 70] = [
        // industrial, named by diameter
        ("18x7-8", 457.0),
        ("16x6-8", 421.0),
        ("15x4.5-8", 383.0),
        ("21x8-9", 533.0),
        ("23x9-10", 590.0),
        ("27x10-12", 690.0),
        ("28x9-15", 706.0),
        ("31x15.50-15", 785.0),
        ("200x50", 200.0),
        ("16x7x10 1/2", 406.0),
        // metric, with a ratio
        ("200/50-10", 458.0),
        ("315/80R22.5", 1076.0),
        ("385/65R22.5", 1072.0),
        ("385/95R25", 1367.0),
        ("340/80R18", 1001.0),
        ("500/70R24", 1310.0),
        ("400/60-15.5", 874.0),
        ("600/50R22.5", 1181.0),
        ("710/45-26.5", 1312.0),
        ("875/65R29", 1874.0),
        ("10.0/75-15.3", 760.0),
        ("11.5/80-15.3", 845.0),
        ("12.5/80-18", 965.0),
        ("15.5/80-24", 1240.0),
        ("16/70-20", 1075.0),
        // conventional
        ("5.00-8", 467.0),
        ("6.50-10", 587.0),
        ("7.00-12", 676.0),
        ("8.25-15", 838.0),
        ("28x9-15 (8.15-15)", 706.0),
        ("8.15-15", 706.0),
        ("10.00-20", 1054.0),
        ("12.00-20", 1130.0),
        ("14.00-24", 1370.0),
        ("16.00-25", 1493.0),
        ("18.00-25", 1615.0),
        // wide base
        ("15.5-25", 1275.0),
        ("17.5-25", 1348.0),
        ("20.5R25", 1490.0),
        ("23.5R25", 1615.0),
        ("26.5R25", 1750.0),
        ("29.5-25", 1873.0),
        // wide base with the deepest tread (L5S; Maxam MS502)
        ("17.5R25", 1408.0),
        ("20.5R25", 1547.0),
        ("26.5R25", 1796.0),
        ("29.5R25", 1928.0),
        ("29.5R29", 2011.0),
        ("35/65R33", 2069.0),
        // rigid dumpers and the largest loaders (Michelin, Bridgestone; treads differ by some 20 mm)
        ("18.00R33", 1870.0),
        ("24.00R35", 2170.0),
        ("27.00R49", 2700.0),
        ("33.00R51", 3045.0),
        ("40.00R57", 3580.0),
        ("45/65R45", 2690.0),
        ("53/80R63", 3780.0),
        ("59/80R63", 4025.0),
        // agricultural
        ("11.2-24", 1105.0),
        ("12.4-24", 1160.0),
        ("13.6-24", 1205.0),
        ("14.9-28", 1365.0),
        ("16.9-24", 1325.0),
        ("18.4-38", 1753.0),
        ("20.8-38", 1835.0),
        ("23.1-26", 1605.0),
        ("24.5-32", 1805.0),
        // low sections and tubeless tyres
        ("11L-15", 775.0),
        ("11R22.5", 1052.0),
        ("12R22.5", 1085.0),
        ("10-16.5", 775.0),
        ("12-16.5", 835.0),
    ];

    #[test]
    fn val_bands_hold_the_listed_diameters() {
        for (name, diameter) in LISTED {
            let tyre = Tyre::parse(name);
            let Some(tyre) = tyre else {
                panic!("{name}: not read");
            };
            let found = 2000.0 * tyre.radius;
            let off = (found / diameter - 1.0).abs();
            assert!(off <= tyre.band, "{name}: {found} for {diameter}");
            assert!(tyre.band <= 0.05, "{name}: a band of {}", tyre.band);
        }
    }

    #[test]
    fn spellings_of_one_tyre_agree() {
        for names in [
            &["20.5R25", "20,5 R 25", "20.5 R25 XHA2", "20.5r25"][..],
            &["17.5-25", "17.5x25", "17.5 - 25 16PR"],
            &[
                "400/60-15.5",
                "400/60 - 15.5",
                "400/60B15.5",
                "IMP 400/60-15.5",
            ],
            &["200x50", "200 x 50 (mm, solid)"],
            &["18x7-8", "18X7-8", "18 x 7 - 8", "18×7-8"],
            &["16x7x10 1/2", "16x7x10.5", "16x7x10-1/2"],
        ] {
            let found: Vec<_> = names.iter().map(|name| Tyre::parse(name)).collect();
            for (name, tyre) in names.iter().zip(&found) {
                let near = tyre
                    .zip(found[0])
                    .is_some_and(|(tyre, first)| (tyre.radius - first.radius).abs() < 1e-9);
                assert!(near, "{name}: {tyre:?}");
            }
        }
    }

    #[test]
    fn other_texts_are_no_tyres() {
        for wrong in [
            "",
            "-",
            "R",
            "x/yRz",
            "20",
            "9/9R9",
            "1e9R1",
            "ü-1",
            "-R/",
            "x",
            "1x",
            "x1",
            "4.10/3.50-4",
            "20.5-0",
            "7.00-900",
            "0x0",
            "1/0-1",
            "18x7-30",
            "800",
            "18x70-8",
            "7x18-8",
            "-18x7-8",
            "+20.5R25",
            "0x0-0",
            "180x7-8",
            "18x7-80",
            "18x0-8",
            "999/99R99",
            "385/95R2",
            "20.5R250",
            "40.00R157",
            "53/800R63",
            "8 inch",
            "nan",
        ] {
            assert_eq!(Tyre::parse(wrong), None, "{wrong}");
        }
    }
}
