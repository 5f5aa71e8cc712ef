//! FNV-1a, 64 bits: distinguishes layouts, machines and sessions. Not a protection against manipulation.

/// The hash of no data.
pub(super) const HASH_START: u64 = 0xcbf2_9ce4_8422_2325;
/// The factor at every byte.
pub(super) const HASH_PRIME: u64 = 0x100_0000_01b3;

/// A hash in progress.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fnv1a(u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self::new()
    }
}

impl Fnv1a {
    /// The hash of no data.
    #[must_use]
    pub(super) const fn new() -> Self {
        Self(HASH_START)
    }

    /// Adds bytes and their number, so that "ab", "c" differs from "a", "bc".
    #[must_use]
    pub(super) const fn bytes(mut self, bytes: &[u8]) -> Self {
        let mut i = 0;
        while i < bytes.len() {
            self.0 = (self.0 ^ bytes[i] as u64).wrapping_mul(HASH_PRIME);
            i += 1;
        }
        self.number(bytes.len() as u64)
    }

    /// Adds a number.
    #[must_use]
    pub(super) const fn number(mut self, number: u64) -> Self {
        let bytes = number.to_le_bytes();
        let mut i = 0;
        while i < bytes.len() {
            self.0 = (self.0 ^ bytes[i] as u64).wrapping_mul(HASH_PRIME);
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
