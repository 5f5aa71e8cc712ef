//! Pairs of topics that measure the same motion, and their signals on an even time grid.
//!
//! | pair | both measure |
//! |---|---|
//! | odometry, IMU | rotation about each axis, longitudinal and lateral acceleration |
//! | joint states, odometry | wheel speed and machine speed |
//! | joint states, IMU | without odometry: wheel and machine acceleration |
//! | joint states, IMU | machine at standstill: tilt of the platform as the arm moves |
//! | force or pressure of a linkage, joint states | measured and computed actuator force |
//! | tool wrench, IMU | machine at standstill: tilt of the platform under the force |
//!
//! Driven and braked wheels slip in proportion to their force, which looks like a delay; rolling wheels
//! agree best and count most. A platform on tyres tilts slightly later than its load moves: see
//! `tilt`.

use rayon::prelude::*;
use tipwatch_language::word;
use tipwatch_mechanics::state::Sensor;

use super::delay::Delay;
use super::offsets::PairOffset;
use super::scene::Scene;
use crate::base::error_text::error_text;
use crate::base::estimated::EstimatedRows;
use crate::load::linkage_force::LinkageForce;
use crate::load::{LoadedLog, Signal};

/// A pair of topics, and how the delay between them is found.
struct Pair<'a> {
    topic: &'a str,
    against: &'a str,
    by: &'static str,
    find: Box<dyn Fn() -> Result<Delay, String> + Sync + Send + 'a>,
}

impl<'a> Pair<'a> {
    fn new(
        topic: &'a str,
        against: &'a str,
        by: &'static str,
        find: impl Fn() -> Result<Delay, String> + Sync + Send + 'a,
    ) -> Self {
        Self {
            topic,
            against,
            by,
            find: Box::new(find),
        }
    }
}

/// Compares every pair of topics that measure the same motion, in parallel.
pub(super) fn compare(
    loaded: &LoadedLog,
    forces: &[LinkageForce],
    rows: &EstimatedRows,
) -> Vec<PairOffset> {
    let scene = Scene::of(loaded, rows);
    let pairs = pairs(&scene, forces);
    let compare =
        |pair: &Pair<'_>| PairOffset::new(pair.topic, pair.against, pair.by, (pair.find)());
    pairs.par_iter().with_max_len(1).map(compare).collect()
}

fn pairs<'a>(scene: &'a Scene<'a>, forces: &'a [LinkageForce]) -> Vec<Pair<'a>> {
    let loaded = scene.loaded;
    let mut pairs = Vec::new();
    let (imu, odometry) = (scene.signal(Sensor::Imu), scene.signal(Sensor::Odometry));
    if let (Some(imu), Some(odometry)) = (imu, odometry) {
        let by = word!("rotation and acceleration of the machine");
        let find = move || scene.rotation_and_acceleration(odometry);
        pairs.push(Pair::new(&odometry.topic, &imu.topic, by, find));
    }
    for joints in loaded.signals.iter() {
        let Sensor::Joints(stream) = joints.sensor else {
            continue;
        };
        if let Some(odometry) = odometry
            && !scene.wheels_of(stream).is_empty()
        {
            let by = word!("wheel speed and machine speed");
            let find = move || scene.wheel_speed(stream, odometry);
            pairs.push(Pair::new(&joints.topic, &odometry.topic, by, find));
        } else if let Some(imu) = imu
            && !scene.wheels_of(stream).is_empty()
        {
            let by = word!("acceleration of wheels and machine");
            let find = move || scene.wheel_acceleration(stream);
            pairs.push(Pair::new(&joints.topic, &imu.topic, by, find));
        }
        if let Some(imu) = imu
            && scene.has_other_joints(stream)
        {
            let by = word!("tilt of the platform as the joints move");
            let find = move || scene.tilt(Some(stream));
            pairs.push(Pair::new(&joints.topic, &imu.topic, by, find));
        }
    }
    if let (Some(imu), Some(wrench)) = (imu, scene.signal(Sensor::ToolWrench)) {
        let by = word!("tilt of the platform under the tool force");
        let find = || scene.tilt(None);
        pairs.push(Pair::new(&wrench.topic, &imu.topic, by, find));
    }
    for force in forces {
        let joint = loaded.machine.linkages()[force.linkage].measured_joint;
        let of_joint = |signal: &&Signal| {
            let joints = loaded.matched.sensors.joints_of(signal.sensor);
            joints.is_some_and(|joints| joints.contains(&joint))
        };
        let Some(joints) = loaded.signals.iter().find(of_joint) else {
            continue;
        };
        let by = word!("measured and computed actuator force");
        let find = move || match &force.series {
            Ok(series) => scene.actuator_force(force.linkage, series),
            Err(error) => Err(error_text(error)),
        };
        pairs.push(Pair::new(&force.topic, &joints.topic, by, find));
    }
    // the signals of one topic share its clock
    pairs.retain(|pair| pair.topic != pair.against);
    pairs
}
