//! The machine that is computed: valid by construction.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use std::sync::Arc;

use super::ImpossibleInertia;
use super::arm_force::{ArmForce, ForceSignal};
use super::body::{Body, JointCoupling, JointKind, Link, MeasuredJoint, Mount, Mounting, Payload};
use super::contact::Contact;
use super::identified::{Identified, SensorCorrections};
use super::inertia::MassMoments;
use super::joint_command::JointCommand;
use super::linkage::{Linkage, LinkageInput};
use super::load_sensor::LoadSensor;
use super::note::Note;
use super::payload_signal::{Lift, PayloadSignal};
use super::plausibility_spec::PlausibilitySpec;
use super::prediction_spec::PredictionSpec;
use super::quasi_static::QuasiStaticSpec;
use super::signals::SignalsSpec;
use super::spec::{EstimatorSpec, LimitsSpec, UncertaintySpec};
use super::support_id::SupportId;
use super::support_polygon::SupportPolygon;
use super::supports::Supports;
use super::suspension::Suspension;
use super::wheel::Wheel;

/// Limits of a joint that turns on are given as a turn, rounded (rad).
const TURN_TOLERANCE_RAD: f64 = 0.1;

/// Mass, as a multiple of the machine's, above which a reading is an error value of a scale.
pub const MOST_MASSES: f64 = 3.0;
/// An empty scale may show less than nothing by this share of the machine's mass.
const EMPTY_SHARE: f64 = 0.01;

/// A machine that is ready for computation: valid by construction and cheap to share.
///
/// The base frame is that of the link `base_link` if the URDF has one rigidly connected to its root, else the
/// frame of the root link: x forward, y left, z up (REP-103).
#[derive(Debug, Clone)]
pub struct Machine {
    pub(crate) name: String,
    pub(crate) gravity: f64,
    pub(crate) base_link: String,
    pub(crate) bodies: Vec<Body>,
    pub(crate) links: Vec<Link>,
    pub(crate) linkages: Vec<Linkage>,
    pub(crate) joints: Vec<MeasuredJoint>,
    pub(crate) wheels: Vec<Wheel>,
    pub(crate) supports: Arc<Supports>,
    pub(crate) stands_on: Vec<SupportId>,
    pub(crate) polygon: SupportPolygon,
    pub(crate) contact: Contact,
    pub(crate) imu: Mount,
    pub(crate) notes: Vec<Note>,
    pub(crate) replaced_inertias: Vec<ImpossibleInertia>,
    pub(crate) tool: Option<Mount>,
    /// The link of the tool, if the machine file names it.
    pub(crate) tool_link: Option<usize>,
    pub(crate) arm_root: Option<Mount>,
    pub(crate) arm_mounting: Option<Mounting>,
    pub(crate) payloads: Vec<Payload>,
    pub(crate) limits: LimitsSpec,
    pub(crate) signals: SignalsSpec,
    pub(crate) estimator: EstimatorSpec,
    pub(crate) uncertainty: UncertaintySpec,
    pub(crate) plausibility: PlausibilitySpec,
    pub(crate) quasi_static: QuasiStaticSpec,
    /// Whether rows without neighbours are static.
    pub(crate) is_quasi_static: bool,
    pub(crate) prediction: PredictionSpec,
    pub(crate) reference: super::Reference,
    pub(crate) suspension: Option<Suspension>,
    pub(crate) load_sensors: Vec<LoadSensor>,
    pub(crate) joint_commands: Vec<JointCommand>,
    pub(crate) payload_signals: Vec<PayloadSignal>,
    pub(crate) arm_forces: Vec<ArmForce>,
    pub(crate) force_signals: Vec<ForceSignal>,
    pub(crate) identified: Option<Identified>,
    pub(crate) corrections: Option<SensorCorrections>,
}

/// Declares methods that give the fields of these names.
macro_rules! fields {
    ($($(#[$about:meta])+ $name:ident: $of:ty;)+) => {
        $($(#[$about])+
        #[must_use]
        pub fn $name(&self) -> &$of {
            &self.$name
        })+
    };
}

impl Machine {
    fields! {
        /// Name of the machine.
        name: str;
        /// The link whose frame is the base frame.
        base_link: str;
        /// The rigid bodies, parents before children, the root first.
        bodies: [Body];
        /// The links of the URDF.
        links: [Link];
        /// The closed chains.
        linkages: [Linkage];
        /// The joints whose motion a [`State`](crate::State) holds, in its order.
        joints: [MeasuredJoint];
        /// The wheels and other supports on the ground, sorted by name.
        wheels: [Wheel];
        /// All supports of the machine, those that are off the ground included.
        supports: Supports;
        /// The supports on the ground, in the order of [`Machine::wheels`].
        stands_on: [SupportId];
        /// The support polygon of the contact points.
        polygon: SupportPolygon;
        /// Contact between wheels and ground.
        contact: Contact;
        /// Pose of the inertial measurement unit.
        imu: Mount;
        /// Peculiarities that are not errors.
        notes: [Note];
        /// Returns the impossible inertias of the URDF and their replacements.
        replaced_inertias: [ImpossibleInertia];
        /// Sensors that measure the load of wheels.
        load_sensors: [LoadSensor];
        /// Rates that the controller commands, in the order of the joints' names in the machine file. A joint that no message
        /// measures has none.
        joint_commands: [JointCommand];
        /// Uncertainty of its parameters.
        uncertainty: UncertaintySpec;
        /// Limits of plausible signals.
        plausibility: PlausibilitySpec;
        /// Bounds of the machine's motion between the rows of a sparse log.
        quasi_static: QuasiStaticSpec;
        /// The reference loads.
        reference: super::Reference;
        /// Loads attached to links.
        payloads: [Payload];
        /// The signals that tell masses of payloads: by payload, the mass that a signal states, or the force of the actuator by which it
        /// is estimated.
        payload_signals: [PayloadSignal];
        /// The measured forces of linkages by which nothing is computed, in the order of the linkages.
        arm_forces: [ArmForce];
        /// The signals of [`Self::arm_forces`], in their order: a force, or the pressures at piston and rod.
        force_signals: [ForceSignal];
        /// Thresholds for findings.
        limits: LimitsSpec;
        /// Topics named in the machine file.
        signals: SignalsSpec;
        /// Settings of the state estimator.
        estimator: EstimatorSpec;
        /// Settings of the prediction: horizon and assumed motions.
        prediction: PredictionSpec;
    }

    /// Gravitational acceleration (m/s^2).
    #[must_use]
    pub fn gravity(&self) -> f64 {
        self.gravity
    }

    /// Pose of the frame in which the tool wrench acts.
    #[must_use]
    pub fn tool(&self) -> Option<&Mount> {
        self.tool.as_ref()
    }

    /// Returns the active suspension; `None` without one.
    #[must_use]
    pub fn suspension(&self) -> Option<&Suspension> {
        self.suspension.as_ref()
    }

    /// Whether a measured joint is prismatic (m) and not revolute (rad).
    #[must_use]
    pub fn joint_slides(&self, joint: usize) -> bool {
        let measured_rod = |linkage: &Linkage| {
            linkage.measured_joint == joint && linkage.input == LinkageInput::RodLength
        };
        let driven = |body: &Body| {
            body.coupling == JointCoupling::Measured(joint) && body.kind == JointKind::Prismatic
        };
        self.linkages.iter().any(measured_rod) || self.bodies.iter().any(driven)
    }

    /// Whether a measured joint may turn a whole turn: it is revolute, and its limits, if any, are a turn apart. Then its
    /// encoder may start anew after each turn.
    #[must_use]
    pub fn joint_turns(&self, joint: usize) -> bool {
        let is_turn = |[least, most]: [f64; 2]| most - least >= TAU - TURN_TOLERANCE_RAD;
        !self.joint_slides(joint) && self.joints[joint].limits.is_none_or(is_turn)
    }

    /// Positions beyond which a measured joint may be at its stop (rad or m): within its margin of a limit of the URDF.
    #[must_use]
    pub fn joint_stops(&self, joint: usize) -> [f64; 2] {
        let margin = self.plausibility.margin_of(self.joint_slides(joint));
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let [least, greatest] = self.joints[joint].limits.unwrap_or(free);
        [least + margin, greatest - margin]
    }

    /// The greatest speed at which a measured joint may move (rad/s or m/s): a faster change of its position is a fault.
    #[must_use]
    pub fn greatest_joint_rate(&self, joint: usize) -> f64 {
        let (spec, it) = (&self.plausibility, &self.joints[joint]);
        let usual = match (it.spins_wheel.is_some(), self.joint_slides(joint)) {
            (true, _) => spec.wheel_rate_max,
            (false, true) => spec.joint_rate_max_linear,
            (false, false) => spec.joint_rate_max,
        };
        it.max_velocity
            .map_or(usual, |rate| rate * spec.joint_rate_margin)
    }

    /// Removes the tool, for logs without a measured tool wrench.
    pub fn leave_out_tool(&mut self) {
        self.tool = None;
    }

    /// Gives every tyre a stiffness with which the mean load deflects it by `deflection` (m), unless all have a stated one.
    /// Returns whether they have.
    pub fn complete_tyre_stiffness(&mut self, deflection: f64) -> bool {
        let is_stated = self.wheels.iter().all(|wheel| wheel.stiffness.is_some());
        if !is_stated {
            let load = self.mass() * self.gravity / self.wheels.len() as f64;
            for wheel in &mut self.wheels {
                wheel.stiffness = Some(load / deflection);
            }
            self.contact.tyres_deflect = true;
        }
        is_stated
    }

    /// Takes the forces of actuators out of the machine: where nobody has measured them.
    pub fn leave_out_actuator_forces(&mut self) {
        self.contact.actuated_joints.clear();
    }

    /// The mount of the arm.
    #[must_use]
    pub fn arm_mounting(&self) -> Option<&Mounting> {
        self.arm_mounting.as_ref()
    }

    /// Makes unknown masses of payloads known row by row from here on, by a [`PayloadWatch`](crate::studies::payload_watch::PayloadWatch)
    /// behind the causal estimator.
    pub fn weigh_payloads_by_row(&mut self) {
        for payload in (self.payloads.iter_mut()).filter(|payload| payload.is_estimated) {
            payload.is_by_row = true;
            payload.inertia.mass = 1.0;
            payload.moments = MassMoments::from(&payload.inertia);
        }
    }

    /// The masses that a payload can have (kg). Others are an error value of a scale.
    #[must_use]
    pub fn possible_payload(&self) -> RangeInclusive<f64> {
        -EMPTY_SHARE * self.mass()..=MOST_MASSES * self.mass()
    }

    /// Mass in a state (kg) of an attached payload that weighs nothing: an exact zero is that of a payload that is not attached,
    /// whose mass has no error.
    pub const EMPTY_PAYLOAD: f64 = 1e-9;

    /// A mass of an attached payload (kg), NaN if none can have it.
    #[must_use]
    pub fn plausible_payload(&self, mass: f64) -> f64 {
        match self.possible_payload().contains(&mass) {
            true if mass == 0.0 => Self::EMPTY_PAYLOAD,
            true => mass,
            false => f64::NAN,
        }
    }

    /// The payloads of which [`Self::payload_signals`] tell, by index.
    pub fn payloads_by_signals(&self) -> impl Iterator<Item = usize> + '_ {
        let by_force = |lift: &Lift| !lift.signals.is_empty();
        let payloads = self.payloads.iter().enumerate();
        let told = payloads
            .filter(move |(_, it)| it.signal.is_some() || it.lift.as_ref().is_some_and(by_force));
        told.map(|(payload, _)| payload)
    }

    /// Whether `body` is `carrier` or in its distal subtree.
    #[must_use]
    pub fn is_carried_by(&self, mut body: usize, carrier: usize) -> bool {
        while body > carrier {
            body = self.bodies[body].parent;
        }
        body == carrier
    }

    /// The bodies whose own joint moves with a measured joint: with itself, by coupling, or as part of its linkage.
    pub fn bodies_of_joint(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        let linkage = move |linkage: usize| self.linkages[linkage].measured_joint == joint;
        let moves = move |coupling: JointCoupling| match coupling {
            JointCoupling::Root => false,
            JointCoupling::Measured(of) | JointCoupling::Mimic { joint: of, .. } => of == joint,
            JointCoupling::Pivot(of) | JointCoupling::Cylinder(of) | JointCoupling::Rod(of) => {
                linkage(of)
            }
        };
        let bodies = self.bodies.iter().enumerate();
        bodies
            .filter(move |(_, body)| moves(body.coupling))
            .map(|(index, _)| index)
    }

    /// Whether a measured joint moves a wheel or another support relative to the base, on the ground or not.
    #[must_use]
    pub fn joint_carries_support(&self, joint: usize) -> bool {
        self.bodies_of_joint(joint).any(|body| {
            let mut supports = self.supports.all.iter();
            supports.any(|support| self.is_carried_by(support.body, body))
        })
    }

    /// Whether a measured joint spins a wheel, on the ground or not.
    #[must_use]
    pub fn joint_spins_wheel(&self, joint: usize) -> bool {
        self.supports.spins[joint].is_some()
    }

    /// Mass of all bodies and of the payloads without a time limit (kg).
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.bodies.iter().map(|b| b.inertia.mass).sum::<f64>()
            + self
                .payloads
                .iter()
                .filter(|payload| payload.is_always())
                .map(|p| p.inertia.mass)
                .sum::<f64>()
    }
}

/// Prior standard deviation of a load from the split rule before any measurement, as a fraction of the mean
/// load: on uneven ground a stiff frame shifts that much from one diagonal to the other.
const WARP_SHARE: f64 = 0.5;

impl Machine {
    /// Index of the wheel with this name in lower case.
    #[must_use]
    pub fn wheel_named(&self, lower: &str) -> Option<usize> {
        let mut wheels = self.wheels.iter();
        wheels.position(|wheel| wheel.name.to_lowercase() == lower)
    }

    /// Index of the edge with this name in lower case.
    #[must_use]
    pub fn edge_named(&self, lower: &str) -> Option<usize> {
        let mut edges = self.polygon().edges().iter();
        edges.position(|edge| edge.name.to_lowercase() == lower)
    }

    /// Prior standard deviation of each wheel's share of the warp (N): half the mean load; on ground declared
    /// flat, at most what the stated uncertainty of the wheels' heights causes.
    #[must_use]
    pub fn warp_sigma(&self) -> f64 {
        let unknown = WARP_SHARE * self.mass() * self.gravity / self.wheels.len() as f64;
        // Four heights, each off by sigma, deflect each wheel of one diagonal by half a height.
        let by_heights = |stiffness: f64| 0.5 * stiffness * self.uncertainty.wheel_position;
        (self.contact.mean_stiffness)
            .map_or(unknown, |stiffness| by_heights(stiffness).min(unknown))
    }
}

impl Machine {
    /// Joint positions with every cylinder of the suspension at mid-stroke and the other joints unchanged.
    #[must_use]
    pub fn at_mid_stroke(&self, joint_positions: &[f64]) -> Vec<f64> {
        let mut positions = joint_positions.to_vec();
        let Some(suspension) = &self.suspension else {
            return positions;
        };
        let [least, greatest] = suspension.stroke;
        let middle = 0.5 * (least + greatest);
        for &linkage in &suspension.linkages {
            let linkage = &self.linkages[linkage];
            if let Some(position) = positions.get_mut(linkage.measured_joint) {
                *position = match linkage.input {
                    LinkageInput::RodLength => middle,
                    LinkageInput::PivotAngle => linkage.pivot_at_rod(middle),
                };
            }
        }
        positions
    }
}
