//! The interface of every format: one file of a log, read in file order.
//!
//! Messages are delivered one by one, or chunk by chunk in batches that any thread may fill.

use std::ops::ControlFlow;

use crate::message::{Error, Extra, Losses, RawMessage, TopicId};

/// One opened file of a log.
pub(crate) trait FileReader: Send + Sync {
    /// Passes every intact message of the wanted topics to the request, in file order.
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error>;

    /// Log times of the first and the last message of all topics, by the file's index where it has one;
    /// `None` if unknown.
    fn span_ns(&self) -> Option<(i64, i64)>;

    /// Passes metadata records to `take`, and attachments if they are wanted.
    fn extras(
        &self,
        _with_attachments: bool,
        _take: &mut dyn FnMut(Extra<'_>),
    ) -> Result<(), Error> {
        Ok(())
    }
}

/// Request of the caller of [`Log::read`](crate::Log::read), and where losses are recorded.
pub(crate) struct Request<'r> {
    /// One flag per topic of the log.
    pub(crate) wanted: &'r [bool],
    pub(crate) visit: &'r mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
    pub(crate) progress: &'r mut dyn FnMut(u64),
    /// The total size of the files before this one.
    pub(crate) bytes_before: u64,
    pub(crate) losses: &'r mut Losses,
    /// If given, most messages go to batches instead of `visit`.
    pub(crate) batches: Option<Batches<'r>>,
}

/// Collects the messages of one chunk, on any thread.
pub(crate) trait Batch: Send {
    /// Reserves memory for the messages of a chunk that is such a share of the file, but not for more than `most`.
    fn expect(&mut self, share: f64, most: usize);
    /// Adds a message.
    fn take(&mut self, message: &RawMessage<'_>);
    /// Hands over the collected messages and empties the batch. Batches are delivered in file
    /// order, interleaved with visits to single messages.
    fn deliver(&mut self);
}

/// Creates batches, and learns of those delivered.
#[derive(Clone, Copy)]
pub(crate) struct Batches<'r> {
    pub(crate) empty: &'r (dyn Fn() -> Box<dyn Batch> + Sync),
    /// Called after each delivery, by the thread that called [`FileReader::read`].
    pub(crate) delivered: &'r dyn Fn(),
    /// Receives the number of messages delivered.
    pub(crate) came: &'r dyn Fn(TopicId, u64),
}

impl Request<'_> {
    pub(crate) fn wants(&self, topic: TopicId) -> bool {
        self.wanted.get(topic.0).copied().unwrap_or(false)
    }

    /// Reports the progress within this file.
    pub(crate) fn advance(&mut self, bytes_of_file: u64) {
        (self.progress)(self.bytes_before.saturating_add(bytes_of_file));
    }
}
