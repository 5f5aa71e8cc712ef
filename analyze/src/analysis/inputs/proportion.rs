//! Proportion of two quantities that should be equal, by least squares through the origin.

use tipwatch_language::{say, told};

/// Sums of products of pairs (x, y).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Proportion {
    xx: f64,
    xy: f64,
    yy: f64,
    pub(super) pairs: usize,
}

impl Proportion {
    /// Adds a pair; one that is not finite is ignored.
    pub(super) fn add(&mut self, x: f64, y: f64) {
        if x.is_finite() && y.is_finite() {
            self.xx += x * x;
            self.xy += x * y;
            self.yy += y * y;
            self.pairs += 1;
        }
    }

    /// The proportion y / x if the pairs determine it: `y = factor x` explains all but a fifth of y.
    pub(super) fn factor(&self) -> Option<f64> {
        let factor = self.xy / self.xx;
        let correlation = self.xy / (self.xx * self.yy).sqrt();
        (factor.is_finite() && correlation.abs() > 0.9).then_some(factor)
    }

    /// Root mean square of x and of y.
    pub(super) fn sizes(&self) -> [f64; 2] {
        [self.xx, self.yy].map(|sum| (sum / self.pairs.max(1) as f64).sqrt())
    }
}

/// A unit, with its factor from SI.
pub(super) type Unit = (&'static str, f64);

/// The unit whose factor is within a fifth of `factor`.
pub(super) fn unit_by_factor(factor: f64, units: &[Unit]) -> Option<Unit> {
    let fits = |unit: &&Unit| (factor / unit.1).ln().abs() < 0.2;
    units.iter().find(fits).copied()
}

/// The unit and the `scale` of the machine file that converts it to SI, or the scale alone.
pub(super) fn scale_hint(factor: f64, unit: Option<Unit>) -> String {
    match unit {
        Some((name, of_unit)) => {
            say!(
                "the values look like {}, which is scale = {}",
                told(name),
                digits(1.0 / of_unit)
            )
        }
        None => say!(
            "no usual unit explains it, scale = {} would",
            digits(1.0 / factor)
        ),
    }
}

/// A factor with the digits that a machine file needs, in every language as that reads it.
pub(super) fn digits(factor: f64) -> String {
    format!("{}", (factor * 1e7).round() / 1e7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proportion_needs_pairs_that_determine_it() {
        let mut clear = Proportion::default();
        let mut unclear = Proportion::default();
        for i in 0..100 {
            let x = f64::from(i) * 0.1;
            clear.add(x, 57.3 * x + (f64::from(i)).sin());
            unclear.add((f64::from(i)).sin(), (f64::from(i)).cos());
        }
        clear.add(f64::NAN, 1.0);
        assert!((clear.factor().unwrap() - 57.3).abs() < 0.5);
        assert_eq!(clear.pairs, 100);
        assert_eq!(unclear.factor(), None);
        assert_eq!(Proportion::default().factor(), None);
    }

    #[test]
    fn units_are_recognised_by_their_factor() {
        let units = [("degrees", 57.29578), ("minutes of arc", 3437.7)];
        assert_eq!(unit_by_factor(55.0, &units), Some(units[0]));
        assert_eq!(unit_by_factor(1.0, &units), None);
        assert_eq!(unit_by_factor(-57.3, &units), None);
        assert!(scale_hint(57.0, Some(units[0])).ends_with("scale = 0.0174533"));
    }
}
