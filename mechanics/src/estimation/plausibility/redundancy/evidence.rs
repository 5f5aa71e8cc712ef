//! Evidence that grows and shrinks sample by sample.

/// Evidence below which a contradiction no longer stands.
const CLEARED: f64 = 2.0;
/// Largest evidence, so that a fault that ends can be forgotten.
const LARGEST: f64 = 24.0;

/// The logarithm of a likelihood ratio, and since when it grows.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Evidence {
    pub(super) value: f64,
    pub(super) since_ns: i64,
    pub(super) stands: bool,
}

impl Evidence {
    pub(super) fn add(&mut self, stamp_ns: i64, gained: f64) {
        // Written so that NaN is no evidence.
        if !gained.is_finite() {
            return;
        }
        if self.value == 0.0 {
            self.since_ns = stamp_ns;
        }
        self.value = (self.value + gained).clamp(0.0, LARGEST);
    }

    /// The evidence, if it shows a contradiction: from `limit` on, until most of it is refuted.
    pub(super) fn stands(&mut self, limit: f64) -> Option<Self> {
        self.stands = self.value > if self.stands { CLEARED } else { limit };
        self.stands.then_some(*self)
    }

    /// What has just begun is forgotten.
    pub(super) fn forget(&mut self) {
        if !self.stands {
            *self = Self::default();
        }
    }
}
