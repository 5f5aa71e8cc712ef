//! The edges that a platform can rotate about, and how far its tyres let it lean.

use nalgebra::{Vector2, Vector3};

use crate::machine::{Machine, Wheel};

/// Smallest standard deviation of the lean (rad).
const LEAST_LEAN: f64 = 0.3 * DEGREE;
/// Standard deviation of the lean of a machine whose supports come and go: jacking and sinking feet (rad).
const JACKING: f64 = 3.0 * DEGREE;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// An edge of the polygon as an axis of rotation.
#[derive(Debug, Clone)]
pub(super) struct EdgeAxis {
    pub(super) name: String,
    /// Unit vector along the edge, in base axes: a positive rotation about it lifts the interior.
    pub(super) axis: Vector3<f64>,
    /// Standard deviation of the lean about the edge while the machine stands on its supports (rad).
    pub(super) lean_sigma: f64,
    /// Largest lean on the tyres alone (rad).
    pub(super) lean_on_tyres: f64,
    /// Distance of the farthest support from the edge (m).
    pub(super) width: f64,
}

/// The edges, the length over which the ground under the machine becomes another (m), the height of the base's origin above the
/// ground (m), and the radius of the largest wheel (m).
#[derive(Debug, Clone)]
pub(super) struct Edges {
    pub(super) all: Vec<EdgeAxis>,
    pub(super) length: f64,
    pub(super) height: f64,
    pub(super) radius: f64,
}

impl Edges {
    /// Returns the edges of the support polygon; where supports come and go, of the polygon around all of them.
    pub(super) fn of(machine: &Machine) -> Self {
        let outer = machine.outer_polygon();
        let (polygon, wheels) = match &outer {
            Some(polygon) => (polygon, &machine.supports().all[..]),
            None => (machine.polygon(), machine.wheels()),
        };
        let contact = |wheel: usize| {
            let wheel = &wheels[wheel];
            wheel.centre_at_zero - Vector3::z() * wheel.radius
        };
        let edges = polygon.edges().iter().filter_map(|edge| {
            let axis = (contact(edge.to) - contact(edge.from)).try_normalize(1e-9)?;
            let across = Vector2::new(-axis.y, axis.x).try_normalize(1e-9)?;
            let places = (0..wheels.len()).map(|wheel| (contact(wheel) - contact(edge.from)).xy());
            let width = places
                .map(|place| across.dot(&place).abs())
                .reduce(f64::max)?;
            let lean = largest_lean(machine, wheels, &across).max(LEAST_LEAN);
            Some(EdgeAxis {
                name: edge.name.clone(),
                axis,
                lean_sigma: if outer.is_some() {
                    lean.hypot(JACKING)
                } else {
                    lean
                },
                lean_on_tyres: lean,
                width,
            })
        });
        let heights = (0..wheels.len()).map(|wheel| -contact(wheel).z);
        let along = wheels.iter().map(|wheel| wheel.centre_at_zero.x);
        let (first, last) = along.fold((f64::MAX, f64::MIN), |(least, most), x| {
            (least.min(x), most.max(x))
        });
        Self {
            all: edges.collect(),
            length: (last - first).max(0.5),
            height: heights.fold(0.0, f64::max),
            radius: wheels.iter().map(|wheel| wheel.radius).fold(0.0, f64::max),
        }
    }
}

/// Largest lean on the tyres in a direction `across` an edge (rad): the whole weight on the farthest wheel.
fn largest_lean(machine: &Machine, wheels: &[Wheel], across: &Vector2<f64>) -> f64 {
    let weight = machine.mass() * machine.gravity();
    let stiffness = Wheel::stiffnesses(wheels, weight);
    let places = wheels.iter().zip(&stiffness);
    let places =
        places.map(|(wheel, stiffness)| (across.dot(&wheel.centre_at_zero.xy()), *stiffness));
    let (sum, first) = (places.clone()).fold((0.0, 0.0), |(sum, first), (place, stiffness)| {
        (sum + stiffness, first + stiffness * place)
    });
    let centre = first / sum;
    let (second, farthest) =
        places.fold((0.0, 0.0_f64), |(second, farthest), (place, stiffness)| {
            let from_centre = place - centre;
            (
                second + stiffness * from_centre * from_centre,
                farthest.max(from_centre.abs()),
            )
        });
    let lean = weight * farthest / second;
    if lean.is_finite() { lean } else { 0.0 }
}
