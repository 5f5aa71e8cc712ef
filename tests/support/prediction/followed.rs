//! A log followed row by row by the causal estimator and the predictor, with the truth beside it.

use std::path::{Path, PathBuf};

use crate::Truth;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Estimator;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::PredictionSpec;
use tipwatch_mechanics::prediction::{Ahead, Law, PacedPredictor, Predictor};
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::{Quantity, State};

/// Times ahead at which loads are compared (s).
pub const AHEAD_S: [f64; 3] = [0.5, 1.0, 2.0];
/// A wheel with less than this share of the mean load is off the ground.
pub const OFF_GROUND: f64 = 0.01;
/// Time for which a wheel must be off the ground to have lifted (s); a bounce is shorter.
const LIFTED_S: f64 = 0.05;
/// Time without a wheel off the ground after which a lift begins (s).
const APART_S: f64 = 1.0;

/// Results of one row, and its errors.
#[derive(Debug, Clone)]
pub struct Row {
    /// Time after the first sample of the truth (s).
    pub time_s: f64,
    /// The level of the verdict.
    pub level: Level,
    /// The plain rate, as the verdict announces it (s); NaN without.
    pub by_rate_s: f64,
    /// Prediction by law, as the user gets it: repeated where the program repeats it.
    pub ahead: [Ahead; Law::ALL.len()],
    /// Speed along the ground (m/s); NaN where it is unknown.
    pub speed: f64,
    /// Velocity of the fastest joint that is not a wheel (rad/s or m/s).
    pub arm_speed: f64,
    /// Squared errors of the loads ahead relative to the mean load, of the prediction and of the present loads; NaN where a
    /// wheel is off the ground.
    pub errors: [[f64; 2]; AHEAD_S.len()],
}

/// A true lift.
#[derive(Debug, Clone, Copy)]
pub struct Lift {
    /// Start of the lift (s).
    pub time_s: f64,
}

/// A log with the results of its rows.
#[derive(Debug)]
pub struct Followed {
    /// Name of the log.
    pub name: String,
    /// Its rows.
    pub rows: Vec<Row>,
    /// Mean load of a wheel (N).
    pub mean_load: f64,
    log: PathBuf,
    keys: PredictionSpec,
    truth: Truth,
    wheels: usize,
    lifts: Vec<Lift>,
    /// Time during which all wheels were on the ground (s).
    pub on_ground_s: f64,
}

impl Followed {
    /// Follows a log with its machine file and truth beside it. `keys` replaces the machine file's `[prediction]`.
    ///
    /// # Panics
    /// A file is missing.
    #[must_use]
    pub fn new(log: &Path, keys: Option<&PredictionSpec>) -> Self {
        let options = crate::by(Estimator::Causal);
        let machine = log.with_extension("toml");
        let mut file = MachineFile::read(&machine).expect("a simulated log with its truth");
        if let Some(keys) = keys {
            file.spec.prediction = keys.clone();
        }
        let analysis =
            analyse(log, &file, options, &mut |_| {}).expect("a simulated log with its truth");
        let machine = &analysis.machine;
        let names: Vec<&str> = machine.wheels().iter().map(|w| w.name.as_str()).collect();
        let truth = Truth::smoothed_already(log, &names);
        let start_ns = truth.times_ns()[0];
        let seconds = |time_ns: i64| (time_ns - start_ns) as f64 * 1e-9;
        let mean = machine.mass() * machine.gravity() / names.len() as f64;
        let (lifts, on_ground_s) = true_lifts(&truth, names.len(), OFF_GROUND * mean);
        let verdicts = analysis
            .rows
            .whole()
            .verdicts
            .as_ref()
            .expect("a simulated log with its truth");
        let mut pacer = PacedPredictor::new(machine);
        let mut predictor = Predictor::new(machine);
        let mut state = State::zero(machine);
        let last_ns = *truth
            .times_ns()
            .last()
            .expect("a simulated log with its truth");
        let rows = (0..analysis.rows.len()).map(|row| {
            let time_ns = analysis.rows.times_ns[row];
            analysis.rows.state(row, &mut state);
            let reasons = analysis.rows.reasons[row];
            let level = verdicts.verdicts[row].level;
            let prediction = pacer.row(machine, time_ns, &state, reasons, level).clone();
            // the loads at given times ahead are those of the row itself
            predictor.predict(machine, &state, reasons, level);
            let mut errors = [[f64::NAN; 2]; AHEAD_S.len()];
            for (errors, ahead_s) in errors.iter_mut().zip(AHEAD_S) {
                let then_ns = time_ns + (ahead_s * 1e9) as i64;
                let is_known = then_ns < last_ns && reasons.is_empty();
                let loads: Vec<f64> = (0..names.len()).map(|w| truth.load(w, then_ns)).collect();
                if !is_known || loads.iter().any(|load| *load < OFF_GROUND * mean) {
                    continue;
                }
                let square = |of: &dyn Fn(usize) -> f64| {
                    let squares = loads.iter().enumerate();
                    let squares = squares.map(|(wheel, load)| ((of(wheel) - load) / mean).powi(2));
                    squares.sum::<f64>() / loads.len() as f64
                };
                *errors = [
                    square(&|wheel| predictor.otf_at(Law::GoOn, ahead_s, wheel)),
                    square(&|wheel| {
                        analysis.rows.whole().outcomes.column(Quantity::Otf(wheel))[row]
                    }),
                ];
            }
            let along = &state.base.velocity;
            let joints = machine.joints().iter().zip(&state.joints);
            let others = joints.filter(|(joint, _)| joint.spins_wheel.is_none());
            Row {
                time_s: seconds(time_ns),
                level,
                by_rate_s: verdicts.time_to_lift_off_s[row],
                ahead: prediction.ahead,
                speed: along.x.hypot(along.y),
                arm_speed: others.fold(0.0, |most, (_, motion)| motion.rate.abs().max(most)),
                errors,
            }
        });
        let rows: Vec<Row> = rows.collect();
        Self {
            mean_load: mean,
            log: log.to_path_buf(),
            keys: machine.prediction().clone(),
            wheels: names.len(),
            name: log
                .file_stem()
                .expect("a simulated log with its truth")
                .to_string_lossy()
                .into_owned(),
            rows,
            truth,
            lifts,
            on_ground_s,
        }
    }

    /// Returns the log followed again, with other keys of `[prediction]`.
    #[must_use]
    pub fn again(&self, keys: &PredictionSpec) -> Self {
        Self::new(&self.log, Some(keys))
    }

    /// The keys of `[prediction]`.
    #[must_use]
    pub fn keys(&self) -> &PredictionSpec {
        &self.keys
    }

    /// The wheel that comes to carry least within a span of time (s), and that load (N), a mean over `LIFTED_S`.
    #[must_use]
    pub fn least_load(&self, span_s: [f64; 2]) -> (usize, f64) {
        let start_ns = self.truth.times_ns()[0];
        let at_ns = |time_s: f64| start_ns + (time_s * 1e9) as i64;
        let steps = ((span_s[1] - span_s[0]) / LIFTED_S * 5.0) as usize;
        let mut least = (0, f64::INFINITY);
        for step in 0..=steps {
            let from_s = span_s[0] + step as f64 * LIFTED_S / 5.0;
            for wheel in 0..self.wheels {
                let loads = (0..10).map(|k| from_s + (f64::from(k) / 10.0 - 0.5) * LIFTED_S);
                let mean = loads
                    .map(|time_s| self.truth.load(wheel, at_ns(time_s)))
                    .sum::<f64>()
                    / 10.0;
                if mean < least.1 {
                    least = (wheel, mean);
                }
            }
        }
        least
    }

    /// The true lifts.
    #[must_use]
    pub fn lifts(&self) -> &[Lift] {
        &self.lifts
    }
}

/// The lifts, and the time during which all wheels were on the ground (s).
fn true_lifts(truth: &Truth, wheels: usize, off_ground: f64) -> (Vec<Lift>, f64) {
    let times_ns = truth.times_ns();
    let seconds = |row: usize| (times_ns[row] - times_ns[0]) as f64 * 1e-9;
    let (mut lifts, mut last_off_s, mut on_ground_s) = (Vec::new(), f64::NEG_INFINITY, 0.0);
    let mut off_since: Vec<Option<f64>> = vec![None; wheels];
    for (row, &time_ns) in times_ns.iter().enumerate() {
        let mut lifted_s: Option<f64> = None;
        for (wheel, since) in off_since.iter_mut().enumerate() {
            if truth.load(wheel, time_ns) >= off_ground {
                *since = None;
                continue;
            }
            let since = *since.get_or_insert(seconds(row));
            if seconds(row) - since >= LIFTED_S {
                lifted_s = Some(lifted_s.map_or(since, |other| other.min(since)));
            }
        }
        if let Some(since) = lifted_s {
            if since - last_off_s >= APART_S {
                lifts.push(Lift { time_s: since });
            }
            last_off_s = seconds(row);
        } else if row > 0 {
            on_ground_s += seconds(row) - seconds(row - 1);
        }
    }
    (lifts, on_ground_s)
}
