//! Estimation of a payload's mass from the force of the cylinder that lifts it.
//!
//! The actuator's force is linear in the mass. Over the rows in which the payload is attached,
//! ```text
//!     F_measured - f(without it) = m df/dm + mu |F| sign(rod velocity) + noise                    P(2)
//! ```
//! is solved for m and the friction mu by least squares, with mu constrained to zero within its stated
//! standard deviation. Errors that do not average out are added to the variance: masses and centres of mass of the links and the
//! position of the payload by finite differences, and the friction while the rod rests, whose direction is unknown then.

use nalgebra::{Matrix2, Vector2};

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::explain::sensitivity::followed_by;
use crate::machine::{Axis, Machine, Parameter};
use crate::state::State;
use crate::studies::actuator_force::{actuator_force, carries_payload, force_by_payload_mass};
use crate::studies::actuator_force_sigma::with_changed_links;

/// Below this rod speed (m/s) the sign of the friction is undetermined.
const LEAST_ROD_SPEED: f64 = 1e-3;
/// Time (s) after which force errors count as independent.
pub(super) const CORRELATION_S: f64 = 0.2;

/// A measured actuator force with its state.
#[derive(Debug, Clone)]
pub struct MeasuredForce {
    /// The state; its payload shares say which payloads are attached.
    pub state: State<f64>,
    /// Force (N), positive when it extends the rod.
    pub force: f64,
}

/// Accuracy of the measured force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceQuality {
    /// Standard deviation of one sample (N).
    pub sigma: f64,
    /// Standard deviation of the friction, as a fraction of the force.
    pub friction_share: f64,
    /// Sampling interval (s).
    pub interval_s: f64,
}

/// Estimated mass of a payload.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PayloadEstimate {
    /// Mass (kg).
    pub mass: f64,
    /// Standard deviation (kg).
    pub sigma: f64,
    /// Friction as a fraction of the force.
    pub friction_share: f64,
    /// Root mean square residual of the fit (N).
    pub residual: f64,
    /// Number of samples used.
    pub samples: usize,
}

/// Estimates a payload's mass from the actuator force of a linkage; `None` if the actuator does not carry
/// the payload or if no sample contains information.
#[must_use]
pub fn estimate_payload(
    machine: &Machine,
    linkage: usize,
    payload: usize,
    samples: &[MeasuredForce],
    quality: ForceQuality,
) -> Option<PayloadEstimate> {
    if !carries_payload(machine, linkage, payload) {
        return None;
    }
    let mut scale = Scale::new(machine, linkage, payload);
    let (mut sums, mut used) = (Sums::default(), Vec::new());
    for sample in samples {
        if sample.state.payload_share[payload] > 0.0
            && let Some(row) = scale.row(&sample.state, sample.force)
        {
            sums.add(&row);
            used.push(&sample.state);
        }
    }
    let fit = sums.fit(&quality)?;
    scale.update_systematic(used.get(used.len() / 2)?, 1);
    let constant = scale.systematic_variance(fit.mass);
    Some(PayloadEstimate {
        mass: fit.mass,
        sigma: (fit.variance + constant).sqrt(),
        friction_share: fit.friction,
        residual: fit.residual,
        samples: used.len(),
    })
}

/// A machine whose actuator weighs a payload.
#[derive(Debug)]
pub(super) struct Scale {
    linkage: usize,
    payload: usize,
    /// The machine without the payload.
    empty: Machine,
    /// The empty machine with each mass and centre of mass of its links off by one standard deviation.
    changed: Vec<Machine>,
    /// The empty machine with the payload's place off along each axis.
    moved: [Machine; 3],
    /// Change of the estimated mass by each of `changed` (kg), and by each of `moved` as a share of the mass; NaN before it was
    /// computed.
    by_changed: Vec<f64>,
    by_moved: [f64; 3],
    /// The next of both to be computed.
    next: usize,
    workspace: Workspace<f64>,
}

impl Scale {
    pub(super) fn new(machine: &Machine, linkage: usize, payload: usize) -> Self {
        let empty = machine.with_payload_mass(payload, 0.0, 0.0);
        let moved = Axis::ALL.map(|axis| {
            let mut moved = empty.clone();
            moved.payloads[payload].inertia.com[axis as usize] += empty.uncertainty.com;
            moved
        });
        let changed: Vec<Machine> = with_changed_links(&empty).collect();
        Self {
            linkage,
            payload,
            by_changed: vec![f64::NAN; changed.len()],
            changed,
            moved,
            by_moved: [f64::NAN; 3],
            next: 0,
            workspace: Workspace::new(&empty),
            empty,
        }
    }

    /// The equation of a state with its measured force (N); `None` if it says nothing.
    pub(super) fn row(&mut self, state: &State<f64>, measured: f64) -> Option<Row> {
        let empty = &self.empty;
        let places = (self.linkage, self.payload);
        let [known, by_mass] = force(empty, state, &mut self.workspace, places);
        let linkage = &empty.linkages[self.linkage];
        let rate = state.joints[linkage.measured_joint].rate;
        let speed = followed_by(linkage, state)[2].coordinate * rate;
        let is_at_rest = speed.abs() < LEAST_ROD_SPEED;
        let row = Row {
            excess: measured - known,
            by_mass,
            force: measured.abs(),
            direction: if is_at_rest { 0.0 } else { speed.signum() },
        };
        (row.excess.is_finite() && row.by_mass.is_finite()).then_some(row)
    }

    /// Computes again, in this posture, the change of the mass by uncertain links in the pivot's distal subtree and by the
    /// uncertain position of the payload: one of `parts` parts of it, the next with the next call. Does not allocate.
    pub(super) fn update_systematic(&mut self, state: &State<f64>, parts: usize) {
        let places = (self.linkage, self.payload);
        let workspace = &mut self.workspace;
        let [known, by_mass] = force(&self.empty, state, workspace, places);
        let all = self.changed.len() + self.moved.len();
        for _ in 0..all.div_ceil(parts) {
            match self.next.checked_sub(self.changed.len()) {
                None => {
                    let [changed, _] = force(&self.changed[self.next], state, workspace, places);
                    self.by_changed[self.next] = (changed - known) / by_mass;
                }
                Some(axis) => {
                    let [_, moved] = force(&self.moved[axis], state, workspace, places);
                    self.by_moved[axis] = (moved - by_mass) / by_mass;
                }
            }
            self.next = (self.next + 1) % all;
        }
    }

    /// Variance of a mass (kg) due to these; NaN before all were computed (kg^2).
    pub(super) fn systematic_variance(&self, mass: f64) -> f64 {
        let by_links = self.by_changed.iter().map(|by| by.powi(2));
        let by_place = self.by_moved.iter().map(|by| (mass * by).powi(2));
        by_links.chain(by_place).sum()
    }
}

/// Force of a linkage's actuator (N), and its derivative with respect to a payload's mass (N/kg).
fn force(
    machine: &Machine,
    state: &State<f64>,
    workspace: &mut Workspace<f64>,
    (linkage, payload): (usize, usize),
) -> [f64; 2] {
    evaluate(machine, state, workspace);
    let known = actuator_force(machine, state, workspace, linkage);
    let by_mass = force_by_payload_mass(machine, state, workspace, linkage, payload);
    [known, by_mass]
}

/// One equation of the fit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    /// Measured force minus the force without the payload (N).
    excess: f64,
    /// Derivative with respect to the mass (N/kg).
    by_mass: f64,
    /// The measured force without its sign (N).
    force: f64,
    /// Direction in which the rod moves; 0 at rest.
    direction: f64,
}

impl Row {
    /// Derivatives with respect to the mass and to the friction fraction.
    fn factors(&self) -> Vector2<f64> {
        Vector2::new(self.by_mass, self.force * self.direction)
    }

    /// Whether a fit explains the row within `sigmas` standard deviations: of one sample, of its friction and of the fit.
    pub(super) fn is_explained(&self, by: &Fit, quality: &ForceQuality, sigmas: f64) -> bool {
        let left = self.excess - self.factors().dot(&Vector2::new(by.mass, by.friction));
        let variance = quality.sigma.powi(2)
            + (quality.friction_share * self.force).powi(2)
            + by.variance * self.by_mass.powi(2);
        left.powi(2) <= sigmas.powi(2) * variance
    }
}

/// The sums of the least squares for mass and friction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    rows: f64,
    normal: Matrix2<f64>,
    right: Vector2<f64>,
    /// Sum of the squared excesses (N^2).
    squares: f64,
    /// Part of the right side by friction of the whole force, in the rows in which the rod rests.
    at_rest: Vector2<f64>,
}

impl Sums {
    pub(super) fn add(&mut self, row: &Row) {
        let factors = row.factors();
        self.rows += 1.0;
        self.normal += factors * factors.transpose();
        self.right += factors * row.excess;
        self.squares += row.excess.powi(2);
        if row.direction == 0.0 {
            self.at_rest += factors * row.force;
        }
    }

    /// Lets all rows so far count for less.
    pub(super) fn forget(&mut self, kept: f64) {
        self.rows *= kept;
        self.normal *= kept;
        self.right *= kept;
        self.squares *= kept;
        self.at_rest *= kept;
    }

    pub(super) fn fit(&self, quality: &ForceQuality) -> Option<Fit> {
        let mut normal = self.normal;
        // Prior: friction is zero within its stated standard deviation.
        normal[(1, 1)] += (quality.sigma / quality.friction_share).powi(2);
        let inverse = normal.try_inverse()?;
        let solution = inverse * self.right;
        let explained = 2.0 * solution.dot(&self.right) - solution.dot(&(self.normal * solution));
        let residual = ((self.squares - explained).max(0.0) / self.rows).sqrt();
        let sigma = residual.max(quality.sigma);
        let repeats = (CORRELATION_S / quality.interval_s).max(1.0);
        let at_rest = quality.friction_share * (inverse * self.at_rest).x;
        Some(Fit {
            mass: solution.x,
            friction: solution.y,
            variance: inverse[(0, 0)] * sigma * sigma * repeats + at_rest * at_rest,
            residual,
        })
        .filter(|fit| fit.mass.is_finite() && fit.variance.is_finite())
    }
}

/// Least squares for mass and friction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// (kg)
    pub(super) mass: f64,
    friction: f64,
    /// Variance of the mass without that of the links and of the payload's position (kg^2).
    pub(super) variance: f64,
    /// (N)
    residual: f64,
}

impl Machine {
    /// Returns this machine with a different mass of a payload and its standard deviation (kg).
    #[must_use]
    pub fn with_payload_mass(&self, payload: usize, mass: f64, sigma: f64) -> Self {
        let change = mass - self.payloads[payload].inertia.mass;
        let mut machine = self.changed(&[(Parameter::PayloadMass(payload), change)]);
        machine.payloads[payload].mass_sigma = Some(sigma);
        machine
    }
}
