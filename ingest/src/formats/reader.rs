//! What every format has to offer: one file of a log, read in file order.
//!
//! A new format is one file with one implementation of [`Reader`], one line in
//! [`Format`](crate::Format) and one in [`recognise`](crate::recognise).

use std::ops::ControlFlow;

use crate::message::{Error, Extra, Losses, Message, TopicId};

/// One file of a log. What opening it found is in the topic table and the losses given then.
pub(crate) trait Reader: Send + Sync {
    /// Hands every intact message of the wanted topics to the request, in file order.
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error>;

    /// Hands over what the file holds besides messages.
    fn extras(&self, _take: &mut dyn FnMut(Extra<'_>)) -> Result<(), Error> {
        Ok(())
    }
}

/// What the caller of [`Log::read`](crate::Log::read) wants, and where losses go.
pub(crate) struct Request<'r> {
    /// For each topic of the log.
    pub(crate) wanted: &'r [bool],
    pub(crate) visit: &'r mut dyn FnMut(&Message<'_>) -> ControlFlow<()>,
    pub(crate) progress: &'r mut dyn FnMut(u64),
    /// The size of the files before this one.
    pub(crate) bytes_before: u64,
    pub(crate) losses: &'r mut Losses,
    /// If given, most messages go to batches and not to `visit`.
    pub(crate) batches: Option<Batches<'r>>,
}

/// Messages that are taken in on any thread, all those of a chunk by one.
pub(crate) trait Batch: Send {
    /// Takes in a message.
    fn take(&mut self, message: &Message<'_>);
    /// Hands on what was taken in and empties the batch. Batches are delivered in the order of the
    /// file, between the visits to single messages.
    fn deliver(&mut self);
}

/// Where batches come from, and who is told how many messages came by them.
#[derive(Clone, Copy)]
pub(crate) struct Batches<'r> {
    pub(crate) empty: &'r (dyn Fn() -> Box<dyn Batch> + Sync),
    pub(crate) came: &'r dyn Fn(TopicId, u64),
}

impl Request<'_> {
    pub(crate) fn wants(&self, topic: TopicId) -> bool {
        self.wanted.get(topic.0).copied().unwrap_or(false)
    }

    /// Tells how far into this file the reading has come.
    pub(crate) fn advance(&mut self, bytes_of_file: u64) {
        (self.progress)(self.bytes_before.saturating_add(bytes_of_file));
    }
}
