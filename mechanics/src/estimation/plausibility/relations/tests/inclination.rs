//! The up direction without an attitude: that at rest, carried on by the gyro.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::inclination::{Inclination, Rest};
use crate::estimation::noise_of_tests::Noise;

const GRAVITY: f64 = 9.81;
const STEP_S: f64 = 0.01;
const BIAS: [f64; 3] = [0.004, -0.003, 0.002];

fn rest(up: &Vector3<f64>, bias: Vector3<f64>, noise: &mut Noise) -> Rest {
    let mut scattered = |scale: f64| Vector3::from_fn(|_, _| scale * noise.next());
    Rest {
        force: up * GRAVITY + scattered(0.02),
        force_scatter: 0.03,
        turning: bias + scattered(2e-4),
        turning_scatter: 2e-4,
    }
}

#[test]
fn up_and_bias_of_a_rest_are_carried_on_within_their_sigma() {
    let bias = Vector3::from(BIAS);
    let mut noise = Noise(3);
    let mut attitude = UnitQuaternion::from_euler_angles(0.1, -0.06, 0.4);
    let up = |attitude: &UnitQuaternion<f64>| attitude.inverse_transform_vector(&Vector3::z());
    let mut inclination = Inclination::at(&rest(&up(&attitude), bias, &mut noise)).unwrap();
    for _ in 0..4 {
        inclination.take(&rest(&up(&attitude), bias, &mut noise));
    }
    let at_rest = inclination.sigma();
    let mut apart = 0.0_f64;
    for k in 0..2000_i32 {
        let t = f64::from(k) * STEP_S;
        let turning = Vector3::new(0.1 * t.sin(), 0.08 * (0.7 * t).cos(), 0.3);
        attitude *= UnitQuaternion::from_scaled_axis(turning * STEP_S);
        let carried = inclination.turn(&((turning + bias) * STEP_S), STEP_S);
        apart = carried.angle(&up(&attitude));
        assert!(
            apart < 3.0 * inclination.sigma(),
            "{t}: {apart} {}",
            inclination.sigma()
        );
    }
    assert!(apart < 0.02, "the bias was learned: {apart}");
    assert!(inclination.sigma() > 1.5 * at_rest);
    inclination.take(&rest(&up(&attitude), bias, &mut noise));
    assert!(inclination.sigma() < 0.01);
}

#[test]
fn without_a_force_there_is_no_up() {
    let mut noise = Noise(5);
    let nothing = Rest {
        force: Vector3::zeros(),
        ..rest(&Vector3::z(), Vector3::zeros(), &mut noise)
    };
    assert!(Inclination::at(&nothing).is_none());
}
