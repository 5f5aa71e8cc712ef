//! Relations on synthetic motion: a machine that rocks, turns, speeds up and slows down, and its sensors with one fault.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::super::fault::{Part, YawBy};
use super::super::super::notice::Rules;
use super::super::super::signals::Sound;
use super::super::super::{Explanation, SpeedUnit};
use super::super::Relations;
use super::{bogies, posture};
use crate::estimation::noise_of_tests::Noise;
use crate::machine::{Axis, FaultKind, Machine};
use crate::state::{JointStream, Sample, Sensor, Sensors};

/// Readings of the sensors at one time.
#[derive(Clone)]
struct Shown {
    force: Vector3<f64>,
    gyro: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    odometry_turning: f64,
    joints: Vec<[f64; 2]>,
}

/// The first explanation found by each relation, with its time (s).
type Found = Vec<(Part, Explanation, f64)>;

const SOUND: Sound = Sound {
    whole: true,
    force: true,
    turning: true,
    attitude: true,
    velocity: true,
};

/// Returns the findings in 30 s of a machine with sensors on its base, at 100 Hz. `change` turns the true motion into the
/// measured one.
fn found(machine: &Machine, change: impl Fn(f64, &mut Shown)) -> Found {
    found_within(30, machine, change)
}

fn found_within(seconds: i64, machine: &Machine, change: impl FnMut(f64, &mut Shown)) -> Found {
    found_after(0.0, seconds, machine, change)
}

/// Returns the findings on a machine that moves only after so many seconds.
fn found_after(
    rest_s: f64,
    seconds: i64,
    machine: &Machine,
    mut change: impl FnMut(f64, &mut Shown),
) -> Found {
    let joints: Vec<usize> = (0..machine.joints().len()).collect();
    let sensors = Sensors {
        joints: vec![JointStream {
            joints: joints.clone(),
        }],
        imu: true,
        odometry: true,
        ..Sensors::default()
    };
    let mut relations = Relations::new(machine, &sensors);
    assert!(Rules::of(machine).limits.max_gap_s > 0.02);
    let mut attitude = UnitQuaternion::identity();
    let mut found = Found::new();
    let mut findings = Vec::with_capacity(64);
    for step in 0..100 * seconds {
        let (stamp_ns, t) = (step * 10_000_000, step as f64 * 0.01);
        let moves = f64::from(u8::from(t >= rest_s));
        let s = (t - rest_s).max(0.0);
        let gyro = Vector3::new(
            0.05 * (1.3 * s).sin(),
            0.04 * moves * (0.9 * s).cos(),
            0.3 * (0.4 * s).sin(),
        );
        attitude *= UnitQuaternion::from_scaled_axis(gyro * 0.01);
        let speed = 1.5 * (0.5 * s).sin();
        let velocity = Vector3::x() * speed;
        let up = attitude.inverse_transform_vector(&Vector3::z());
        let noise = |k: f64| (k * t).sin() * 0.02;
        let at_imu = gyro.cross(&machine.imu().body_from_mount.translation.vector);
        let force = Vector3::x() * (0.75 * moves * (0.5 * s).cos())
            + gyro.cross(&(velocity + at_imu))
            + up * machine.gravity()
            + Vector3::new(noise(171.0), noise(193.0), noise(207.0));
        let of_joint = |index: usize| match machine.joints()[index].spins_wheel {
            Some(wheel) => {
                let wheel = &machine.wheels()[wheel];
                let forward = speed - gyro.z * wheel.centre_at_zero.y;
                [0.0, forward / wheel.radius]
            }
            None => [posture(machine, 0.0)[index], 0.0],
        };
        let mut shown = Shown {
            force,
            gyro: gyro + Vector3::new(noise(91.0), noise(97.0), noise(89.0)) * 0.1,
            attitude,
            velocity,
            odometry_turning: gyro.z,
            joints: joints.iter().map(|&index| of_joint(index)).collect(),
        };
        change(t, &mut shown);
        let [x, y, z, w] = shown.attitude.coords.into();
        let (f, g, v) = (shown.force, shown.gyro, shown.velocity);
        let turning = shown.odometry_turning;
        let part = |of: usize| shown.joints.iter().map(move |joint| joint[of]);
        let joints: Vec<f64> = part(0).chain(part(1)).collect();
        let nan = f64::NAN;
        for (sensor, values) in [
            (Sensor::Joints(0), joints),
            (
                Sensor::Odometry,
                vec![v.x, v.y, v.z, 0.0, 0.0, turning, nan, nan, nan, nan],
            ),
            (Sensor::Imu, vec![f.x, f.y, f.z, g.x, g.y, g.z, x, y, z, w]),
        ] {
            let sample = Sample::new(sensor, stamp_ns + i64::from(sensor == Sensor::Imu), &values);
            findings.clear();
            relations.step(&sample, SOUND, true, &mut findings);
            for finding in &findings {
                assert_eq!(finding.kind, FaultKind::Contradiction);
                let explanation = finding.explanation.unwrap();
                if found.iter().all(|(part, ..)| *part != finding.part) {
                    found.push((finding.part, explanation, t));
                }
            }
        }
    }
    found
}

fn of(found: &Found, part: Part) -> Option<(Explanation, f64)> {
    let it = found.iter().find(|(of, ..)| *of == part);
    it.map(|(_, explanation, s)| (*explanation, *s))
}

#[test]
fn sound_sensors_contradict_nothing() {
    let machine = bogies();
    assert_eq!(found(&machine, |_, _| {}), []);
    let bias = Vector3::new(0.004, -0.003, 0.005);
    assert_eq!(found(&machine, |_, shown| shown.gyro += bias), []);
    let bias = Vector3::new(0.2, -0.15, 0.1);
    assert_eq!(found(&machine, |_, shown| shown.force += bias), []);
    // A vibration of 4 m/s^2, a knock of 5 ms, an attitude without heading.
    let vibrates = |t: f64, shown: &mut Shown| shown.force.z += 4.0 * (220.0 * t).sin();
    assert_eq!(found(&machine, vibrates), []);
    let knocked = |t: f64, shown: &mut Shown| {
        if (12.0..12.005).contains(&t) {
            shown.force.y += 60.0;
        }
    };
    assert_eq!(found(&machine, knocked), []);
    let without_heading = |_: f64, shown: &mut Shown| {
        let (roll, pitch, _) = shown.attitude.euler_angles();
        shown.attitude = UnitQuaternion::from_euler_angles(roll, pitch, 0.0);
    };
    assert_eq!(found(&machine, without_heading), []);
}

#[test]
fn an_accelerometer_that_steps_and_stays_is_told_within_a_second() {
    let machine = bogies();
    for by in [Vector3::y() * 3.0, Vector3::x() * -3.0] {
        let found = found(&machine, |t, shown| {
            if t > 9.995 {
                shown.force += by;
            }
        });
        let (explanation, at_s) = of(&found, Part::SpecificForce).unwrap();
        assert_eq!(explanation, Explanation::AccelerometerOffset);
        assert!((10.6..11.0).contains(&at_s), "{at_s}");
    }
    // brakes that bite, and a knock of a tenth of a second
    let brakes = |t: f64, shown: &mut Shown| {
        let since_s = (t - 10.0).clamp(0.0, 0.5);
        shown.velocity.x -= 4.0 * since_s;
        shown.force.x -= if (9.995..10.495).contains(&t) {
            4.0
        } else {
            0.0
        };
    };
    assert_eq!(of(&found(&machine, brakes), Part::SpecificForce), None);
    let knocks = |t: f64, shown: &mut Shown| {
        if (9.995..10.095).contains(&t) {
            shown.force += Vector3::new(-6.0, 2.0, 5.0);
        }
    };
    assert_eq!(of(&found(&machine, knocks), Part::SpecificForce), None);
    // an attitude that jumps while the force does not, for good or for some seconds
    for until_s in [99.0, 14.995] {
        let jumps = |t: f64, shown: &mut Shown| {
            if (9.995..until_s).contains(&t) {
                shown.attitude *= UnitQuaternion::from_scaled_axis(Vector3::x() * 0.2);
            }
        };
        assert_eq!(of(&found(&machine, jumps), Part::SpecificForce), None);
    }
}

#[test]
fn a_machine_that_rests_proves_nothing_by_noise_however_long() {
    let machine = bogies();
    for velocity_noise in [0.02, 0.08] {
        let mut noise = Noise(7);
        let found = found_within(600, &machine, |_, shown| {
            let mut scattered = |scale: f64| Vector3::from_fn(|_, _| scale * noise.next());
            shown.force = Vector3::z() * machine.gravity() + scattered(0.03);
            shown.gyro = scattered(2e-3);
            shown.attitude = UnitQuaternion::from_scaled_axis(scattered(1e-4));
            shown.velocity = scattered(velocity_noise);
            shown.odometry_turning = 0.0;
            shown.joints.iter_mut().for_each(|joint| joint[1] = 0.0);
        });
        assert_eq!(found, [], "{velocity_noise}");
    }
}

#[test]
fn a_wrong_gyro_is_found_by_the_attitude() {
    let machine = bogies();
    let signs = [
        (Axis::X, Vector3::new(-1.0, 1.0, 1.0)),
        (Axis::Y, Vector3::new(1.0, -1.0, 1.0)),
    ];
    for (axis, signs) in signs {
        let found = found(&machine, |_, shown| shown.gyro.component_mul_assign(&signs));
        let (explanation, s) = of(&found, Part::Rotation).unwrap();
        assert_eq!(explanation, Explanation::Sign(axis), "{found:?}");
        assert!(s < 8.0, "{found:?}");
    }
}

#[test]
fn a_wrong_accelerometer_is_found_by_attitude_and_velocity() {
    let machine = bogies();
    type Change = fn(&mut Shown);
    let wrong: [(Explanation, Change); 3] = [
        (Explanation::Sign(Axis::X), |shown| shown.force.x *= -1.0),
        (Explanation::Exchanged(Axis::X, Axis::Y), |shown| {
            shown.force = shown.force.yxz();
        }),
        (Explanation::HalfTurn(Axis::Z), |shown| {
            (shown.force.x, shown.force.y) = (-shown.force.x, -shown.force.y);
        }),
    ];
    for (expected, change) in wrong {
        let found = found(&machine, |_, shown| change(shown));
        let (_, s) =
            of(&found, Part::Acceleration).unwrap_or_else(|| panic!("{expected:?}: {found:?}"));
        assert!(s < 15.0, "{expected:?}: {found:?}");
    }
}

/// Turns the housing of the IMU from the mounting in the machine file by this angle (base axes).
fn turn_housing(shown: &mut Shown, axis: Axis, degrees: f64) {
    let mut along = Vector3::zeros();
    along[axis as usize] = degrees.to_radians();
    let turn = UnitQuaternion::from_scaled_axis(along);
    shown.force = turn.inverse_transform_vector(&shown.force);
    shown.gyro = turn.inverse_transform_vector(&shown.gyro);
    shown.attitude *= turn;
}

#[test]
fn a_turned_housing_is_found_by_the_velocity_though_all_in_it_agree() {
    let machine = bogies();
    let on_a_slope = UnitQuaternion::from_euler_angles(0.15, 0.1, 0.0);
    let turned = [
        (Explanation::HousingHalfTurn(Axis::Z), 180.0),
        (Explanation::HousingQuarterTurn(Axis::Z, true), 90.0),
        (Explanation::HousingQuarterTurn(Axis::Z, false), -90.0),
    ];
    for (expected, degrees) in turned {
        let found = found(&machine, |_, shown| {
            let flat = shown.attitude.inverse_transform_vector(&Vector3::z());
            shown.attitude = on_a_slope * shown.attitude;
            let up = shown.attitude.inverse_transform_vector(&Vector3::z());
            shown.force += (up - flat) * machine.gravity();
            turn_housing(shown, Axis::Z, degrees);
        });
        let (explanation, s) = of(&found, Part::Acceleration).unwrap();
        assert_eq!(explanation, expected, "{found:?}");
        assert!(s < 15.0, "{found:?}");
        assert_eq!(of(&found, Part::Rotation), None, "they turn together");
    }
}

#[test]
fn one_axis_that_is_wrong_in_another_way_is_found_beside_two_that_are_right() {
    let machine = bogies();
    let wanders = |t: f64, shown: &mut Shown| shown.force.y += 1.2 * (0.7 * t).sin();
    let found = found(&machine, wanders);
    let (explanation, _) = of(&found, Part::Acceleration).unwrap();
    assert_eq!(explanation, Explanation::Other, "{found:?}");
}

#[test]
fn a_velocity_in_another_unit_is_found_without_speeds_of_the_wheels() {
    let machine = bogies();
    for unit in SpeedUnit::ALL {
        let found = found(&machine, |_, shown| {
            shown.velocity /= unit.in_si();
            shown
                .joints
                .iter_mut()
                .for_each(|joint| joint[1] = f64::NAN);
        });
        let (explanation, s) = of(&found, Part::Acceleration).unwrap();
        assert_eq!(explanation, Explanation::Speed(unit), "{found:?}");
        assert!(s < 15.0, "{found:?}");
    }
}

#[test]
fn a_wrong_sign_of_odometry_or_wheels_is_found() {
    let machine = bogies();
    let odometry = found(&machine, |_, shown| shown.odometry_turning *= -1.0);
    assert!(
        of(&odometry, Part::Yaw(YawBy::Odometry)).is_some(),
        "{odometry:?}"
    );
    let wheels = found(&machine, |_, shown| {
        let spins = |index: usize| machine.joints()[index].spins_wheel.is_some();
        let joints = shown.joints.iter_mut().enumerate();
        joints
            .filter(|(index, _)| spins(*index))
            .for_each(|(_, joint)| joint[1] *= -1.0);
    });
    assert!(of(&wheels, Part::Rolling).is_some(), "{wheels:?}");
    // Wheels that lock while the machine slides, and one that spins in the air.
    let locked = found(&machine, |t, shown| {
        if (4.0..5.5).contains(&t) {
            shown.joints.iter_mut().for_each(|joint| joint[1] = 0.0);
        }
    });
    assert_eq!(locked, []);
    let wheel = (machine.joints().iter()).position(|joint| joint.spins_wheel.is_some());
    let wheel = wheel.unwrap();
    let spins = found(&machine, |t, shown| {
        if (4.0..9.0).contains(&t) {
            shown.joints[wheel][1] = 40.0;
        }
    });
    assert_eq!(spins, []);
}

/// Returns the findings without an attitude, on a machine at rest in the first seconds.
fn found_without_attitude(machine: &Machine, change: impl Fn(&mut Shown)) -> Found {
    found_after(3.0, 30, machine, |_, shown| {
        change(shown);
        // by convention: no roll and pitch
        shown.attitude = UnitQuaternion::identity();
    })
}

#[test]
fn sound_sensors_without_attitude_contradict_nothing() {
    let machine = bogies();
    assert_eq!(found_without_attitude(&machine, |_| {}), []);
    let bias = Vector3::new(0.004, -0.003, 0.005);
    assert_eq!(
        found_without_attitude(&machine, |shown| shown.gyro += bias),
        []
    );
    let bias = Vector3::new(0.2, -0.15, 0.1);
    assert_eq!(
        found_without_attitude(&machine, |shown| shown.force += bias),
        []
    );
}

#[test]
fn a_wrong_accelerometer_is_found_without_attitude() {
    let machine = bogies();
    let quarter = |sign: f64| move |shown: &mut Shown| turn_housing(shown, Axis::Z, sign * 90.0);
    let half = |shown: &mut Shown| turn_housing(shown, Axis::Z, 180.0);
    let sign = |shown: &mut Shown| shown.force.x *= -1.0;
    type Wrong<'w> = (&'w [Explanation], &'w dyn Fn(&mut Shown));
    let wrong: [Wrong<'_>; 4] = [
        (
            &[Explanation::HousingQuarterTurn(Axis::Z, true)],
            &quarter(1.0),
        ),
        (
            &[Explanation::HousingQuarterTurn(Axis::Z, false)],
            &quarter(-1.0),
        ),
        (&[Explanation::HousingHalfTurn(Axis::Z)], &half),
        (&[Explanation::Sign(Axis::X)], &sign),
    ];
    for (expected, change) in wrong {
        let found = found_without_attitude(&machine, change);
        let (explanation, s) =
            of(&found, Part::Acceleration).unwrap_or_else(|| panic!("{expected:?}: {found:?}"));
        assert!(expected.contains(&explanation), "{expected:?}: {found:?}");
        assert!(s < 20.0, "{expected:?}: {found:?}");
    }
}
