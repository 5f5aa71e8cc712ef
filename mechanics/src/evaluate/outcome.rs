//! The result of an evaluation, and the list of its quantities.

use std::ops::Range;

use nalgebra::Vector3;

use crate::closed_form::{ClosedFormOutcome, GroundMotion};
use crate::evaluate::scope::Scope;
use crate::explain::attribution::{Contribution, Contributions};
use crate::explain::indicators::Indicators;
use crate::explain::uncertainty::Uncertainty;
use crate::geometry::spatial::Wrench;
use crate::machine::{Axis, BaseMotion, Machine, links_with_mass};
use crate::number::Real;

/// Wheel loads and stability at one instant, or at several instants at once: see [`Real`].
///
/// NaN means that a value cannot be computed, and nothing else.
#[derive(Debug, Clone)]
pub struct Outcome<T> {
    /// Force and moment of the ground on the machine, about the base origin, in base axes (N, N m).
    pub ground_wrench: Wrench<T>,
    /// Unit normal of the plane through the contact points, pointing up, in base axes.
    pub contact_normal: Vector3<T>,
    /// Force of the ground along the normal: the sum of the loads (N).
    pub normal_force: T,
    /// Overturning force by wheel: its load if every wheel were held to the ground, OTF (109) of the first
    /// paper; negative where the ground would have to pull (N).
    pub otf: Vec<T>,
    /// Load by wheel (N), never negative.
    pub load: Vec<T>,
    /// Smallest load by wheel that equilibrium allows (N).
    pub load_least: Vec<T>,
    /// Largest load by wheel that equilibrium allows (N).
    pub load_largest: Vec<T>,
    /// Centre of pressure in the contact plane, forward of the projected base origin (m).
    pub zmp_x: T,
    /// Centre of pressure in the contact plane, left of the projected base origin (m).
    pub zmp_y: T,
    /// Distance of the centre of pressure from the nearest edge (m), positive inside the polygon.
    pub zmp_margin: T,
    /// Overturning moment about each edge of the support polygon, wheel weights included (the first paper's
    /// ITOM with wheel weights); negative = stable (N m).
    pub itom_full: Vec<T>,
    /// Number of measured torques of actuated joints that determined the load split.
    pub measured_torques: T,
    /// Residual of each measured torque: measured minus predicted, about its pivot (N m); NaN where
    /// unknown. Large residuals indicate an error of a sensor, of the machine description or of its traction.
    pub torque_residual: Vec<T>,
    /// Smallest closure of the linkages; not negative where all of them close.
    pub linkage_closure: T,
    /// Further measures of stability; NaN where the scope excludes them.
    pub indicators: Indicators<T>,
    /// Contributions to the load, by wheel.
    pub contributions: Vec<Contributions<T>>,
    /// Contribution of each link to the OTF, by link and wheel (N); empty where the scope excludes them.
    /// Minus the contribution of the tool wrench they add up to the OTF.
    pub parts: Vec<Vec<T>>,
    /// Standard deviations of the loads.
    pub uncertainty: Uncertainty<T>,
    /// Results of the analytic model beyond the loads; NaN with another model.
    pub closed_form: ClosedFormOutcome<T>,
}

/// A point that travels over the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GroundPoint {
    /// The wheel of this index.
    Wheel(usize),
    /// The middle of the front axle.
    FrontAxle,
    /// The middle of the rear axle.
    RearAxle,
}

/// A quantity of an [`Outcome`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// [`Outcome::otf`] of this wheel.
    Otf(usize),
    /// [`Outcome::load`] of this wheel.
    Load(usize),
    /// [`Outcome::load_least`] of this wheel.
    LoadLeast(usize),
    /// [`Outcome::load_largest`] of this wheel.
    LoadLargest(usize),
    /// [`Outcome::normal_force`].
    NormalForce,
    /// [`Outcome::zmp_x`].
    ZmpX,
    /// [`Outcome::zmp_y`].
    ZmpY,
    /// [`Outcome::zmp_margin`].
    ZmpMargin,
    /// [`Outcome::itom_full`] of this edge.
    ItomFull(usize),
    /// [`Outcome::linkage_closure`].
    LinkageClosure,
    /// [`Outcome::measured_torques`].
    MeasuredTorques,
    /// [`Outcome::torque_residual`] of this actuated joint.
    TorqueResidual(usize),
    /// [`Indicators::mhs`] of this edge.
    Mhs(usize),
    /// [`Indicators::tom`] of this edge.
    Tom(usize),
    /// [`Indicators::itom`] of this edge.
    Itom(usize),
    /// [`Indicators::force_angle`] of this edge.
    ForceAngle(usize),
    /// [`Indicators::stability_angle`] of this edge.
    StabilityAngle(usize),
    /// [`Indicators::load_transfer_ratio`].
    LoadTransferRatio,
    /// [`Indicators::spread`].
    Spread,
    /// [`Indicators::sigma`].
    Sigma,
    /// A component of [`Indicators::sigma_gradient`].
    SigmaGradient(BaseMotion),
    /// Force of [`Indicators::arm_wrench`] along this axis.
    ArmForce(Axis),
    /// Moment of [`Indicators::arm_wrench`] about this axis.
    ArmMoment(Axis),
    /// This contribution to the load of this wheel.
    Contribution(Contribution, usize),
    /// Contribution of a link, the first index, to the OTF of a wheel, the second.
    Part(usize, usize),
    /// [`Uncertainty::load`] of this wheel.
    LoadSigma(usize),
    /// [`Uncertainty::otf`] of this wheel.
    OtfSigma(usize),
    /// [`Uncertainty::utilisation`].
    Utilisation,
    /// A term of the analytic model, 0 to 10 for zeta 1 to 11, for this wheel.
    Term(usize, usize),
    /// Ground speed of this point.
    Speed(GroundPoint),
    /// Direction of travel of this point.
    Direction(GroundPoint),
    /// Sideslip angle of this point.
    Sideslip(GroundPoint),
}

impl<T: Real> Outcome<T> {
    pub(crate) fn blank(machine: &Machine) -> Self {
        let wheels = vec![T::zero(); machine.wheels.len()];
        Self {
            ground_wrench: Wrench::zero(),
            contact_normal: Vector3::zeros(),
            normal_force: T::zero(),
            otf: wheels.clone(),
            load: wheels.clone(),
            load_least: wheels.clone(),
            load_largest: wheels,
            zmp_x: T::zero(),
            zmp_y: T::zero(),
            zmp_margin: T::zero(),
            itom_full: vec![T::zero(); machine.polygon.edges.len()],
            measured_torques: T::zero(),
            torque_residual: vec![T::constant(f64::NAN); machine.contact.actuated_joints.len()],
            linkage_closure: T::zero(),
            indicators: Indicators::blank(machine),
            contributions: vec![
                [T::constant(f64::NAN); Contribution::ALL.len()];
                machine.wheels.len()
            ],
            parts: Vec::new(),
            uncertainty: Uncertainty::blank(machine),
            closed_form: ClosedFormOutcome::blank(machine),
        }
    }

    /// The value of a quantity.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> T {
        match quantity {
            Quantity::Otf(wheel) => self.otf[wheel],
            Quantity::Load(wheel) => self.load[wheel],
            Quantity::LoadLeast(wheel) => self.load_least[wheel],
            Quantity::LoadLargest(wheel) => self.load_largest[wheel],
            Quantity::NormalForce => self.normal_force,
            Quantity::ZmpX => self.zmp_x,
            Quantity::ZmpY => self.zmp_y,
            Quantity::ZmpMargin => self.zmp_margin,
            Quantity::ItomFull(edge) => self.itom_full[edge],
            Quantity::LinkageClosure => self.linkage_closure,
            Quantity::MeasuredTorques => self.measured_torques,
            Quantity::TorqueResidual(joint) => self.torque_residual[joint],
            Quantity::Contribution(cause, wheel) => self.contributions[wheel][cause as usize],
            Quantity::Part(link, wheel) => self.parts[link][wheel],
            Quantity::LoadSigma(wheel) => self.uncertainty.load[wheel],
            Quantity::OtfSigma(wheel) => self.uncertainty.otf[wheel],
            Quantity::Utilisation => self.uncertainty.utilisation,
            Quantity::Term(term, wheel) => self.closed_form.terms[wheel][term],
            Quantity::Speed(place) => self.closed_form.at(place).speed,
            Quantity::Direction(place) => self.closed_form.at(place).direction,
            Quantity::Sideslip(place) => self.closed_form.at(place).sideslip,
            _ => self.indicators.get(quantity),
        }
    }
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

impl<T: Real> Indicators<T> {
    /// The value of a quantity; NaN if it is not one of the analytic model.
    fn get(&self, quantity: Quantity) -> T {
        match quantity {
            Quantity::Mhs(edge) => self.mhs[edge],
            Quantity::Tom(edge) => self.tom[edge],
            Quantity::Itom(edge) => self.itom[edge],
            Quantity::ForceAngle(edge) => self.force_angle[edge],
            Quantity::StabilityAngle(edge) => self.stability_angle[edge],
            Quantity::LoadTransferRatio => self.load_transfer_ratio,
            Quantity::Spread => self.spread,
            Quantity::Sigma => self.sigma,
            Quantity::SigmaGradient(travel) => self.sigma_gradient.get(travel),
            Quantity::ArmForce(axis) => self.arm_wrench.force[axis as usize],
            Quantity::ArmMoment(axis) => self.arm_wrench.moment[axis as usize],
            _ => T::constant(f64::NAN),
        }
    }
}

impl Quantity {
    /// All quantities that the scope fills for this machine, in column order.
    #[must_use]
    pub fn all(machine: &Machine, scope: Scope) -> Vec<Self> {
        let (wheels, edges) = (0..machine.wheels.len(), 0..machine.polygon.edges.len());
        let by = |indices: &Range<usize>, kinds: &[fn(usize) -> Self]| -> Vec<Self> {
            let of = |kind: &fn(usize) -> Self| indices.clone().map(*kind).collect::<Vec<_>>();
            kinds.iter().flat_map(of).collect()
        };
        let mut all = by(
            &wheels,
            &[Self::Load, Self::Otf, Self::LoadLeast, Self::LoadLargest],
        );
        all.extend(by(&edges, &[Self::ItomFull]));
        all.extend([
            Self::NormalForce,
            Self::ZmpX,
            Self::ZmpY,
            Self::ZmpMargin,
            Self::LinkageClosure,
        ]);
        let actuated = machine.contact.actuated_joints.len();
        if actuated > 0 {
            all.push(Self::MeasuredTorques);
            all.extend((0..actuated).map(Self::TorqueResidual));
        }
        if scope.sensitivities {
            all.extend(by(&wheels, &[Self::LoadSigma, Self::OtfSigma]));
            all.push(Self::Utilisation);
        }
        if scope.indicators {
            all.extend(by(
                &edges,
                &[
                    Self::Itom,
                    Self::Tom,
                    Self::Mhs,
                    Self::ForceAngle,
                    Self::StabilityAngle,
                ],
            ));
            all.extend([Self::LoadTransferRatio, Self::Spread, Self::Sigma]);
            if machine.arm_root.is_some() {
                all.extend(Axis::ALL.map(Self::ArmForce));
                all.extend(Axis::ALL.map(Self::ArmMoment));
            }
        }
        if scope.indicators && scope.sensitivities {
            all.extend(BaseMotion::ALL.map(Self::SigmaGradient));
        }
        if scope.contributions {
            let contributions = Contribution::ALL.into_iter();
            all.extend(
                contributions
                    .flat_map(|cause| wheels.clone().map(move |w| Self::Contribution(cause, w))),
            );
        }
        if scope.terms {
            all.extend((0..11).flat_map(|term| wheels.clone().map(move |w| Self::Term(term, w))));
            let axles = [GroundPoint::FrontAxle, GroundPoint::RearAxle];
            let places: Vec<_> = wheels
                .clone()
                .map(GroundPoint::Wheel)
                .chain(axles)
                .collect();
            for kind in [Self::Speed, Self::Direction, Self::Sideslip] {
                all.extend(places.iter().copied().map(kind));
            }
        }
        if scope.parts {
            let links = links_with_mass(machine);
            all.extend(links.flat_map(|link| wheels.clone().map(move |w| Self::Part(link, w))));
        }
        all
    }
}
