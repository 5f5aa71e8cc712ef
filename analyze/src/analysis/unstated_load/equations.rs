//! The equations of a fall, and their errors without those of the machine's parameters.

use nalgebra::{DMatrix, DVector};
use tipwatch_mechanics::{Parameter, signal_errors};

use super::amounts::{Computed, RowState, Scene, Unstated};
use super::rows::FallRows;

/// Correlation times of the errors that the model leaves out and of the estimated accelerations (s).
const MODEL_S: f64 = 0.3;
const NOISE_S: f64 = 0.1;
/// Errors of the model are as large as stated, or so many times larger.
const MODEL_FACTORS: [f64; 3] = [1.0, 3.0, 10.0];
/// Error of the lean that the model leaves out, as a share of the root mean square of the lean.
const LEAN_SHARE: f64 = 0.03;
/// Noise of a measured lean (rad).
const LEAN_NOISE_RAD: f64 = 2e-4;
/// Correlation time of errors that no explanation has, and their usual size: as a share of weight times half the track for
/// moments, as a multiple of the lean for the lean. They are as large as usual, or so many times larger.
const UNEXPLAINED_S: f64 = 1.0;
const UNEXPLAINED_FACTORS: [f64; 4] = [0.1, 0.3, 1.0, 3.0];
const UNEXPLAINED_SHARE: f64 = 0.2;
const UNEXPLAINED_LEAN: f64 = 1.0;
/// Change of a signal by which derivatives are taken (in its unit).
const SIGNAL_STEP: f64 = 1e-4;

/// Estimate that an equation belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Lean,
    Onset,
    Fall,
}

/// One equation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Equation {
    pub(super) part: Part,
    /// Index of its row.
    pub(super) row: usize,
    /// Component of the lean, 0 or 1.
    pub(super) axis: usize,
}

/// The equations of a fall.
pub(super) struct Equations {
    pub(super) rows: Vec<RowState>,
    pub(super) all: Vec<Equation>,
    /// Standard deviations by equation: of white noise, of the noise of the estimated state, of the model.
    white: Vec<f64>,
    signals: Vec<f64>,
    /// Error by the lag of the estimated state, by equation. Where a motion turns round, so does what lags behind it.
    lag: Vec<f64>,
    model: Vec<f64>,
    /// Standard deviation of the errors that no explanation has, by equation.
    unexplained: Vec<f64>,
}

/// Errors of the model.
#[derive(Debug, Clone, Copy)]
pub(super) struct ModelError {
    /// Ratio of the errors to the stated ones.
    factor: f64,
    /// Correlation of errors that are so many correlation times apart.
    shape: fn(f64) -> f64,
    /// Correlation time (s).
    time_s: f64,
}

impl ModelError {
    pub(super) const STATED: Self = Self {
        factor: 1.0,
        shape: rough,
        time_s: MODEL_S,
    };

    /// Returns all errors that may come with an explanation, of any shape, as those that no explanation has: the estimated
    /// accelerations of a machine that bounces on its tyres are smooth, and no reason for another explanation.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let smoothly = |time_s| Self {
            shape: smooth,
            time_s,
            ..Self::STATED
        };
        let shapes = [Self::STATED, smoothly(MODEL_S), smoothly(NOISE_S)];
        shapes
            .into_iter()
            .flat_map(|error| MODEL_FACTORS.map(|factor| Self { factor, ..error }))
    }
}

/// Returns the correlation of errors `times` correlation times apart, for an error that can change abruptly.
fn rough(times: f64) -> f64 {
    (-times).exp()
}

/// Returns the correlation of errors `times` correlation times apart, for an error whose rate can change abruptly (a Matern
/// process of order 3/2).
fn smooth(times: f64) -> f64 {
    let root = 3.0_f64.sqrt() * times;
    (1.0 + root) * (-root).exp()
}

impl Equations {
    pub(super) fn new(scene: &Scene<'_>, rows: FallRows, has_lean: bool) -> Self {
        let FallRows {
            onset, fall, lean, ..
        } = rows;
        let mut all = Vec::new();
        let mut states = Vec::new();
        let lean = if has_lean { lean } else { Vec::new() };
        for (part, rows) in [(Part::Lean, lean), (Part::Onset, onset), (Part::Fall, fall)] {
            for row in rows {
                let axes = if part == Part::Lean { 2 } else { 1 };
                all.extend((0..axes).map(|axis| Equation {
                    part,
                    row: states.len(),
                    axis,
                }));
                states.push(row);
            }
        }
        let mut equations = Self {
            rows: states,
            all,
            white: Vec::new(),
            signals: Vec::new(),
            lag: Vec::new(),
            model: Vec::new(),
            unexplained: Vec::new(),
        };
        equations.set_noise(scene);
        equations
    }

    /// Number of rows of a part.
    pub(super) fn count(&self, part: Part) -> usize {
        let of_part = self.all.iter().filter(|of| of.part == part && of.axis == 0);
        of_part.count()
    }

    /// The places of the equations of a part.
    pub(super) fn of_part(&self, part: Part) -> Vec<usize> {
        let places = 0..self.all.len();
        places
            .filter(|&place| self.all[place].part == part)
            .collect()
    }

    /// Returns the residuals of the equations for computed rows (rad for leans, N m for moments): zero but for errors if all
    /// amounts are right.
    pub(super) fn residuals(&self, computed: &[Computed]) -> DVector<f64> {
        let first_lean = self.all.iter().find(|of| of.part == Part::Lean);
        let of = |equation: &Equation| {
            let (row, now) = (&self.rows[equation.row], &computed[equation.row]);
            match (equation.part, first_lean) {
                (Part::Lean, Some(first)) => {
                    let axis = equation.axis;
                    let leaned = now.lean_rad[axis] - computed[first.row].lean_rad[axis];
                    row.lean_rad[axis] - leaned
                }
                _ => -now.moment_nm,
            }
        };
        DVector::from_iterator(self.all.len(), self.all.iter().map(of))
    }

    /// Covariance of noise and of the model's errors.
    pub(super) fn covariance(&self, error: ModelError) -> DMatrix<f64> {
        let model: Vec<f64> = (self.model.iter())
            .map(|sigma| sigma * error.factor)
            .collect();
        let mut sum = self.correlated(&model, error.time_s, error.shape)
            + self.correlated(&self.signals, NOISE_S, rough)
            + self.correlated(&self.lag, NOISE_S, rough);
        for (place, sigma) in self.white.iter().enumerate() {
            sum[(place, place)] += sigma * sigma;
        }
        sum
    }

    /// Covariances that errors which no explanation has may be of: of several sizes, rough as an arm that knocks against
    /// something, or smooth as a rope that pulls.
    pub(super) fn unexplained(&self) -> impl Iterator<Item = DMatrix<f64>> {
        UNEXPLAINED_FACTORS.into_iter().flat_map(|factor| {
            let sigmas: Vec<f64> = self
                .unexplained
                .iter()
                .map(|sigma| sigma * factor)
                .collect();
            let kernels: [fn(f64) -> f64; 2] = [rough, smooth];
            kernels.map(|kernel| self.correlated(&sigmas, UNEXPLAINED_S, kernel))
        })
    }

    /// An error that is forgotten with time, given in correlation times: that of moments in one process, that of each component
    /// of the lean in another.
    fn correlated(&self, sigmas: &[f64], time_s: f64, kernel: fn(f64) -> f64) -> DMatrix<f64> {
        let kind = |place: usize| {
            let equation = self.all[place];
            match equation.part {
                Part::Lean => equation.axis,
                Part::Onset | Part::Fall => 2,
            }
        };
        let at_s = |place: usize| self.rows[self.all[place].row].time_s;
        DMatrix::from_fn(self.all.len(), self.all.len(), |a, b| {
            match kind(a) == kind(b) {
                true => sigmas[a] * sigmas[b] * kernel((at_s(a) - at_s(b)).abs() / time_s),
                false => 0.0,
            }
        })
    }

    fn set_noise(&mut self, scene: &Scene<'_>) {
        let computed = scene.computed(&self.rows, &[]);
        let by_signals = self.moment_errors_by_signals(scene, &computed);
        let squares = self.rows.iter().map(|row| row.lean_rad.norm_squared());
        let leaning = self.count(Part::Lean).max(1) as f64;
        let lean_rms = (squares.sum::<f64>() / leaning).sqrt();
        let wheels = scene.machine.wheels();
        let edge = &scene.machine.polygon().edges()[scene.edge];
        let place = |wheel: usize| wheels[wheel].centre_at_zero.xy();
        let along = (place(edge.to) - place(edge.from)).normalize();
        let distances = (0..wheels.len()).map(|w| along.perp(&(place(w) - place(edge.from))));
        let distances: Vec<f64> = distances.collect();
        let share = scene.machine.uncertainty().model_share;
        let squares: f64 = distances.iter().map(|d| d * d).sum();
        let track = distances.iter().copied().fold(0.0, f64::max);
        for equation in &self.all {
            let weight = computed[equation.row].normal_n.abs();
            let mean_load = weight / wheels.len() as f64;
            let [white, signals, lag, model, unexplained] = match equation.part {
                Part::Lean => [
                    LEAN_NOISE_RAD,
                    0.0,
                    0.0,
                    LEAN_SHARE * lean_rms,
                    UNEXPLAINED_LEAN * lean_rms,
                ],
                Part::Onset | Part::Fall => {
                    let model = share * mean_load * squares.sqrt();
                    let unexplained = UNEXPLAINED_SHARE * weight * 0.5 * track;
                    let [signals, lag] = by_signals[equation.row];
                    [0.1 * model, signals, lag, model, unexplained]
                }
            };
            self.white.push(white);
            self.signals.push(signals);
            self.lag.push(lag);
            self.model.push(model);
            self.unexplained.push(unexplained);
        }
    }

    /// Returns the standard deviation of the moment of each row by the noise of the estimated state, and its error by the lag, with its
    /// sign (N m): of positions and velocities as well as of accelerations. What lags behind a motion lags together.
    fn moment_errors_by_signals(&self, scene: &Scene<'_>, computed: &[Computed]) -> Vec<[f64; 2]> {
        let derivatives = Parameter::all(scene.machine).into_iter().map(|parameter| {
            let varies = parameter.is_signal() || matches!(parameter, Parameter::PayloadMass(_));
            if !varies {
                return vec![0.0; self.rows.len()];
            }
            let step = (Unstated::Parameter(parameter), SIGNAL_STEP);
            let changed = scene.computed(&self.rows, &[step]);
            let by = changed.iter().zip(computed);
            let by = by.map(|(changed, now)| (changed.moment_nm - now.moment_nm) / SIGNAL_STEP);
            // what cannot be evaluated with a change is not known to matter
            by.map(|by| if by.is_finite() { by } else { 0.0 }).collect()
        });
        let derivatives: Vec<Vec<f64>> = derivatives.collect();
        let of_row = |(place, row): (usize, &RowState)| {
            let of_row: Vec<f64> = derivatives.iter().map(|by| by[place]).collect();
            let mut state = row.state.clone();
            // the bias is constant: a nuisance
            state.noise.accelerometer_bias.covariance_change = [0.0; 6];
            signal_errors(scene.machine, &state, &of_row)
        };
        self.rows.iter().enumerate().map(of_row).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};
    use tipwatch_mechanics::State;

    use super::*;
    use crate::base::rigid::rigid;

    const LEFT: usize = 1;

    /// Returns the error of the moment by the lag that `set` gives a turning machine, and the change of the moment by what
    /// `change` adds to its state (N m).
    fn error_and_change(
        set: impl Fn(&mut State<f64>),
        change: impl Fn(&mut State<f64>),
    ) -> [f64; 2] {
        let machine = rigid();
        let scene = Scene {
            machine: &machine,
            edge: LEFT,
            load: machine.load_on_tool(),
            lean: None,
        };
        let mut state = State::zero(&machine);
        state.base.up = Vector3::z();
        state.imu.specific_force = Vector3::z() * machine.gravity();
        state.imu.angular_velocity = Vector3::new(0.6, 0.3, 0.4);
        set(&mut state);
        let row = RowState {
            time_ns: 0,
            time_s: 0.0,
            state,
            load_place: Vector3::zeros(),
            outward: Vector3::y(),
            rotation_rad: 0.0,
            lean_rad: Vector2::zeros(),
        };
        let mut changed = row.clone();
        change(&mut changed.state);
        let rows = [row, changed];
        let moments = scene.computed(&rows, &[]);
        let [row, _] = rows;
        let rows = FallRows {
            onset: Vec::new(),
            fall: vec![row],
            lean: Vec::new(),
            no_lean: None,
            has_attitude: true,
        };
        let equations = Equations::new(&scene, rows, false);
        [
            equations.lag[0],
            moments[1].moment_nm - moments[0].moment_nm,
        ]
    }

    #[test]
    fn an_angular_velocity_that_lags_is_an_error_of_the_moment() {
        let lag = Vector3::new(1e-3, -2e-3, 3e-3);
        let [error, change] = error_and_change(
            |state| state.lag.angular_velocity = lag,
            |state| state.imu.angular_velocity += lag,
        );
        assert!(change != 0.0, "{change}");
        assert!((error / change - 1.0).abs() < 0.02, "{error}, {change}");
    }

    #[test]
    fn what_lags_turns_round_with_the_motion() {
        let lag = Vector3::new(1e-2, 1e-2, -1e-2);
        let none = |_: &mut State<f64>| {};
        let [there, _] = error_and_change(|state| state.lag.angular_acceleration = lag, none);
        let [back, _] = error_and_change(|state| state.lag.angular_acceleration = -lag, none);
        assert!(there != 0.0 && there == -back, "{there}, {back}");
    }

    /// The lag of one motion is one error: about two axes it is the sum with their signs.
    #[test]
    fn what_lags_together_errs_together() {
        let lag = Vector3::new(1e-2, 1e-2, -1e-2);
        let [error, change] = error_and_change(
            |state| {
                state.lag.angular_acceleration = lag;
                state.lag.specific_force = lag;
            },
            |state| {
                state.imu.angular_acceleration += lag;
                state.imu.specific_force += lag;
            },
        );
        assert!((error / change - 1.0).abs() < 0.02, "{error}, {change}");
    }
}
