//! Decodes the messages of the four kinds of sensor into samples.

use std::ops::Range;

use super::{
    attitude::{given_attitude, given_vector, is_given},
    error::DecodeError,
    fields::Fields,
    layout::Layout,
    shortcut::{Credit, Marks, Shortcut},
};
use crate::{
    decode::layout::layout_of,
    message::{BindingError, RawMessage, SensorKind, Topic},
};

/// Indices of the header's fields among the paths; those of the sensor follow.
const SEC: usize = 0;
const NANOSEC: usize = 1;
const FRAME_ID: usize = 2;
const FIRST: usize = 3;
/// Index of the names of joints, before their positions and velocities.
const NAMES: usize = FIRST;
const HEADER_PATHS: [&str; FIRST] = [
    "header.stamp.sec",
    "header.stamp.nanosec",
    "header.frame_id",
];

// Indices of some of the sensor's fields, see below.
const ATTITUDE: usize = FIRST;
const TWIST: usize = FIRST + 4;
const ATTITUDE_MARK: usize = FIRST + 4;
const ANGULAR_VELOCITY: usize = FIRST + 5;
const ANGULAR_VELOCITY_MARK: usize = FIRST + 8;
const SPECIFIC_FORCE: usize = FIRST + 9;
const SPECIFIC_FORCE_MARK: usize = FIRST + 12;
// Of the values of a sample, in their order.
const IMU_VALUES: [usize; 10] = [12, 13, 14, 8, 9, 10, 3, 4, 5, 6];
const ODOMETRY_VALUES: [usize; 10] = [7, 8, 9, 10, 11, 12, 3, 4, 5, 6];
const WRENCH_VALUES: [usize; 6] = [3, 4, 5, 6, 7, 8];

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
            "angular_velocity_covariance[0]",
            "linear_acceleration.x",
            "linear_acceleration.y",
            "linear_acceleration.z",
            "linear_acceleration_covariance[0]",
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
    /// Time at which the recorder received the message (ns).
    pub log_time_ns: i64,
    /// Time at which the message was sent (ns).
    pub publish_time_ns: i64,
    /// The values, in the order of the table above.
    pub values: Vec<f64>,
}

/// Result of a message for a sensor of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JointSample {
    /// A sample, with its header stamp (ns).
    Of(Option<i64>),
    /// The message names none of the wanted joints: several publishers share the topic, each with joints of its own.
    OfOthers,
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
    /// The indices as a range, if they are consecutive.
    joints_in_row: Option<Range<usize>>,
    names_revision: Option<u64>,
    /// Positions of the values in the last message that was followed from its beginning.
    shortcut: Option<Box<Shortcut>>,
    credit: Credit,
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
            shortcut: None,
            credit: Credit::default(),
        })
    }

    /// Refuses messages of other frames than this one, instead of other ones than that of the first message.
    pub(crate) fn expect_frame(&mut self, frame_id: String) {
        self.frame_id = Some(frame_id);
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
        match self.append_values(message, &mut sample.values)? {
            JointSample::Of(stamp_ns) => sample.header_stamp_ns = stamp_ns,
            JointSample::OfOthers => {
                let count = self.kind.value_count(self.joint_names.len());
                sample.values.resize(count, f64::NAN);
                let (sec, nanosec) = (self.fields.number(SEC), self.fields.number(NANOSEC));
                sample.header_stamp_ns = stamp_ns(sec, nanosec);
            }
        }
        Ok(())
    }

    /// Appends the values of one message and returns its header stamp; appends nothing after an
    /// error, and nothing for a message that names none of the wanted joints.
    pub(crate) fn append_values(
        &mut self,
        message: &RawMessage<'_>,
        values: &mut Vec<f64>,
    ) -> Result<JointSample, DecodeError> {
        let shortcut = self.shortcut.as_ref();
        if let Some([sec, nanosec]) =
            shortcut.and_then(|shortcut| shortcut.append_values(message.data, values))
        {
            self.credit.earn();
            return Ok(JointSample::Of(stamp_ns(sec, nanosec)));
        }
        self.follow(message, values)
    }

    /// Decodes a message by following all its lengths.
    fn follow(
        &mut self,
        message: &RawMessage<'_>,
        values: &mut Vec<f64>,
    ) -> Result<JointSample, DecodeError> {
        self.layout.decode(message.data, &mut self.fields)?;
        self.take_frame()?;
        match self.kind {
            SensorKind::JointStates => {
                self.find_joints();
                let names_none = self.joint_places.iter().all(Option::is_none);
                if !self.joint_places.is_empty() && (names_none || self.has_no_motion()) {
                    return Ok(JointSample::OfOthers);
                }
                self.joint_values(values);
            }
            SensorKind::Imu => self.imu_values(values),
            SensorKind::Odometry => self.odometry_values(values),
            SensorKind::ToolWrench => self.extend(values, FIRST, 6),
            // decoded by `NumberDecoder`
            SensorKind::Number => {}
        }
        if self.credit.spend() {
            self.shortcut = self.new_shortcut(message.data).map(Box::new);
        }
        Ok(JointSample::Of(stamp_ns(
            self.fields.number(SEC),
            self.fields.number(NANOSEC),
        )))
    }

    /// Keeps the frame of the first message. Another frame is that of another sensor; joint states have none.
    fn take_frame(&mut self) -> Result<(), DecodeError> {
        let text = String::from_utf8_lossy(self.fields.text(FRAME_ID));
        let frame = text.trim_start_matches('/');
        let Some(first) = &self.frame_id else {
            self.frame_id = Some(frame.to_owned());
            return Ok(());
        };
        let is_other = self.kind != SensorKind::JointStates && frame != first;
        match is_other {
            true => Err(DecodeError::OtherFrame),
            false => Ok(()),
        }
    }

    /// The shortcut for messages like this one, which was decoded just now.
    fn new_shortcut(&self, message: &[u8]) -> Option<Shortcut> {
        let places = self.layout.places(message)?;
        let stamp = [places.numbers(SEC)?, places.numbers(NANOSEC)?];
        let singles = |paths: &[usize]| {
            let single = |path: &usize| places.numbers(*path).map(Some);
            paths.iter().map(single).collect::<Option<Vec<_>>>()
        };
        let (values, marks) = match self.kind {
            SensorKind::JointStates => {
                let of_joints = |path: usize| {
                    let array = places.numbers(path);
                    let joint = move |place: usize| array?.part(place..place.checked_add(1)?);
                    (self.joint_places.iter()).map(move |place| place.and_then(joint))
                };
                let joints = of_joints(FIRST + 1).chain(of_joints(FIRST + 2));
                (joints.collect(), Marks::None)
            }
            SensorKind::Imu => {
                let marks = [SPECIFIC_FORCE_MARK, ANGULAR_VELOCITY_MARK, ATTITUDE_MARK];
                let [force, turning, attitude] = marks.map(|mark| places.numbers(mark));
                let marks = [force?, turning?, attitude?];
                (singles(&IMU_VALUES)?, Marks::Imu(marks))
            }
            SensorKind::Odometry => (singles(&ODOMETRY_VALUES)?, Marks::NoneOfAttitude),
            SensorKind::ToolWrench => (singles(&WRENCH_VALUES)?, Marks::None),
            SensorKind::Number => return None,
        };
        Shortcut::new(places, stamp, values.into_iter(), marks)
    }

    /// The frame of the messages that are decoded, that of the first one, without a leading slash.
    pub fn frame_id(&self) -> Option<&str> {
        self.frame_id.as_deref()
    }

    /// The kind of sensor.
    pub fn kind(&self) -> SensorKind {
        self.kind
    }

    /// Whether a message of joint states gives neither positions nor velocities, but efforts: an empty array counts as not given,
    /// by convention.
    fn has_no_motion(&self) -> bool {
        [NAMES + 1, NAMES + 2]
            .into_iter()
            .all(|array| self.fields.numbers(array).is_empty())
    }

    /// Finds the wanted joints among the names of the message.
    fn find_joints(&mut self) {
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
    }

    fn joint_values(&mut self, values: &mut Vec<f64>) {
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
        for (first, mark) in [
            (SPECIFIC_FORCE, SPECIFIC_FORCE_MARK),
            (ANGULAR_VELOCITY, ANGULAR_VELOCITY_MARK),
        ] {
            let vector = [0, 1, 2].map(|part| self.fields.number(first + part));
            values.extend(given_vector(vector, is_given(self.fields.number(mark))));
        }
        let has_attitude = is_given(self.fields.number(ATTITUDE_MARK));
        self.extend_attitude(values, ATTITUDE, has_attitude);
    }

    fn odometry_values(&self, values: &mut Vec<f64>) {
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
        values.extend(given_attitude(quaternion, is_given));
    }
}

/// Returns the stamp of a header (ns); `None` if it is zero.
pub(super) fn stamp_ns(sec: f64, nanosec: f64) -> Option<i64> {
    // Both are small integers, so the conversion is exact.
    let (sec, nanosec) = (sec as i64, nanosec as i64);
    let stamp_ns = sec.saturating_mul(1_000_000_000).saturating_add(nanosec);
    (stamp_ns != 0).then_some(stamp_ns)
}

/// The indices as a range, if they are consecutive.
fn in_row(places: &[Option<usize>]) -> Option<Range<usize>> {
    let first = (*places.first()?)?;
    let row = first..first + places.len();
    let is_row = places.iter().copied().eq(row.clone().map(Some));
    is_row.then_some(row)
}
