//! Decoding of the bytes of one message to numbers and strings.

mod attitude;
mod binary;
mod can_frame;
mod error;
mod fields;
mod json;
mod layout;
mod number_decoder;
mod number_fields;
mod path_collector;
mod places;
mod protobuf;
mod sensor;
mod shortcut;

pub(crate) use self::{
    can_frame::{FrameDecoder, Stamp, is_can_frame},
    layout::layout_of,
    number_decoder::NumberDecoder,
    number_fields::{NumberPaths, number_paths},
    path_collector::MOST_FIELDS,
    sensor::JointSample,
};
pub use self::{
    error::DecodeError,
    fields::Fields,
    layout::Layout,
    number_decoder::{LARGEST_TILT_RAD, NumberField, SampleSpec, ValueSource},
    number_fields::number_fields,
    sensor::{SensorDecoder, SensorSample},
};
