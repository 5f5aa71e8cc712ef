//! A row: a measured number and the computed one.

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::machine::{ArmForce, Machine};
use crate::state::State;
use crate::studies::actuator_force::actuator_force;
use crate::studies::measured_loads::{FEWEST_ROWS, LEAST_NS};

/// Standard deviations from which measured and computed force contradict each other.
pub const MOST_SIGMAS: f64 = 5.0;

/// A compared row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Its time (ns).
    pub time_ns: i64,
    /// Measured value, in the unit of the quantity.
    pub measured: f64,
    /// Computed value, in the same unit.
    pub computed: f64,
    /// Difference from which on the two contradict each other, in the same unit.
    pub limit: f64,
}

impl Compared {
    /// Compares the measured force of an actuator (N) with the computed one, of which `by_masses` is the standard deviation due to masses
    /// and centres of mass. `position` is that of the measured joint (rad or m). `None` where the arm may lie on its rest, as the machine
    /// file says: there the actuator carries less than is required, or pulls the arm down.
    #[must_use]
    pub fn of_force(
        time_ns: i64,
        force: &ArmForce,
        position: f64,
        measured: f64,
        computed: f64,
        by_masses: f64,
    ) -> Option<Self> {
        let friction = force.friction_share * measured.abs().max(computed.abs());
        let row = Self {
            time_ns,
            measured,
            computed,
            limit: MOST_SIGMAS * force.force_sigma.hypot(friction).hypot(by_masses),
        };
        let may_rest = (force.rests_within)
            .is_some_and(|[least, greatest]| (least..=greatest).contains(&position));
        let is_relieved = row.residual() * computed < 0.0;
        (!may_rest || !is_relieved).then_some(row)
    }

    /// Measured minus computed.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.measured - self.computed
    }

    /// Whether the two contradict each other.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.residual().abs() > self.limit
    }

    /// The difference relative to its limit.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.residual().abs() / self.limit
    }

    /// Whether consecutive rows, of which these are the first and the last time (ns), last long enough to count.
    #[must_use]
    pub fn is_long(first_ns: i64, last_ns: i64, rows: usize) -> bool {
        last_ns.saturating_sub(first_ns) >= LEAST_NS && rows >= FEWEST_ROWS
    }
}

/// The force that masses and motion require of a linkage's actuator (N); `None` where it is not finite, and where the cylinder may be at
/// its stop: as far as the measured joint may show, it is within its margin of a limit of the URDF.
#[must_use]
pub fn required_force(
    machine: &Machine,
    state: &State<f64>,
    linkage: usize,
    workspace: &mut Workspace<f64>,
) -> Option<f64> {
    if is_at_stop(machine, state, linkage) {
        return None;
    }
    evaluate(machine, state, workspace);
    let force = actuator_force(machine, state, workspace, linkage);
    force.is_finite().then_some(force)
}

/// The position of a linkage's measured joint (rad or m).
#[must_use]
pub fn measured_position(machine: &Machine, state: &State<f64>, linkage: usize) -> f64 {
    state.joints[machine.linkages()[linkage].measured_joint].position
}

fn is_at_stop(machine: &Machine, state: &State<f64>, linkage: usize) -> bool {
    let position = measured_position(machine, state, linkage);
    let [least, greatest] = machine.joint_stops(machine.linkages()[linkage].measured_joint);
    position < least || position > greatest
}
