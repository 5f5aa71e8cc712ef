//! A prediction in words, for terminals and screens.

use tipwatch_mechanics::Contribution;
use tipwatch_mechanics::prediction::{Law, PredictedNumber};

use crate::wire::topics::WireVerdict;

/// Returns the wheel that lifts first by each assumed motion, as text; `None` if none lifts, if nothing is predicted, or if a
/// wheel is off the ground already.
#[must_use]
pub fn prediction_text(verdict: &WireVerdict, wheels: &[String]) -> Option<String> {
    let parts = Law::ALL.into_iter().filter_map(|law| {
        let assumed = match law {
            Law::GoOn => "if it goes on",
            Law::BrakeNow => "if it brakes now",
            Law::StopArm => "if the arm stops now",
        };
        part(verdict, wheels, law).map(|part| format!("{assumed}: {part}"))
    });
    let parts: Vec<String> = parts.collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

fn part(verdict: &WireVerdict, wheels: &[String], law: Law) -> Option<String> {
    let place = law as usize;
    let number = |number| verdict.predicted(number)[place];
    let lift_off_s = number(PredictedNumber::LiftOff);
    let is_ahead = lift_off_s.is_finite() && verdict.gap_of(law).is_none();
    let has_lifted = verdict.otf.iter().take(wheels.len()).any(|otf| *otf <= 0.0);
    if !is_ahead || has_lifted {
        return None;
    }
    let wheel = wheels.get(verdict.predicted_wheel[place] as usize);
    let wheel = wheel.map_or("?".into(), |name| name.to_uppercase());
    let earliest_s = number(PredictedNumber::Earliest);
    let latest_s = number(PredictedNumber::Latest);
    let latest = match latest_s.is_finite() {
        true => format!("to {latest_s:.1}"),
        false => "or later".into(),
    };
    let cause = verdict.predicted_cause_of(law).map(Contribution::name);
    let cause = cause.map_or(String::new(), |cause| {
        format!(", {}", cause.replace('_', " "))
    });
    Some(format!(
        "{wheel} lifts in {lift_off_s:.1} s ({earliest_s:.1} {latest}{cause})"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict() -> WireVerdict {
        let mut verdict = WireVerdict::unknown();
        verdict.otf[..2].copy_from_slice(&[900.0, 5000.0]);
        verdict.prediction_gap = [0, 2, 0];
        verdict.predicted_wheel = [1, 0, 0];
        verdict.predicted_cause[0] = 1 + Contribution::ArmWeight as u32;
        verdict.predicted_lift_off_s = [1.26, 0.1, f64::NAN];
        verdict.predicted_earliest_s = [0.94, 0.1, f64::NAN];
        verdict
    }

    #[test]
    fn says_what_lifts_and_nothing_of_gaps() {
        let wheels = ["fl".to_string(), "rr".to_string()];
        let mut verdict = verdict();
        let expected = "if it goes on: RR lifts in 1.3 s (0.9 or later, arm weight)";
        assert_eq!(prediction_text(&verdict, &wheels).unwrap(), expected);
        verdict.predicted_latest_s[0] = 1.55;
        let text = prediction_text(&verdict, &wheels).unwrap();
        assert!(text.contains("(0.9 to 1.6"), "{text}");
        // a number that no version knows is a reason, not a prediction
        verdict.prediction_gap[0] = 77;
        assert_eq!(prediction_text(&verdict, &wheels), None);
        // a wheel in the air is not ahead
        verdict.prediction_gap[0] = 0;
        verdict.otf[0] = -10.0;
        assert_eq!(prediction_text(&verdict, &wheels), None);
        assert_eq!(prediction_text(&WireVerdict::unknown(), &wheels), None);
    }
}
