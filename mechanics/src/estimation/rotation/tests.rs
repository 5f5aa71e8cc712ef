//! Synthetic rotations: what must count, and what must not.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::noise_of_tests::Noise;
use super::edges::Edges;
use super::suspension::SuspensionPlane;
use super::{PlatformRotation, RotationSpell, RotationWitness};
use crate::machine::of_tests::rigid_with;
use crate::machine::{LogFacts, Machine, MachineSpec};
use crate::state::{JointStream, Sample, Sensor, Sensors};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const GRAVITY: f64 = 9.8066;
const PERIOD_NS: i64 = 8_000_000;
/// Height of the machine's base above the ground (m).
const BASE_HEIGHT: f64 = 0.45;

fn machine() -> Machine {
    on_tyres("8.0e5")
}

/// The machine on tyres of this stiffness (N/m).
fn on_tyres(stiffness: &str) -> Machine {
    let stated = format!("tyre_stiffness = {stiffness}");
    rigid_with(
        |file| file.replace("tyre_stiffness = 8.0e5", &stated),
        str::to_owned,
    )
}

/// Roll to the right, pitch (nose down) and heading of the platform (rad), its speed (m/s), and its acceleration beyond
/// gravity (m/s^2, base axes).
#[derive(Debug, Clone, Copy, Default)]
struct Pose {
    roll: f64,
    pitch: f64,
    yaw: f64,
    speed: f64,
    acceleration: [f64; 3],
}

impl Pose {
    fn attitude(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(self.roll, self.pitch, self.yaw)
    }
}

/// Angular velocity of a motion (rad/s, base axes).
fn turning(time_s: f64, pose: &dyn Fn(f64) -> Pose) -> Vector3<f64> {
    let step_s = 1e-4;
    let [now, soon] = [time_s, time_s + step_s].map(|time_s| pose(time_s).attitude());
    (now.inverse() * soon).scaled_axis() / step_s
}

/// The ten values of an IMU.
type Values = [f64; 10];

/// An error of an IMU: its name, and the edit of a sample at a time (s).
type NamedEdit<'a> = (&'a str, &'a dyn Fn(f64, &mut Values));

/// A motion of so many seconds, with the errors of its IMU.
struct Run<'a> {
    seconds: f64,
    pose: &'a dyn Fn(f64) -> Pose,
    edit: &'a dyn Fn(f64, &mut Values),
    /// Times without samples of the IMU (s).
    gap: [f64; 2],
}

#[derive(Debug, Default)]
struct Seen {
    spells: Vec<(String, RotationSpell)>,
    /// Whether the last spell still stands at the end.
    is_open: bool,
    /// Time at which the platform first counted as falling (s).
    falls_s: Option<f64>,
}

impl Seen {
    fn only(&self) -> &(String, RotationSpell) {
        assert_eq!(self.spells.len(), 1, "{self:?}");
        &self.spells[0]
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

fn imu_and_odometry() -> Sensors {
    Sensors {
        imu: true,
        odometry: true,
        ..Sensors::default()
    }
}

impl<'a> Run<'a> {
    /// Creates a run with a sound IMU.
    fn sound(seconds: f64, pose: &'a dyn Fn(f64) -> Pose) -> Self {
        Self {
            seconds,
            pose,
            edit: SOUND,
            gap: NO_GAP,
        }
    }

    fn watch(&self) -> Seen {
        self.watch_of(&machine())
    }

    fn watch_of(&self, machine: &Machine) -> Seen {
        self.looked_at(machine, &mut |_, _| {})
    }

    /// Lets `look` see the watch after every sample of the IMU.
    fn looked_at(&self, machine: &Machine, look: &mut dyn FnMut(&PlatformRotation, f64)) -> Seen {
        let mut watch = PlatformRotation::new(machine, &imu_and_odometry());
        let mut noise = Noise(7);
        let mut seen = Seen::default();
        let steps = (self.seconds * 1e9) as i64 / PERIOD_NS;
        for step in 0..steps {
            let stamp_ns = step * PERIOD_NS;
            let time_s = seconds(stamp_ns);
            let pose = (self.pose)(time_s);
            if step % 5 == 0 {
                let mut values = [0.0; 10];
                // the base moves with the platform that turns over its wheels
                let turning = turning(time_s, self.pose) * BASE_HEIGHT;
                values[0] = pose.speed + turning.y + 0.008 * noise.next();
                values[1] = -turning.x + 0.008 * noise.next();
                values[9] = 1.0;
                watch.step(&Sample {
                    sensor: Sensor::Odometry,
                    stamp_ns,
                    values: &values,
                });
            }
            if self.gap[0] <= time_s && time_s < self.gap[1] {
                continue;
            }
            let mut values = self.measured(time_s, &pose, &mut noise);
            (self.edit)(time_s, &mut values);
            watch.step(&Sample {
                sensor: Sensor::Imu,
                stamp_ns,
                values: &values,
            });
            look(&watch, time_s);
            if watch.falls(stamp_ns) {
                seen.falls_s.get_or_insert(time_s);
            }
            if let Some(ended) = watch.ended() {
                seen.spells
                    .push((watch.edge_name(ended.edge).into(), *ended));
            }
        }
        if let Some(spell) = watch.spell() {
            seen.spells
                .push((watch.edge_name(spell.edge).into(), *spell));
            seen.is_open = true;
        }
        seen
    }

    fn measured(&self, time_s: f64, pose: &Pose, noise: &mut Noise) -> Values {
        let now = pose.attitude();
        let turning = turning(time_s, self.pose);
        let up = now.inverse_transform_vector(&Vector3::z());
        let force = up * GRAVITY + Vector3::from(pose.acceleration);
        let tilt = Vector3::from_fn(|_, _| 8e-4 * noise.next());
        let measured = now * UnitQuaternion::from_scaled_axis(tilt);
        let mut values = [0.0; 10];
        for axis in 0..3 {
            values[axis] = force[axis] + 0.03 * noise.next();
            values[3 + axis] = turning[axis] + 1e-3 * noise.next();
        }
        values[6..].copy_from_slice(measured.coords.as_slice());
        values
    }
}

const SOUND: &dyn Fn(f64, &mut Values) = &|_, _| {};
const NO_GAP: [f64; 2] = [f64::MAX; 2];

/// Returns a fall to the right from `from_s` on that begins with `first_rate` (degrees per second), up to 48 degrees, where the
/// machine lies. The specific force of a falling platform hardly turns.
fn fall(from_s: f64, first_rate: f64) -> impl Fn(f64) -> Pose {
    move |time_s| {
        let s = (time_s - from_s).max(0.0);
        let growth = 2.2;
        let free = first_rate * DEGREE / growth * (growth * s).sinh();
        let roll = free.min(48.0 * DEGREE);
        let hidden = if free < 48.0 * DEGREE {
            0.7 * GRAVITY * roll.sin()
        } else {
            0.0
        };
        Pose {
            roll,
            acceleration: [0.0, -hidden, 0.0],
            ..Pose::default()
        }
    }
}

fn run(seconds: f64, pose: &dyn Fn(f64) -> Pose) -> Seen {
    edited(seconds, pose, SOUND)
}

fn edited(seconds: f64, pose: &dyn Fn(f64) -> Pose, edit: &dyn Fn(f64, &mut Values)) -> Seen {
    Run {
        seconds,
        pose,
        edit,
        gap: NO_GAP,
    }
    .watch()
}

fn without_attitude(_: f64, values: &mut Values) {
    values[6..].fill(f64::NAN);
}

fn smooth(time_s: f64, from_s: f64, to_s: f64) -> f64 {
    let s = ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

/// The tyres of one side of a machine with four equal wheels let it turn as far as half the weight presses them in, to either
/// side.
#[test]
fn tyres_let_a_machine_turn_by_what_presses_them_in() {
    for (tyres, stiffness) in [("8.0e5", 8.0e5), ("1.6e5", 1.6e5)] {
        let machine = on_tyres(tyres);
        let watch = PlatformRotation::new(&machine, &imu_and_odometry());
        let place = |wheel: usize| machine.wheels()[wheel].centre_at_zero.xy();
        let weight = machine.mass() * GRAVITY;
        for (at, edge) in machine.polygon().edges().iter().enumerate() {
            let along = (place(edge.to) - place(edge.from)).normalize();
            let wheels = 0..machine.wheels().len();
            let width = wheels
                .map(|wheel| along.perp(&(place(wheel) - place(edge.from))).abs())
                .fold(0.0, f64::max);
            let lean = weight / (2.0 * stiffness * width);
            let turn = watch.turn_on_tyres(at);
            assert!((turn / (2.0 * lean) - 1.0).abs() < 0.02, "{turn} {lean}");
        }
    }
}

#[test]
fn ground_that_gives_way_is_no_fall_and_hides_none() {
    let settles = |time_s: f64| Pose {
        roll: 8.0 * DEGREE * smooth(time_s, 4.0, 14.0),
        ..Pose::default()
    };
    let seen = run(20.0, &settles);
    assert!(seen.spells.is_empty() && seen.falls_s.is_none(), "{seen:?}");
    // it falls from where the ground has left it
    let falls = |time_s: f64| {
        let fall = fall(20.0, 2.0)(time_s);
        Pose {
            roll: settles(time_s).roll + fall.roll,
            ..fall
        }
    };
    let seen = run(26.0, &falls);
    let (_, spell) = seen.only();
    assert!(seen.is_open && spell.certainty > 0.999, "{spell:?}");
    let at = falls(seconds(spell.certain_ns)).roll - 8.0 * DEGREE;
    assert!(at < 6.0 * DEGREE, "{}", at / DEGREE);
}

#[test]
fn falls_are_found_from_the_first_degrees_on() {
    for (first_rate, most_degrees) in [(2.0, 6.0), (0.5, 6.0), (15.0, 8.0)] {
        let seen = run(12.0, &fall(4.0, first_rate));
        let (edge, spell) = seen.only();
        assert_eq!(edge, "right");
        assert!(seen.is_open && spell.largest > 46.0 * DEGREE, "{spell:?}");
        assert_eq!(spell.witness, RotationWitness::Both);
        assert!(spell.certainty > 0.999, "{spell:?}");
        let at = fall(4.0, first_rate)(seconds(spell.certain_ns)).roll;
        assert!(at < most_degrees * DEGREE, "{first_rate}: {}", at / DEGREE);
        assert!(seconds(spell.left_ns) >= 4.0, "{spell:?}");
        let rest_s = seconds(spell.at_rest_ns.unwrap());
        assert!(
            fall(4.0, first_rate)(rest_s).roll > 47.9 * DEGREE,
            "{rest_s}"
        );
    }
}

/// The alarm does not wait until a rotation is certain.
#[test]
fn a_machine_that_stands_falls_from_where_tyres_and_ground_explain_it_no_longer() {
    for first_rate in [0.5, 2.0, 15.0] {
        for (sensor, edit) in [("both", SOUND), ("gyro", &without_attitude)] {
            let pose = fall(4.0, first_rate);
            let seen = edited(12.0, &pose, edit);
            let (_, spell) = seen.only();
            let falls_s = seen.falls_s.unwrap();
            let certain_s = seconds(spell.certain_ns);
            assert!(
                falls_s > 4.0 && falls_s <= certain_s,
                "{sensor}, {first_rate}: {falls_s} {certain_s}"
            );
            let at = pose(falls_s).roll;
            // without an attitude, a gyro that shows an even rate may have jumped
            let most = if first_rate < 10.0 { 2.0 } else { 10.0 };
            assert!(
                at < most * DEGREE,
                "{sensor}, {first_rate}: {}",
                at / DEGREE
            );
        }
    }
}

/// Wheels that creep, held by their drives on a slope, delay nothing either: the rotation by ramps and steps on so short a way is
/// known.
#[test]
fn a_fall_on_wheels_that_creep_is_an_alarm_before_it_is_certain() {
    for (edge, speed) in [("front", 0.12), ("front", 0.2), ("right", 0.12)] {
        let falls = fall(4.0, 1.0);
        let pose = |time_s: f64| {
            let fallen = falls(time_s);
            let (roll, pitch) = match edge {
                "front" => (0.0, fallen.roll),
                _ => (fallen.roll, 0.0),
            };
            let [_, hidden, _] = fallen.acceleration;
            Pose {
                roll,
                pitch,
                speed: if fallen.roll < 0.5 { speed } else { 0.0 },
                acceleration: match edge {
                    "front" => [-hidden, 0.0, 0.0],
                    _ => fallen.acceleration,
                },
                ..Pose::default()
            }
        };
        for (sensor, edit) in [("both", SOUND), ("gyro", &without_attitude)] {
            let seen = edited(12.0, &pose, edit);
            let at = falls(seen.falls_s.unwrap()).roll;
            let certain = falls(seconds(seen.only().1.certain_ns)).roll;
            assert!(
                at < 9.0 * DEGREE && at < 0.6 * certain,
                "{edge}, {speed} m/s, {sensor}: {}, {}",
                at / DEGREE,
                certain / DEGREE
            );
        }
    }
}

/// Motion of the base in a fall, and the slope before it, do not delay the detection.
#[test]
fn neither_the_motion_of_a_fall_nor_a_slope_at_the_start_hides_it() {
    let falls = fall(4.0, 2.0);
    let on_soft_tyres = Run::sound(12.0, &falls);
    let falls_s = on_soft_tyres.watch_of(&on_tyres("1.0e5")).falls_s.unwrap();
    assert!(
        falls(falls_s).roll < 10.0 * DEGREE,
        "{}",
        falls(falls_s).roll / DEGREE
    );
    // no second of rest has shown that the slope is one
    let slope = 6.0 * DEGREE;
    let on_slope = |time_s: f64| {
        let fall = fall(3.0, 2.0)(time_s);
        Pose {
            roll: slope + 0.3 * DEGREE * (9.0 * time_s).sin() + fall.roll,
            ..fall
        }
    };
    let falls_s = run(8.0, &on_slope).falls_s.unwrap();
    let at = on_slope(falls_s).roll - slope;
    assert!(falls_s > 3.0 && at < 3.0 * DEGREE, "{falls_s}");
}

/// A machine that comes back to its wheels does not fall over the other edge.
#[test]
fn coming_down_is_no_fall_to_the_other_side() {
    let comes_down = |time_s: f64| Pose {
        roll: 1.6 * DEGREE * (smooth(time_s, 3.0, 4.5) - smooth(time_s, 4.7, 5.3)),
        ..Pose::default()
    };
    let seen = run(9.0, &comes_down);
    assert!(seen.falls_s.is_none(), "{seen:?}");
}

/// Measured joints of a suspension show the rotation by it: only the rest is a fall.
#[test]
fn a_suspension_neither_hides_a_fall_nor_is_one() {
    let names = [
        "suspension_right",
        "suspension_left",
        "slew",
        "lift",
        "tilt",
        "extension",
    ]
    .map(String::from);
    let spec = MachineSpec::from_toml(include_str!("../../../tests/data/bogie.toml"), "bogie.toml");
    let urdf = include_str!("../../../tests/data/bogie.urdf");
    let facts = LogFacts {
        joint_names: Some(&names),
        ..LogFacts::default()
    };
    let machine = spec.unwrap().check(urdf, "bogie.urdf", facts).unwrap();
    let joint = |name: &String| (machine.joints().iter()).position(|it| it.name == *name);
    let rods = names[..2].iter().filter_map(joint).collect();
    let sensors = Sensors {
        joints: vec![JointStream { joints: rods }],
        ..imu_and_odometry()
    };
    // the rods turn the platform by a few degrees in a second, or stand while it falls
    let moved = |time_s: f64| 0.08 * smooth(time_s, 4.0, 5.0);
    let mut plane = SuspensionPlane::new(&machine, &sensors).unwrap();
    let mut lean_at = |time_s: f64| {
        let values = [-0.1 + moved(time_s), -0.1 - moved(time_s), 0.0, 0.0];
        let sample = Sample {
            sensor: Sensor::Joints(0),
            stamp_ns: (time_s * 1e9) as i64,
            values: &values,
        };
        plane.take(&sample).map_or(0.0, |by| by.x)
    };
    let leans: Vec<f64> = (0..1000)
        .scan(0.0, |sum, step| {
            *sum += lean_at(f64::from(step) * 0.01);
            Some(*sum)
        })
        .collect();
    let leaning = |time_s: f64| {
        let (step, share) = ((time_s * 100.0) as usize, (time_s * 100.0).fract());
        let [from, to] = [step, step + 1].map(|step| leans[step.min(999)]);
        Pose {
            roll: from + share * (to - from),
            ..Pose::default()
        }
    };
    let falling = fall(4.0, 2.0);
    assert!(leans[999].abs() > 2.0 * DEGREE, "{}", leans[999] / DEGREE);
    for (pose, is_moved) in [(&leaning as &dyn Fn(f64) -> Pose, true), (&falling, false)] {
        let mut watch = PlatformRotation::new(&machine, &sensors);
        let mut noise = Noise(7);
        let mut falls_s = None;
        for step in 0..1250 {
            let stamp_ns = step * PERIOD_NS;
            let time_s = seconds(stamp_ns);
            let by = if is_moved { moved(time_s) } else { 0.0 };
            let rods = [-0.1 + by, -0.1 - by, 0.0, 0.0];
            let still = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            let run = Run::sound(10.0, pose);
            let imu = run.measured(time_s, &pose(time_s), &mut noise);
            for (sensor, values) in [
                (Sensor::Joints(0), &rods[..]),
                (Sensor::Odometry, &still[..]),
                (Sensor::Imu, &imu[..]),
            ] {
                watch.step(&Sample {
                    sensor,
                    stamp_ns,
                    values,
                });
            }
            if watch.falls(stamp_ns) {
                falls_s.get_or_insert(time_s);
            }
        }
        match falls_s {
            None => assert!(is_moved),
            Some(falls_s) => {
                let at = pose(falls_s).roll;
                assert!(!is_moved && at < 3.0 * DEGREE, "{falls_s} {}", at / DEGREE);
            }
        }
    }
}

#[test]
fn reference_of_a_machine_that_travels_does_not_fall_with_it() {
    // the log begins in a corner, in which the machine rolls over at so many degrees per second, growing
    for rate in [15.0, 40.0, 70.0] {
        let pose = |time_s: f64| Pose {
            roll: (rate * DEGREE * (time_s + 0.4 * time_s * time_s)).min(170.0 * DEGREE),
            speed: 8.0,
            ..Pose::default()
        };
        let seen = run(8.0, &pose);
        let (edge, spell) = &seen.spells[0];
        assert_eq!(edge, "right");
        assert!(spell.largest > 90.0 * DEGREE, "{rate}: {spell:?}");
    }
}

#[test]
fn machine_beyond_its_side_keeps_the_edge_that_it_fell_about() {
    // Beyond 90 degrees of roll, the up direction points down in base axes, whatever the pitch.
    for pitch in [-8.0, 8.0] {
        let pose = |time_s: f64| {
            let share = smooth(time_s, 4.0, 6.0);
            Pose {
                roll: 105.0 * DEGREE * share,
                pitch: pitch * DEGREE * share,
                ..Pose::default()
            }
        };
        let seen = run(10.0, &pose);
        let (edge, spell) = seen.only();
        assert_eq!(edge, "right");
        let largest = spell.largest / DEGREE;
        assert!((100.0..110.0).contains(&largest), "{largest}");
    }
}

#[test]
fn machine_on_its_roof_is_not_back() {
    // over the right side onto the roof, and there it slides on, a little past half a turn
    let pose = |time_s: f64| Pose {
        roll: 3.3 * smooth(time_s, 3.0, 6.0),
        yaw: 0.5 * smooth(time_s, 7.0, 20.0),
        ..Pose::default()
    };
    let seen = run(25.0, &pose);
    let (_, spell) = seen.only();
    assert!(seen.is_open, "{spell:?}");
    assert!(spell.at_rest_ns.is_some(), "{spell:?}");
}

#[test]
fn gyro_without_attitude_shows_a_fall() {
    let bias = |time_s: f64, values: &mut Values| {
        without_attitude(time_s, values);
        values[3] += 0.02;
        values[4] -= 0.01;
    };
    let seen = edited(12.0, &fall(4.0, 2.0), &bias);
    let (edge, spell) = seen.only();
    assert_eq!(
        (edge.as_str(), spell.witness),
        ("right", RotationWitness::GyroAlone)
    );
    assert!(spell.largest > 44.0 * DEGREE && seen.is_open, "{spell:?}");
}

#[test]
fn attitude_that_stands_still_does_not_hide_a_fall() {
    let stuck = |time_s: f64, values: &mut Values| {
        // with noise, so that its bits change
        let tilt = UnitQuaternion::from_euler_angles(1e-3 * (91.0 * time_s).sin(), 1e-3, 0.0);
        values[6..].copy_from_slice(tilt.coords.as_slice());
    };
    let seen = edited(12.0, &fall(4.0, 2.0), &stuck);
    let (edge, spell) = seen.only();
    assert_eq!(
        (edge.as_str(), spell.witness),
        ("right", RotationWitness::GyroNotAttitude)
    );
    assert!(spell.largest > 40.0 * DEGREE, "{spell:?}");
    assert!(spell.certainty > 0.8 && spell.certainty < 0.95, "{spell:?}");
    let frozen = |_: f64, values: &mut Values| {
        values[6..].copy_from_slice(&[1e-3, 0.0, 0.0, 1.0]);
    };
    let seen = edited(12.0, &fall(4.0, 2.0), &frozen);
    assert_eq!(seen.only().1.witness, RotationWitness::GyroAlone);
}

#[test]
fn gyro_of_wrong_sign_does_not_hide_a_fall() {
    let wrong = |_: f64, values: &mut Values| values[3] = -values[3];
    let seen = edited(12.0, &fall(4.0, 2.0), &wrong);
    let (edge, spell) = seen.only();
    assert_eq!(edge, "right");
    assert!(spell.largest > 46.0 * DEGREE, "{spell:?}");
    // at rest on its side, its gyro is levelled by the specific force
    assert!(spell.witness.is_both(), "{spell:?}");
    let silent = |_: f64, values: &mut Values| values[3..6].fill(0.0);
    let seen = edited(12.0, &fall(4.0, 2.0), &silent);
    assert_eq!(seen.only().0, "right");
    assert!(seen.is_open);
}

fn exchanged(_: f64, values: &mut Values) {
    values.swap(0, 1);
    values.swap(3, 4);
}

#[test]
fn a_fall_about_another_edge_by_each_sensor_is_one_fall() {
    for first_rate in [0.5, 2.0, 15.0] {
        let seen = edited(12.0, &fall(4.0, first_rate), &exchanged);
        let (edge, spell) = seen.only();
        assert_eq!(edge, "right");
        assert_eq!(spell.witness, RotationWitness::OtherEdges);
        let edges = Edges::of(&machine()).all;
        assert_eq!(edges[spell.other_edge.unwrap()].name, "front");
        assert!(spell.largest > 46.0 * DEGREE && seen.is_open, "{spell:?}");
        assert!(spell.certainty > 0.98, "{spell:?}");
    }
}

/// The rotation by the other source may come later, and the edge by each source may become that by the other.
#[test]
fn two_edges_stay_two_and_the_sigma_is_that_of_the_witness() {
    // over the right edge, and then farther over the front edge
    let corner = |time_s: f64| Pose {
        roll: 38.0 * DEGREE * smooth(time_s, 4.0, 5.5) - 15.0 * DEGREE * smooth(time_s, 6.5, 9.0),
        pitch: 55.0 * DEGREE * smooth(time_s, 6.5, 9.0),
        ..Pose::default()
    };
    // the gyro shows half of the first as the second, and then stands still
    let half = |time_s: f64, values: &mut Values| {
        exchanged(time_s, values);
        let share = if time_s < 6.0 { 0.55 } else { 0.0 };
        values[3..6].iter_mut().for_each(|rate| *rate *= share);
    };
    let seen = edited(11.0, &corner, &half);
    let (edge, spell) = seen.only();
    assert_eq!(spell.witness, RotationWitness::OtherEdges, "{spell:?}");
    let edges = Edges::of(&machine()).all;
    let other = &edges[spell.other_edge.unwrap()].name;
    assert_eq!([edge, other], ["front", "right"], "{spell:?}");
    // a gyro of exchanged axes alone, and then the attitude as well
    let late = |time_s: f64, values: &mut Values| {
        exchanged(time_s, values);
        if (4.0..5.6).contains(&time_s) {
            without_attitude(time_s, values);
        }
    };
    // the attitude alone, and then the gyro that was silent
    let woken = |time_s: f64, values: &mut Values| {
        if (3.9..5.75).contains(&time_s) {
            values[3..6].fill(f64::NAN);
        }
    };
    let late_or_woken: [(NamedEdit<'_>, RotationWitness); 2] = [
        (("late", &late), RotationWitness::OtherEdges),
        (("woken", &woken), RotationWitness::Both),
    ];
    for ((name, edit), last) in late_or_woken {
        let (mut witnesses, mut changes) = (Vec::new(), 0);
        let run = Run {
            seconds: 9.0,
            pose: &fall(4.0, 4.0),
            edit,
            gap: NO_GAP,
        };
        run.looked_at(&machine(), &mut |watch, _| {
            let Some(spell) = watch.spell() else { return };
            let is_by_gyro = spell.witness.is_by_gyro();
            let before: Option<RotationWitness> = witnesses.last().copied();
            witnesses.push(spell.witness);
            if before.is_some_and(|before| before.is_by_gyro() != is_by_gyro) {
                let source = if is_by_gyro {
                    &watch.by_gyro
                } else {
                    &watch.by_attitude
                };
                let claim = source.reference.claim;
                changes += 1;
                assert_eq!(spell.sigma, claim.sigma, "{name}: {before:?} {spell:?}");
                assert_eq!(spell.by_ground, claim.by_ground, "{name}");
            }
        });
        assert_eq!((changes, witnesses.last()), (1, Some(&last)), "{name}");
    }
}

/// A fall is known only while gyro or attitude is measured.
#[test]
fn a_fall_is_known_as_long_as_it_is_measured() {
    let fall = fall(4.0, 2.0);
    let falls_s = run(12.0, &fall).falls_s.unwrap();
    let silent = |from_s: f64| Run::sound(from_s, &fall);
    // before and after it is certain
    for measured_s in [falls_s + 0.05, 8.0] {
        silent(measured_s).looked_at(&machine(), &mut |watch, time_s| {
            if time_s + 0.02 > measured_s {
                let falls = |later_s: f64| watch.falls(((time_s + later_s) * 1e9) as i64);
                assert!(falls(0.2) && !falls(0.3), "{measured_s}");
            }
        });
    }
}

#[test]
fn fall_in_a_gap_is_found_after_it() {
    for has_attitude in [true, false] {
        let edit = |time_s: f64, values: &mut Values| {
            if !has_attitude {
                without_attitude(time_s, values);
            }
        };
        let pose = fall(4.0, 4.0);
        let run = Run {
            seconds: 12.0,
            pose: &pose,
            edit: &edit,
            gap: [3.0, 8.0],
        };
        let seen = run.watch();
        let (edge, spell) = seen.only();
        assert_eq!(edge, "right");
        assert!(spell.angle > 42.0 * DEGREE && seen.is_open, "{spell:?}");
        assert!(seconds(spell.certain_ns) < 9.5, "{spell:?}");
    }
}

#[test]
fn log_that_begins_in_a_fall_says_so() {
    let pose = fall(-1.0, 3.0);
    let seen = run(6.0, &pose);
    let (edge, spell) = seen.only();
    assert_eq!(edge, "right");
    assert!(spell.is_from_start && seen.is_open, "{spell:?}");
}

#[test]
fn knock_at_the_start_of_a_log_does_not_hide_that_the_machine_stood() {
    for size in [5.0, 12.0, 30.0] {
        let knock = |time_s: f64, values: &mut Values| {
            if time_s < 0.016 {
                for (value, part) in values.iter_mut().zip([0.6, -0.5, 0.6]) {
                    *value += size * part;
                }
            }
        };
        let seen = edited(10.0, &fall(4.0, 2.0), &knock);
        let (_, spell) = seen.only();
        assert!(!spell.is_from_start, "{size}: {spell:?}");
        assert_eq!(spell.witness, RotationWitness::Both, "{size}");
    }
}

#[test]
fn fall_in_a_corner_at_speed_counts() {
    let pose = |time_s: f64| Pose {
        speed: 3.0,
        yaw: 0.9 * (time_s - 2.0).max(0.0),
        acceleration: [0.0, if time_s > 2.0 { 2.7 } else { 0.0 }, 0.0],
        ..fall(5.0, 2.0)(time_s)
    };
    for edit in [SOUND, &without_attitude] {
        let seen = edited(9.0, &pose, edit);
        let (edge, spell) = seen.only();
        assert_eq!(edge, "right");
        assert!(seen.is_open && spell.largest > 35.0 * DEGREE, "{spell:?}");
    }
}

#[test]
fn fall_over_the_front_edge_while_driving_counts() {
    for speed in [0.8, 2.0] {
        let pose = |time_s: f64| {
            let fallen = fall(5.0, 4.0)(time_s).roll;
            Pose {
                pitch: fallen,
                speed: if fallen > 0.5 { 0.0 } else { speed },
                acceleration: [0.7 * GRAVITY * fallen.sin(), 0.0, 0.0],
                ..Pose::default()
            }
        };
        for edit in [SOUND, &without_attitude] {
            let seen = edited(9.0, &pose, edit);
            let (edge, spell) = seen.only();
            assert_eq!(edge, "front");
            // what the reference follows of the first degrees is taken for the ground
            assert!(seen.is_open && spell.largest > 35.0 * DEGREE, "{spell:?}");
            assert!((5.0..6.5).contains(&seconds(spell.left_ns)), "{spell:?}");
            assert!(spell.certainty > 0.98, "{spell:?}");
        }
    }
}

#[test]
fn fall_back_onto_the_wheels_ends() {
    let pose = |time_s: f64| Pose {
        roll: 9.0 * DEGREE * (smooth(time_s, 3.0, 4.0) - smooth(time_s, 4.5, 5.2)),
        ..Pose::default()
    };
    let without_gyro = |time_s: f64, values: &mut Values| {
        if time_s >= 4.2 {
            values[3..6].fill(f64::NAN);
        }
    };
    // also where the gyro, by which it was followed, falls silent in it
    for seen in [run(10.0, &pose), edited(10.0, &pose, &without_gyro)] {
        let (edge, spell) = seen.only();
        assert!(!seen.is_open && edge == "right", "{seen:?}");
        assert!((spell.largest / DEGREE - 9.0).abs() < 0.7, "{spell:?}");
    }
}

/// Messages of one stamp, the first without an attitude, and an odometry by wheels, which stand while the base turns over them: as
/// by the gyro alone.
#[test]
fn a_stamp_that_comes_twice_delays_no_fall() {
    let fall = fall(4.0, 2.0);
    let sound = Run::sound(8.0, &fall);
    let mut watch = PlatformRotation::new(&machine(), &imu_and_odometry());
    let mut noise = Noise(7);
    let mut standing = [0.0; 10];
    standing[9] = 1.0;
    let mut stamps = (0..1000).map(|step| step * PERIOD_NS);
    let falls_ns = stamps.find(|&stamp_ns| {
        let time_s = seconds(stamp_ns);
        let whole = sound.measured(time_s, &fall(time_s), &mut noise);
        let mut first = whole;
        without_attitude(time_s, &mut first);
        let samples = [
            (Sensor::Odometry, &standing),
            (Sensor::Imu, &first),
            (Sensor::Imu, &whole),
        ];
        for (sensor, values) in samples {
            watch.step(&Sample {
                sensor,
                stamp_ns,
                values,
            });
        }
        watch.falls(stamp_ns)
    });
    let by_gyro = edited(8.0, &fall, &without_attitude);
    let once_s = by_gyro.falls_s.unwrap();
    let twice_s = seconds(falls_ns.unwrap());
    assert!((twice_s - once_s).abs() < 0.05, "{once_s} s, {twice_s} s");
}

/// Motions on all wheels.
/// A motion with its name.
type NamedMotion = (&'static str, Box<dyn Fn(f64) -> Pose>);

fn sound_motions() -> Vec<NamedMotion> {
    let ramp = |time_s: f64| Pose {
        pitch: -15.0 * DEGREE * smooth(time_s, 4.0, 4.0 + 2.3 / 1.3),
        speed: 1.3,
        ..Pose::default()
    };
    // one axle climbs while the other is still on the ground before it
    let steep_ramp = |degrees: f64, speed: f64| {
        move |time_s: f64| {
            let length = 2.3;
            let climbed = |from_m: f64| {
                let on_ramp = (speed * (time_s - 4.0) - from_m).clamp(0.0, 3.5);
                on_ramp * (degrees * DEGREE).sin()
            };
            Pose {
                pitch: -((climbed(0.0) - climbed(length)) / length).asin(),
                speed,
                ..Pose::default()
            }
        }
    };
    let side_ramp = |time_s: f64| Pose {
        roll: 15.0 * DEGREE * smooth(time_s, 4.0, 4.0 + 2.3 / 1.3),
        speed: 1.3,
        ..Pose::default()
    };
    let bump = |time_s: f64| Pose {
        roll: 4.0 * DEGREE * (smooth(time_s, 4.0, 4.15) - smooth(time_s, 4.15, 4.35))
            - 2.0 * DEGREE * (smooth(time_s, 4.3, 4.4) - smooth(time_s, 4.4, 4.6)),
        speed: 2.0,
        acceleration: [
            0.0,
            0.0,
            3.0 * (40.0 * time_s).sin() * smooth(time_s, 4.0, 4.1),
        ],
        ..Pose::default()
    };
    let turn_on_slope = |time_s: f64| {
        // a plane of 12 degrees, driven in circles
        let yaw = 0.4 * time_s;
        let slope = 12.0 * DEGREE;
        let up = Vector3::new(slope.sin(), 0.0, slope.cos());
        let in_plane = UnitQuaternion::rotation_between(&Vector3::z(), &up).unwrap();
        let attitude = in_plane * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        let (roll, pitch, yaw) = attitude.euler_angles();
        Pose {
            roll,
            pitch,
            yaw,
            speed: if time_s > 1.5 { 1.5 } else { 0.0 },
            ..Pose::default()
        }
    };
    let shaken = |time_s: f64| Pose {
        acceleration: [
            4.0 * (220.0 * time_s).sin(),
            4.0 * (219.0 * time_s).cos(),
            4.0 * (221.0 * time_s).sin(),
        ],
        ..Pose::default()
    };
    let leaning = |time_s: f64| Pose {
        roll: 0.7 * DEGREE * (0.8 * time_s).sin(),
        pitch: 0.5 * DEGREE * (1.3 * time_s).sin(),
        ..Pose::default()
    };
    let braking = |time_s: f64| Pose {
        speed: (3.0 - 4.0 * (time_s - 5.0).max(0.0)).max(0.0),
        pitch: 1.0 * DEGREE * (smooth(time_s, 5.0, 5.2) - smooth(time_s, 5.7, 5.9)),
        acceleration: [
            if (5.0..5.75).contains(&time_s) {
                -4.0
            } else {
                0.0
            },
            0.0,
            0.0,
        ],
        ..Pose::default()
    };
    vec![
        ("ramp", Box::new(ramp)),
        ("steep ramp, slowly", Box::new(steep_ramp(22.0, 0.4))),
        ("steep ramp, fast", Box::new(steep_ramp(24.0, 2.0))),
        ("off a steep ramp", Box::new(steep_ramp(-24.0, 1.0))),
        ("side ramp", Box::new(side_ramp)),
        ("bump", Box::new(bump)),
        ("turn on a slope", Box::new(turn_on_slope)),
        ("vibration", Box::new(shaken)),
        ("leaning", Box::new(leaning)),
        ("braking", Box::new(braking)),
    ]
}

#[test]
fn motions_on_all_wheels_do_not_count() {
    for (name, pose) in sound_motions() {
        for (sensor, edit) in [("both", SOUND), ("gyro", &without_attitude)] {
            let seen = edited(16.0, &pose, edit);
            let is_sound = seen.spells.is_empty() && seen.falls_s.is_none();
            assert!(is_sound, "{name}, {sensor}: {seen:?}");
        }
        let seen = edited(16.0, &pose, &exchanged);
        let mut witnesses = seen.spells.iter().map(|(_, spell)| spell.witness);
        assert!(
            !witnesses.any(|witness| witness == RotationWitness::OtherEdges),
            "{name}: {seen:?}"
        );
    }
}

/// Returns the height of a wheel (m) that has rolled so far on to a kerb, or down from one (m).
fn climbed(rolled: f64, height: f64, is_down: bool) -> f64 {
    let radius = 0.35_f64;
    let along = (2.0 * radius * height - height * height).sqrt();
    let rolled = rolled.clamp(0.0, along);
    match is_down {
        false => (radius * radius - (along - rolled).powi(2)).sqrt() - (radius - height),
        true => (radius * radius - rolled * rolled).sqrt() - radius,
    }
}

/// Returns the poses over time of the platform on four equal springs, while some of its wheels drive onto a kerb, or off it.
/// `later` is the distance along the way by which each wheel is later than the first one (m).
fn over_kerb(
    height: f64,
    is_down: bool,
    later: [Option<f64>; 4],
    speed: f64,
    run_up: f64,
) -> impl Fn(f64) -> Pose {
    move |time_s| {
        let speeding_s = 2.0 * speed;
        let share = ((time_s - 3.0) / speeding_s).clamp(0.0, 1.0);
        let going = share * share * (3.0 - 2.0 * share);
        let after_s = (time_s - 3.0 - speeding_s).max(0.0);
        let travelled = speed * (speeding_s * (share.powi(3) - 0.5 * share.powi(4)) + after_s);
        let [fl, fr, rl, rr] = later.map(|later| {
            later.map_or(0.0, |later| {
                climbed(travelled - run_up - later, height, is_down)
            })
        });
        Pose {
            roll: ((fl + rl - fr - rr) / (2.0 * 1.75)).atan(),
            pitch: ((rl + rr - fl - fr) / (2.0 * 2.3)).atan(),
            speed: speed * going,
            ..Pose::default()
        }
    }
}

/// A wheel that rolls a little turns its machine a lot.
#[test]
fn kerbs_do_not_count() {
    let wheels = [
        ("a front wheel", [None, Some(0.0), None, None]),
        ("a rear wheel", [None, None, Some(0.0), None]),
        (
            "one side after the other",
            [None, Some(0.0), None, Some(2.3)],
        ),
        ("one side", [Some(0.0), None, Some(0.0), None]),
        ("the front axle", [Some(0.0), Some(0.0), None, None]),
    ];
    let mut wrong = Vec::new();
    for (name, later) in wheels {
        for height in [0.1, 0.15, 0.2] {
            for speed in [0.1, 0.2, 0.3, 0.5, 1.0] {
                for (is_down, run_up) in [(false, 0.0), (false, 0.5), (true, 0.0), (true, 0.5)] {
                    let pose = over_kerb(height, is_down, later, speed, run_up);
                    let seconds = 5.0 + 2.0 * speed + 3.5 / speed;
                    for (sensor, edit) in [("both", SOUND), ("gyro", &without_attitude)] {
                        let seen = edited(seconds, &pose, edit);
                        if !(seen.spells.is_empty() && seen.falls_s.is_none()) {
                            wrong.push(format!("{name}, {height} m, {speed} m/s, down {is_down}, {run_up} m, {sensor}: {:?}, {} spells", seen.falls_s, seen.spells.len()));
                        }
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn wrong_samples_and_biases_do_not_count() {
    let still = |_: f64| Pose::default();
    let spike = |time_s: f64, values: &mut Values| {
        if (time_s - 4.0).abs() < 5e-3 {
            values[3] = 5.5;
            values[6..].copy_from_slice(&[0.5, 0.0, 0.0, 0.866]);
        }
    };
    let bias = |_: f64, values: &mut Values| values[3] += 0.1;
    let late_bias = |time_s: f64, values: &mut Values| {
        values[3] += if time_s > 5.0 { 0.06 } else { 0.0 };
    };
    let stuck = |time_s: f64, values: &mut Values| {
        values[3] += if time_s > 5.0 { 0.6 } else { 0.0 };
    };
    let jump = |time_s: f64, values: &mut Values| {
        if time_s > 5.0 {
            let turned = UnitQuaternion::from_euler_angles(0.4, 0.0, 1e-3 * (50.0 * time_s).sin());
            values[6..].copy_from_slice(turned.coords.as_slice());
        }
    };
    let edits: [NamedEdit<'_>; 5] = [
        ("spike", &spike),
        ("bias", &bias),
        ("late bias", &late_bias),
        ("stuck gyro", &stuck),
        ("attitude jumps", &jump),
    ];
    for (name, edit) in edits {
        let seen = edited(14.0, &still, edit);
        let is_sound = seen.spells.is_empty() && seen.falls_s.is_none();
        assert!(is_sound, "{name}: {seen:?}");
    }
    let alone: [NamedEdit<'_>; 3] = [
        ("spike", &spike),
        ("bias", &bias),
        ("late bias", &late_bias),
    ];
    for (name, edit) in alone {
        let edit = |time_s: f64, values: &mut Values| {
            edit(time_s, values);
            without_attitude(time_s, values);
        };
        let seen = edited(14.0, &still, &edit);
        let is_sound = seen.spells.is_empty() && seen.falls_s.is_none();
        assert!(is_sound, "{name}, gyro alone: {seen:?}");
    }
}

#[test]
fn no_byte_sequence_stops_it() {
    let mut watch = PlatformRotation::new(&machine(), &imu_and_odometry());
    let wild = [f64::NAN, f64::INFINITY, -1e300, 0.0, 1e-310, 1.0];
    let mut noise = Noise(3);
    for step in 0..4000 {
        let values: Vec<f64> = (0..10)
            .map(|_| wild[(noise.next().abs() * 2.0) as usize % 6])
            .collect();
        let stamps = [i64::MIN, step * PERIOD_NS, i64::MAX, 0];
        let sensor = [Sensor::Imu, Sensor::Odometry, Sensor::Joints(0)][step as usize % 3];
        watch.step(&Sample {
            sensor,
            stamp_ns: stamps[(noise.next().abs() * 3.0) as usize % 4],
            values: &values[..(step as usize % 11)],
        });
    }
}
