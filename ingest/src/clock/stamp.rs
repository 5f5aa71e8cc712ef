//! Chooses one of a message's three times.

use schemars::JsonSchema;
use serde::Serialize;
use strum::Display;
use tipwatch_language::{say, word};

use super::time::seconds_between;
use crate::file::Format;

/// The times of a message, the best first.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema, Display,
)]
#[serde(rename_all = "snake_case")]
pub enum StampSource {
    /// The stamp that the sensor wrote into the message.
    #[strum(serialize = "header.stamp")]
    Header,
    /// When the message was sent.
    #[strum(serialize = "publish time")]
    Publish,
    /// When the recorder received it.
    #[strum(serialize = "log time")]
    Log,
}

/// The time to use for a topic, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StampDecision {
    /// The time to use.
    pub source: StampSource,
    /// Why no better one is used, or why this one is usable.
    pub reason: String,
}

/// The evidence for a decision.
pub(super) struct StampEvidence {
    pub(super) messages: usize,
    /// Messages whose header has a stamp that is not zero.
    pub(super) stamped: usize,
    pub(super) header_changes: bool,
    /// The resolution of the header stamps (ns), if several messages share each stamp because of it.
    pub(super) header_resolution_ns: Option<i64>,
    /// Header stamps earlier than the previous one, and the scatter of all of them (s), if the messages themselves come in order.
    pub(super) header_disorder: Option<(usize, f64)>,
    pub(super) publish_is_apart: bool,
    pub(super) publish_changes: bool,
    /// The format, if it has no publish times.
    pub(super) without_publish: Option<Format>,
}

impl StampEvidence {
    /// The header stamp if most messages have one and it changes; else a separate publish time;
    /// else the log time.
    pub(super) fn decide(&self) -> StampDecision {
        let against_header = match self.against_header() {
            None => {
                let reason = word!("header.stamp is present and changes").to_owned();
                return StampDecision {
                    source: StampSource::Header,
                    reason,
                };
            }
            Some(reason) => reason,
        };
        if self.publish_is_apart && self.publish_changes {
            let reason = say!("{against_header}; the publish time changes");
            return StampDecision {
                source: StampSource::Publish,
                reason,
            };
        }
        let against_publish = match self.without_publish {
            Some(format) => say!("a {format} has no publish time"),
            None if self.publish_is_apart => word!("the publish time is constant").to_owned(),
            None => word!("the publish time is absent or equals the log time").to_owned(),
        };
        let reason = format!("{against_header}; {against_publish}");
        StampDecision {
            source: StampSource::Log,
            reason,
        }
    }

    fn against_header(&self) -> Option<String> {
        let Self {
            messages, stamped, ..
        } = *self;
        if stamped == 0 {
            Some(word!("header.stamp is absent or zero").to_owned())
        } else if stamped * 2 < messages {
            Some(say!(
                "header.stamp is zero in {} of {messages} messages",
                messages - stamped
            ))
        } else if messages > 1 && !self.header_changes {
            Some(word!("header.stamp is constant").to_owned())
        } else if let Some((backward, scatter_s)) = self.header_disorder {
            Some(say!(
                "header.stamp is earlier than the previous one in {backward} of {messages} messages, which come regularly, and \
                 scatters by {:.1} ms",
                scatter_s * 1e3
            ))
        } else {
            self.header_resolution_ns.map(|resolution_ns| {
                say!(
                    "header.stamp has a resolution of {} s, which several messages share",
                    seconds_between(0, resolution_ns)
                )
            })
        }
    }
}
