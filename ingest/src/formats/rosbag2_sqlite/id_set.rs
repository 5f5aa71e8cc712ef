//! The set of message ids seen, one bit each.

/// A set of small numbers.
pub(super) struct IdSet {
    bits: Vec<u64>,
    /// Ids from here on are not valid.
    limit: i64,
}

impl IdSet {
    /// For a file of this size: every row takes a few bytes.
    pub(super) fn new(file_bytes: u64) -> Self {
        const SMALLEST_ROW_BYTES: u64 = 8;
        Self {
            bits: Vec::new(),
            limit: i64::try_from(file_bytes / SMALLEST_ROW_BYTES).unwrap_or(i64::MAX),
        }
    }

    fn place(&self, id: i64) -> Option<(usize, u64)> {
        let is_plausible = id < self.limit;
        let id = usize::try_from(id).ok().filter(|_| is_plausible)?;
        Some((id / 64, 1 << (id % 64)))
    }

    pub(super) fn insert(&mut self, id: i64) {
        if let Some((word, bit)) = self.place(id) {
            if self.bits.len() <= word {
                self.bits.resize(word + 1, 0);
            }
            self.bits[word] |= bit;
        }
    }

    pub(super) fn contains(&self, id: i64) -> bool {
        let place = self.place(id);
        place.is_some_and(|(word, bit)| self.bits.get(word).is_some_and(|bits| bits & bit != 0))
    }
}
