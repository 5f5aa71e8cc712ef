//! When a prediction is made anew, and when the last one is repeated.

use super::ahead::{Ahead, Prediction};
use super::gap::PredictionGap;
use super::predictor::Predictor;
use crate::machine::Machine;
use crate::state::{Reasons, State};
use crate::verdict::Level;

/// Predicts the rows of a machine in order, and spares what cannot matter: at level Safe, a prediction by which no wheel may lift
/// within the horizon is repeated, with its age, until the next period of the rows' clock begins.
///
/// Which rows are predicted depends on their times, their levels and the predictions alone, never on the speed of the
/// computer: live and offline they are the same. Periods are counted from time zero of the clock, so that a start in the
/// middle of a session makes no difference after one period.
#[derive(Debug)]
pub struct PacedPredictor {
    /// The predictor; on a machine whose supports come and go, the empty prediction that is told instead.
    predictor: Result<Box<Predictor>, Prediction>,
    period_ns: i64,
    /// Time of the row for which the last prediction was made, if it may be repeated (ns).
    quiet_since_ns: Option<i64>,
}

impl PacedPredictor {
    /// A predictor that has seen nothing, for this machine; with another machine it panics or gives wrong results.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        Self {
            predictor: match machine.supports().vary() {
                true => Err(on_other_supports(machine)),
                false => Ok(Box::new(Predictor::new(machine))),
            },
            period_ns: ((machine.prediction.period * 1e9) as i64).max(1),
            quiet_since_ns: None,
        }
    }

    /// States the rate that is asked of each joint from the next row on (rad/s or m/s); NaN where none is.
    pub fn set_commands(&mut self, commands: &[f64]) {
        if let Ok(predictor) = &mut self.predictor {
            predictor.set_commands(commands);
        }
    }

    /// The prediction for the next row, with this time, state, reasons and level.
    pub fn row(
        &mut self,
        machine: &Machine,
        time_ns: i64,
        state: &State<f64>,
        reasons: Reasons,
        level: Level,
    ) -> &Prediction {
        let predictor = match &mut self.predictor {
            Ok(predictor) => predictor,
            Err(unknown) => return unknown,
        };
        let can_repeat = level.sees_no_danger() && reasons.leave_loads();
        let made_ns = (self.quiet_since_ns)
            .filter(|&made_ns| can_repeat && is_same_period(self.period_ns, made_ns, time_ns));
        if let Some(made_ns) = made_ns {
            predictor.set_age((time_ns - made_ns) as f64 * 1e-9);
        } else {
            let prediction = predictor.predict(machine, state, reasons, level);
            let is_quiet = prediction.ahead.iter().all(is_quiet);
            self.quiet_since_ns = (can_repeat && is_quiet).then_some(time_ns);
        }
        predictor.last()
    }
}

fn is_same_period(period_ns: i64, made_ns: i64, time_ns: i64) -> bool {
    let period = |time_ns: i64| time_ns.div_euclid(period_ns);
    time_ns >= made_ns && period(time_ns) == period(made_ns)
}

fn on_other_supports(machine: &Machine) -> Prediction {
    let mut unknown = Prediction::unknown(machine.supports().all.len());
    unknown.set_gap(PredictionGap::SupportsVary);
    unknown
}

/// Whether no wheel may lift within the horizon by this motion, not even where its OTF is two standard deviations less. True for
/// a motion that is never predicted on the machine: it hides nothing.
fn is_quiet(ahead: &Ahead) -> bool {
    match ahead.gap {
        None => ahead.earliest_s.is_nan() && ahead.lift_off_s.is_nan(),
        Some(gap) => matches!(gap, PredictionGap::NoArm | PredictionGap::VelocityUnknown),
    }
}
