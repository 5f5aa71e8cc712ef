//! Size of a tyre from its designation.

/// Unloaded radius and width of a tyre (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tyre {
    pub(crate) radius: f64,
    pub(crate) width: f64,
}

const INCH: f64 = 0.0254;
/// Height of the side wall by width, of sizes that state none: wide-base tyres are named by halves of an inch.
const WIDE_BASE: f64 = 0.82;
const CONVENTIONAL: f64 = 1.04;

impl Tyre {
    /// From designations such as `710/45-26.5`, `315/80R22.5`, `20.5R25` and `7.00-12`; `None` for others.
    ///
    /// ```text
    ///     r = rim / 2 + aspect ratio * width
    /// ```
    pub(crate) fn parse(designation: &str) -> Option<Self> {
        let upper = designation.trim().to_ascii_uppercase();
        let (section, rim) = upper.rsplit_once(['-', 'R'])?;
        let rim = leading(rim)? * INCH;
        let section = section.trim_end_matches(['Z', ' ']);
        let (width, aspect) = match section.split_once('/') {
            Some((width, aspect)) => (leading(width)? * 1e-3, leading(aspect)? / 100.0),
            None => {
                let inches = leading(section)?;
                let is_wide = (inches.fract() - 0.5).abs() < 1e-9 && inches > 15.0;
                (
                    inches * INCH,
                    if is_wide { WIDE_BASE } else { CONVENTIONAL },
                )
            }
        };
        let radius = rim / 2.0 + aspect * width;
        let is_tyre = (0.05..2.5).contains(&radius) && (0.03..2.0).contains(&width);
        is_tyre.then_some(Self { radius, width })
    }
}

/// The number at the beginning of a text.
fn leading(text: &str) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.'));
    text[..end.unwrap_or(text.len())].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Outer diameters (mm) that tyre makers' tables give for these sizes, within 3 %.
    #[test]
    fn val_radii_of_common_tyres() {
        for (name, diameter) in [
            ("315/80R22.5", 1076.0),
            ("385/95R25", 1367.0),
            ("20.5R25", 1490.0),
            ("23.5R25", 1615.0),
            ("12.00-20", 1130.0),
            ("7.00-12", 676.0),
            ("710/45-26.5", 1312.0),
        ] {
            let found = 2000.0 * Tyre::parse(name).unwrap().radius;
            assert!((found / diameter - 1.0).abs() < 0.03, "{name}: {found}");
        }
        for wrong in ["", "-", "R", "x/yRz", "20", "9/9R9", "1e9R1", "ü-1", "-R/"] {
            assert_eq!(Tyre::parse(wrong), None, "{wrong}");
        }
    }
}
