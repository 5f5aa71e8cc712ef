//! Common types of the crate: topics, messages, losses and errors.

mod binding_error;
mod error;
mod extra;
mod losses;
mod raw_message;
mod sensor_kind;
mod topic;

pub use self::{
    binding_error::BindingError,
    error::Error,
    losses::{Integrity, Losses, LostPart, LostRange},
    raw_message::RawMessage,
    sensor_kind::SensorKind,
    topic::{DefinitionSource, Topic, TopicId, TopicWriter},
};
pub(crate) use self::{
    extra::Extra,
    topic::{TopicDescription, TopicTable},
};
