//! What is on the wire: the two services, their names and queue sizes, and the layout of their
//! messages.
//!
//! | service | message | who writes | settings |
//! |---|---|---|---|
//! | `NAME/session` | [`WireSession`] | one replay, once | the latest is kept for late joiners |
//! | `NAME/samples` | [`WireSample`] | one replay | [`SAMPLE_QUEUE`] samples for each reader, no overwriting |
//!
//! The queue of samples never overwrites: with a full queue it is the writer that decides, so that
//! lossless and lossy replays share one service. A lossless writer sends the sample again until there
//! is room; a lossy one discards it for that reader, who sees the gap in the sequence numbers.
//!
//! iceoryx2 compares names, sizes and alignments of types. The attribute [`LAYOUT_ATTRIBUTE`] of each
//! service also compares names and places of the fields.

use iceoryx2::prelude::ZeroCopySend;

use crate::fnv::Fnv;

/// The name of the services unless another is asked for.
pub const DEFAULT_SERVICE: &str = "tipwatch";
/// What follows the name in the service of samples.
pub const SAMPLES_SUFFIX: &str = "/samples";
/// What follows the name in the service of sessions.
pub const SESSION_SUFFIX: &str = "/session";
/// How many unread samples a reader may have: 1 s at 500 samples a second.
pub const SAMPLE_QUEUE: usize = 512;
/// How many unread sessions a reader may have, and how many a late joiner gets.
pub const SESSION_QUEUE: usize = 1;
/// Writers of a service: two would mix their samples.
pub const MAX_WRITERS: usize = 1;
/// Readers of a service.
pub const MAX_READERS: usize = 8;
/// Messages that a reader looks at at once.
pub const MAX_BORROWED: usize = 2;
/// Processes that may have a service open.
pub const MAX_NODES: usize = 20;
/// Name of the attribute that holds the hash of the layout.
pub const LAYOUT_ATTRIBUTE: &str = "layout";

/// Values that a sample has room for.
pub const MAX_VALUES: usize = 128;
/// Joints that a session has room for: a position and a rate each.
pub const MAX_JOINTS: usize = MAX_VALUES / 2;
/// Bytes of a name on the wire, the closing zero included.
pub const NAME_BYTES: usize = 64;

/// A message type whose layout both ends must agree on.
pub trait Wire: ZeroCopySend + std::fmt::Debug + Copy + 'static {
    /// FNV-1a over name, place and size of each field.
    const LAYOUT: u64;
}

/// Defines the struct of a message, and the hash of its layout.
macro_rules! wire {
    ($(#[$on_type:meta])* pub struct $name:ident { $($(#[$on_field:meta])* pub $field:ident: $type:ty,)* }) => {
        $(#[$on_type])*
        pub struct $name { $($(#[$on_field])* pub $field: $type,)* }

        impl Wire for $name {
            const LAYOUT: u64 = Fnv::new()
                $(.bytes(stringify!($field).as_bytes())
                    .number(std::mem::offset_of!($name, $field) as u64)
                    .number(size_of::<$type>() as u64))*
                .finish();
        }

        // Without padding every byte that is shared is initialised.
        const _: () = assert!(size_of::<$name>() == 0 $(+ size_of::<$type>())*);
    };
}

wire! {
    /// One message of one sensor.
    #[repr(C)]
    #[derive(Debug, Clone, Copy, ZeroCopySend)]
    #[type_name("tipwatch.SensorSample.v1")]
    pub struct WireSample {
        /// Counts the samples of a session from zero: a jump is a loss.
        pub sequence: u64,
        /// The session that it belongs to.
        pub session: u64,
        /// When it was measured, in nanoseconds, by the clock that was chosen for the sensor.
        pub stamp_ns: i64,
        /// When the recorder received it, in nanoseconds.
        pub log_time_ns: i64,
        /// Which kind of sensor: see [`Kind`].
        pub kind: u32,
        /// Which stream of this kind.
        pub stream: u32,
        /// How many of the values it has.
        pub value_count: u32,
        /// Zero.
        pub reserved: u32,
        /// The values, as `tipwatch_mechanics::signal::Sample` orders them; zero beyond their count.
        pub values: [f64; MAX_VALUES],
    }
}

wire! {
    /// What a reader must know before the first sample.
    #[repr(C)]
    #[derive(Debug, Clone, Copy, ZeroCopySend)]
    #[type_name("tipwatch.Session.v2")]
    pub struct WireSession {
        /// Tells this session from every other one.
        pub session: u64,
        /// Hash of machine file and URDF.
        pub machine_hash: u64,
        /// Samples of the session, the end not counted.
        pub total_samples: u64,
        /// How many joints there are in all streams.
        pub joint_count: u32,
        /// How many streams of joint states there are.
        pub stream_count: u32,
        /// One where there is an IMU.
        pub has_imu: u32,
        /// One where there is odometry.
        pub has_odometry: u32,
        /// One where the tool wrench is measured.
        pub has_tool_wrench: u32,
        /// A bit for each of the machine's actuated joints whose force is measured.
        pub actuated_joints: u32,
        /// The frame that the IMU names; empty where it names none.
        pub imu_frame: [u8; NAME_BYTES],
        /// The stream of each joint, ascending.
        pub joint_streams: [u32; MAX_JOINTS],
        /// The name of each joint, in the order of its stream's values.
        pub joint_names: [[u8; NAME_BYTES]; MAX_JOINTS],
    }
}

/// [`WireSample::kind`] as an enumeration; the numbers are part of the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// Joint states.
    Joints = 1,
    /// The inertial measurement unit.
    Imu = 2,
    /// Odometry.
    Odometry = 3,
    /// The tool wrench.
    ToolWrench = 4,
    /// No sensor: the session is over. Its sequence number is the number of samples.
    End = 5,
    /// A signal of an actuator's force.
    Actuator = 6,
}

impl TryFrom<u32> for Kind {
    type Error = u32;

    fn try_from(number: u32) -> Result<Self, u32> {
        [
            Self::Joints,
            Self::Imu,
            Self::Odometry,
            Self::ToolWrench,
            Self::End,
            Self::Actuator,
        ]
        .into_iter()
        .find(|&kind| kind as u32 == number)
        .ok_or(number)
    }
}
