//! The prediction of one row: states ahead, their loads, and the first wheel to lift.

use std::sync::Arc;

use super::ahead::{Ahead, Prediction};
use super::gap::PredictionGap;
use super::instant::Instant;
use super::joints::JointLaw;
use super::law::Law;
use super::platform::Platform;
use crate::dynamics::kinematics::{self, SensorFrame};
use crate::evaluate::batch::{BatchWorkspace, OutcomeColumns, evaluate_into};
use crate::evaluate::model::Model;
use crate::evaluate::quantities::Quantity;
use crate::evaluate::scope::Scope;
use crate::explain::attribution::Contribution;
use crate::explain::uncertainty::utilisation;
use crate::geometry::coordinate::Coordinate;
use crate::machine::{MAX_WHEELS, Machine};
use crate::state::{JetCovariance, Reason, Reasons, State, StateColumns};
use crate::verdict::Level;

/// Number of standard deviations of the band around the time of lift-off.
const BAND: f64 = 2.0;

/// Row of the present state among those that are explained; the laws follow.
const NOW: usize = 0;

/// Scope of the evaluation of the present state, and of one state of each law.
const EXPLAINED: Scope = Scope {
    contributions: true,
    sensitivities: true,
    ..Scope::LOADS
};

/// Predicts the loads of one machine from its present state. Keeps nothing from one row to the next but the commanded rates; a
/// prediction does not allocate.
#[derive(Debug)]
pub struct Predictor {
    joints: Vec<JointLaw>,
    has_arm: bool,
    /// Now, then the instants ahead.
    instants: Vec<Instant>,
    coordinates: Vec<Coordinate<f64>>,
    /// The rate that is asked of each joint; NaN where none is.
    commands: Vec<f64>,
    /// The present state, and the state at an instant.
    now: State<f64>,
    then: State<f64>,
    /// The states of all laws, and their loads.
    states: StateColumns,
    loads: BatchWorkspace,
    outcomes: OutcomeColumns,
    /// The present state and one state of each law, and all about their loads.
    chosen: StateColumns,
    explainer: BatchWorkspace,
    explained: OutcomeColumns,
    places: Places,
    prediction: Prediction,
}

/// Places of numbers among the columns: a search in every row would cost as much as the loads.
#[derive(Debug)]
struct Places {
    /// OTF by wheel, of the states ahead.
    otf: Vec<usize>,
    /// The following, of the explained states: OTF and its standard deviation by wheel.
    explained_otf: Vec<usize>,
    sigma: Vec<usize>,
    /// Contributions by wheel and cause.
    contributions: Vec<Vec<usize>>,
}

impl Places {
    fn new(outcomes: &OutcomeColumns, explained: &OutcomeColumns, wheels: usize) -> Self {
        let find = |columns: &OutcomeColumns, quantity: Quantity| {
            let found = columns.place(quantity);
            found.unwrap_or_else(|| panic!("no column of {quantity:?}"))
        };
        let by_wheel = |columns, of: fn(usize) -> Quantity| -> Vec<usize> {
            (0..wheels).map(|wheel| find(columns, of(wheel))).collect()
        };
        let causes = |wheel| {
            let causes = Contribution::ALL.into_iter();
            causes.map(move |cause| find(explained, Quantity::Contribution(cause, wheel)))
        };
        Self {
            otf: by_wheel(outcomes, Quantity::Otf),
            explained_otf: by_wheel(explained, Quantity::Otf),
            sigma: by_wheel(explained, Quantity::OtfSigma),
            contributions: (0..wheels).map(|wheel| causes(wheel).collect()).collect(),
        }
    }
}

/// The instant of a law at which a wheel is closest to lifting.
#[derive(Debug, Clone, Copy)]
struct Worst {
    instant: usize,
    /// Its row among the states ahead.
    row: usize,
    /// The last instant up to the worst one at which the machine does not tip: a machine that tips has no standard deviations and
    /// no causes. `None` if it tips at once, and then those of the present state are used.
    explained: Option<usize>,
}

/// An instant of a law: its OTF are in a row of the explained states or of the states ahead.
#[derive(Debug, Clone, Copy)]
enum Node {
    Now,
    Ahead { instant: usize, row: usize },
}

impl Predictor {
    /// A predictor for this machine; with another machine it panics or gives wrong results.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let model = Arc::new(Model::WholeBody);
        let joints = JointLaw::all(machine);
        let times = std::iter::once(0.0).chain(machine.prediction.times_s());
        let instants: Vec<_> = times.map(|time_s| Instant::new(machine, time_s)).collect();
        let rows = Law::ALL.map(|law| rows_of(law, instants.len()).len());
        let [outcomes, explained] =
            [Scope::LOADS, EXPLAINED].map(|scope| OutcomeColumns::empty(machine, scope));
        let mut predictor = Self {
            has_arm: joints.iter().any(JointLaw::moves_arm),
            joints,
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies.len()],
            commands: vec![f64::NAN; machine.joints.len()],
            now: State::zero(machine),
            then: State::zero(machine),
            states: StateColumns::unknown(machine, rows.iter().sum()),
            loads: BatchWorkspace::new(machine, Scope::LOADS, &model),
            places: Places::new(&outcomes, &explained, machine.wheels.len()),
            outcomes,
            chosen: StateColumns::unknown(machine, 1 + Law::ALL.len()),
            explainer: BatchWorkspace::new(machine, EXPLAINED, &model),
            explained,
            prediction: Prediction::unknown(machine.wheels.len()),
            instants,
        };
        // the first evaluation allocates its columns
        predictor.evaluate_ahead(machine);
        predictor.explain(machine);
        predictor
    }

    fn evaluate_ahead(&mut self, machine: &Machine) {
        let rows = 0..self.states.rows();
        let (workspace, outcomes) = (&mut self.loads, &mut self.outcomes);
        evaluate_into(machine, &self.states, rows, workspace, outcomes);
    }

    fn explain(&mut self, machine: &Machine) {
        let rows = 0..self.chosen.rows();
        let (workspace, outcomes) = (&mut self.explainer, &mut self.explained);
        evaluate_into(machine, &self.chosen, rows, workspace, outcomes);
    }

    /// The last prediction.
    #[must_use]
    pub fn last(&self) -> &Prediction {
        &self.prediction
    }

    /// Gives the last prediction an age (s): it is repeated for a later row.
    pub(super) fn set_age(&mut self, age_s: f64) {
        self.prediction.age_s = age_s;
    }

    /// States the rate that is asked of each joint from now on (rad/s or m/s), NaN where none is: such a joint goes on as it moves.
    pub fn set_commands(&mut self, commands: &[f64]) {
        for (known, command) in self.commands.iter_mut().zip(commands) {
            *known = *command;
        }
    }

    /// Predicts from the state of a row with these reasons and this level. Nothing is predicted where the level says that
    /// nothing is known of the present.
    pub fn predict(
        &mut self,
        machine: &Machine,
        state: &State<f64>,
        reasons: Reasons,
        level: Level,
    ) -> &Prediction {
        let is_known = !matches!(level, Level::Unknown | Level::Fault);
        if is_known && reasons.leave_loads() {
            self.predict_loads(machine, state);
            self.prediction.age_s = 0.0;
        } else {
            self.prediction.set_gap(PredictionGap::RowInvalid);
        }
        &self.prediction
    }

    /// OTF of a wheel by a law at a time ahead (N), interpolated between the instants of the last prediction; NaN beyond the
    /// horizon or where it is unknown.
    #[must_use]
    pub fn otf_at(&self, law: Law, time_s: f64, wheel: usize) -> f64 {
        let mut nodes = self.nodes(law).map(|node| self.point(node, wheel));
        let is_known = self.prediction.of(law).gap.is_none();
        let Some(mut before) = nodes.next().filter(|_| is_known) else {
            return f64::NAN;
        };
        for after in nodes {
            if time_s <= after.0 {
                let share = (time_s - before.0) / (after.0 - before.0);
                return before.1 + share * (after.1 - before.1);
            }
            before = after;
        }
        f64::NAN
    }

    fn predict_loads(&mut self, machine: &Machine, state: &State<f64>) {
        let platform = self.begin(machine, state);
        for law in Law::ALL {
            for (row, instant) in rows_of(law, self.instants.len()).zip(first_of(law)..) {
                self.set_then(machine, &platform, law, instant);
                self.states.set(row, &mut self.then);
            }
        }
        self.evaluate_ahead(machine);
        self.chosen.set(NOW, &mut self.now);
        let worst = Law::ALL.map(|law| {
            let (worst, gap) = self.find_worst(machine, law);
            let lacks = match law {
                Law::BrakeNow if !platform.has_velocity() => Some(PredictionGap::VelocityUnknown),
                Law::StopArm if !self.has_arm => Some(PredictionGap::NoArm),
                _ => gap,
            };
            self.prediction.ahead[law as usize].gap = lacks;
            let instant = worst.explained.unwrap_or(worst.instant);
            self.set_then(machine, &platform, law, instant);
            propagate(&mut self.then, &self.instants[instant]);
            self.chosen.set(1 + law as usize, &mut self.then);
            worst
        });
        self.explain(machine);
        // what goes on begins now
        let now = self.explained.reasons(NOW, Reasons::NONE);
        let lacks_now = (!now.leave_loads()).then_some(PredictionGap::NotFinite);
        for (law, worst) in Law::ALL.into_iter().zip(&worst) {
            let place = &mut self.prediction.ahead[law as usize];
            // an empty list does not allocate
            let mut ahead = std::mem::replace(place, Ahead::unknown(0));
            match ahead.gap.or(lacks_now) {
                Some(gap) => ahead.set_gap(gap),
                None => self.fill(machine, law, worst, &mut ahead),
            }
            self.prediction.ahead[law as usize] = ahead;
        }
    }

    /// Copies the present state, without the forces of actuators: their future values are unknown, and the split rule holds.
    fn begin(&mut self, machine: &Machine, state: &State<f64>) -> Platform {
        self.now.copy_from(state);
        self.now.actuator_force.fill(f64::NAN);
        self.then.copy_from(&self.now);
        kinematics::coordinates(machine, &self.now, &mut self.coordinates);
        let sensor_frame = SensorFrame::of(machine, &self.coordinates);
        let base = kinematics::base_motion(machine, &sensor_frame, &self.now.imu);
        Platform::new(machine, base, &self.now.base)
    }

    /// Sets the state of a law at an instant, with the noise of the present one.
    fn set_then(&mut self, machine: &Machine, platform: &Platform, law: Law, instant: usize) {
        let instant = &self.instants[instant];
        let course = platform.at(law, instant);
        let stop_time_s = machine.prediction.stop_time;
        let joints = self.joints.iter().zip(&self.now.joints);
        let joints = joints.zip(&self.commands);
        for (((joint, now), &command), then) in joints.zip(&mut self.then.joints) {
            *then = joint.at(law, now, command, instant, &course, stop_time_s);
        }
        if machine.imu.body != 0 {
            kinematics::coordinates(machine, &self.then, &mut self.coordinates);
        }
        let sensor_frame = SensorFrame::of(machine, &self.coordinates);
        self.then.imu = sensor_frame.measured(&course.base);
        self.then.base = course.known;
        self.then.noise = self.now.noise;
        self.then.lag.copy_from(&self.now.lag);
    }

    /// Finds the first instant with a lifted wheel, else the one at which a wheel has the least of its static load; returns
    /// why the loads are unknown before.
    fn find_worst(&self, machine: &Machine, law: Law) -> (Worst, Option<PredictionGap>) {
        let static_load = &machine.reference.static_load;
        let (mut least, mut last_on_ground) = (f64::INFINITY, None);
        let mut worst = Worst {
            instant: first_of(law),
            row: rows_of(law, self.instants.len()).start,
            explained: None,
        };
        for (row, instant) in rows_of(law, self.instants.len()).zip(first_of(law)..) {
            let reasons = self.outcomes.reasons(row, Reasons::NONE);
            if reasons.has(Reason::LinkageOpen) {
                return (worst, Some(PredictionGap::LinkageOpen));
            }
            if !reasons.leave_loads() {
                return (worst, Some(PredictionGap::NotFinite));
            }
            if !reasons.has(Reason::Tipping) {
                last_on_ground = Some(instant);
            }
            for (wheel, &load) in static_load.iter().enumerate() {
                let otf = self.outcomes.columns[self.places.otf[wheel]][row];
                let left = share_left(otf, load);
                if left < least || otf <= 0.0 {
                    least = left;
                    worst = Worst {
                        instant,
                        row,
                        explained: last_on_ground,
                    };
                }
                if otf <= 0.0 {
                    return (worst, None);
                }
            }
        }
        (worst, None)
    }

    /// The instants of a law, in order.
    fn nodes(&self, law: Law) -> impl Iterator<Item = Node> + use<> {
        let ahead = rows_of(law, self.instants.len())
            .zip(first_of(law)..)
            .map(|(row, instant)| Node::Ahead { instant, row });
        let starts_now = law == Law::GoOn;
        starts_now.then_some(Node::Now).into_iter().chain(ahead)
    }

    /// Time (s) and OTF of a wheel (N).
    fn point(&self, node: Node, wheel: usize) -> (f64, f64) {
        match node {
            Node::Now => (
                0.0,
                self.explained.columns[self.places.explained_otf[wheel]][NOW],
            ),
            Node::Ahead { instant, row } => (
                self.instants[instant].time_s,
                self.outcomes.columns[self.places.otf[wheel]][row],
            ),
        }
    }

    /// Returns the time at which the OTF of a wheel plus `more` becomes zero (s), by straight lines between the instants; NaN if
    /// it does not.
    fn crossing_s(&self, law: Law, wheel: usize, more: f64) -> f64 {
        let mut before: Option<(f64, f64)> = None;
        for node in self.nodes(law) {
            let (time_s, otf) = self.point(node, wheel);
            let otf = otf + more;
            if otf <= 0.0 {
                return match before {
                    // in this form a smaller OTF never crosses later, whatever is rounded
                    Some((from_s, from)) => {
                        (from_s + (time_s - from_s) / (1.0 - otf / from)).min(time_s)
                    }
                    None => time_s,
                };
            }
            before = Some((time_s, otf));
        }
        f64::NAN
    }

    fn fill(&self, machine: &Machine, law: Law, worst: &Worst, ahead: &mut Ahead) {
        let row = worst.explained.map_or(NOW, |_| 1 + law as usize);
        let places = &self.places;
        let explained = |column: usize| self.explained.columns[column][row];
        let static_load = &machine.reference.static_load;
        let wheels = 0..static_load.len();
        let (mut at_worst, mut sigmas) = ([f64::NAN; MAX_WHEELS], [f64::NAN; MAX_WHEELS]);
        let mut closest = (f64::INFINITY, 0);
        (ahead.lift_off_s, ahead.earliest_s) = (f64::NAN, f64::NAN);
        let mut lifts = None;
        for wheel in wheels {
            let otf = &self.outcomes.columns[places.otf[wheel]];
            let rows = rows_of(law, self.instants.len());
            ahead.otf_least[wheel] = otf[rows].iter().copied().fold(f64::INFINITY, f64::min);
            let lift_off_s = self.crossing_s(law, wheel, 0.0);
            if lift_off_s.is_finite() && !(ahead.lift_off_s <= lift_off_s) {
                ahead.lift_off_s = lift_off_s;
                lifts = Some(wheel);
            }
            let sigma = explained(places.sigma[wheel]);
            let earliest_s = self.crossing_s(law, wheel, -BAND * sigma).min(lift_off_s);
            ahead.earliest_s = ahead.earliest_s.min(earliest_s);
            (at_worst[wheel], sigmas[wheel]) = (otf[worst.row], sigma);
            let left = share_left(at_worst[wheel], static_load[wheel]);
            if left < closest.0 {
                closest = (left, wheel);
            }
        }
        let wheel = lifts.unwrap_or(closest.1);
        ahead.wheel = Some(wheel);
        ahead.latest_s = self.crossing_s(law, wheel, BAND * sigmas[wheel]);
        ahead.utilisation = utilisation(machine, &at_worst, &sigmas);
        ahead.cause = self.cause(row, wheel);
    }

    /// The contribution that takes most off the OTF of a wheel from now to an explained row.
    fn cause(&self, row: usize, wheel: usize) -> Option<Contribution> {
        let mut most = (0.0, None);
        let places = &self.places.contributions[wheel];
        for (cause, &place) in Contribution::ALL.into_iter().zip(places) {
            // what lifted wheels leave to the others is no part of the OTF
            if cause == Contribution::LiftOff {
                continue;
            }
            let column = &self.explained.columns[place];
            let change = column[row] - column[NOW];
            if change < most.0 {
                most = (change, Some(cause));
            }
        }
        most.1
    }
}

/// OTF as a fraction of the static load, or itself where that is unknown: only compared.
fn share_left(otf: f64, static_load: f64) -> f64 {
    if static_load.is_finite() {
        otf / static_load
    } else {
        otf
    }
}

/// Index of the first instant of a law. Going on begins with the present state, which is known; the others jump.
fn first_of(law: Law) -> usize {
    usize::from(law == Law::GoOn)
}

/// The rows of a law among the states ahead, for this number of instants with the present one.
fn rows_of(law: Law, instants: usize) -> std::ops::Range<usize> {
    let start = match law {
        Law::GoOn => 0,
        Law::BrakeNow => instants - 1,
        Law::StopArm => 2 * instants - 1,
    };
    start..start + instants - first_of(law)
}

/// Carries the covariance of the signals ahead by the same law: `P' = F P F'`. It is that of the assumed motion; what the
/// operator will do is no part of it.
///
/// ```text
///     F = | 1  t  d |
///         | 0  1  i |
///         | 0  0  e |
/// ```
fn propagate(state: &mut State<f64>, instant: &Instant) {
    let (noise, lag) = (&mut state.noise, &mut state.lag);
    let JetCovariance {
        value: [p00, p01, p02],
        first: [p11, p12],
        second: p22,
    } = noise.joint;
    let p = [[p00, p01, p02], [p01, p11, p12], [p02, p12, p22]];
    let decay = &instant.joint;
    let f = [
        [1.0, instant.time_s, decay.d],
        [0.0, 1.0, decay.i],
        [0.0, 0.0, decay.e],
    ];
    let element = |a: usize, b: usize| -> f64 {
        let products = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        products.map(|(i, j)| f[a][i] * p[i][j] * f[b][j]).sum()
    };
    noise.joint = JetCovariance {
        value: [element(0, 0), element(0, 1), element(0, 2)],
        first: [element(1, 1), element(1, 2)],
        second: element(2, 2),
    };
    let e = instant.shake.e;
    let [w, w_alpha, alpha] = noise.turning;
    noise.turning = [w, w_alpha * e, alpha * e * e];
    // With the last column of P', which is e F P[:, 2], a lag of e l gives the error F P[:, 2] l / P[2][2].
    lag.joints.iter_mut().for_each(|lag| *lag *= decay.e);
    lag.angular_acceleration *= e;
}
