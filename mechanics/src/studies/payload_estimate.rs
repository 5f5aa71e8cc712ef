//! Estimation of a payload's mass from the force of the cylinder that lifts it.
//!
//! The actuator's force is linear in the mass. Over the rows in which the payload is attached,
//! ```text
//!     F_measured - f(without it) = m df/dm + mu |F| sign(rod velocity) + noise                    P(2)
//! ```
//! is solved for m and the friction mu by least squares, with mu constrained to zero within its stated
//! standard deviation. Errors that do not average out (masses and centres of mass of the links, position of
//! the payload) are added to the variance by finite differences.

use nalgebra::{Matrix2, Vector2};

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::explain::sensitivity::followed_by;
use crate::machine::{Machine, Parameter};
use crate::state::State;
use crate::studies::actuator_force::{actuator_force, carries_payload, force_by_payload_mass};
use crate::studies::actuator_force_sigma::changes_by_links;

/// Below this rod speed (m/s) the sign of the friction is undetermined.
const LEAST_ROD_SPEED: f64 = 1e-3;
/// Time (s) after which force errors count as independent.
const CORRELATION_S: f64 = 0.2;

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
    let empty = machine.with_payload_mass(payload, 0.0, 0.0);
    let rows: Vec<Row> = samples
        .iter()
        .filter(|sample| sample.state.payload_share[payload] > 0.0)
        .filter_map(|sample| Row::of(&empty, linkage, payload, sample))
        .collect();
    let fit = Fit::of(&rows, &quality)?;
    let middle = rows.get(rows.len() / 2)?;
    let constant = systematic_variance(&empty, linkage, payload, middle, fit.mass);
    let repeats = (CORRELATION_S / quality.interval_s).max(1.0);
    Some(PayloadEstimate {
        mass: fit.mass,
        sigma: (fit.variance * repeats + constant).sqrt(),
        friction_share: fit.friction,
        residual: fit.residual,
        samples: rows.len(),
    })
}

/// One equation of the fit.
struct Row {
    state: State<f64>,
    /// Measured force minus the force without the payload (N).
    excess: f64,
    /// Derivative with respect to the mass (N/kg).
    by_mass: f64,
    /// Derivative with respect to the friction fraction (N).
    by_friction: f64,
}

impl Row {
    fn of(empty: &Machine, linkage: usize, payload: usize, sample: &MeasuredForce) -> Option<Self> {
        let mut workspace = Workspace::new(empty);
        evaluate(empty, &sample.state, &mut workspace);
        let known = actuator_force(empty, &sample.state, &workspace, linkage);
        let by_mass = force_by_payload_mass(empty, &sample.state, &workspace, linkage, payload);
        let followed = followed_by(&empty.linkages[linkage], &sample.state);
        let measured = &sample.state.joints[empty.linkages[linkage].measured_joint];
        let speed = followed[2].coordinate * measured.rate;
        let direction = if speed.abs() < LEAST_ROD_SPEED {
            0.0
        } else {
            speed.signum()
        };
        let row = Self {
            state: sample.state.clone(),
            excess: sample.force - known,
            by_mass,
            by_friction: sample.force.abs() * direction,
        };
        (row.excess.is_finite() && row.by_mass.is_finite()).then_some(row)
    }
}

/// Least squares for mass and friction.
struct Fit {
    mass: f64,
    friction: f64,
    /// Variance of the mass for independent samples (kg^2).
    variance: f64,
    /// (N)
    residual: f64,
}

impl Fit {
    fn of(rows: &[Row], quality: &ForceQuality) -> Option<Self> {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for row in rows {
            let factors = Vector2::new(row.by_mass, row.by_friction);
            normal += factors * factors.transpose();
            right += factors * row.excess;
        }
        // Prior: friction is zero within its stated standard deviation.
        normal[(1, 1)] += (quality.sigma / quality.friction_share).powi(2);
        let inverse = normal.try_inverse()?;
        let solution = inverse * right;
        let left = |row: &Row| row.excess - solution.x * row.by_mass - solution.y * row.by_friction;
        let squares: f64 = rows.iter().map(|row| left(row).powi(2)).sum();
        let residual = (squares / rows.len() as f64).sqrt();
        let sigma = residual.max(quality.sigma);
        Some(Self {
            mass: solution.x,
            friction: solution.y,
            variance: inverse[(0, 0)] * sigma * sigma,
            residual,
        })
        .filter(|fit| fit.mass.is_finite() && fit.variance.is_finite())
    }
}

/// Variance of the mass due to uncertain links in the pivot's distal subtree and to the uncertain position
/// of the payload, in one posture (kg^2).
fn systematic_variance(
    empty: &Machine,
    linkage: usize,
    payload: usize,
    row: &Row,
    mass: f64,
) -> f64 {
    let force = |machine: &Machine| {
        let mut workspace = Workspace::new(machine);
        evaluate(machine, &row.state, &mut workspace);
        let known = actuator_force(machine, &row.state, &workspace, linkage);
        let by_mass = force_by_payload_mass(machine, &row.state, &workspace, linkage, payload);
        [known, by_mass]
    };
    let [known, by_mass] = force(empty);
    let mut variance = 0.0;
    for change in changes_by_links(empty, |machine| force(machine)[0] - known) {
        variance += (change / by_mass).powi(2);
    }
    for axis in 0..3 {
        let mut moved = empty.clone();
        moved.payloads[payload].inertia.com[axis] += empty.uncertainty.com;
        let [_, changed] = force(&moved);
        variance += (mass * (changed - by_mass) / by_mass).powi(2);
    }
    variance
}

impl Machine {
    /// This machine with a different mass of a payload and its standard deviation (kg).
    #[must_use]
    pub fn with_payload_mass(&self, payload: usize, mass: f64, sigma: f64) -> Self {
        let change = mass - self.payloads[payload].inertia.mass;
        let mut machine = self.changed(&[(Parameter::PayloadMass(payload), change)]);
        machine.payloads[payload].mass_sigma = Some(sigma);
        machine
    }
}
