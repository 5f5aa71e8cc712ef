//! How heights of the wheels off one plane press tyres where the ground is a plane.

use nalgebra::{Matrix4, Vector2, Vector4};

use super::{Contact, Ground, Split, Wheel};

/// What a height off the plane does under the front share's rule: the four loads in equilibrium with
/// themselves, by their stiffness.
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    /// Value of the rule's equation by each wheel's offset.
    pub(crate) value_by_offset: Vec<f64>,
    /// Share of each tyre in the compliance of the warp.
    pub(crate) compliance_share: Vec<f64>,
}

impl Contact {
    /// Sets what follows from the wheels' stiffness on plane ground. Under the front share's rule the
    /// loads in equilibrium with themselves, z, are those with all joints at zero; a height u of each
    /// wheel below the plane then gives z (z.u) / (z' K^-1 z).
    pub(super) fn set_warp(&mut self, wheels: &[Wheel]) {
        self.mean_stiffness = None;
        self.warp = None;
        if self.ground != Ground::Plane || !self.tyres_deflect {
            return;
        }
        let stiffness: f64 = wheels.iter().filter_map(|wheel| wheel.stiffness).sum();
        self.mean_stiffness = Some(stiffness / wheels.len() as f64);
        if let Split::FrontShare {
            share,
            wheels: four,
        } = self.split
        {
            let places = four.map(|wheel| wheels[wheel].centre_at_zero.xy());
            let exchange = exchange(share, &places);
            let mut warp = Warp {
                value_by_offset: vec![0.0; 4],
                compliance_share: vec![0.0; 4],
            };
            let soft = |k: usize| exchange[k].powi(2) / wheels[four[k]].relative_stiffness;
            let compliance: f64 = (0..4).map(soft).sum();
            for (k, &wheel) in four.iter().enumerate() {
                warp.value_by_offset[wheel] = exchange[k] / compliance;
                warp.compliance_share[wheel] = soft(k) / compliance;
            }
            self.warp = Some(warp);
        }
    }
}

/// The loads of FL FR RL RR that carry nothing and give the rule (54) the value one; zero where
/// the wheels stand so that there are none.
fn exchange(share: f64, places: &[Vector2<f64>; 4]) -> Vector4<f64> {
    let row = |of: fn(&Vector2<f64>) -> f64| places.each_ref().map(of);
    let [sum, left, forward] = [row(|_| 1.0), row(|p| p.y), row(|p| p.x)];
    let rule = [share - 1.0, 1.0 - share, share, -share];
    let equations = Matrix4::from_row_slice(&[sum, left, forward, rule].concat());
    let unit = Vector4::new(0.0, 0.0, 0.0, 1.0);
    equations.lu().solve(&unit).unwrap_or_else(Vector4::zeros)
}
