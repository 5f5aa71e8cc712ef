//! A quantity that dies away.

/// Factors of an acceleration a that dies away with the time constant T, after a time t.
///
/// ```text
///     a(t) = a e,   e = exp(-t / T)
///     v(t) = v + a i,   i = T (1 - e)
///     x(t) = x + v t + a d,   d = T (t - i)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Decay {
    pub(super) e: f64,
    pub(super) i: f64,
    pub(super) d: f64,
}

impl Decay {
    /// The factors after `time_s`.
    pub(super) fn after(time_s: f64, constant_s: f64) -> Self {
        let e = (-time_s / constant_s).exp();
        let i = constant_s * (1.0 - e);
        Self {
            e,
            i,
            d: constant_s * (time_s - i),
        }
    }
}
