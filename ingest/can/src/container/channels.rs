//! The channels of a file, by name or by number.

use std::collections::HashMap;

/// Far above any logger; names beyond it share the last.
const MOST_CHANNELS: usize = 256;

/// Channels in the order in which they were met.
#[derive(Debug, Default)]
pub(super) struct Channels {
    pub(super) names: Vec<String>,
    by_number: HashMap<u64, usize>,
}

impl Channels {
    /// The index of a channel by name.
    pub(super) fn named(&mut self, name: &str) -> usize {
        if let Some(index) = self.names.iter().position(|known| known == name) {
            return index;
        }
        if self.names.len() < MOST_CHANNELS {
            self.names.push(name.to_owned());
        }
        self.names.len() - 1
    }

    /// The index of a channel by number: `can1` is number 1.
    pub(super) fn numbered(&mut self, number: u64) -> usize {
        if let Some(&index) = self.by_number.get(&number) {
            return index;
        }
        let index = self.named(&format!("can{number}"));
        if self.by_number.len() < MOST_CHANNELS {
            self.by_number.insert(number, index);
        }
        index
    }
}
