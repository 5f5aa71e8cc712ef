//! Stamps of samples, which a log may have in any order, in that of time.

use std::borrow::Cow;

/// Returns the stamps (ns) in rising order; copied only if they were not sorted.
#[must_use]
pub fn sorted_stamps(stamps_ns: &[i64]) -> Cow<'_, [i64]> {
    let mut sorted = Cow::Borrowed(stamps_ns);
    if !sorted.is_sorted() {
        sorted.to_mut().sort_unstable();
    }
    sorted
}
