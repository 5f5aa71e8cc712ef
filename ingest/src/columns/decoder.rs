//! Decodes the messages of one sensor, by type or number by number.

use crate::{
    decode::{DecodeError, NumberDecoder, SampleSpec, SensorDecoder, SensorSample},
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
    ) -> Result<Self, BindingError> {
        let decoder = SensorDecoder::new(topic, kind, joint_names)?;
        Ok(Self::Typed(Box::new(decoder)))
    }

    pub(crate) fn numbers(topic: &Topic, sample: &SampleSpec) -> Result<Self, BindingError> {
        Ok(Self::Numbers(Box::new(NumberDecoder::new(topic, sample)?)))
    }

    /// Appends the values of one message and returns its header stamp; `None` for a message without
    /// any value of the sample. Appends nothing after an error. `sample` is scratch space.
    #[inline]
    pub(super) fn append_values(
        &mut self,
        message: &RawMessage<'_>,
        sample: &mut SensorSample,
        values: &mut Vec<f64>,
    ) -> Result<Option<HeaderStamp>, DecodeError> {
        match self {
            Self::Typed(decoder) => {
                let stamp_ns = decoder.append_values(message, values)?;
                Ok(Some(HeaderStamp(stamp_ns)))
            }
            Self::Numbers(decoder) => {
                let has_any = decoder.decode(message, sample)?;
                if has_any {
                    values.extend_from_slice(&sample.values);
                }
                Ok(has_any.then_some(HeaderStamp(sample.header_stamp_ns)))
            }
        }
    }

    /// Merges the results of the decoder of the part that follows.
    pub(super) fn append(&mut self, next: &mut Self) {
        if let (Self::Numbers(decoder), Self::Numbers(next)) = (self, next) {
            decoder.append(next);
        }
    }

    pub(crate) fn check_found(&self) -> Result<(), BindingError> {
        match self {
            Self::Typed(_) => Ok(()),
            Self::Numbers(decoder) => decoder.check_found(),
        }
    }
}

/// In nanoseconds; `None` if the header has none.
pub(super) struct HeaderStamp(pub(super) Option<i64>);
