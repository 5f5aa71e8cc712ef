//! What a machine stands on while it is weighed.

use super::{SupportId, Supports, WeighedPosture};

impl WeighedPosture {
    /// The supports on the ground.
    #[must_use]
    pub fn stands_on(&self, supports: &Supports) -> Vec<SupportId> {
        if self.supports.is_empty() {
            return match supports.at_rest() {
                some if some.len() >= 3 => some,
                _ => supports.ids().collect(),
            };
        }
        let named = self.supports.iter().flat_map(|name| supports.named(name));
        named.collect()
    }
}
