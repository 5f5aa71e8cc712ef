//! Decodes the messages of one sensor, by type or number by number.

use crate::{
    decode::{DecodeError, JointSample, NumberDecoder, SampleSpec, SensorDecoder, SensorSample},
    message::{BindingError, RawMessage, SensorKind, Topic},
};

/// Decodes messages into samples, by type or number by number.
#[derive(Clone)]
pub(crate) enum Decoder {
    Typed(Box<SensorDecoder>),
    Numbers(Box<NumberDecoder>),
}

impl Decoder {
    pub(crate) fn typed(
        topic: &Topic,
        kind: SensorKind,
        joint_names: &[String],
        frame_id: Option<String>,
    ) -> Result<Self, BindingError> {
        let mut decoder = SensorDecoder::new(topic, kind, joint_names)?;
        if let Some(frame_id) = frame_id {
            decoder.expect_frame(frame_id);
        }
        Ok(Self::Typed(Box::new(decoder)))
    }

    pub(crate) fn numbers(topic: &Topic, sample: &SampleSpec) -> Result<Self, BindingError> {
        Ok(Self::Numbers(Box::new(NumberDecoder::new(topic, sample)?)))
    }

    /// Appends the values of one message, unless it has none of the sample. Appends nothing after an
    /// error. `sample` is scratch space.
    #[inline]
    pub(super) fn append_values(
        &mut self,
        message: &RawMessage<'_>,
        sample: &mut SensorSample,
        values: &mut Vec<f64>,
    ) -> Result<Decoded, DecodeError> {
        match self {
            Self::Typed(decoder) => Ok(match decoder.append_values(message, values)? {
                JointSample::Of(header_stamp_ns) => Decoded::Sample { header_stamp_ns },
                JointSample::OfOthers => Decoded::OfOtherJoints,
            }),
            Self::Numbers(decoder) => {
                if !decoder.decode(message, sample)? {
                    return Ok(Decoded::WithoutValue);
                }
                values.extend_from_slice(&sample.values);
                let header_stamp_ns = sample.header_stamp_ns;
                Ok(Decoded::Sample { header_stamp_ns })
            }
        }
    }

    /// Merges the results of the decoder of the part that follows.
    pub(super) fn append(&mut self, next: &mut Self) {
        if let (Self::Numbers(decoder), Self::Numbers(next)) = (self, next) {
            decoder.append(next);
        }
    }

    /// `header.frame_id` of the messages that are decoded.
    pub(crate) fn frame_id(&self) -> &str {
        match self {
            Self::Typed(decoder) => decoder.frame_id().unwrap_or_default(),
            Self::Numbers(_) => "",
        }
    }

    pub(crate) fn check_found(&self) -> Result<(), BindingError> {
        match self {
            Self::Typed(_) => Ok(()),
            Self::Numbers(decoder) => decoder.check_found(),
        }
    }
}

/// Result of decoding a message.
pub(super) enum Decoded {
    /// Its values.
    Sample {
        /// Header stamp in nanoseconds; `None` if the header has none.
        header_stamp_ns: Option<i64>,
    },
    /// The message has no number of the sample.
    WithoutValue,
    /// The message names none of the wanted joints, but those of another part of the topic.
    OfOtherJoints,
}
