//! Reads logs of robots and machines: messages, typed sensor samples, and a report of all damage.
//!
//! - [`Log`] opens a log, lists its [`Topic`]s and passes every intact [`RawMessage`] to a callback;
//!   [`Losses`] report what was damaged. No damage in a file ends the program.
//! - [`bind`] finds the topic that carries a signal; [`SensorDecoder`] turns its messages into
//!   [`SensorSample`]s.
//! - [`TopicStatistics`] describes the clocks and gaps of a topic; [`TimeBase`] puts all topics on one
//!   clock and reports the corrections.
//! - [`read_sensor_blocks`] passes the samples of all sensors on in blocks, in one pass and bounded
//!   memory; [`record_sensors`] returns them as whole columns.
//! - [`SampleStream`] decodes the messages of a running system one at a time, into the same samples.
//! - [`Layout`] reads single fields of any message by its recorded definition.
//! - [`recover`] writes the intact part of a log as a clean MCAP file, [`write_clips`] spans of its time;
//!   [`Ros2Writer`] writes a new one.
//!
//! The crate knows nothing about machines: callers interpret the numbers.
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

mod clock;
mod columns;
mod decode;
mod file;
mod formats;
mod log;
mod message;
mod schema;
mod table;
mod topics;
mod write;

pub use crate::{
    clock::{
        BackwardStep, ClockFinding, ClockFindingKind, Gap, MessageTimes, Placed, Placement,
        StampCorrection, StampDecision, StampOffset, StampSource, TimeBase, Times, TopicStatistics,
        TopicTiming, Treatment,
    },
    columns::{
        FieldRequest, SampleStream, SensorBlock, SensorReading, SensorRecording, SensorRequest,
        StreamClock, StreamRefusals, arrival_order, read_sensor_blocks, record_fields,
        record_sensors,
    },
    decode::{
        DecodeError, Fields, LARGEST_TILT_RAD, Layout, NumberField, SampleSpec, SensorDecoder,
        SensorSample, ValueSource, number_fields,
    },
    file::{FileTransfer, Format, ReadOptions, read_options, set_read_options},
    formats::CanFrameType,
    log::{CanTopic, Log},
    message::{
        BindingError, DefinitionSource, Error, Integrity, Losses, LostPart, LostRange, RawMessage,
        SensorKind, Topic, TopicId, TopicWriter,
    },
    schema::{CDR, FieldPath, SchemaError, known_definition},
    table::{DateOrder, TableOptions, TimeUnit},
    topics::{
        Binding, FieldContents, JointNamedTwice, JointTopic, MetadataRecord, NamedTopics,
        RobotDescription, SensorTopics, StaticFrame, TopicContents, bind, bind_joint_states,
        first_frame, joint_names_in, metadata_records, robot_descriptions, static_frames,
        topic_contents, topic_of_field,
    },
    write::{
        ClipReport, ClipRequest, RecoverError, RecoveryReport, Ros2Writer, WriteError, WriterTopic,
        recover, recover_with, write_clips,
    },
};
