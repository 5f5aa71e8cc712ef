//! Errors of binding a machine to a log.

use tipwatch_ingest::SensorKind;
use tipwatch_mechanics::MachineError;
use tipwatch_mechanics::state::JointTwice;

/// Error: a machine cannot be bound to a log.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// The log cannot be read, or a signal is missing, of the wrong type or ambiguous.
    #[error(transparent)]
    Log(#[from] tipwatch_ingest::Error),
    /// The machine description is invalid, or the log lacks a signal that it needs.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// Two topics measure one joint.
    #[error(transparent)]
    JointTwice(#[from] JointTwice),
    /// A message names a joint twice, and its positions differ.
    #[error(
        "topic {topic}: expected joint \"{joint}\" once in a message, found it twice with different positions: {} at \
         index {} and {} at index {}; choose one in the machine file: [signals.joints.{joint}] position = {{ topic = \
         \"{topic}\", field = \"position[{}]\" }}",
        positions[0].0, positions[0].1, positions[1].0, positions[1].1, positions[0].1
    )]
    NamedTwice {
        /// The topic.
        topic: String,
        /// The joint.
        joint: String,
        /// Both positions, as text, and their places in the message.
        positions: [(String, usize); 2],
    },
    /// No topic carries joint states.
    #[error("{log}: expected joint states ({}), found none{lost}; the log has: {topics}", SensorKind::JointStates.type_name())]
    NoJointStates {
        /// The log.
        log: String,
        /// Every topic with its type.
        topics: String,
        /// Lost messages of joint states, as " that can be read: ...", or empty.
        lost: String,
    },
    /// The machine file states the clock offset of a topic that does not exist.
    #[error("{file}: clock.offset.\"{topic}\": expected a topic of {log}, which has: {topics}")]
    NoTopicOfClock {
        /// The machine file.
        file: String,
        /// The topic.
        topic: String,
        /// The log.
        log: String,
        /// Every topic of the log.
        topics: String,
    },
    /// The joint states contain none of the machine's joints.
    #[error("{log}: expected joint states of the machine's joints, found only: {joints}")]
    NoJointOfTheMachine {
        /// The log.
        log: String,
        /// The joints that the log has.
        joints: String,
    },
}
