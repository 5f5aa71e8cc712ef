//! The services on the wire: their names, queue sizes and message layouts.
//!
//! | service | message | writer | queue of each reader |
//! |---|---|---|---|
//! | `NAME/session` | [`WireSession`] | one producer, once | the latest, also for late joiners |
//! | `NAME/samples` | [`WireSample`] | one producer | [`SAMPLE_QUEUE`] |
//! | `NAME/machine` | [`WireMachine`] | one monitor, once per session | the latest, also for late joiners |
//! | `NAME/verdict` | [`WireVerdict`] | one monitor | [`VERDICT_QUEUE`] |
//! | `NAME/command` | [`WireCommand`] | one control | [`COMMAND_QUEUE`] |
//! | `NAME/acknowledge` | [`WireAcknowledge`] | operators | [`ACKNOWLEDGE_QUEUE`] |
//! | `NAME/progress` | [`WireProgress`] | readers of a replay's samples | [`PROGRESS_QUEUE`] |
//!
//! `NAME/samples`, `NAME/verdict` and `NAME/command` are event services too: each message notifies the
//! listeners. A full queue overwrites its oldest message: a reader that sleeps, hangs or has died loses
//! messages and notices it by their sequence numbers. No writer waits for it. A lossless replay waits by
//! the progress that readers report on `NAME/progress`.
//!
//! iceoryx2 compares names, sizes and alignments of types. The attribute [`LAYOUT_ATTRIBUTE`] of each
//! service adds names and offsets of the fields.

use iceoryx2::prelude::ZeroCopySend;
use tipwatch_mechanics::machine::MAX_WHEELS;
use tipwatch_mechanics::state::NumberKind;
use tipwatch_mechanics::{quantity_doc, verdict_quantities};
use tipwatch_suspension::MAX_ACTUATORS;

use crate::wire::hash::Fnv1a;
pub use crate::wire::message::{Field, FieldType, Head, MAGIC, Wire};
use crate::wire::message::{own_checksum, wire};

/// Default name of the services.
pub const DEFAULT_SERVICE: &str = "tipwatch";
/// Suffix of the service of sessions.
pub const SESSION_SUFFIX: &str = "/session";
/// Suffix of the service of samples.
pub const SAMPLES_SUFFIX: &str = "/samples";
/// Suffix of the service of machines.
pub const MACHINE_SUFFIX: &str = "/machine";
/// Suffix of the service of verdicts.
pub const VERDICT_SUFFIX: &str = "/verdict";
/// Suffix of the service of commands.
pub const COMMAND_SUFFIX: &str = "/command";
/// Suffix of the service of refusals.
pub const REFUSAL_SUFFIX: &str = "/refusal";
/// Suffix of the service of acknowledgements.
pub const ACKNOWLEDGE_SUFFIX: &str = "/acknowledge";
/// Suffix of the service of progress.
pub const PROGRESS_SUFFIX: &str = "/progress";

/// Unread samples of a reader: 2 s of a sensor at 1 kHz.
pub const SAMPLE_QUEUE: usize = 2048;
/// Unread verdicts of a reader: 2 s at 1 kHz.
pub const VERDICT_QUEUE: usize = 2048;
/// Unread commands of a reader: 2 s at 1 kHz.
pub const COMMAND_QUEUE: usize = 2048;
/// Unread sessions or machines of a reader, and the number that a late joiner receives.
pub const LATEST: usize = 1;
/// Unread acknowledgements of the monitor.
pub const ACKNOWLEDGE_QUEUE: usize = 16;
/// Unread reports of progress of a replay.
pub const PROGRESS_QUEUE: usize = 256;
/// Writers of a service with a single writer: two would mix their messages.
pub const ONE_WRITER: usize = 1;
/// Maximum number of readers of a service, and of writers of one with several.
pub const MAX_READERS: usize = 12;
/// Of these the last are kept for monitor, control, recorder and acknowledgement: whoever else finds no more places than
/// these is refused, so that a restarted monitor always has one.
pub const RESERVED_READERS: usize = 4;
/// Messages that a reader may hold at a time.
pub const MAX_BORROWED: usize = 2;
/// Nodes that may have a service open.
pub const MAX_NODES: usize = 36;
/// Whether a full buffer overwrites its oldest message: a writer never waits for a reader.
pub const SAFE_OVERFLOW: bool = true;
/// Name of the attribute with the hash of the layout.
pub const LAYOUT_ATTRIBUTE: &str = "layout";

/// Maximum number of values of a sample.
pub const MAX_VALUES: usize = 128;
/// Maximum number of joints of a session: each has a position and a velocity.
pub const MAX_JOINTS: usize = MAX_VALUES / 2;
/// Maximum number of load sensors of a session: one bit each.
pub const MAX_LOAD_SENSORS: usize = 32;
/// Maximum number of forces of the arm that have a name and a bit of their own.
pub const MAX_ARM_FORCES: usize = 32;
/// Bytes of a name on the wire, including the terminating zero.
pub const NAME_BYTES: usize = 64;
/// Bytes of a text on the wire, including the terminating zero.
pub const TEXT_BYTES: usize = 512;
/// Maximum number of wheels, and of edges of the support polygon.
pub const MAX_PLACES: usize = MAX_WHEELS;
/// Number of assumed motions by which a verdict predicts.
pub const LAWS: usize = tipwatch_mechanics::prediction::Law::ALL.len();
/// Number of load contributions in a verdict.
pub const CAUSES: usize = tipwatch_mechanics::Contribution::ALL.len();

wire! {
    /// One message of one sensor.
    "tipwatch.Sample.v3"
    pub struct WireSample {
        /// Time at which the recorder of a replayed log received it (ns); 0 from a machine.
        pub log_time_ns: i64,
        /// Kind of sensor: 1 joints, 2 IMU, 3 odometry, 4 tool wrench, 5 end of the session, 6 actuator
        /// signal, 7 signal that tells whether supports are set or raised, 8 load sensor, 9 rate that
        /// is asked of a joint, 10 signal that tells the mass of a payload, 11 signal of a force of the arm.
        pub kind: u32,
        /// Index of the stream among those of its kind.
        pub stream: u32,
        /// Number of values.
        pub value_count: u32,
        /// Zero.
        pub reserved: u32,
        /// Joints: positions (rad, m), then velocities (rad/s, m/s), NaN if unknown. IMU: specific force
        /// (m/s2), angular velocity (rad/s), attitude as quaternion x y z w or NaN. Odometry: velocity
        /// (m/s), angular velocity, attitude. Tool wrench: force (N) and moment (N m) of the environment
        /// on the tool. Actuator: force (N) or pressure (Pa). Signal of supports: the number that the machine file binds, on from
        /// its threshold on; it is to be sent again before it is older than the machine file allows. Load sensor: its load (N). Rate that a
        /// controller asks of a joint (rad/s, m/s), NaN while it asks for nothing. Force of the arm: force (N) or pressure (Pa), as of an
        /// actuator. Zero beyond value_count.
        pub values: [f64; MAX_VALUES],
    }
}

wire! {
    /// What a reader must know before the first sample. Its source identifies the session.
    "tipwatch.Session.v6"
    pub struct WireSession {
        /// Samples of the session without the end message; 0 if unknown.
        pub total_samples: u64,
        /// Speed of the sensors' clock relative to real time: 1 on a machine; 0 if unrelated to real time
        /// (a replay as fast as possible), which the monitor accepts only with --allow-untimed and the control never.
        pub pace: f64,
        /// A time of the sensors' clock (ns), to which clock_host_ns belongs: a sample with the stamp time_ns was
        /// measured at clock_host_ns + (time_ns - clock_stamp_ns) / pace. Unused if pace is 0.
        pub clock_stamp_ns: i64,
        /// The same instant by this computer's CLOCK_MONOTONIC (ns). A producer whose stamps are CLOCK_MONOTONIC sets
        /// both fields to the same time; with stamps in Unix time it reads both clocks when it announces the session.
        pub clock_host_ns: i64,
        /// Number of joints in all streams.
        pub joint_count: u32,
        /// Number of streams of joint states. The first is the fastest: each of its samples completes a row.
        pub stream_count: u32,
        /// 1 if there is an IMU.
        pub has_imu: u32,
        /// 1 if there is odometry.
        pub has_odometry: u32,
        /// 1 if the tool wrench is measured.
        pub has_tool_wrench: u32,
        /// 1 if readers must report their progress.
        pub wants_progress: u32,
        /// Bits: the machine's actuated joints whose force is measured, and its supports whose load is, behind them.
        pub actuated_joints: u32,
        /// Bits: the signals that tell whether supports are set or raised. Supports sort by name; signals are numbered by the
        /// first support of each.
        pub switches: u32,
        /// Bits: the machine's load sensors. Those of [signals.wheels] sort by name; [[signals.load_sums]] follow in their order.
        pub load_sensors: u32,
        /// Bits: the joints of [signals.joints] with a command, numbered by name among these. A joint without one, and one whose
        /// command is too old, is predicted to go on as it moves.
        pub joint_commands: u32,
        /// Bits: the signals that tell masses of payloads, numbered in the order of the payloads in the machine file: the one of a
        /// stated mass; of an estimated one the force, or the pressures at piston and rod, of the first linkage that lifts it,
        /// each numbered once.
        pub payload_signals: u32,
        /// Bits: the signals of the forces of the arm, by which nothing is computed, and which are compared with what masses and motion
        /// require: by linkage in the order of the machine file, the force, or the pressures at piston and rod, of each that binds
        /// them, carries no wheels and carries no payload of unknown mass.
        pub force_signals: u32,
        /// frame_id of the IMU; empty if it has none.
        pub imu_frame: [u8; NAME_BYTES],
        /// Stream of each joint, ascending.
        pub joint_streams: [u32; MAX_JOINTS],
        /// Name of each joint, in the order of its stream's values.
        pub joint_names: [[u8; NAME_BYTES]; MAX_JOINTS],
    }
}

wire! {
    /// What a reader of verdicts must know about the machine, and about the monitor that computes them.
    "tipwatch.Machine.v8"
    pub struct WireMachine {
        /// The session that the monitor follows.
        pub session: u64,
        /// Bits: the joints that slide, with positions in m; those of others are in rad.
        pub sliding_joints: u64,
        /// Utilisation at which the levels notice, warning and danger begin.
        pub limits: [f64; 3],
        /// Number of wheels.
        pub wheel_count: u32,
        /// Number of edges of the support polygon.
        pub edge_count: u32,
        /// Number of joints.
        pub joint_count: u32,
        /// Number of signals that failed visibly in a session before, and that the session begins by doubting.
        pub doubted_count: u32,
        /// Number of load sensors.
        pub load_sensor_count: u32,
        /// Number of joints whose position in a session before is compared with the first one.
        pub known_count: u32,
        /// Number of forces of the arm.
        pub arm_force_count: u32,
        /// Zero.
        pub reserved: u32,
        /// Name of the machine.
        pub name: [u8; NAME_BYTES],
        /// Names of the wheels, in lower case: of all supports, on the ground or not, where these come and go.
        pub wheel_names: [[u8; NAME_BYTES]; MAX_PLACES],
        /// Names of the edges, in lower case. A machine whose supports come and go has none: the verdict tells where they are.
        pub edge_names: [[u8; NAME_BYTES]; MAX_PLACES],
        /// Names of the joints, in the order of the bits of the verdict's unproven.
        pub joint_names: [[u8; NAME_BYTES]; MAX_JOINTS],
        /// Names of the load sensors, in the order of the bits of the session.
        pub load_sensor_names: [[u8; NAME_BYTES]; MAX_LOAD_SENSORS],
        /// Names of the linkages with a force of the arm, in the order of the bits of the verdict's doubted_forces.
        pub arm_force_names: [[u8; NAME_BYTES]; MAX_ARM_FORCES],
        /// Which signals these are: 0 specific force, 1 angular velocity, 8 + k: joint k of the machine.
        pub doubted_signals: [u32; MAX_JOINTS],
        /// By how much each is off (rad, m, m/s2), as far as was seen; 0 of a joint that stopped to be measured.
        pub doubted_by: [f64; MAX_JOINTS],
        /// What of that may be motion (same unit). Of a joint that stopped to be measured: its velocity then (rad/s, m/s). Infinite
        /// where the lean of the platform has contradicted that the joint stood still, and minus infinity where the joint does not
        /// show what its controller asks; it may have another doubt beside that.
        pub doubted_moved: [f64; MAX_JOINTS],
        /// Which joints of the machine these are.
        pub known_joints: [u32; MAX_JOINTS],
        /// When each was there (whole microseconds), by the sensors' clock of this session.
        pub known_stamps_us: [f64; MAX_JOINTS],
        /// Where it was (rad, m).
        pub known_positions: [f64; MAX_JOINTS],
        /// Least position at which the bound commissioning has proven each joint (rad, m); NaN where it has not.
        pub commissioned_from: [f64; MAX_JOINTS],
        /// Greatest position at which it has.
        pub commissioned_to: [f64; MAX_JOINTS],
        /// Version of the monitor; empty, and all hashes zero, if it did not state what it is.
        pub version: [u8; NAME_BYTES],
        /// SHA-256 of the monitor's executable.
        pub program_sha256: [u8; 32],
        /// SHA-256 of the whole text of its options.
        pub options_sha256: [u8; 32],
        /// SHA-256 of the machine file.
        pub machine_sha256: [u8; 32],
        /// SHA-256 of the URDF.
        pub urdf_sha256: [u8; 32],
        /// SHA-256 of the result of the machine's commissioning; zero without one.
        pub commissioning_sha256: [u8; 32],
        /// The monitor's arguments as a JSON array, cut if they are too long.
        pub options: [u8; TEXT_BYTES],
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
            "tipwatch.Verdict.v8"
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
                /// Sequence number of the first verdict of this source that carries the latched alarm. An
                /// acknowledgement must name this verdict or a later one. Meaningless without an alarm.
                pub alarm_sequence: u64,
                /// The announced session that the monitor refuses; 0 if none.
                pub refused_session: u64,
                /// Bits: what the loads hang on that nothing has proven. Bits 0 to 7: specific force, angular velocity,
                /// odometry, tool wrench, actuator forces, ground, masses of payloads, which supports are on the ground; bit
                /// 8 + k: joint k of the machine. Without any, and without a doubt, the basis is proven.
                pub unproven: u64,
                /// Bits, as in unproven: signals that failed visibly, such as a joint that jumped where it cannot have moved, or
                /// that does not show what its controller asks, in this session or before. They are doubted until they are back, or
                /// somebody acknowledges them.
                pub doubted: u64,
                /// Bits: the signals that somebody has acknowledged since the last row, and that are trusted again. One that was refused,
                /// because it still repeats one value, is not among them and stays in doubted.
                pub acknowledged_signals: u64,
                /// Bits: the joints of the machine whose command is known: the prediction moves them by it.
                pub commanded: u64,
                /// 1 a row; 2 between rows: the numbers are those of the last row.
                pub event: u32,
                /// Current level: 0 unknown, 1 safe, 2 notice, 3 warning, 4 danger, 5 fault, 6 assumed: no danger is seen, but
                /// the sensors are not proven.
                pub level: u32,
                /// Level to act on: danger, and a failure of the model (fault), stay until they are over and were
                /// acknowledged, over the end of a session and a restart of the monitor.
                pub latched_level: u32,
                /// What the level stands on: 0 doubted, 1 assumed, 2 proven.
                pub basis: u32,
                /// Bits: faults of the input since the last row.
                pub faults: u32,
                /// Bits: cautions of the input since the last row.
                pub cautions: u32,
                /// Bits: why the row is not valid.
                pub reasons: u32,
                /// Bits: faults behind the level. A level outlasts its causes.
                pub held_faults: u32,
                /// Bits: cautions behind the level.
                pub held_cautions: u32,
                /// Bits: reasons of the rows behind a level of fault.
                pub held_reasons: u32,
                /// 1 if an acknowledgement of the latched alarm arrived since the last row.
                pub acknowledged: u32,
                /// 1 if real time was not checked: the samples are replayed as fast as possible.
                pub untimed: u32,
                /// Index of the wheel that lifts next; meaningless if the time is NaN.
                pub next_wheel: u32,
                /// Number of wheels.
                pub wheel_count: u32,
                /// Number of edges of the support polygon: around the supports that are on the ground.
                pub edge_count: u32,
                /// Bits: the wheels that are on the ground as supports; none while these are unknown. The others have no numbers. All
                /// but where supports come and go.
                pub standing: u32,
                /// Why it is unknown which supports are on the ground; 0 if it is known. 1 the weight passes from some to others,
                /// 2 the machine cannot stand on what is told, 3 they are known, but in its reference posture it would not stand on them: U is unknown,
                /// 16 + k: the signal that tells of wheel k is missing or too old,
                /// 32 + k: wheel k is told to be off the ground while its own sensor measures a load.
                pub ground_gap: u32,
                /// Index of the wheel where each edge begins, counter-clockwise seen from above.
                pub edge_from: [u32; MAX_PLACES],
                /// Index of the wheel where each edge ends.
                pub edge_to: [u32; MAX_PLACES],
                /// Level of the latched alarm, danger or fault; 0 without one.
                pub alarm: u32,
                /// 1 if the latched alarm was acknowledged: it is released when it is over.
                pub alarm_acknowledged: u32,
                /// The latched alarm with which the session began, as in alarm: one from an earlier session, or from
                /// before a restart.
                pub inherited_alarm: u32,
                /// 1 if that one had been acknowledged.
                pub inherited_acknowledged: u32,
                /// Why the announced session is refused: 0 it is not; 1 damaged message, 2 another machine, 3 untimed,
                /// 4 a sensor is missing, 5 a sensor that the machine does not have, 6 joints, 7 mounting of the IMU,
                /// 8 the machine does not suit live use. The service of refusals has the text.
                pub refusal: u32,
                /// 1 if the mounting, a sign, the order or a scale of a sensor was contradicted in a session before, and the
                /// machine was not commissioned since: all rows are doubted.
                pub inherited_contradiction: u32,
                /// What measured loads contradict, lasting for two seconds: 0 nothing, or they are not compared; bit 0: the loads of single
                /// sensors contradict the computed ones; bit 1: their total or their moments do. Rows are doubted meanwhile.
                pub load_doubt: u32,
                /// The load sensor that is furthest off; meaningless without bit 0 of load_doubt.
                pub doubted_load_sensor: u32,
                /// What would explain the total, as bits: 0 a load that is not stated; 1 it acts where the arm carries loads;
                /// 2 it acts at a support, so that a wrong sensor of that support explains it as well; 3 two exchanged sensors.
                pub load_explanation: u32,
                /// Bits: the supports whose sensors may be exchanged.
                pub exchanged_sensors: u32,
                /// Bits: the forces of the arm that contradict, lasting for two seconds, what masses and motion require. Rows are doubted
                /// meanwhile: the force, a position, a mass or a load is wrong, or the arm rests on something.
                pub doubted_forces: u32,
                /// Bits: the forces of the arm that repeat one value, lasting for two seconds, although the motion has changed the force that
                /// is required: they are not measured any more. Rows are not doubted because of that.
                pub frozen_forces: u32,
                /// Why nothing is predicted by each assumed motion; 0 if something is: the other fields of the prediction are
                /// NaN or meaningless otherwise. Assumed motions: 0 the motion goes on, 1 the platform brakes now, 2 the arm
                /// stops now. A prediction never changes the level.
                pub prediction_gap: [u32; LAWS],
                /// Index of the wheel that lifts first by each assumed motion; if none lifts, of the one that comes closest.
                pub predicted_wheel: [u32; LAWS],
                /// What takes most load off that wheel until then, as 1 plus the index of the cause; 0 if nothing does.
                pub predicted_cause: [u32; LAWS],
                $(#[doc = quantity_doc!($worst_of)] pub $worst: f64,)*
                /// Time until the next wheel lifts if its load keeps falling at its present rate (s); NaN beyond 5 s.
                pub time_to_lift_off_s: f64,
                /// Age of the prediction (s): it was made so long before this row, and its times are from then; 0 if it was made
                /// for this row. Only at the levels safe and assumed and only a prediction by which no wheel may lift is repeated.
                pub predicted_age_s: f64,
                /// Mass of the load that is not stated (kg), negative for less than what is stated; NaN if none would explain the
                /// measured loads.
                pub unstated_mass_kg: f64,
                /// Its standard deviation (kg).
                pub unstated_mass_sigma_kg: f64,
                /// Mass of the payloads that a signal states or that is estimated row by row, their sum (kg); NaN while it is unknown, and
                /// on a machine without such payloads.
                pub payload_mass_kg: f64,
                /// Its standard deviation (kg).
                pub payload_mass_sigma_kg: f64,
                /// Time until a wheel lifts by each assumed motion (s), by the computed OTF; 0 if it has lifted; NaN if none
                /// lifts within the horizon of the machine file.
                pub predicted_lift_off_s: [f64; LAWS],
                /// The same for the OTF less two standard deviations: lift-off is possible from then on (s).
                pub predicted_earliest_s: [f64; LAWS],
                /// The same for the OTF plus two standard deviations of the wheel that lifts first (s).
                pub predicted_latest_s: [f64; LAWS],
                /// Utilisation by each assumed motion at the first instant ahead with a lifted wheel; if there is none, at
                /// the one with the smallest OTF relative to the static load.
                pub predicted_utilisation: [f64; LAWS],
                /// Smallest OTF within the horizon by each assumed motion and wheel (N).
                pub predicted_otf_min: [[f64; MAX_PLACES]; LAWS],
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
    /// Command to the valves of the suspension. The valve driver must close them when it is past
    /// valid_until_ns. Arrays are by actuator, in the order of suspension.linkages in the machine file.
    "tipwatch.Command.v1"
    pub struct WireCommand {
        /// Time until which it may be acted on (ns), by CLOCK_MONOTONIC.
        pub valid_until_ns: i64,
        /// The session that the control follows; 0 without one.
        pub session: u64,
        /// Sequence number of the sample that completed the row.
        pub sample_sequence: u64,
        /// Publication time of that sample (ns), by CLOCK_MONOTONIC.
        pub sample_published_ns: i64,
        /// Sequence number of the last verdict received.
        pub verdict_sequence: u64,
        /// Rows so far.
        pub rows: u64,
        /// 1 a row; 2 between rows.
        pub event: u32,
        /// Mode of the valves: 0 held closed, 1 closing, 2 following the optimiser.
        pub mode: u32,
        /// Bits: why they do not follow.
        pub reasons: u32,
        /// Status of the optimiser's last solution: 0 not asked, 1 optimal, 2 work limit, 3 margin lost,
        /// 4 step too short, 5 outside limits, 6 no solution, 7 position unknown, 8 restrained, 9 position
        /// implausible, 10 not following.
        pub status: u32,
        /// Level of the last verdict received.
        pub level: u32,
        /// Number of actuators.
        pub actuator_count: u32,
        /// Iterations of the optimiser.
        pub iterations: u32,
        /// Motions of the suspension that the optimiser evaluated.
        pub evaluations: u32,
        /// Valve command, -1 to 1; positive extends the rod.
        pub opening: [f64; MAX_ACTUATORS],
        /// Measured cylinder stroke (m).
        pub measured: [f64; MAX_ACTUATORS],
        /// Reference stroke (m); NaN if the valves do not follow.
        pub reference: [f64; MAX_ACTUATORS],
        /// Reference velocity (m/s); NaN if the valves do not follow.
        pub velocity: [f64; MAX_ACTUATORS],
        /// The optimum: target stroke (m), in one-step mode its acceleration (m/s2).
        pub target: [f64; MAX_ACTUATORS],
        /// Cost (30) of the best point found; NaN if no problem was solved.
        pub cost: f64,
    }
}

wire! {
    /// An operator has acknowledged the alarm, or trusts signals again that failed visibly. It counts only if magic and
    /// checksum are right, machine_hash is that of the monitor, and the named verdict carried the alarm or the doubt. A rod that does not obey its valve is acknowledged likewise,
    /// by naming a command whose reasons tell of it.
    "tipwatch.Acknowledge.v3"
    pub struct WireAcknowledge {
        /// Source of the acknowledged verdict or command: that run of the monitor or control.
        pub verdict_source: u64,
        /// Sequence number of the acknowledged verdict, not below its alarm_sequence, or of the command.
        pub verdict_sequence: u64,
        /// Bits, as in the verdict's doubted: the signals that are trusted again as they are now. 0: it is of the alarm.
        pub signals: u64,
    }
}

wire! {
    /// Why the monitor refuses an announced session. Kept for late joiners.
    "tipwatch.Refusal.v1"
    pub struct WireRefusal {
        /// The refused session.
        pub session: u64,
        /// The reason, as refusal of the verdict.
        pub reason: u32,
        /// Zero.
        pub reserved: u32,
        /// The reason as text (UTF-8), cut to fit: what was expected, and what was found.
        pub text: [u8; TEXT_BYTES],
    }
}

wire! {
    /// Progress of a reader of samples. Its source is the session that it reads.
    "tipwatch.Progress.v1"
    pub struct WireProgress {
        /// Identity of the reader in iceoryx2, lower half.
        pub reader_low: u64,
        /// Upper half.
        pub reader_high: u64,
        /// Sequence number that the reader expects next; the largest number before its first sample.
        pub next: u64,
    }
}

/// A service that carries a message type: its name and settings.
pub trait Topic: Wire {
    /// Suffix of the service name.
    const SUFFIX: &'static str;
    /// Unread messages of each reader.
    const QUEUE: usize;
    /// Messages that late joiners receive.
    const HISTORY: usize;
    /// Maximum number of writers.
    const WRITERS: usize;
    /// Whether each message notifies the listeners of the event service of the same name.
    const HAS_EVENTS: bool;
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

/// One service a row: message, suffix, queue, history, writers, whether it has events.
macro_rules! topics {
    ($($message:ident: $suffix:expr, $queue:expr, $history:expr, $writers:expr, $has_events:expr;)*) => {
        $(impl Topic for $message {
            const SUFFIX: &'static str = $suffix;
            const QUEUE: usize = $queue;
            const HISTORY: usize = $history;
            const WRITERS: usize = $writers;
            const HAS_EVENTS: bool = $has_events;
        })*
    };
}

topics! {
    WireSession: SESSION_SUFFIX, LATEST, LATEST, ONE_WRITER, false;
    WireSample: SAMPLES_SUFFIX, SAMPLE_QUEUE, 0, ONE_WRITER, true;
    WireMachine: MACHINE_SUFFIX, LATEST, LATEST, ONE_WRITER, false;
    WireVerdict: VERDICT_SUFFIX, VERDICT_QUEUE, 0, ONE_WRITER, true;
    WireCommand: COMMAND_SUFFIX, COMMAND_QUEUE, 0, ONE_WRITER, true;
    WireRefusal: REFUSAL_SUFFIX, LATEST, LATEST, ONE_WRITER, false;
    WireAcknowledge: ACKNOWLEDGE_SUFFIX, ACKNOWLEDGE_QUEUE, 0, MAX_READERS, false;
    WireProgress: PROGRESS_SUFFIX, PROGRESS_QUEUE, 0, MAX_READERS, false;
}

/// [`WireVerdict::event`]: a row.
pub const EVENT_ROW: u32 = tipwatch_binding::monitor_topic::EVENT_ROW;
/// [`WireVerdict::event`]: between rows.
pub const EVENT_BETWEEN: u32 = 2;

/// [`WireVerdict::alarm_sequence`] of a verdict with a new alarm, before it is sealed.
pub(crate) const ALARM_BEGINS: u64 = u64::MAX;

tipwatch_mechanics::named! {
    /// [`WireSample::kind`] as an enumeration; the numbers are part of the wire.
    #[derive(strum::FromRepr)]
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
        /// No sensor: the end of the session. Its sequence number is the number of samples.
        End = 5,
        /// A force or pressure signal of an actuator, or the load of a support.
        Actuator = 6,
        /// A signal that tells whether supports are set or raised.
        Switch = 7,
        /// The load of one or more supports.
        Load = 8,
        /// The rate that a controller asks of a joint.
        Command = 9,
        /// What tells the mass of a payload.
        Payload = 10,
        /// A force of the arm by which nothing is computed, or a pressure of it.
        Force = 11,
    }
}

impl From<NumberKind> for Kind {
    fn from(kind: NumberKind) -> Self {
        match kind {
            NumberKind::Actuator => Self::Actuator,
            NumberKind::Switch => Self::Switch,
            NumberKind::Load => Self::Load,
            NumberKind::Command => Self::Command,
            NumberKind::Payload => Self::Payload,
            NumberKind::Force => Self::Force,
        }
    }
}

impl TryFrom<u32> for Kind {
    type Error = u32;

    fn try_from(number: u32) -> Result<Self, u32> {
        Self::from_repr(number).ok_or(number)
    }
}
