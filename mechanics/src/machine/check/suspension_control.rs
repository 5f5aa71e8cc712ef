//! Validation of `[suspension.control]`.

use super::checker::Checker;
use crate::machine::{MachineError, SuspensionControl};

/// Description of valid values, and the test for them.
type Rule = (&'static str, fn(f64) -> bool);

const POSITIVE: Rule = ("a positive number", |value| value > 0.0);
const NOT_NEGATIVE: Rule = ("a number that is not negative", |value| value >= 0.0);
const SHARE: Rule = ("above 0 and at most 1", |value| value > 0.0 && value <= 1.0);
const AT_LEAST_ONE: Rule = ("1 or more", |value| value >= 1.0);
const ACUTE: Rule = ("0 or more and below pi/2", |value| {
    (0.0..std::f64::consts::FRAC_PI_2).contains(&value)
});

impl Checker<'_> {
    pub(super) fn check_control(&self, control: &SuspensionControl) -> Result<(), MachineError> {
        let weights = &control.weights;
        let numbers = [
            ("rate", control.rate, POSITIVE),
            ("look_ahead", control.look_ahead, POSITIVE),
            ("min_stability_angle", control.min_stability_angle, ACUTE),
            ("acceleration_at_stop", control.acceleration_at_stop, SHARE),
            ("approach_margin", control.approach_margin, AT_LEAST_ONE),
            ("weights.front_rear", weights.front_rear, NOT_NEGATIVE),
            ("weights.lateral", weights.lateral, NOT_NEGATIVE),
            ("weights.diagonal", weights.diagonal, NOT_NEGATIVE),
            (
                "weights.front_and_rear_edges",
                weights.front_and_rear_edges,
                NOT_NEGATIVE,
            ),
            ("weights.side_edges", weights.side_edges, NOT_NEGATIVE),
        ];
        let pairs = weights.pairs.iter();
        let pairs = pairs.map(|pair| ("weights.pairs", pair.weight, NOT_NEGATIVE));
        let edges = weights.edges.values();
        let edges = edges.map(|&weight| ("weights.edges", weight, NOT_NEGATIVE));
        for (key, value, (expected, holds)) in numbers.into_iter().chain(pairs).chain(edges) {
            if !(value.is_finite() && holds(value)) {
                let place = format!("suspension.control.{key}");
                return Err(self.value_error(place, expected, value));
            }
        }
        self.check_pairs(control)
    }

    fn check_pairs(&self, control: &SuspensionControl) -> Result<(), MachineError> {
        for pair in &control.weights.pairs {
            let [a, b] = &pair.wheels;
            let known = |name: &String| self.spec.wheels.contains_key(name);
            if a == b || !known(a) || !known(b) {
                return Err(self.value_error(
                    "suspension.control.weights.pairs",
                    "two names of [wheels]",
                    format!("\"{a}\", \"{b}\""),
                ));
            }
        }
        Ok(())
    }
}
