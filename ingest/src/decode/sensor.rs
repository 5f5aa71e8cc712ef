//! Decodes the messages of the four kinds of sensor into samples.

use std::ops::Range;

use super::{error::DecodeError, fields::Fields, layout::Layout};
use crate::{
    decode::layout::layout_of,
    message::{BindingError, RawMessage, SensorKind, Topic},
};

/// Indices of the header's fields among the paths; those of the sensor follow.
const SEC: usize = 0;
const NANOSEC: usize = 1;
const FRAME_ID: usize = 2;
const FIRST: usize = 3;
const HEADER_PATHS: [&str; FIRST] = [
    "header.stamp.sec",
    "header.stamp.nanosec",
    "header.frame_id",
];

/// The fields to read, in message order, so that adjacent numbers are read at once.
fn paths_of(kind: SensorKind) -> &'static [&'static str] {
    match kind {
        SensorKind::JointStates => &["name[]", "position[]", "velocity[]"],
        SensorKind::Imu => &[
            "orientation.x",
            "orientation.y",
            "orientation.z",
            "orientation.w",
            "orientation_covariance[0]",
            "angular_velocity.x",
            "angular_velocity.y",
            "angular_velocity.z",
            "linear_acceleration.x",
            "linear_acceleration.y",
            "linear_acceleration.z",
        ],
        SensorKind::Odometry => &[
            "pose.pose.orientation.x",
            "pose.pose.orientation.y",
            "pose.pose.orientation.z",
            "pose.pose.orientation.w",
            "twist.twist.linear.x",
            "twist.twist.linear.y",
            "twist.twist.linear.z",
            "twist.twist.angular.x",
            "twist.twist.angular.y",
            "twist.twist.angular.z",
        ],
        SensorKind::ToolWrench => &[
            "wrench.force.x",
            "wrench.force.y",
            "wrench.force.z",
            "wrench.torque.x",
            "wrench.torque.y",
            "wrench.torque.z",
        ],
        SensorKind::Number => &[],
    }
}

/// One sample. Reuse one instance for all messages.
///
/// The values, in SI units and in the frame of the message:
///
/// | kind | values |
/// |---|---|
/// | joint states | positions in the order of the joint names (rad or m), then velocities (rad/s or m/s) |
/// | IMU | specific force x y z (m/s²), angular velocity x y z (rad/s), attitude x y z w |
/// | odometry | velocity x y z (m/s), angular velocity x y z (rad/s), attitude x y z w |
/// | tool wrench | force x y z (N), moment x y z (N m) |
///
/// A value that the message lacks is NaN. Values are as recorded; their plausibility is not checked
/// here.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SensorSample {
    /// Time of measurement by the sensor's clock; `None` if the message leaves it at zero.
    pub header_stamp_ns: Option<i64>,
    /// When the recorder received it.
    pub log_time_ns: i64,
    /// When it was sent.
    pub publish_time_ns: i64,
    /// The values, in the order of the table above.
    pub values: Vec<f64>,
}

/// Decodes the messages of one topic into samples.
#[derive(Debug, Clone)]
pub struct SensorDecoder {
    kind: SensorKind,
    layout: Layout,
    fields: Fields,
    frame_id: Option<String>,
    joint_names: Vec<String>,
    /// Index of each wanted joint in the message, valid for `names_revision`.
    joint_places: Vec<Option<usize>>,
    /// The same as a range, if the indices are consecutive.
    joints_in_row: Option<Range<usize>>,
    names_revision: Option<u64>,
}

impl SensorDecoder {
    /// Prepares decoding. `joint_names` are the wanted joints, in order; other kinds of sensor
    /// ignore them.
    pub fn new(
        topic: &Topic,
        kind: SensorKind,
        joint_names: &[String],
    ) -> Result<Self, BindingError> {
        if !kind.is_type(&topic.type_name) {
            return Err(BindingError::WrongType {
                topic: topic.name.clone(),
                expected: kind.type_name(),
                found: topic.type_name.clone(),
            });
        }
        let paths: Vec<&str> = HEADER_PATHS.iter().chain(paths_of(kind)).copied().collect();
        Ok(Self {
            kind,
            layout: layout_of(topic, &paths)?,
            fields: Fields::new(),
            frame_id: None,
            joint_names: joint_names.to_vec(),
            joint_places: Vec::new(),
            joints_in_row: None,
            names_revision: None,
        })
    }

    /// Decodes one message into `sample`. After an error the sample's values are empty.
    pub fn decode(
        &mut self,
        message: &RawMessage<'_>,
        sample: &mut SensorSample,
    ) -> Result<(), DecodeError> {
        sample.values.clear();
        sample.log_time_ns = message.log_time_ns;
        sample.publish_time_ns = message.publish_time_ns;
        sample.header_stamp_ns = None;
        sample.header_stamp_ns = self.append_values(message, &mut sample.values)?;
        Ok(())
    }

    /// Appends the values of one message and returns its header stamp; appends nothing after an
    /// error.
    pub(crate) fn append_values(
        &mut self,
        message: &RawMessage<'_>,
        values: &mut Vec<f64>,
    ) -> Result<Option<i64>, DecodeError> {
        self.layout.decode(message.data, &mut self.fields)?;
        if self.frame_id.is_none() {
            let frame_id = String::from_utf8_lossy(self.fields.text(FRAME_ID));
            self.frame_id = Some(frame_id.trim_start_matches('/').to_owned());
        }
        match self.kind {
            SensorKind::JointStates => self.joint_values(values),
            SensorKind::Imu => self.imu_values(values),
            SensorKind::Odometry => self.odometry_values(values),
            SensorKind::ToolWrench => self.extend(values, FIRST, 6),
            // decoded by `NumberDecoder`
            SensorKind::Number => {}
        }
        Ok(self.stamp_ns())
    }

    /// The frame of the first decoded message, without a leading slash.
    pub fn frame_id(&self) -> Option<&str> {
        self.frame_id.as_deref()
    }

    /// The kind of sensor.
    pub fn kind(&self) -> SensorKind {
        self.kind
    }

    fn stamp_ns(&self) -> Option<i64> {
        // Both are small integers, so the conversion is exact.
        let (sec, nanosec) = (
            self.fields.number(SEC) as i64,
            self.fields.number(NANOSEC) as i64,
        );
        let stamp_ns = sec.saturating_mul(1_000_000_000).saturating_add(nanosec);
        (stamp_ns != 0).then_some(stamp_ns)
    }

    fn joint_values(&mut self, values: &mut Vec<f64>) {
        const NAMES: usize = FIRST;
        let revision = self.fields.texts_revision(NAMES);
        if self.names_revision != Some(revision) {
            self.joint_places.clear();
            for joint in &self.joint_names {
                let place = self
                    .fields
                    .texts(NAMES)
                    .position(|name| name == joint.as_bytes());
                self.joint_places.push(place);
            }
            self.joints_in_row = in_row(&self.joint_places);
            self.names_revision = Some(revision);
        }
        for array in [NAMES + 1, NAMES + 2] {
            let numbers = self.fields.numbers(array);
            let row = self.joints_in_row.clone();
            if let Some(row) = row.and_then(|row| numbers.get(row)) {
                values.extend_from_slice(row);
                continue;
            }
            values.extend(self.joint_places.iter().map(|place| {
                place
                    .and_then(|place| numbers.get(place))
                    .copied()
                    .unwrap_or(f64::NAN)
            }));
        }
    }

    fn imu_values(&self, values: &mut Vec<f64>) {
        const ATTITUDE: usize = FIRST;
        const COVARIANCE: usize = FIRST + 4;
        const ANGULAR_VELOCITY: usize = FIRST + 5;
        const SPECIFIC_FORCE: usize = FIRST + 8;
        self.extend(values, SPECIFIC_FORCE, 3);
        self.extend(values, ANGULAR_VELOCITY, 3);
        // By convention, -1 marks an IMU without attitude.
        let has_attitude = self.fields.number(COVARIANCE) != -1.0;
        self.extend_attitude(values, ATTITUDE, has_attitude);
    }

    fn odometry_values(&self, values: &mut Vec<f64>) {
        const ATTITUDE: usize = FIRST;
        const TWIST: usize = FIRST + 4;
        self.extend(values, TWIST, 6);
        self.extend_attitude(values, ATTITUDE, true);
    }

    #[inline]
    fn extend(&self, values: &mut Vec<f64>, first: usize, count: usize) {
        values.extend_from_slice(self.fields.neighbours(first, count));
    }

    #[inline]
    fn extend_attitude(&self, values: &mut Vec<f64>, first: usize, is_given: bool) {
        let quaternion = [0, 1, 2, 3].map(|part| self.fields.number(first + part));
        // all zeros: never set by the driver
        values.extend(if is_given && quaternion != [0.0; 4] {
            quaternion
        } else {
            [f64::NAN; 4]
        });
    }
}

/// The indices as a range, if they are consecutive.
fn in_row(places: &[Option<usize>]) -> Option<Range<usize>> {
    let first = (*places.first()?)?;
    let row = first..first + places.len();
    let is_row = places.iter().copied().eq(row.clone().map(Some));
    is_row.then_some(row)
}
