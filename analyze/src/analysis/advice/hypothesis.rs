//! Hypotheses about the recorded log, and the effect of each on the states of rows.
//!
//! In these states the sensor frame is the base frame, as in those of a window.

use std::fmt;
use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};
use tipwatch_language::word;
use tipwatch_mechanics::machine::{LinkGroup, Machine, Payload};
use tipwatch_mechanics::{Parameter, Placement, State};

use super::change::{slow_joints, slow_manoeuvre};
use super::ground_slope::{GroundSlope, Slope};

/// A supposition that replaces a recorded quantity.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Hypothesis {
    /// The ground slopes so many times as much, 0 of level ground; the platform rocks on it as recorded.
    Slope(Arc<GroundSlope>, f64),
    /// Machine and joints travel the same path so many times as fast.
    Speed(f64),
    /// The joints do, and the base rests as recorded.
    ArmSpeed(f64),
    /// More mass of the payloads that are attached at a time, in proportion, or on the tool where none is stated; less where
    /// negative (kg).
    Payload(f64),
    /// No payload, and no force on the tool.
    WithoutLoad,
    /// The joints of the arm rest at these positions (rad or m).
    ArmAt(Vec<f64>),
    /// A joint is off by a constant (rad or m).
    Joint(usize, f64),
}

impl Hypothesis {
    /// Returns the hypothesis of `times` the recorded speed: that of the arm alone where the base rests.
    pub(crate) fn speed(times: f64, base_rests: bool) -> Self {
        match base_rests {
            true => Self::ArmSpeed(times),
            false => Self::Speed(times),
        }
    }

    /// Returns the machine under hypotheses.
    ///
    /// # Errors
    /// The machine cannot carry the supposed load; the error says why.
    pub(crate) fn machine(all: &[Self], machine: &Machine) -> Result<Machine, &'static str> {
        let loads = all.iter().filter_map(|hypothesis| match hypothesis {
            Self::Payload(more_kg) => Some(*more_kg),
            _ => None,
        });
        let mut found = machine.clone();
        for more_kg in loads {
            found = laden(&found, more_kg)?;
        }
        Ok(found)
    }
}

/// The machine with more or less load (kg).
fn laden(machine: &Machine, more_kg: f64) -> Result<Machine, &'static str> {
    let payloads = machine.payloads();
    if payloads.iter().any(|payload| payload.is_by_row) {
        return Err(word!(
            "the mass of the payload changes from row to row, as signals tell it"
        ));
    }
    let stated_kg: f64 = payloads.iter().map(|payload| payload.inertia.mass).sum();
    if stated_kg > 0.0 {
        if stated_kg + more_kg < 0.0 {
            return Err(word!("the payload weighs less than is taken from it"));
        }
        if !are_always_attached(machine) {
            // those that share it at a time, the states tell
            return Ok(machine.clone());
        }
        let of = |(payload, spec): (usize, &Payload)| {
            let share = spec.inertia.mass / stated_kg;
            (Parameter::PayloadMass(payload), share * more_kg)
        };
        let changes: Vec<_> = payloads.iter().enumerate().map(of).collect();
        return Ok(machine.changed(&changes));
    }
    if machine.load_on_tool().is_none() {
        return Err(word!(
            "the machine file states no payload and no arm that carries one"
        ));
    }
    (machine.with_more_on_tool(more_kg)).ok_or(word!(
        "the machine file states no payload, and the link at the end of the arm weighs less than is taken from it"
    ))
}

/// Applies hypotheses to states of a machine.
pub(crate) struct Supposed<'m> {
    machine: &'m Machine,
    placement: Placement<'m>,
    is_of_arm: Vec<bool>,
}

impl fmt::Debug for Supposed<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Supposed").finish_non_exhaustive()
    }
}

impl<'m> Supposed<'m> {
    /// Prepares hypotheses on a machine whose sensor is at the base frame.
    pub(crate) fn new(machine: &'m Machine) -> Self {
        let joints = 0..machine.joints().len();
        Self {
            machine,
            placement: Placement::new(machine),
            is_of_arm: joints
                .map(|joint| moves_arm_alone(machine, joint))
                .collect(),
        }
    }

    /// Changes the state at a time (ns) as the hypothesis supposes. Unknown parts of it make the quantities that follow from them
    /// unknown.
    pub(crate) fn apply(&mut self, hypothesis: &Hypothesis, time_ns: i64, state: &mut State<f64>) {
        match hypothesis {
            Hypothesis::Slope(ground, times) => self.slope(&ground.at(time_ns), *times, state),
            Hypothesis::Speed(times) => slow_manoeuvre(*times, state),
            Hypothesis::ArmSpeed(times) => slow_joints(*times, state),
            Hypothesis::WithoutLoad => {
                state.payload_share.fill(0.0);
                state.tool_wrench.force.fill(0.0);
                state.tool_wrench.moment.fill(0.0);
            }
            Hypothesis::ArmAt(positions) => {
                let joints = state.joints.iter_mut().zip(positions);
                for ((joint, &position), _) in
                    joints.zip(&self.is_of_arm).filter(|(_, of_arm)| **of_arm)
                {
                    (joint.position, joint.rate, joint.acceleration) = (position, 0.0, 0.0);
                }
            }
            // the machine is another one
            Hypothesis::Payload(_) if are_always_attached(self.machine) => {}
            Hypothesis::Payload(more_kg) => {
                let attached_kg = attached_kg(self.machine, state);
                if attached_kg > 0.0 {
                    let factor = 1.0 + more_kg / attached_kg;
                    // nobody knows what takes more than is there
                    let factor = if factor < 0.0 { f64::NAN } else { factor };
                    let shares = state.payload_share.iter_mut();
                    shares.for_each(|share| *share *= factor);
                }
            }
            Hypothesis::Joint(joint, offset) => state.joints[*joint].position += offset,
        }
    }

    /// Turns gravity back by the tilt of the ground, or by what it tilts less with k times the slope; the acceleration of the
    /// base and how its platform rocks stay. With the normal n of the plane through the contacts and the rotation R that takes
    /// up on the slope to up on the other one:
    /// ```text
    ///     R (n - (1 - k) tilt x n) = n,      up' = R up,      f' = f + g (up' - up),      var f' = var f + (g (1 - k) sigma)^2
    /// ```
    /// Where the ground cannot be told from level ground, nothing is turned, and how far it may slope all the same remains.
    fn slope(&mut self, slope: &Slope, times: f64, state: &mut State<f64>) {
        let share = slope.share() * (1.0 - times);
        let by_slope = (1.0 - times) * slope.sigma_rad * self.machine.gravity();
        state.noise.specific_force += by_slope * by_slope;
        if share == 0.0 {
            // as recorded, as far as the attitude is known
            if state.base.known_up().is_none() {
                state.imu.specific_force.fill(f64::NAN);
            }
            return;
        }
        self.placement.place(state);
        let (normal, up) = (self.placement.normal, state.base.up);
        let tilt = Vector3::new(slope.tilt.x, slope.tilt.y, 0.0) * share;
        let on_slope = normal - tilt.cross(&normal);
        let turn = Rotation3::rotation_between(&on_slope, &normal);
        let unknown = || Vector3::repeat(f64::NAN);
        state.base.up = turn.map_or_else(unknown, |turn| turn * up);
        state.imu.specific_force += (state.base.up - up) * self.machine.gravity();
    }

    /// Returns the smallest distance of the centre of mass from the tipping lines in a posture (m), negative outside; NaN where
    /// the machine cannot stand.
    pub(crate) fn steadiness(&mut self, state: &State<f64>) -> f64 {
        self.placement.place(state);
        let placed = &self.placement;
        let edges = 0..self.machine.polygon().edges().len();
        let distances = edges.map(|edge| {
            let [from, to] = placed.tipping_line(edge).through;
            let inwards = placed.normal.cross(&(to - from)).normalize();
            inwards.dot(&(placed.centre_of_mass - from))
        });
        let least = distances.reduce(|a, b| if b < a { b } else { a });
        least.unwrap_or(f64::NAN)
    }
}

fn are_always_attached(machine: &Machine) -> bool {
    machine.payloads().iter().all(Payload::is_always)
}

/// Mass of the payloads that are attached in a state (kg).
pub(super) fn attached_kg(machine: &Machine, state: &State<f64>) -> f64 {
    let shares = state.payload_share.iter().zip(machine.payloads());
    shares
        .map(|(share, payload)| share * payload.inertia.mass)
        .sum()
}

/// Whether a joint moves parts of the arm and nothing else.
pub(crate) fn moves_arm_alone(machine: &Machine, joint: usize) -> bool {
    let moved: Vec<usize> = machine.bodies_of_joint(joint).collect();
    let mut links = machine.links().iter().filter(|link| {
        let mut bodies = moved.iter();
        bodies.any(|&body| machine.is_carried_by(link.body, body))
    });
    !moved.is_empty() && links.all(|link| link.group == LinkGroup::Arm)
}
