//! Properties of the analytic model for any platform and motion.

use crate::support;
use crate::support::attitude::Attitude;
use crate::support::closed_form::{
    ITOM_WITH_WHEELS, assert_all_close, assert_close, measured_terms, motion, platform, wrench,
};
use crate::support::velocity_gradient::{LoadGradient, sigma_gradient};
use nalgebra::{Matrix4, Vector3, Vector4};
use proptest::prelude::*;
use tipwatch_mechanics::closed_form::{
    Counted, DemandContributions, MeasuredMotion, PlanarMotion, Platform,
};
use tipwatch_mechanics::wheel_loads::sigma;
use tipwatch_mechanics::{Lanes, Real, Wrench};

/// A platform, the up direction in its axes, its motion and the arm's wrench.
type Case = (Platform<f64>, Vector3<f64>, PlanarMotion<f64>, Wrench<f64>);

fn arm(u: &[f64]) -> Wrench<f64> {
    wrench(std::array::from_fn(|k| 8000.0 * u[k]))
}

fn cases() -> impl Strategy<Value = Case> {
    prop::collection::vec(-1.0..1.0_f64, 28).prop_map(|u| {
        let up = Vector3::new(0.4 * u[14], 0.4 * u[15], 1.0).normalize();
        (platform(&u), up, motion(&u[16..]), arm(&u[22..]))
    })
}

/// (56)-(58), with the weights of four wheels on unequal half tracks.
fn printed_b((p, up, v, arm): &Case) -> [f64; 3] {
    let g = p.gravity;
    let [m_w, m_w_r_w] = [p.wheel_mass / 4.0, p.wheel_moment.z / 4.0];
    let rate = v.yaw_rate;
    let (f, m, base) = (&arm.force, &arm.moment, &p.arm_base);
    let tilted = g * (p.mass * p.com_height + 4.0 * m_w_r_w);
    let lever = p.mass * p.com_height;
    let b1 = (base.z + p.com_height) * f.y
        - base.y * f.z
        - m.x
        - tilted * up.y
        - lever * (v.vdot_y + v.v_x * rate)
        - p.inertia_yz * rate * rate
        + p.inertia_xz * v.yaw_acceleration
        + 2.0 * g * m_w * (p.half_track_left - p.half_track_right) * up.z;
    let b2 = -(base.z + p.com_height) * f.x + base.x * f.z - m.y
        + tilted * up.x
        + 2.0 * g * (p.to_rear - p.to_front) * m_w * up.z
        + lever * (v.vdot_x - v.v_y * rate)
        + p.inertia_xz * rate * rate
        + p.inertia_yz * v.yaw_acceleration;
    [b1, b2, g * (p.mass + 4.0 * m_w) * up.z - f.z]
}

/// (55) with the row of (54) for any D, solved as a linear system.
fn solved(p: &Platform<f64>, [b1, b2, b3]: [f64; 3]) -> [f64; 4] {
    let (l, r, d) = (
        p.half_track_left,
        p.half_track_right,
        p.roll_moment_distribution,
    );
    let (l1, l2) = (p.to_rear, p.to_front);
    #[rustfmt::skip]
    let rows = Matrix4::new(
        l,       -r,      -r,  l,
        -l2,     -l2,     l1,  l1,
        1.0,     1.0,     1.0, 1.0,
        d - 1.0, 1.0 - d, -d,  d,
    );
    let solution = rows.lu().solve(&Vector4::new(b1, b2, b3, 0.0));
    solution.map_or([f64::NAN; 4], Into::into)
}

fn contributions((platform, up, motion, arm): &Case) -> DemandContributions<f64> {
    DemandContributions::of_motion(platform, up, motion, arm)
}

fn measured_contributions((platform, up, motion, arm): &Case) -> DemandContributions<f64> {
    let measured = MeasuredMotion {
        specific_force: motion.acceleration().push(0.0) + up * platform.gravity,
        yaw_rate: motion.yaw_rate,
        yaw_acceleration: motion.yaw_acceleration,
    };
    DemandContributions::of_measured(platform, up, &measured, arm)
}

/// The terms as printed, in one formula for the four wheels: F = 1 in front, S = 1 on the left.
fn printed_terms((p, up, v, arm): &Case, f: f64, s: f64) -> [f64; 11] {
    let (w, l, g) = (p.half_track_left, p.wheelbase(), p.gravity);
    let other = if f > 0.0 { p.to_rear } else { p.to_front };
    let (m_w, height) = (p.wheel_mass / 4.0, p.arm_base.z + p.com_height);
    let q = p.wheel_moment.z / 4.0 + p.mass * p.com_height / 4.0;
    let lever = p.mass * p.com_height;
    let (force, moment, rate) = (&arm.force, &arm.moment, v.yaw_rate);
    let (xz, yz) = (p.inertia_xz, p.inertia_yz);
    [
        g * ((p.mass * other / (2.0 * l) + m_w) * up.z - s * q / w * up.y - f * 2.0 * q / l * up.x),
        f * height / (2.0 * l) * force.x,
        s * height / (4.0 * w) * force.y,
        -0.5 * ((other + f * p.arm_base.x) / l + s * p.arm_base.y / (2.0 * w)) * force.z,
        -s * moment.x / (4.0 * w),
        f * moment.y / (2.0 * l),
        -f * lever / (2.0 * l) * v.vdot_x,
        -s * lever / (4.0 * w) * v.vdot_y,
        0.5 * lever * (-s * v.v_x / (2.0 * w) + f * v.v_y / l) * rate,
        -0.5 * (f * xz / l + s * yz / (2.0 * w)) * rate * rate,
        -0.5 * (f * yz / l - s * xz / (2.0 * w)) * v.yaw_acceleration,
    ]
}

proptest! {
    #![proptest_config(support::cases(400))]

    #[test]
    fn terms_sum_to_solution_of_linear_system(case in cases()) {
        let b = contributions(&case).sum();
        assert_all_close([b.b1, b.b2, b.b3], printed_b(&case), 1e-7);
        let loads = contributions(&case).terms(&case.0).loads();
        assert_all_close(loads, solved(&case.0, printed_b(&case)), 1e-6);
    }

    #[test]
    fn terms_equal_printed_ones_on_equal_half_tracks(case in cases()) {
        let (mut p, up, motion, arm) = case;
        p.half_track_right = p.half_track_left;
        p.roll_moment_distribution = 0.5;
        p.wheel_moment.y = 0.0;
        let case = (p, up, motion, arm);
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        for (found, (f, s)) in contributions(&case).terms(&p).wheel.into_iter().zip(corners) {
            assert_all_close(found, printed_terms(&case, f, s), 1e-7);
        }
    }

    #[test]
    fn accelerometer_and_velocity_inputs_agree(case in cases()) {
        let (by_velocity, measured) = (contributions(&case), measured_contributions(&case));
        assert_all_close(
            measured.terms(&case.0).loads(), by_velocity.terms(&case.0).loads(), 1e-6,
        );
        let (measured, by_velocity) = (measured_terms(&measured, &case.0), measured_terms(&by_velocity, &case.0));
        for (found, expected) in measured.into_iter().zip(by_velocity) {
            assert_all_close(found, expected, 1e-6);
        }
    }

    #[test]
    fn edge_moments_equal_moments_of_loads_off_the_edge(case in cases()) {
        let (platform, contributions) = (&case.0, contributions(&case));
        let [fl, fr, rr, rl] = contributions.terms(platform).loads();
        let m = contributions.edge_moments(platform, ITOM_WITH_WHEELS);
        assert_close(m.front, -platform.wheelbase() * (rr + rl), 1e-5);
        assert_close(m.rear, -platform.wheelbase() * (fl + fr), 1e-5);
        assert_close(m.left, -platform.track() * (fr + rr), 1e-5);
        assert_close(m.right, -platform.track() * (fl + rl), 1e-5);
    }

    #[test]
    fn gradients_equal_load_differences(case in cases()) {
        let (platform, up, motion, arm) = case;
        let loads = |step: [f64; 6]| {
            let moved = PlanarMotion {
                v_x: motion.v_x + step[0],
                v_y: motion.v_y + step[1],
                yaw_rate: motion.yaw_rate + step[2],
                vdot_x: motion.vdot_x + step[3],
                vdot_y: motion.vdot_y + step[4],
                yaw_acceleration: motion.yaw_acceleration + step[5],
            };
            DemandContributions::of_motion(&platform, &up, &moved, &arm).terms(&platform).loads()
        };
        let gradient = LoadGradient::of(&platform, &motion);
        let optimal = [9000.0, 8000.0, 7000.0, 6000.0];
        let of_sigma = sigma_gradient(&loads([0.0; 6]), &optimal, &gradient.by_velocity);
        for k in 0..6 {
            // At most quadratic, so the central difference is exact.
            let step = |h: f64| std::array::from_fn(|i| if i == k { h } else { 0.0 });
            let (ahead, behind) = (loads(step(0.5)), loads(step(-0.5)));
            let found = [gradient.by_velocity, gradient.by_acceleration][k / 3].map(|by| by[k % 3]);
            let difference: [f64; 4] = std::array::from_fn(|wheel| ahead[wheel] - behind[wheel]);
            assert_all_close(found, difference, 1e-6);
            if k < 3 {
                let (ahead, behind) = (loads(step(1e-3)), loads(step(-1e-3)));
                let sigma = |loads: [f64; 4]| sigma(loads.into_iter(), optimal.into_iter());
                let slope = (sigma(ahead) - sigma(behind)) / 2e-3;
                assert_close(of_sigma[k], slope, 1e-6 * slope.abs() + 10.0);
            }
        }
    }

    #[test]
    fn lanes_equal_scalar_bitwise(case in cases(), others in prop::array::uniform4(cases())) {
        let platform = case.0;
        let four = Platform::<Lanes>::constant(&platform);
        let up = Vector3::from_fn(|row, _| lanes(&others, |c| c.1[row]));
        let motion = PlanarMotion {
            v_x: lanes(&others, |c| c.2.v_x),
            v_y: lanes(&others, |c| c.2.v_y),
            vdot_x: lanes(&others, |c| c.2.vdot_x),
            vdot_y: lanes(&others, |c| c.2.vdot_y),
            yaw_rate: lanes(&others, |c| c.2.yaw_rate),
            yaw_acceleration: lanes(&others, |c| c.2.yaw_acceleration),
        };
        let arm = Wrench {
            force: Vector3::from_fn(|row, _| lanes(&others, |c| c.3.force[row])),
            moment: Vector3::from_fn(|row, _| lanes(&others, |c| c.3.moment[row])),
        };
        let together = numbers(&four, &up, &motion, &arm);
        for (k, (_, up, motion, arm)) in others.iter().enumerate() {
            let alone = numbers(&platform, up, motion, arm);
            for (together, alone) in together.iter().zip(alone) {
                prop_assert_eq!(together.to_array()[k].to_bits(), alone.to_bits());
            }
        }
    }
}

fn lanes(cases: &[Case; 4], number: impl Fn(&Case) -> f64) -> Lanes {
    Lanes::from_array(cases.each_ref().map(number))
}

/// All results of the model in one vector.
fn numbers<T: Real>(
    platform: &Platform<T>,
    up: &Vector3<T>,
    motion: &PlanarMotion<T>,
    arm: &Wrench<T>,
) -> Vec<T> {
    let contributions = DemandContributions::of_motion(platform, up, motion, arm);
    let mut all = contributions.terms(platform).wheel.concat();
    all.extend(measured_terms(&contributions, platform).concat());
    all.extend(contributions.terms(platform).loads());
    let moments = contributions.edge_moments(platform, Counted::ITOM);
    all.extend([
        moments.front,
        moments.left,
        moments.rear,
        moments.right,
        moments.largest(),
    ]);
    let gradient = LoadGradient::of(platform, motion);
    all.extend(gradient.by_velocity.concat());
    all.extend(gradient.by_acceleration.concat());
    let velocities = motion.velocities(platform);
    all.extend(velocities.wheels.map(|wheel| wheel.direction()));
    let attitude = Attitude::of_up(up, motion.yaw_rate);
    all.extend([attitude.theta, attitude.phi]);
    all.extend(attitude.up().iter());
    all
}
