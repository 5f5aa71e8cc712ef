//! Speed of the machine, by which the ground under it may have changed.

use nalgebra::Vector2;

use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors};

/// Speed that noise may show while the machine stands (m/s).
const STANDING: f64 = 0.05;
/// Speed that is assumed where nothing measures it (m/s).
const UNKNOWN: f64 = 2.0;

/// The speed by odometry and wheels.
#[derive(Debug, Clone)]
pub(super) struct Speed {
    /// Wheels of each stream of joint states.
    streams: Vec<Vec<SpunWheel>>,
    max_gap_ns: i64,
    by_wheels: Option<(i64, f64)>,
    /// The speed, and the velocity along x and y (m/s).
    by_odometry: Option<(i64, f64, Vector2<f64>)>,
}

/// A wheel of a stream.
#[derive(Debug, Clone)]
struct SpunWheel {
    /// Place of its joint in the stream, of as many joints.
    place: usize,
    of: usize,
    radius: f64,
    last: Option<(i64, f64)>,
}

impl Speed {
    pub(super) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let streams = sensors.joints.iter().map(|stream| {
            let joints = stream.joints.iter().enumerate();
            let spun = joints.filter_map(|(place, &joint)| {
                // a raised wheel turns without the machine moving: then too much is taken for travel, never too little
                let wheel = machine.joints()[joint].spins_wheel?;
                Some(SpunWheel {
                    place,
                    of: stream.joints.len(),
                    radius: machine.wheels()[wheel].radius,
                    last: None,
                })
            });
            spun.collect()
        });
        Self {
            streams: streams.collect(),
            max_gap_ns: (machine.estimator().max_gap * 1e9) as i64,
            by_wheels: None,
            by_odometry: None,
        }
    }

    /// Takes a sample of joint states or odometry.
    pub(super) fn take(&mut self, sample: &Sample<'_>) {
        let values = sample.values;
        match sample.sensor {
            Sensor::Joints(stream) => {
                let wheels = self.streams.get_mut(stream).into_iter().flatten();
                let speeds = wheels.filter_map(|wheel| wheel.speed(sample.stamp_ns, values));
                if let Some(fastest) = speeds.reduce(f64::max) {
                    self.by_wheels = Some((sample.stamp_ns, fastest));
                }
            }
            Sensor::Odometry => {
                let squares = values.iter().take(3).map(|v| v * v).sum::<f64>();
                if let (true, &[x, y, ..]) = (squares.is_finite(), values) {
                    let velocity = Vector2::new(x, y);
                    self.by_odometry = Some((sample.stamp_ns, squares.sqrt(), velocity));
                }
            }
            Sensor::Imu | Sensor::ToolWrench | Sensor::Number(..) => {}
        }
    }

    /// The speed at a time (m/s), zero while the machine stands; `None` where nothing measures it.
    pub(super) fn at(&self, now_ns: i64) -> Option<f64> {
        let by_odometry = self.by_odometry.map(|(at_ns, speed, _)| (at_ns, speed));
        self.fastest(now_ns, [self.by_wheels, by_odometry])
    }

    /// Returns the rolling speed of the wheels at a time (m/s), where the rotation of the platform has `moved` it over them along
    /// x and y (m/s): an odometry measures all of that motion, or, by the wheels, none of it.
    pub(super) fn rolling(&self, now_ns: i64, moved: &Vector2<f64>) -> f64 {
        let by_wheels = self
            .by_wheels
            .map(|(at_ns, speed)| (at_ns, (speed - moved.x.abs()).max(0.0)));
        let by_odometry = self.by_odometry.map(|(at_ns, _, velocity)| {
            let share = velocity.dot(moved) / moved.norm_squared().max(f64::MIN_POSITIVE);
            (at_ns, (velocity - moved * share.clamp(0.0, 1.0)).norm())
        });
        Self::assumed(self.fastest(now_ns, [by_wheels, by_odometry]))
    }

    fn fastest(&self, now_ns: i64, known: [Option<(i64, f64)>; 2]) -> Option<f64> {
        let known = known.into_iter().flatten();
        let fresh = known.filter(|(at_ns, _)| now_ns.saturating_sub(*at_ns) <= self.max_gap_ns);
        let fastest = fresh.map(|(_, speed)| speed).reduce(f64::max)?;
        Some(if fastest < STANDING { 0.0 } else { fastest })
    }

    /// Returns the speed (m/s), or a usual speed where nothing measures it.
    pub(super) fn assumed(speed: Option<f64>) -> f64 {
        speed.unwrap_or(UNKNOWN)
    }
}

impl SpunWheel {
    /// Circumferential speed (m/s): by the velocity of the joint, or the change of its position.
    fn speed(&mut self, stamp_ns: i64, values: &[f64]) -> Option<f64> {
        let position = *values.get(self.place)?;
        let velocity = *values.get(self.of + self.place)?;
        let last = self.last.replace((stamp_ns, position));
        let rate = match velocity.is_finite() {
            true => velocity,
            false => {
                let (last_ns, before) = last?;
                (position - before) / (stamp_ns.saturating_sub(last_ns) as f64 * 1e-9)
            }
        };
        Some((rate * self.radius).abs()).filter(|speed| speed.is_finite())
    }
}
