//! Any log of a robot or machine: messages, typed sensor samples, and what of it is damaged.
//!
//! - [`Log`] opens a recording, lists its [`Topic`]s and hands out every intact [`Message`];
//!   [`Losses`] tell what was damaged. Nothing in a damaged file ends the program.
//! - [`bind`] finds the topic that carries a signal; [`SensorDecoder`] turns its messages into
//!   [`SensorSample`]s.
//! - [`TopicStatistics`] tells how the clocks of a topic behave, and where its gaps are; [`TimeBase`] puts
//!   all topics on one clock and says what it had to do for that.
//! - [`Layout`] reads single fields out of any message by its recorded definition.
//! - [`recover`] writes the intact part of a log as a clean MCAP file; [`Ros2Writer`] writes a new one.
//!
//! It knows no machine: what the numbers mean for one is told by its callers.
//!
//! ```no_run
//! use std::{ops::ControlFlow, path::Path};
//!
//! use tipwatch_ingest::{Log, SensorDecoder, SensorKind, SensorSample, TopicStatistics, bind};
//!
//! let log = Log::open(Path::new("drive.mcap"))?;
//! println!("{}: {} topics", log.format(), log.topics().len());
//!
//! let imu = bind(log.topics(), SensorKind::Imu, None)?.ok_or("no IMU in this log")?;
//! let topic = log.topic(imu.topic)?;
//! let mut decoder = SensorDecoder::new(topic, SensorKind::Imu, &[])?;
//! let mut sample = SensorSample::default();
//! let mut statistics = TopicStatistics::default();
//! let mut undecodable = 0;
//! let losses = log.read(&[imu.topic], &mut |message| {
//!     match decoder.decode(message, &mut sample) {
//!         Ok(()) => statistics.push(
//!             sample.header_stamp_ns,
//!             sample.publish_time_ns,
//!             sample.log_time_ns,
//!         ),
//!         Err(_) => undecodable += 1,
//!     }
//!     ControlFlow::Continue(())
//! })?;
//! println!("{} ranges of bytes lost", losses.ranges.len());
//! println!("{:?}", statistics.timing());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bag;
mod binary;
mod binding;
mod builtin;
mod clock;
mod definition;
mod error;
mod extra;
mod field_path;
mod field_recording;
mod fields;
mod file_bytes;
mod first_messages;
mod json;
mod large_columns;
mod layout;
mod log;
mod log_file;
mod losses;
mod mcap;
mod merged_parts;
mod message;
mod metadata_records;
mod number_decoder;
mod number_fields;
mod path_tree;
mod protobuf;
mod reader;
mod recognise;
mod records;
mod recover;
mod ros2_writer;
mod rosbag2_folder;
mod rosbag2_metadata;
mod rosbag2_sqlite;
mod sensor;
mod sensor_columns;
mod sensor_recording;
mod sensor_topics;
mod static_frames;
mod topic;

pub use crate::{
    binary::DecodeError,
    binding::{Binding, BindingError, Wanted, bind, bind_joint_states},
    clock::{
        BackwardStep, ClockFinding, ClockFindingKind, Gap, Placed, StampCorrection, StampDecision,
        StampOffset, StampSource, TimeBase, Times, TopicStatistics, TopicTiming, Treatment,
    },
    definition::SchemaError,
    error::Error,
    field_path::FieldPath,
    field_recording::{FieldRecording, FieldRequest, record_fields, topic_of_field},
    fields::Fields,
    first_messages::{first_frame, first_string, joint_names_in},
    layout::Layout,
    log::{Format, Log},
    losses::{Integrity, Losses, LostPart, LostRange},
    message::Message,
    metadata_records::{MetadataRecord, metadata_records},
    number_decoder::{NumberField, NumberSample, SampleValue},
    number_fields::number_fields,
    recover::{RecoverError, RecoveryReport, recover},
    ros2_writer::{OutTopic, Ros2Writer, WriteError},
    sensor::{SensorDecoder, SensorKind, SensorSample},
    sensor_recording::{SensorRecording, SensorRequest, arrival_order, record_sensors},
    sensor_topics::{JointTopic, NamedTopics, SensorTopics, robot_description},
    static_frames::{StaticFrame, static_frames},
    topic::{DefinitionSource, Topic, TopicId},
};
