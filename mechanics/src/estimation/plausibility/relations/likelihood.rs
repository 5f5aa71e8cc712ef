//! Likelihood of a residual, and the evidence of an alternative against "all sensors are sound".
//!
//! Residuals of sound logs have heavy tails, and now and then something that no relation models: a kerb, a slipping wheel, a
//! knock. So their density is a mixture,
//! ```text
//!     p(r) = (1 - e) t(r; s) + e t(r; range)
//! ```
//! of Student's t with four degrees of freedom of scale s and of that of all that the quantity can do. No single window can
//! therefore decide: what it adds to a log likelihood ratio is bounded by about `ln(range / s) - ln e`.
//!
//! The evidence of an alternative is the sum of its log likelihood ratios, from the window on that makes it largest (Page's
//! cumulative sum). Of windows that are independent, `exp(h)` pass on average before the sum of a true likelihood ratio
//! exceeds h by chance (Lorden 1971), so the threshold follows from the rate of false alarms that is stated:
//! ```text
//!     h = ln(windows per hour * alternatives / false alarms per hour)
//! ```

use super::super::explanation::Explanation;

/// An alternative that stands, with its evidence and the threshold.
pub(super) type Standing = Option<(Explanation, Evidence, f64)>;

/// Share of the threshold below which an alternative that stood no longer stands.
const CLEARED: f64 = 0.25;
/// Largest evidence as a multiple of the threshold, so that a fault that ends can be forgotten.
const LARGEST: f64 = 1.5;

/// Log likelihood ratio from which windows support a sensor against an alternative: some twenty to one.
const SUPPORTS: f64 = 3.0;

/// The mixture of a relation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mixture {
    /// Share e of windows that the relation does not model.
    pub(super) outliers: f64,
    /// Scale of the residual in those windows, in its unit.
    pub(super) range: f64,
}

impl Mixture {
    /// Logarithm of the density of a residual with this scale.
    pub(super) fn log_density(self, residual: f64, scale: f64) -> f64 {
        let sound = (1.0 - self.outliers) * student(residual, scale);
        (sound + self.outliers * student(residual, self.range.max(scale))).ln()
    }
}

/// Returns the logarithm of the density of a residual of a relation that does not hold, for a reason that is not stated: a
/// mixture of several multiples of its scale, each equally likely beforehand.
pub(super) fn log_density_of_other(residual: f64, scale: f64) -> f64 {
    const WIDER: [f64; 4] = [4.0, 16.0, 64.0, 256.0];
    let sum: f64 = WIDER
        .iter()
        .map(|wider| student(residual, wider * scale))
        .sum();
    (sum / WIDER.len() as f64).ln()
}

/// Density of Student's t with four degrees of freedom, of a value and its scale in one unit: per unit.
#[must_use]
pub fn student(x: f64, scale: f64) -> f64 {
    let z = x / scale;
    0.375 * (1.0 + 0.25 * z * z).powf(-2.5) / scale
}

/// The evidence of one alternative.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Evidence {
    /// Logarithm of the likelihood ratio.
    pub(super) value: f64,
    /// Stamp since which the value grows (ns).
    pub(super) since_ns: i64,
    stands: bool,
    /// The value without its limit, which tells of two that have reached that which explains more.
    pub(super) sum: f64,
    /// Sum over all windows.
    pub(super) total: f64,
    /// Start (ns) of the last windows with which the sensor had been supported, each time by [`SUPPORTS`], with `total` then.
    supported: [(i64, f64); 2],
    /// The value, neither reset by holes nor reduced by windows that prove nothing against the alternative.
    remembered: f64,
    /// The evidence for "all sensors are sound" against the alternative, and whether that has exceeded the threshold.
    against: f64,
    is_refuted: bool,
    /// Whether the alternative has ever stood.
    has_stood: bool,
}

impl Evidence {
    /// Adds the log likelihood ratio of a window that began at `start_ns`. One that is no number is no evidence.
    pub(super) fn add(&mut self, start_ns: i64, ratio: f64, threshold: f64) {
        if !ratio.is_finite() {
            return;
        }
        if self.value == 0.0 {
            (self.since_ns, self.sum) = (start_ns, 0.0);
        }
        self.sum += ratio;
        self.total += ratio;
        let largest = LARGEST * threshold;
        self.value = (self.value + ratio).clamp(0.0, largest);
        let [_, last] = self.supported;
        if self.value == 0.0 && last.1 - self.total > SUPPORTS {
            self.supported = [last, (start_ns, self.total)];
        }
        self.remembered = (self.remembered + ratio).clamp(0.0, largest);
        self.stands = self.value
            > if self.stands {
                CLEARED * threshold
            } else {
                threshold
            };
        self.has_stood |= self.stands;
        self.against = (self.against - ratio).clamp(0.0, largest);
        self.is_refuted |= self.against > threshold;
    }

    /// Adds the log likelihood ratio of a window that may speak for the alternative and proves nothing against it.
    pub(super) fn add_unproven(&mut self, start_ns: i64, ratio: f64, threshold: f64) {
        let before = (self.against, self.is_refuted, self.remembered);
        self.add(start_ns, ratio, threshold);
        if ratio < 0.0 {
            (self.against, self.is_refuted, self.remembered) = before;
        }
    }

    /// Returns the stamp since which the alternative may be true (ns): the value grows where windows speak for it, and before that
    /// they may have told nothing. Windows had last supported the sensor then; zero if they never did.
    pub(super) fn possible_since_ns(&self) -> i64 {
        self.supported[0].0.min(self.since_ns)
    }

    /// Whether the windows have refuted the alternative, as surely as they would have to show it, and have never shown it.
    pub(super) fn is_refuted(&self) -> bool {
        self.is_refuted && !self.has_stood
    }

    /// Returns the evidence of sound sensors against the alternative, as a log likelihood ratio.
    pub(super) fn against(&self) -> f64 {
        self.against
    }

    /// Whether the windows have made the alternative more likely than sound sensors, from this prior probability, by a cumulative
    /// sum that begins where it helps the alternative most. Only windows that speak against the alternative take that back: no
    /// hole does.
    pub(super) fn disputes(&self, beforehand: f64) -> bool {
        self.remembered > -beforehand.ln()
    }

    /// Whether the evidence exceeds the threshold, or did and has not been refuted since.
    pub(super) fn stands(&self) -> bool {
        self.stands
    }

    /// Forgets evidence that does not stand, at a hole in the signals. Alternatives that were refuted before the hole stay
    /// refuted.
    pub(super) fn forget(&mut self) {
        if !self.stands {
            // what is forgotten supports nothing
            self.supported[1].1 += self.value;
            (self.value, self.since_ns) = (0.0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::false_alarms::threshold;
    use super::*;

    const MIXTURE: Mixture = Mixture {
        outliers: 0.05,
        range: 10.0,
    };

    #[test]
    fn densities_are_normalised() {
        let step = 1e-2;
        let sum: f64 = (-400_000..400_000)
            .map(|k| MIXTURE.log_density(f64::from(k) * step, 0.5).exp() * step)
            .sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    }

    #[test]
    fn no_single_window_decides() {
        let threshold = threshold(1e-4, 7200.0, 50);
        assert!((20.0..25.0).contains(&threshold));
        let ratio = student(0.0, 0.01).ln() - MIXTURE.log_density(1e6, 0.01);
        let largest = student(0.0, 0.01).ln() - MIXTURE.log_density(5.0, 0.01);
        assert!(largest < 12.0, "{largest}");
        let mut evidence = Evidence::default();
        evidence.add(1, ratio.min(largest), threshold);
        assert!(!evidence.stands());
        evidence.add(2, largest, threshold);
        evidence.add(3, largest, threshold);
        assert!(evidence.stands());
        assert_eq!(evidence.since_ns, 1);
    }

    #[test]
    fn an_alternative_may_be_true_since_the_sensor_was_last_supported() {
        let mut evidence = Evidence::default();
        (1..10).for_each(|k| evidence.add(k, -2.0, 20.0));
        // the arm rests, and the sensor fails
        (10..15).for_each(|k| evidence.add(k, -0.1, 20.0));
        (15..18).for_each(|k| evidence.add(k, 9.0, 20.0));
        assert!(evidence.stands());
        assert_eq!(evidence.since_ns, 15);
        assert!((5..10).contains(&evidence.possible_since_ns()));
        let mut untold = Evidence::default();
        (15..18).for_each(|k| untold.add(k, 9.0, 20.0));
        assert_eq!(untold.possible_since_ns(), 0);
    }

    #[test]
    fn a_hole_supports_no_sensor() {
        let mut evidence = Evidence::default();
        (1..10).for_each(|k| evidence.add(k, -2.0, 20.0));
        let supported_ns = |evidence: &Evidence| evidence.supported.map(|(start_ns, _)| start_ns);
        let before = supported_ns(&evidence);
        evidence.add(10, 9.0, 20.0);
        evidence.forget();
        (11..14).for_each(|k| evidence.add(k, -0.1, 20.0));
        assert_eq!(supported_ns(&evidence), before);
    }

    #[test]
    fn evidence_that_is_refuted_ends_and_what_has_begun_is_forgotten() {
        let mut evidence = Evidence::default();
        (0..9).for_each(|k| evidence.add(k, 9.0, 20.0));
        assert!(evidence.stands());
        evidence.forget();
        assert!(evidence.stands());
        (0..4).for_each(|k| evidence.add(k, -9.0, 20.0));
        assert!(!evidence.stands());
        evidence.add(7, 9.0, 20.0);
        evidence.add(8, f64::NAN, 20.0);
        evidence.forget();
        assert_eq!(evidence.value, 0.0);
    }

    #[test]
    fn what_explains_more_leads_though_both_have_reached_the_limit() {
        let (mut more, mut less) = (Evidence::default(), Evidence::default());
        for k in 0..20 {
            more.add(k, 9.0, 20.0);
            less.add(k, 8.0, 20.0);
        }
        assert_eq!(more.value, less.value);
        assert!(more.sum > less.sum);
    }

    #[test]
    fn what_was_refuted_stays_so_unless_it_is_shown() {
        let mut evidence = Evidence::default();
        evidence.add(0, -9.0, 20.0);
        evidence.add(1, 9.0, 20.0);
        evidence.add(2, f64::NAN, 20.0);
        (3..5).for_each(|k| evidence.add(k, -9.0, 20.0));
        assert!(!evidence.is_refuted());
        evidence.add(5, -9.0, 20.0);
        assert!(evidence.is_refuted());
        evidence.forget();
        (6..8).for_each(|k| evidence.add(k, 9.0, 20.0));
        assert!(evidence.is_refuted());
        evidence.add(9, 9.0, 20.0);
        assert!(!evidence.is_refuted());
        (10..99).for_each(|k| evidence.add(k, -9.0, 20.0));
        assert!(
            !evidence.is_refuted(),
            "a sensor that was shown to be wrong is not proven"
        );
    }
}
