//! Fault injection: copies of a log with some messages changed.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tipwatch_ingest::{Log, Topic, TopicId};

/// A CDR message (the encoding of ROS 2) whose numbers can be changed in place.
#[derive(Debug)]
struct Cdr<'m> {
    bytes: &'m mut [u8],
    at: usize,
}

impl<'m> Cdr<'m> {
    fn new(bytes: &'m mut [u8]) -> Self {
        Self { bytes, at: 4 }
    }

    fn align(&mut self, to: usize) {
        self.at = 4 + (self.at - 4).next_multiple_of(to);
    }

    fn count(&mut self) -> usize {
        self.align(4);
        let bytes = self.bytes[self.at..self.at + 4].try_into();
        self.at += 4;
        u32::from_le_bytes(bytes.expect("four bytes")) as usize
    }

    fn text(&mut self) -> String {
        let length = self.count();
        let text = String::from_utf8_lossy(&self.bytes[self.at..self.at + length - 1]).into();
        self.at += length;
        text
    }

    /// Skips the header and returns its stamp (ns).
    fn header(&mut self) -> i64 {
        let (seconds, nanoseconds) = (self.count() as i64, self.count() as i64);
        self.text();
        seconds * 1_000_000_000 + nanoseconds
    }

    fn number(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.bytes[at..at + 8].try_into().expect("eight bytes"))
    }

    fn set(&mut self, at: usize, value: f64) {
        self.bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
    }
}

/// The numbers of a sensor message.
#[derive(Debug)]
pub struct Values<'m> {
    cdr: Cdr<'m>,
    /// Byte offset of each number by name: `position.slew`, `velocity.slew`, `effort.slew`, `force.x`, `turning.x`,
    /// `turning.covariance`, `attitude.w`, `velocity.x`.
    places: BTreeMap<String, usize>,
    /// Topic of the message.
    pub topic: &'m str,
    /// Stamp of the message (ns).
    pub stamp_ns: i64,
    /// Time since the first sensor message of the log (s).
    pub time_s: f64,
}

impl Values<'_> {
    /// The names of all numbers.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.places.keys().map(String::as_str)
    }

    /// The number with this name.
    ///
    /// # Panics
    /// If the message has no such number.
    #[must_use]
    pub fn get(&self, name: &str) -> f64 {
        self.cdr.number(self.places[name])
    }

    /// Sets a number.
    ///
    /// # Panics
    /// If the message has no such number.
    pub fn set(&mut self, name: &str, value: f64) {
        self.cdr.set(self.places[name], value);
    }

    /// Multiplies a number.
    ///
    /// # Panics
    /// If the message has no such number.
    pub fn scale(&mut self, name: &str, factor: f64) {
        self.set(name, self.get(name) * factor);
    }

    /// Adds to a number.
    ///
    /// # Panics
    /// If the message has no such number.
    pub fn shift(&mut self, name: &str, by: f64) {
        self.set(name, self.get(name) + by);
    }

    /// Rolls the platform of an IMU message by an angle (rad), attitude and specific force: the same motion, leant.
    ///
    /// # Panics
    /// If the message is not one of an IMU.
    pub fn roll(&mut self, angle: f64) {
        let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let names = ["x", "y", "z", "w"].map(|axis| format!("attitude.{axis}"));
        let [x, y, z, w] = std::array::from_fn(|k| self.get(&names[k]));
        let attitude = (Quaternion::new(w, x, y, z) * roll.into_inner()).coords;
        for (name, value) in names.iter().zip(attitude.iter()) {
            self.set(name, *value);
        }
        let names = ["x", "y", "z"].map(|axis| format!("force.{axis}"));
        let force = Vector3::from_fn(|k, _| self.get(&names[k]));
        let force = roll.inverse_transform_vector(&force);
        for (name, value) in names.iter().zip(force.iter()) {
            self.set(name, *value);
        }
    }

    /// Exchanges two numbers.
    ///
    /// # Panics
    /// If the message has not both.
    pub fn exchange(&mut self, a: &str, b: &str) {
        let (of_a, of_b) = (self.get(a), self.get(b));
        self.set(a, of_b);
        self.set(b, of_a);
    }
}

fn values<'m>(topic: &'m Topic, bytes: &'m mut [u8]) -> Option<Values<'m>> {
    let mut cdr = Cdr::new(bytes);
    let mut places = BTreeMap::new();
    let stamp_ns = match topic.type_name.as_str() {
        "sensor_msgs/msg/JointState" => {
            let stamp_ns = cdr.header();
            let names: Vec<String> = (0..cdr.count()).map(|_| cdr.text()).collect();
            for list in ["position", "velocity", "effort"] {
                let count = cdr.count();
                if count > 0 {
                    cdr.align(8);
                }
                for name in names.iter().take(count) {
                    places.insert(format!("{list}.{name}"), cdr.at);
                    cdr.at += 8;
                }
            }
            stamp_ns
        }
        "sensor_msgs/msg/Imu" => {
            let stamp_ns = cdr.header();
            cdr.align(8);
            let start = cdr.at;
            for (i, axis) in ["x", "y", "z", "w"].into_iter().enumerate() {
                places.insert(format!("attitude.{axis}"), start + 8 * i);
                if axis != "w" {
                    places.insert(format!("turning.{axis}"), start + 8 * (13 + i));
                    places.insert(format!("force.{axis}"), start + 8 * (25 + i));
                }
            }
            places.insert("turning.covariance".into(), start + 8 * 16);
            stamp_ns
        }
        "nav_msgs/msg/Odometry" => {
            let stamp_ns = cdr.header();
            cdr.text();
            cdr.align(8);
            for (i, axis) in ["x", "y", "z", "w"].into_iter().enumerate() {
                places.insert(format!("attitude.{axis}"), cdr.at + 8 * (3 + i));
                if axis != "w" {
                    places.insert(format!("velocity.{axis}"), cdr.at + 8 * (43 + i));
                    places.insert(format!("turning.{axis}"), cdr.at + 8 * (46 + i));
                }
            }
            stamp_ns
        }
        _ => return None,
    };
    Some(Values {
        cdr,
        places,
        topic: &topic.name,
        stamp_ns,
        time_s: 0.0,
    })
}

/// Copies a log to a new MCAP file. `edit` is called with topic name and numbers of every sensor message.
///
/// # Panics
/// If the log cannot be read or the copy cannot be written.
pub fn write_edited(from: &Path, to: &Path, edit: &mut dyn FnMut(&str, &mut Values<'_>)) {
    write_edited_without(from, to, "", edit);
}

/// As [`write_edited`], without the topic `left_out`.
///
/// # Panics
/// If the log cannot be read or the copy cannot be written.
pub fn write_edited_without(
    from: &Path,
    to: &Path,
    left_out: &str,
    edit: &mut dyn FnMut(&str, &mut Values<'_>),
) {
    write_changed(from, to, left_out, &|_, _| true, edit);
}

/// Copies those messages of a log to a new MCAP file whose topic and log time (ns) `keep` accepts.
///
/// # Panics
/// If the log cannot be read or the copy cannot be written.
pub fn write_kept(from: &Path, to: &Path, keep: &dyn Fn(&str, i64) -> bool) {
    write_changed(from, to, "", keep, &mut |_, _| ());
}

fn write_changed(
    from: &Path,
    to: &Path,
    left_out: &str,
    keep: &dyn Fn(&str, i64) -> bool,
    edit: &mut dyn FnMut(&str, &mut Values<'_>),
) {
    let log = Log::open(from).expect("a log");
    let file = std::io::BufWriter::new(std::fs::File::create(to).expect("a new file"));
    let mut writer: Writer<_> = WriteOptions::new().create(file).expect("a writer");
    let is_kept = |topic: &&Topic| topic.name != left_out;
    let channels: BTreeMap<TopicId, u16> = (log.topics().iter())
        .filter(is_kept)
        .map(|topic| {
            let definition = topic.definition.as_deref().unwrap_or_default();
            let schema = writer
                .add_schema(
                    &topic.type_name,
                    &topic.schema_encoding,
                    definition.as_bytes(),
                )
                .expect("a schema");
            let channel = writer
                .add_channel(schema, &topic.name, &topic.encoding, &BTreeMap::new())
                .expect("a channel");
            (topic.id, channel)
        })
        .collect();
    let ids: Vec<TopicId> = channels.keys().copied().collect();
    let mut start_ns = None;
    log.read(&ids, &mut |message| {
        let topic = &log.topics()[message.topic.index()];
        if !keep(&topic.name, message.log_time_ns) {
            return ControlFlow::Continue(());
        }
        let mut data = message.data.to_vec();
        if let Some(mut values) = values(topic, &mut data) {
            let start_ns = *start_ns.get_or_insert(values.stamp_ns);
            values.time_s = (values.stamp_ns - start_ns) as f64 * 1e-9;
            edit(&topic.name, &mut values);
        }
        let header = MessageHeader {
            channel_id: channels[&message.topic],
            sequence: message.sequence,
            log_time: message.log_time_ns as u64,
            publish_time: message.publish_time_ns as u64,
        };
        writer
            .write_to_known_channel(&header, &data)
            .expect("written");
        ControlFlow::Continue(())
    })
    .expect("a log that can be read");
    writer.finish().expect("a finished file");
}
