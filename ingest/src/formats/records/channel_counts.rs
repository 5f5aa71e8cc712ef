//! Counts messages by channel.

/// Message counts of the channels in the lookup table.
pub(crate) struct ChannelCounts(pub(super) Vec<u64>);

impl ChannelCounts {
    pub(super) fn new(channels: usize) -> Self {
        Self(vec![0; channels])
    }

    #[inline]
    pub(super) fn add(&mut self, channel_id: u32, messages: u64) {
        if let Some(count) = self.0.get_mut(channel_id as usize) {
            *count += messages;
        }
    }
}
