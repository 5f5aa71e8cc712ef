//! The hash FNV-1a of 64 bits: tells layouts, machines and sessions apart; no protection against intent.

/// A hash under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fnv1a(u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self::new()
    }
}

impl Fnv1a {
    /// The hash of nothing.
    #[must_use]
    pub(super) const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes bytes, and how many they are: so that "ab", "c" is not "a", "bc".
    #[must_use]
    pub(super) const fn bytes(mut self, bytes: &[u8]) -> Self {
        let mut i = 0;
        while i < bytes.len() {
            self.0 = (self.0 ^ bytes[i] as u64).wrapping_mul(0x100_0000_01b3);
            i += 1;
        }
        self.number(bytes.len() as u64)
    }

    /// Takes a number.
    #[must_use]
    pub(super) const fn number(mut self, number: u64) -> Self {
        let bytes = number.to_le_bytes();
        let mut i = 0;
        while i < bytes.len() {
            self.0 = (self.0 ^ bytes[i] as u64).wrapping_mul(0x100_0000_01b3);
            i += 1;
        }
        self
    }

    /// The hash.
    #[must_use]
    pub(super) const fn finish(self) -> u64 {
        self.0
    }
}
