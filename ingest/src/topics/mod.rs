//! Which topics carry which signals, and what a few messages of a topic reveal about it.

mod binding;
mod contents;
mod first_messages;
mod latched;
mod metadata_records;
mod sensor_topics;
mod static_frames;

pub use self::{
    binding::{Binding, bind, bind_joint_states, topic_of_field},
    contents::{FieldContents, TopicContents, topic_contents},
    first_messages::{JointNamedTwice, first_frame, joint_names_in},
    metadata_records::{MetadataRecord, metadata_records},
    sensor_topics::{JointTopic, NamedTopics, RobotDescription, SensorTopics, robot_descriptions},
    static_frames::{StaticFrame, static_frames},
};
pub(crate) use self::{
    first_messages::frames_in,
    latched::{is_latched, is_static_transform},
};
