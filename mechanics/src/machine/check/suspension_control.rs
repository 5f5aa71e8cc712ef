//! Validation of `[suspension.control]`.

use super::checker::Checker;
use crate::machine::table::{Number, Range};
use crate::machine::{MachineError, SuspensionControl};

impl Checker<'_> {
    pub(super) fn check_control(&self, control: &SuspensionControl) -> Result<(), MachineError> {
        let weights = &control.weights;
        self.check_ranges("suspension.control", &control.numbers())?;
        self.check_ranges("suspension.control.weights", &weights.numbers())?;
        let range = Range::not_negative();
        let number = |key, value| Number { key, value, range };
        let pairs = weights.pairs.iter();
        let pairs = pairs.map(|pair| number("pairs", pair.weight));
        let edges = weights.edges.values();
        let edges = edges.map(|&weight| number("edges", weight));
        let single: Vec<Number> = pairs.chain(edges).collect();
        self.check_ranges("suspension.control.weights", &single)?;
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
