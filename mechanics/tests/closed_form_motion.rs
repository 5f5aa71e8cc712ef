//! Attitude, and planar motion of the platform and the wheels.

use crate::support;
use crate::support::attitude::Attitude;
use crate::support::closed_form::{assert_all_close, assert_close, motion, platform};
use nalgebra::{Matrix3, Vector2, Vector3};
use proptest::prelude::*;
use tipwatch_mechanics::closed_form::{
    LEAST_SPEED, PlanarMotion, axle_heading, heading_of_spin_axis,
};

proptest! {
    #![proptest_config(support::cases(400))]

    #[test]
    fn attitude_from_up_inverts_up_from_attitude(
        theta in -1.5..1.5_f64, phi in -1.5..1.5_f64, psi in -3.1..3.1_f64,
    ) {
        let attitude = Attitude { theta, phi, psi };
        let angles = |a: Attitude<f64>| [a.theta, a.phi, a.psi];
        assert_all_close(angles(Attitude::of_up(&(attitude.up() * 9.8), psi)), angles(attitude), 1e-12);
        let rotation = attitude.rotation();
        assert_all_close(angles(Attitude::of_rotation(&rotation)), angles(attitude), 1e-12);
        prop_assert!((rotation.transpose() * rotation - Matrix3::identity()).norm() < 1e-14);
        prop_assert!((rotation.transpose() * Vector3::z() - attitude.up()).norm() < 1e-15);
    }

    #[test]
    fn angular_velocity_matches_rotation_rate(
        angles in prop::array::uniform3(-1.4..1.4_f64), rates in prop::array::uniform3(-2.0..2.0_f64),
    ) {
        let of = |[theta, phi, psi]: [f64; 3]| Attitude { theta, phi, psi };
        let after = |dt: f64| of(std::array::from_fn(|k| angles[k] + rates[k] * dt)).rotation();
        // (9): the cross-product matrix of w is R' Rdot
        let turning = of(angles).rotation().transpose() * (after(1e-5) - after(-1e-5)) / 2e-5;
        let found = of(angles).angular_velocity(&of(rates));
        prop_assert!((found.cross_matrix() - turning).norm() < 1e-8);
    }

    #[test]
    fn wheel_velocities_follow_rigid_body_motion(u in prop::collection::vec(-1.0..1.0_f64, 20)) {
        let (p, v) = (platform(&u), motion(&u[14..]));
        let velocities = v.velocities(&p);
        let (speed, beta) = (velocities.centre.speed(), velocities.centre.direction());
        prop_assume!(speed > LEAST_SPEED);
        let (l1, l2, rate) = (p.to_rear, p.to_front, v.yaw_rate);
        let (left, right) = (-p.half_track_left * rate, p.half_track_right * rate);
        let offsets = [(l2, left), (l2, right), (-l1, right), (-l1, left), (l2, 0.0), (-l1, 0.0)];
        let [fl, fr, rr, rl] = velocities.wheels;
        let points = [fl, fr, rr, rl, velocities.front, velocities.rear];
        for (point, (lever, along)) in points.into_iter().zip(offsets) {
            // (13)-(24)
            let (sin, cos) = beta.sin_cos();
            let expected = Vector2::new(speed * cos + along, speed * sin + lever * rate);
            prop_assert!((point.0 - expected).norm() < 1e-12);
            prop_assume!(point.speed() > LEAST_SPEED);
            let (sin, cos) = point.direction().sin_cos();
            prop_assert!((Vector2::new(cos, sin) * point.speed() - expected).norm() < 1e-12);
            // (31), modulo full turns
            let heading = Vector2::new(0.3_f64.cos(), 0.3_f64.sin());
            let off = point.sideslip(&heading) - (point.direction() - 0.3);
            prop_assert!(off.abs() < 1e-12 || (off.abs() - std::f64::consts::TAU).abs() < 1e-12);
        }
    }
}

#[test]
fn slope_angles_have_documented_signs() {
    let up = |theta: f64, phi: f64| {
        Attitude {
            theta,
            phi,
            psi: 0.0,
        }
        .up()
    };
    assert!(up(-0.1, 0.0).x > 0.0, "climbing: up leans forward");
    assert!(up(0.0, 0.1).y > 0.0, "left side up: up leans left");
}

#[test]
fn direction_is_unknown_at_standstill() {
    let creeping = PlanarMotion {
        v_x: 0.9 * LEAST_SPEED,
        ..PlanarMotion::zero()
    };
    let centre = creeping.velocity_at(&Vector2::zeros());
    assert!(centre.direction().is_nan());
    assert!(centre.sideslip(&Vector2::x()).is_nan());
    let reversing = PlanarMotion {
        v_x: -1.0,
        ..PlanarMotion::zero()
    };
    let centre = reversing.velocity_at(&Vector2::zeros());
    assert_close(centre.direction(), std::f64::consts::PI, 1e-15);
}

#[test]
fn heading_is_independent_of_spin_axis_sign() {
    // delta of (31): counter-clockwise from forward
    let steering_angle = |heading: &Vector2<f64>| heading.y.atan2(heading.x);
    let (sin, cos) = 0.4_f64.sin_cos();
    for side in [1.0, -1.0] {
        // Steered left by 0.4, with camber.
        let heading = heading_of_spin_axis(&(Vector3::new(-sin, cos, 0.1) * side));
        assert_close(steering_angle(&heading), 0.4, 1e-15);
        let other = Vector2::new(0.2_f64.cos(), 0.2_f64.sin());
        assert_close(steering_angle(&axle_heading(&heading, &other)), 0.3, 1e-12);
    }
}
