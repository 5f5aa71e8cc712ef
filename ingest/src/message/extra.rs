//! Contents of a log other than messages.

/// A record that belongs to no topic.
pub(crate) enum Extra<'a> {
    /// A file embedded in the log.
    Attachment(mcap::Attachment<'a>),
    /// A named set of keys and values.
    Metadata(mcap::records::Metadata),
}
