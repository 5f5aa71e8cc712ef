//! The table of quantities: every number that a row of results carries.
//!
//! One row here gives a quantity its place in [`Quantity::all`], its value in [`Outcome::get`], its column
//! with name and unit in every table, its field in the messages of `derived.mcap`, its label in the report and
//! its entry in the reference. [`verdict_quantities!`](crate::verdict_quantities) below chooses those
//! that the live verdict carries.
//!
//! ```text
//!     /// Meaning, as Markdown, without a period
//!     Variant(index: what it is of) "label", "column name" [unit] group, when it is computed, |outcome| value;
//! ```

use super::quantity::{
    Along, Cause, ColumnNames, Edge, GroundPoint, Index, Link, Linkage, Place, QuantityGroup,
    QuantityKind, Term, Wheel, When, quantities,
};
use crate::closed_form::{ClosedFormOutcome, GroundMotion};
use crate::evaluate::outcome::Outcome;
use crate::evaluate::scope::Scope;
use crate::explain::attribution::Contribution;
use crate::machine::{Axis, Machine};
use crate::number::Real;

quantities! {
    /// Load, never negative
    Load(wheel: Wheel) "load", "load_{wheel}" ["N"] Loads, Always, |o| o.load[wheel];
    /// OTF, the load with every wheel held to the ground; signed
    Otf(wheel: Wheel) "OTF", "otf_{wheel}" ["N"] Margins, Always, |o| o.otf[wheel];
    /// Smallest load that equilibrium allows
    LoadLeast(wheel: Wheel) "smallest load", "load_{wheel}_min" ["N"] Loads, Always, |o| o.load_least[wheel];
    /// Largest load that equilibrium allows
    LoadLargest(wheel: Wheel) "largest load", "load_{wheel}_max" ["N"] Loads, Always, |o| o.load_largest[wheel];
    /// ITOM about the edge, with the weights of the wheels
    ItomFull(edge: Edge) "ITOM with wheels", "itom_full_{edge}" ["N m"] Indicators, Always, |o| o.itom_full[edge];
    /// Force of the ground along the normal of the contact plane: the sum of the loads
    NormalForce "normal force", "normal_force" ["N"] Loads, Always, |o| o.normal_force;
    /// Centre of pressure (ZMP), forward of the base origin's projection onto the contact plane
    ZmpX "ZMP forward", "zmp_x" ["m"] Indicators, Always, |o| o.zmp_x;
    /// Centre of pressure (ZMP), to the left of the base origin's projection onto the contact plane
    ZmpY "ZMP to the left", "zmp_y" ["m"] Indicators, Always, |o| o.zmp_y;
    /// Distance of the centre of pressure from the nearest edge, positive inside
    ZmpMargin "ZMP margin", "zmp_margin" ["m"] Margins, Always, |o| o.zmp_margin;
    /// Number of measured joint torques that determined the split
    MeasuredTorques "measured torques", "measured_torques" ["-"] Indicators, Actuated, |o| o.measured_torques;
    /// Residual: measured minus predicted torque about the pivot of the linkage
    TorqueResidual(linkage: Linkage) "torque residual", "torque_residual_{linkage}" ["N m"] Indicators, Actuated,
        |o| o.torque_residual[linkage];
    /// Standard deviation of the load
    LoadSigma(wheel: Wheel) "σ of the load", "load_{wheel}_sigma" ["N"] Loads, Sensitivities,
        |o| o.uncertainty.load[wheel];
    /// Standard deviation of the OTF
    OtfSigma(wheel: Wheel) "σ of the OTF", "otf_{wheel}_sigma" ["N"] Margins, Sensitivities,
        |o| o.uncertainty.otf[wheel];
    /// `1 - (OTF - 2 sigma) / static load` of the worst wheel
    Utilisation "utilisation", "utilisation" ["-"] Margins, Sensitivities, |o| o.uncertainty.utilisation;
    /// ITOM: moment of arm, tool force, chassis weight and chassis inertia, negative while stable
    Itom(edge: Edge) "ITOM", "itom_{edge}" ["N m"] Indicators, Indicators, |o| o.indicators.itom[edge];
    /// TOM: moment of arm, tool force and chassis weight, negative while stable
    Tom(edge: Edge) "TOM", "tom_{edge}" ["N m"] Indicators, Indicators, |o| o.indicators.tom[edge];
    /// MHS-type moment: arm and tool force, negative while stable
    Mhs(edge: Edge) "MHS", "mhs_{edge}" ["N m"] Indicators, Indicators, |o| o.indicators.mhs[edge];
    /// Force-Angle, positive while stable
    ForceAngle(edge: Edge) "Force-Angle", "force_angle_{edge}" ["rad"] Indicators, Indicators,
        |o| o.indicators.force_angle[edge];
    /// Force-Angle of gravity only, positive while stable
    StabilityAngle(edge: Edge) "stability angle", "stability_angle_{edge}" ["rad"] Indicators, Indicators,
        |o| o.indicators.stability_angle[edge];
    /// Load transfer ratio: right minus left load, divided by the sum
    LoadTransferRatio "LTR", "ltr" ["-"] Indicators, Indicators, |o| o.indicators.load_transfer_ratio;
    /// Sum of the differences of the loads over all pairs of wheels, each pair once
    Spread "spread", "spread" ["N"] Indicators, Indicators, |o| o.indicators.spread;
    /// Half the sum of squared differences between OTF and optimal load
    Sigma "sigma", "sigma" ["N^2"] Indicators, Indicators, |o| o.indicators.sigma;
    /// Force of the arm on what carries it, base axes
    ArmForce(axis: Along) "arm force", "arm_force_{axis}" ["N"] Indicators, Arm,
        |o| o.indicators.arm_wrench.force[axis as usize];
    /// Moment of the arm on what carries it, about the root of the arm, base axes
    ArmMoment(axis: Along) "arm moment", "arm_moment_{axis}" ["N m"] Indicators, Arm,
        |o| o.indicators.arm_wrench.moment[axis as usize];
    /// Derivative of sigma with respect to the forward velocity
    SigmaByForwardVelocity "dσ/dv_x", "dsigma_dvx" ["N^2 s/m"] Indicators, Gradient,
        |o| o.indicators.sigma_gradient.forward_velocity;
    /// Derivative of sigma with respect to the velocity to the left
    SigmaByLeftVelocity "dσ/dv_y", "dsigma_dvy" ["N^2 s/m"] Indicators, Gradient,
        |o| o.indicators.sigma_gradient.left_velocity;
    /// Derivative of sigma with respect to the yaw rate
    SigmaByYawRate "dσ/dyaw rate", "dsigma_dyaw_rate" ["N^2 s/rad"] Indicators, Gradient,
        |o| o.indicators.sigma_gradient.yaw_rate;
    /// Derivative of sigma with respect to the forward acceleration
    SigmaByForwardAcceleration "dσ/da_x", "dsigma_dvx_dot" ["N^2 s^2/m"] Indicators, Gradient,
        |o| o.indicators.sigma_gradient.forward_acceleration;
    /// Derivative of sigma with respect to the acceleration to the left
    SigmaByLeftAcceleration "dσ/da_y", "dsigma_dvy_dot" ["N^2 s^2/m"] Indicators, Gradient,
        |o| o.indicators.sigma_gradient.left_acceleration;
    /// Derivative of sigma with respect to the yaw acceleration
    SigmaByYawAcceleration "dσ/dyaw acceleration", "dsigma_dyaw_rate_dot" ["N^2 s^2/rad"] Indicators, Gradient,
        |o| o.indicators.sigma_gradient.yaw_acceleration;
    /// Contribution of a cause to the load
    Contribution(cause: Cause, wheel: Wheel) "contribution", "cause_{cause}_{wheel}" ["N"] Causes, Contributions,
        |o| o.contributions[wheel][cause as usize];
    /// Term of the analytic model, 1 to 11
    Term(term: Term, wheel: Wheel) "term", "term_{term}_{wheel}" ["N"] Causes, Terms,
        |o| o.closed_form.terms[wheel][term];
    /// Ground speed of a wheel, of `front_axle` or of `rear_axle`
    Speed(place: Place) "speed", "speed_{place}" ["m/s"] Indicators, Terms, |o| o.closed_form.at(place).speed;
    /// Direction of travel of a wheel, of `front_axle` or of `rear_axle`
    Direction(place: Place) "direction", "direction_{place}" ["rad"] Indicators, Terms,
        |o| o.closed_form.at(place).direction;
    /// Sideslip angle of a wheel, of `front_axle` or of `rear_axle`
    Sideslip(place: Place) "sideslip", "sideslip_{place}" ["rad"] Indicators, Terms,
        |o| o.closed_form.at(place).sideslip;
    /// Contribution of a link to the OTF
    Part(link: Link, wheel: Wheel) "part", "part_{link}_{wheel}" ["N"] Causes, Parts, |o| o.parts[link][wheel];
    /// 1 if the row is static: a signal holds its last sample at rest; else 0
    Static "static row", "static" ["-"] Indicators, BetweenRows, |_o| T::constant(f64::NAN);
    /// Age of the oldest sample that a static row holds
    HeldAge "age of held samples", "held_age" ["s"] Indicators, BetweenRows, |_o| T::constant(f64::NAN);
    /// Smallest OTF from this row to the next that the greatest rates and accelerations allow, less two standard
    /// deviations
    OtfBetweenLeast(wheel: Wheel) "smallest OTF to the next row", "otf_{wheel}_between_min" ["N"] Margins, BetweenRows,
        |_o| { let _ = wheel; T::constant(f64::NAN) };
    /// Largest OTF from this row to the next that the greatest rates and accelerations allow, plus two standard
    /// deviations
    OtfBetweenLargest(wheel: Wheel) "largest OTF to the next row", "otf_{wheel}_between_max" ["N"] Margins,
        BetweenRows, |_o| { let _ = wheel; T::constant(f64::NAN) };
}

/// Calls a macro with the quantities of the live verdict, each as `field: Variant`, in the order of the
/// message. A change here changes the layout of the message.
#[macro_export]
macro_rules! verdict_quantities {
    ($callback:ident) => {
        $callback! {
            worst_wheel { utilisation: Utilisation }
            machine {
                normal_force: NormalForce, zmp_x: ZmpX, zmp_y: ZmpY, zmp_margin: ZmpMargin,
                ltr: LoadTransferRatio, sigma: Sigma, spread: Spread,
            }
            wheel {
                load: Load, otf: Otf, load_sigma: LoadSigma, otf_sigma: OtfSigma,
                load_min: LoadLeast, load_max: LoadLargest,
            }
            cause_and_wheel { causes: Contribution }
            edge {
                itom_full: ItomFull, itom: Itom, tom: Tom, mhs: Mhs,
                force_angle: ForceAngle, stability_angle: StabilityAngle,
            }
        }
    };
}

/// A column of the table of samples that is not read from an [`Outcome`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowColumn {
    /// Name of the column.
    pub name: &'static str,
    /// Unit; empty for texts, lists and truth values.
    pub unit: &'static str,
    /// The meaning, as Markdown.
    pub meaning: &'static str,
}

impl RowColumn {
    /// Time.
    pub const TIME: Self = Self {
        name: "time_ns",
        unit: "ns",
        meaning: "Time of the row on the log's common clock",
    };
    /// Validity.
    pub const VALID: Self = Self {
        name: "valid",
        unit: "",
        meaning: "Whether the row can be trusted",
    };
    /// Reasons.
    pub const REASONS: Self = Self {
        name: "reasons",
        unit: "",
        meaning: "Why not, a list; empty when valid",
    };
    /// Level.
    pub const VERDICT: Self = Self {
        name: "verdict",
        unit: "",
        meaning: "Level of the monitor: see [Verdicts](services.md#verdicts)",
    };
    /// Basis of the verdict's level.
    pub const VERDICT_BASIS: Self = Self {
        name: "verdict_basis",
        unit: "",
        meaning: "What the level stands on, `proven`, `assumed` or `doubted`: see [Verdicts](services.md#verdicts)",
    };
    /// Unproven signals.
    pub const UNPROVEN: Self = Self {
        name: "unproven",
        unit: "",
        meaning: "What the loads hang on that neither a commissioning nor the motion has proven, and joints that have read exactly 0 since the first sample",
    };
    /// Latched level.
    pub const VERDICT_LATCHED: Self = Self {
        name: "verdict_latched",
        unit: "",
        meaning: "Latched level of the monitor",
    };
    /// Time to lift-off.
    pub const TIME_TO_LIFT_OFF: Self = Self {
        name: "time_to_lift_off",
        unit: "s",
        meaning: "Time until the next wheel lifts if its load keeps falling at its present rate; null beyond 5 s",
    };
    /// Input faults.
    pub const INPUT_FAULTS: Self = Self {
        name: "input_faults",
        unit: "",
        meaning: "Faults of the input that the monitor found; only in logs that it recorded",
    };

    /// Columns before the quantities.
    pub const BEFORE: [Self; 3] = [Self::TIME, Self::VALID, Self::REASONS];
    /// Columns after the quantities.
    pub const AFTER: [Self; 6] = [
        Self::VERDICT,
        Self::VERDICT_LATCHED,
        Self::VERDICT_BASIS,
        Self::UNPROVEN,
        Self::TIME_TO_LIFT_OFF,
        Self::INPUT_FAULTS,
    ];
}

impl<T: Real> ClosedFormOutcome<T> {
    fn at(&self, place: GroundPoint) -> &GroundMotion<T> {
        match place {
            GroundPoint::Wheel(wheel) => &self.wheels[wheel],
            GroundPoint::FrontAxle => &self.axles[0],
            GroundPoint::RearAxle => &self.axles[1],
        }
    }
}
