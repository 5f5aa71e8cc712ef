//! Validation: the second paper's triangle of bogie, cylinder and rod equals a `[[linkage]]`.

use nalgebra::Vector2;

use super::{LogFacts, MachineSpec};
use crate::geometry::coordinate::Motion;

/// (11)-(17) with q the exterior angle at the pivot (the printed one contradicts (14)-(19)), q1 that at the
/// cylinder's hinge, and L_a, L_b, X = L_x the sides:
/// ```text
///     q  = -arccos((X^2 - L_a^2 - L_b^2)/(2 L_a L_b))    k1 = -X/(L_a L_b sin q)              dk1/dx = k1/X - k1^2 cot q
///     q1 = -arccos((X^2 + L_b^2 - L_a^2)/(2 X L_b))      k2 = -(X - L_b cos q1)/(X L_b sin q1)
///     dk2/dx = -cot(q1)/X^2 + (cos q1/L_b - 1/X) k2/sin^2 q1
/// ```
#[test]
fn val_pivot_and_cylinder_match_second_paper() {
    let spec =
        MachineSpec::from_toml(include_str!("../../tests/data/bogie.toml"), "bogie.toml").unwrap();
    let urdf = include_str!("../../tests/data/bogie.urdf");
    let logged = [
        "suspension_right",
        "suspension_left",
        "lift",
        "tilt",
        "slew",
        "extension",
    ]
    .map(String::from);
    let facts = LogFacts {
        joint_names: Some(&logged),
        ..LogFacts::default()
    };
    let machine = spec.check(urdf, "bogie.urdf", facts).unwrap();
    let linkage = &machine.linkages[0];
    let (hinge, pin) = (
        Vector2::<f64>::new(0.50, 0.55),
        Vector2::<f64>::new(0.75, 0.02),
    );
    let (l_b, l_a) = (hinge.norm(), pin.norm());
    for x in [-0.19_f64, -0.13, -0.07, -0.01] {
        for (rate, acceleration) in [(0.08, 0.0), (-0.05, 0.3), (0.0, -0.2)] {
            let length = x + 0.10 + 0.586;
            let q = -((length * length - l_a * l_a - l_b * l_b) / (2.0 * l_a * l_b)).acos();
            let k1 = -length / (l_a * l_b * q.sin());
            let k1_by_x = k1 / length - k1 * k1 / q.tan();
            let q1 = -((length * length + l_b * l_b - l_a * l_a) / (2.0 * length * l_b)).acos();
            let k2 = -(length - l_b * q1.cos()) / (length * l_b * q1.sin());
            let k2_by_x = -1.0 / (q1.tan() * length * length)
                + (q1.cos() / l_b - 1.0 / length) * k2 / q1.sin().powi(2);
            let solved = linkage.solve(&Motion {
                position: x,
                rate,
                acceleration,
            });
            let angle = solved.pivot.sin.atan2(solved.pivot.cos);
            // Direction of the eye from the pivot, rotated about y, relative to that of the hinge.
            let at_zero = pin.y.atan2(pin.x) - angle;
            let inner = hinge.y.atan2(hinge.x) - at_zero;
            assert!(
                (inner - (std::f64::consts::PI + q)).abs() < 1e-12,
                "{x}: {inner} {}",
                std::f64::consts::PI + q
            );
            for (turned, k, k_by_x) in [
                (&solved.pivot, k1, k1_by_x),
                (&solved.cylinder, k2, k2_by_x),
            ] {
                let expected = k_by_x * rate * rate + k * acceleration;
                assert!((turned.rate.abs() - (k * rate).abs()).abs() < 1e-12);
                assert!((turned.acceleration.abs() - expected.abs()).abs() < 1e-11);
            }
        }
    }
}
