//! Tyre deflection due to the wheels' heights off a common plane, on ground declared flat.

use nalgebra::{Matrix4, Vector2, Vector4};

use super::wheel::Wheel;

/// Effect of a height off the plane under the split rule by roll moment distribution: the self-equilibrated
/// loads of four wheels, scaled by their stiffness.
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    /// z: the self-equilibrated loads, by wheel, with all joints at zero.
    pub(super) exchange: Vec<f64>,
    /// Value of the split rule's equation per offset of each wheel.
    pub(crate) value_by_offset: Vec<f64>,
    /// Fraction of each tyre in the compliance of the warp.
    pub(crate) compliance_share: Vec<f64>,
}

impl Warp {
    pub(super) fn of(exchange: Vec<f64>, wheels: &[Wheel]) -> Self {
        let soft = exchange.iter().zip(wheels);
        let soft: Vec<f64> = soft.map(|(z, w)| z * z / w.relative_stiffness).collect();
        let compliance: f64 = soft.iter().sum();
        Self {
            value_by_offset: exchange.iter().map(|z| z / compliance).collect(),
            compliance_share: soft.iter().map(|s| s / compliance).collect(),
            exchange,
        }
    }
}

pub(super) fn mean_stiffness(wheels: &[Wheel]) -> f64 {
    let sum: f64 = wheels.iter().filter_map(|wheel| wheel.stiffness).sum();
    sum / wheels.len() as f64
}

/// The self-equilibrated loads of FL FR RL RR that give the rule (54) the value one; zero where the wheel
/// positions allow none.
pub(super) fn exchange(share: f64, places: &[Vector2<f64>; 4]) -> Vector4<f64> {
    let row = |of: fn(&Vector2<f64>) -> f64| places.each_ref().map(of);
    let [sum, left, forward] = [row(|_| 1.0), row(|p| p.y), row(|p| p.x)];
    let rule = [share - 1.0, 1.0 - share, share, -share];
    let equations = Matrix4::from_row_slice(&[sum, left, forward, rule].concat());
    let unit = Vector4::new(0.0, 0.0, 0.0, 1.0);
    equations.lu().solve(&unit).unwrap_or_else(Vector4::zeros)
}
