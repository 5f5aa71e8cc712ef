//! What a log holds besides messages.

/// A record that belongs to no topic.
pub(crate) enum Extra<'a> {
    /// A file within the log.
    Attachment(mcap::Attachment<'a>),
    /// Names and values.
    Metadata(mcap::records::Metadata),
}
