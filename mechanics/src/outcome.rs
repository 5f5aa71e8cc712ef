//! What one evaluation gives, and the list of its numbers by name.

use nalgebra::Vector3;

use crate::machine::Machine;
use crate::number::Real;
use crate::spatial::Wrench;

/// Wheel loads and stability of one instant, or of several side by side: see [`Real`].
///
/// A number that cannot be computed is NaN; nothing else is.
#[derive(Debug, Clone)]
pub struct Outcome<T> {
    /// Force and moment that the ground supplies, about the base origin, in base axes (N, N m).
    pub ground_wrench: Wrench<T>,
    /// Unit normal of the plane through the contact points, upwards, in base axes.
    pub contact_normal: Vector3<T>,
    /// Force of the ground along the normal: the sum of the loads (N).
    pub normal_force: T,
    /// Load with all wheels held to the ground, by wheel: OTF (109) of the first paper, negative where
    /// a wheel would have to pull (N).
    pub otf: Vec<T>,
    /// Load, by wheel (N): never negative.
    pub load: Vec<T>,
    /// Least load that equilibrium allows, by wheel (N).
    pub load_least: Vec<T>,
    /// Largest load that equilibrium allows, by wheel (N).
    pub load_largest: Vec<T>,
    /// Centre of pressure forward of the base origin's projection, in the contact plane (m).
    pub zmp_x: T,
    /// Centre of pressure to the left of it (m).
    pub zmp_y: T,
    /// Distance of the centre of pressure from the nearest edge, inside positive (m).
    pub zmp_margin: T,
    /// Overturning moment about each edge of the support polygon, wheel weights included (ITOM of the
    /// first paper with wheel weights), negative = stable (N m).
    pub itom_full: Vec<T>,
    /// Smallest closure of the linkages, not below zero where all close.
    pub linkage_closure: T,
}

/// A number of an [`Outcome`], by meaning.
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
            linkage_closure: T::zero(),
        }
    }

    /// One of its numbers.
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
        }
    }
}

impl Quantity {
    /// All numbers of an outcome of this machine, in the order of their columns.
    #[must_use]
    pub fn all(machine: &Machine) -> Vec<Self> {
        let wheels = 0..machine.wheels.len();
        let by_wheel: [fn(usize) -> Self; 4] =
            [Self::Load, Self::Otf, Self::LoadLeast, Self::LoadLargest];
        let mut all: Vec<Self> = by_wheel
            .iter()
            .flat_map(|kind| wheels.clone().map(kind))
            .collect();
        all.extend((0..machine.polygon.edges.len()).map(Self::ItomFull));
        all.extend([
            Self::NormalForce,
            Self::ZmpX,
            Self::ZmpY,
            Self::ZmpMargin,
            Self::LinkageClosure,
        ]);
        all
    }
}
