//! What is on the wire: the services, their names and queue sizes, and the layout of their messages.
//!
//! | service | message | who writes | queue of each reader |
//! |---|---|---|---|
//! | `NAME/session` | [`WireSession`] | one producer, once | the latest, for late joiners too |
//! | `NAME/samples` | [`WireSample`] | one producer | [`SAMPLE_QUEUE`] |
//! | `NAME/machine` | [`WireMachine`] | one monitor, once a session | the latest, for late joiners too |
//! | `NAME/verdict` | [`WireVerdict`] | one monitor | [`VERDICT_QUEUE`] |
//! | `NAME/command` | [`WireCommand`] | one control | [`COMMAND_QUEUE`] |
//! | `NAME/acknowledge` | [`WireAcknowledge`] | operators | [`ACKNOWLEDGE_QUEUE`] |
//! | `NAME/progress` | [`WireProgress`] | readers of a replay's samples | [`PROGRESS_QUEUE`] |
//!
//! `NAME/samples`, `NAME/verdict` and `NAME/command` also are services of events, sent after a message to whoever
//! wants to be woken. Every queue overwrites what is oldest: a reader that sleeps, hangs or has died
//! loses messages, and sees it by their sequence numbers; nobody waits for it. A replay that must not
//! lose anything goes by what its readers say on `NAME/progress`.
//!
//! iceoryx2 compares names, sizes and alignments of types. The attribute [`LAYOUT_ATTRIBUTE`] of each
//! service also compares names and places of the fields.

use iceoryx2::prelude::ZeroCopySend;
use tipwatch_mechanics::machine::MAX_WHEELS;
use tipwatch_mechanics::{quantity_doc, verdict_quantities};
use tipwatch_suspension::MAX_ACTUATORS;

use crate::wire::hash::Fnv1a;
pub use crate::wire::message::{Field, FieldType, Head, MAGIC, Wire};
use crate::wire::message::{own_checksum, wire};

/// The name of the services unless another is asked for.
pub const DEFAULT_SERVICE: &str = "tipwatch";
/// What follows the name in the service of sessions.
pub const SESSION_SUFFIX: &str = "/session";
/// What follows the name in the service of samples.
pub const SAMPLES_SUFFIX: &str = "/samples";
/// What follows the name in the service of machines.
pub const MACHINE_SUFFIX: &str = "/machine";
/// What follows the name in the service of verdicts.
pub const VERDICT_SUFFIX: &str = "/verdict";
/// What follows the name in the service of commands.
pub const COMMAND_SUFFIX: &str = "/command";
/// What follows the name in the service of acknowledgements.
pub const ACKNOWLEDGE_SUFFIX: &str = "/acknowledge";
/// What follows the name in the service of progress.
pub const PROGRESS_SUFFIX: &str = "/progress";

/// Unread samples of a reader: 2 s of a sensor at 1 kHz.
pub const SAMPLE_QUEUE: usize = 2048;
/// Unread verdicts of a reader: 2 s at 1 kHz.
pub const VERDICT_QUEUE: usize = 2048;
/// Unread commands of a reader: 2 s at 1 kHz.
pub const COMMAND_QUEUE: usize = 2048;
/// Unread sessions and machines of a reader, and how many a late joiner gets.
pub const LATEST: usize = 1;
/// Unread acknowledgements of the monitor.
pub const ACKNOWLEDGE_QUEUE: usize = 16;
/// Unread reports of progress of a replay.
pub const PROGRESS_QUEUE: usize = 256;
/// Writers of a service that has one: two would mix their messages.
pub const ONE_WRITER: usize = 1;
/// Readers of a service, and writers of one that has many.
pub const MAX_READERS: usize = 8;
/// Messages that a reader looks at at once.
pub const MAX_BORROWED: usize = 2;
/// Processes that may have a service open.
pub const MAX_NODES: usize = 24;
/// Name of the attribute that holds the hash of the layout.
pub const LAYOUT_ATTRIBUTE: &str = "layout";

/// Values that a sample has room for.
pub const MAX_VALUES: usize = 128;
/// Joints that a session has room for: a position and a rate each.
pub const MAX_JOINTS: usize = MAX_VALUES / 2;
/// Bytes of a name on the wire, the closing zero included.
pub const NAME_BYTES: usize = 64;
/// Wheels, and edges between them, that a verdict has room for.
pub const MAX_PLACES: usize = MAX_WHEELS;
/// Causes that a verdict tells.
pub const CAUSES: usize = tipwatch_mechanics::Contribution::ALL.len();

wire! {
    /// One message of one sensor.
    "tipwatch.Sample.v2"
    pub struct WireSample {
        /// When the recorder of a replayed log received it (ns); 0 from a machine.
        pub log_time_ns: i64,
        /// Which kind of sensor: joints 1, IMU 2, odometry 3, tool wrench 4, end of the session 5, signal
        /// of an actuator 6.
        pub kind: u32,
        /// Which stream of this kind.
        pub stream: u32,
        /// How many of the values it has.
        pub value_count: u32,
        /// Zero.
        pub reserved: u32,
        /// Joints: positions (rad, m), then rates, NaN where unknown. IMU: specific force (m/s2), angular
        /// velocity (rad/s), attitude x y z w or NaN. Odometry: velocity (m/s), angular velocity, attitude.
        /// Tool wrench: force (N), moment (N m) by the surroundings on the tool. Actuator: its
        /// force (N) or a pressure (Pa). Zero beyond their count.
        pub values: [f64; MAX_VALUES],
    }
}

wire! {
    /// What a reader must know before the first sample. Its source is the session's identity.
    "tipwatch.Session.v2"
    pub struct WireSession {
        /// Samples of the session, the end not counted; 0 where nobody knows.
        pub total_samples: u64,
        /// How many times as fast as real time the sensors' clock runs: 1 on a machine; 0 where it has
        /// nothing to do with real time (a replay as fast as possible).
        pub pace: f64,
        /// How many joints there are in all streams.
        pub joint_count: u32,
        /// How many streams of joint states there are; the first is the fastest: it makes the rows.
        pub stream_count: u32,
        /// One where there is an IMU.
        pub has_imu: u32,
        /// One where there is odometry.
        pub has_odometry: u32,
        /// One where the tool wrench is measured.
        pub has_tool_wrench: u32,
        /// One where readers are to report their progress.
        pub wants_progress: u32,
        /// A bit for each of the machine's actuated joints whose force is measured.
        pub actuated_joints: u32,
        /// Zero.
        pub reserved: u32,
        /// The frame that the IMU names; empty where it names none.
        pub imu_frame: [u8; NAME_BYTES],
        /// The stream of each joint, ascending.
        pub joint_streams: [u32; MAX_JOINTS],
        /// The name of each joint, in the order of its stream's values.
        pub joint_names: [[u8; NAME_BYTES]; MAX_JOINTS],
    }
}

wire! {
    /// What a reader of verdicts must know of the machine.
    "tipwatch.Machine.v1"
    pub struct WireMachine {
        /// The session that the monitor follows.
        pub session: u64,
        /// Utilisation of the levels notice, warning and danger.
        pub limits: [f64; 3],
        /// How many wheels there are.
        pub wheel_count: u32,
        /// How many edges the support polygon has.
        pub edge_count: u32,
        /// Name of the machine.
        pub name: [u8; NAME_BYTES],
        /// Names of the wheels, in lower case.
        pub wheel_names: [[u8; NAME_BYTES]; MAX_PLACES],
        /// Names of the edges, in lower case.
        pub edge_names: [[u8; NAME_BYTES]; MAX_PLACES],
    }
}

/// The verdict: its numbers, their order and their meaning come from the table of quantities.
macro_rules! verdict_message {
    (
        worst_wheel { $($worst:ident: $worst_of:ident),* $(,)? }
        machine { $($one:ident: $one_of:ident),* $(,)? }
        wheel { $($wheel:ident: $wheel_of:ident),* $(,)? }
        cause_and_wheel { $($cause:ident: $cause_of:ident),* $(,)? }
        edge { $($edge:ident: $edge_of:ident),* $(,)? }
    ) => {
        wire! {
            /// The verdict: how close the machine is to tipping. A number that cannot be computed is NaN.
            /// Consumers must treat a verdict past valid_until_ns as a fault.
            "tipwatch.Verdict.v1"
            pub struct WireVerdict {
                /// Time until which it may be acted on (ns), by CLOCK_MONOTONIC.
                pub valid_until_ns: i64,
                /// The session that the monitor follows; 0 without one.
                pub session: u64,
                /// Sequence number of the sample that completed the row.
                pub sample_sequence: u64,
                /// Publication time of that sample (ns), by CLOCK_MONOTONIC.
                pub sample_published_ns: i64,
                /// Rows so far.
                pub rows: u64,
                /// Samples that never arrived.
                pub lost: u64,
                /// Samples that arrived but could not be used.
                pub refused: u64,
                /// Samples that arrived again.
                pub repeated: u64,
                /// 1 a row; 2 between rows: the numbers are those of the last row.
                pub event: u32,
                /// Current level: 0 unknown, 1 safe, 2 notice, 3 warning, 4 danger, 5 fault.
                pub level: u32,
                /// Level to act on: danger stays until it has ended and was acknowledged.
                pub latched_level: u32,
                /// Bits: faults of the input since the last row.
                pub faults: u32,
                /// Bits: cautions of the input since the last row.
                pub cautions: u32,
                /// Bits: why the row is not valid.
                pub reasons: u32,
                /// 1 if an acknowledgement arrived since the last row.
                pub acknowledged: u32,
                /// 1 if real time was not checked: the samples are replayed as fast as possible.
                pub untimed: u32,
                /// Index of the wheel that lifts next; meaningless if the time is NaN.
                pub next_wheel: u32,
                /// Number of wheels.
                pub wheel_count: u32,
                /// Number of edges of the support polygon.
                pub edge_count: u32,
                /// Zero.
                pub reserved: u32,
                $(#[doc = quantity_doc!($worst_of)] pub $worst: f64,)*
                /// Time until the next wheel lifts if its load keeps falling at its present rate (s); NaN beyond 5 s.
                pub time_to_lift_off_s: f64,
                $(#[doc = quantity_doc!($one_of)] pub $one: f64,)*
                $(#[doc = concat!(quantity_doc!($wheel_of), ", by wheel")] pub $wheel: [f64; MAX_PLACES],)*
                $(
                    #[doc = concat!(quantity_doc!($cause_of), ", by cause and wheel: chassis_weight,")]
                    /// wheel_weight, arm_weight, slope, arm_motion, platform_acceleration, cornering, tool_force,
                    /// warp, lift_off, specific_force
                    pub $cause: [[f64; MAX_PLACES]; CAUSES],
                )*
                $(#[doc = concat!(quantity_doc!($edge_of), ", by edge")] pub $edge: [f64; MAX_PLACES],)*
            }
        }
    };
}
verdict_quantities!(verdict_message);

wire! {
    /// What the valves of the suspension should do. Whoever drives them closes them where it is past
    /// valid_until_ns. By actuator, in the order of the machine file's suspension.linkages.
    "tipwatch.Command.v1"
    pub struct WireCommand {
        /// Until when it may be acted on (ns), by CLOCK_MONOTONIC.
        pub valid_until_ns: i64,
        /// The session that the control follows; 0 where there is none.
        pub session: u64,
        /// Sequence number of the sample that made the row.
        pub sample_sequence: u64,
        /// When that sample was published (ns), by CLOCK_MONOTONIC.
        pub sample_published_ns: i64,
        /// Sequence number of the last verdict that the control has seen.
        pub verdict_sequence: u64,
        /// Rows so far.
        pub rows: u64,
        /// A row 1; between rows 2.
        pub event: u32,
        /// What the valves do: hold closed 0, ramp to closed 1, follow 2.
        pub mode: u32,
        /// Why they do not follow, as bits.
        pub reasons: u32,
        /// How the stabiliser found its last command: not asked 0, optimal 1, work limit 2, margin lost 3,
        /// step too short 4, outside limits 5, no solution 6, position unknown 7.
        pub status: u32,
        /// Level of the last verdict that the control has seen.
        pub level: u32,
        /// How many actuators there are.
        pub actuator_count: u32,
        /// Iterations of the search.
        pub iterations: u32,
        /// How many motions of the suspension were looked at.
        pub evaluations: u32,
        /// Opening of the valve, -1 to 1, positive where the rod is to go out.
        pub opening: [f64; MAX_ACTUATORS],
        /// Measured position of the rod (m).
        pub measured: [f64; MAX_ACTUATORS],
        /// Where the rod should be now (m); NaN where the valves do not follow.
        pub reference: [f64; MAX_ACTUATORS],
        /// How fast it should go (m/s); NaN where the valves do not follow.
        pub velocity: [f64; MAX_ACTUATORS],
        /// The optimum: where the rod is led (m), in literal mode its acceleration (m/s2).
        pub target: [f64; MAX_ACTUATORS],
        /// Cost (30) of the best point found; NaN where no problem was solved.
        pub cost: f64,
    }
}

wire! {
    /// Somebody has seen the alarm.
    "tipwatch.Acknowledge.v1"
    pub struct WireAcknowledge {
        /// The verdict that was seen.
        pub verdict_sequence: u64,
    }
}

wire! {
    /// How far a reader of samples is. Its source is the session that it reads.
    "tipwatch.Progress.v1"
    pub struct WireProgress {
        /// The reader's identity in iceoryx2, the lower half.
        pub reader_low: u64,
        /// The upper half.
        pub reader_high: u64,
        /// The sequence number of the next sample that it wants; the largest number where it has had none.
        pub next: u64,
    }
}

/// A service that carries a message type: its name and settings.
pub trait Topic: Wire {
    /// What follows the common name.
    const SUFFIX: &'static str;
    /// Unread messages of each reader.
    const QUEUE: usize;
    /// Whether late joiners get what was sent last.
    const IS_KEPT: bool;
    /// How many may write.
    const WRITERS: usize;
}

/// A message that consumers may act on for a limited time.
pub trait Expiring: Topic {
    /// Sets the end of that time (ns), by CLOCK_MONOTONIC.
    fn set_valid_until(&mut self, valid_until_ns: i64);
}

impl Expiring for WireVerdict {
    fn set_valid_until(&mut self, valid_until_ns: i64) {
        self.valid_until_ns = valid_until_ns;
    }
}

impl Expiring for WireCommand {
    fn set_valid_until(&mut self, valid_until_ns: i64) {
        self.valid_until_ns = valid_until_ns;
    }
}

macro_rules! topic {
    ($type:ty, $suffix:expr, $queue:expr, $is_kept:expr, $writers:expr) => {
        impl Topic for $type {
            const SUFFIX: &'static str = $suffix;
            const QUEUE: usize = $queue;
            const IS_KEPT: bool = $is_kept;
            const WRITERS: usize = $writers;
        }
    };
}

topic!(WireSession, SESSION_SUFFIX, LATEST, true, ONE_WRITER);
topic!(WireSample, SAMPLES_SUFFIX, SAMPLE_QUEUE, false, ONE_WRITER);
topic!(WireMachine, MACHINE_SUFFIX, LATEST, true, ONE_WRITER);
topic!(
    WireVerdict,
    VERDICT_SUFFIX,
    VERDICT_QUEUE,
    false,
    ONE_WRITER
);
topic!(
    WireCommand,
    COMMAND_SUFFIX,
    COMMAND_QUEUE,
    false,
    ONE_WRITER
);
topic!(
    WireAcknowledge,
    ACKNOWLEDGE_SUFFIX,
    ACKNOWLEDGE_QUEUE,
    false,
    MAX_READERS
);
topic!(
    WireProgress,
    PROGRESS_SUFFIX,
    PROGRESS_QUEUE,
    false,
    MAX_READERS
);

/// [`WireVerdict::event`]: a row.
pub const EVENT_ROW: u32 = tipwatch_binding::monitor_topic::EVENT_ROW;
/// [`WireVerdict::event`]: between rows.
pub const EVENT_BETWEEN: u32 = 2;

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
