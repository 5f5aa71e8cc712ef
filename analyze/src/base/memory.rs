//! Memory that an analysis may take.

/// Share of the free memory that analyses may take (%).
const PERCENT: u64 = 75;
/// Limit if the free memory is unknown (bytes).
const FALLBACK_BYTES: u64 = 2 << 30;

/// Three quarters of the memory that is free (bytes).
pub(crate) fn limit_bytes() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.map_or(FALLBACK_BYTES, |free| {
        free.saturating_mul(1024) / 100 * PERCENT
    })
}
