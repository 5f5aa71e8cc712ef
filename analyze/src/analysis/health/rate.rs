//! The rate of a sensor, and where it changes.

use super::block::median;
use super::record::RateChange;

/// Samples whose median period is compared with that of the samples before.
const BLOCK: usize = 50;
/// Smaller changes of the period are jitter.
const LEAST_CHANGE: f64 = 0.1;
/// Deviation of the periods from their median, as a share, from which there is no rate that could change.
const IRREGULAR: f64 = 0.25;
/// Most changes that are listed.
const MOST_LISTED: usize = 20;

/// Sampling rate by the stamps of a sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Rates {
    pub(super) rate_hz: Option<f64>,
    pub(super) changes: Option<Vec<RateChange>>,
    /// Longest time between two samples (s), and the sample before it (ns).
    pub(super) longest_gap: Option<(f64, i64)>,
}

/// The median period of some samples, and whether they are regular.
struct Block {
    at_ns: i64,
    period_s: f64,
    is_regular: bool,
}

impl Rates {
    /// Finds the rates of stamps in order of time (ns).
    pub(super) fn of(stamps_ns: &[i64]) -> Self {
        let pairs = || stamps_ns.windows(2).map(|pair| (pair[0], pair[1]));
        let longest = pairs().max_by_key(|(from, to)| to.saturating_sub(*from));
        let mut periods: Vec<f64> = pairs()
            .map(|(from, to)| seconds(from, to))
            .filter(|period| *period > 0.0)
            .collect();
        let blocks: Vec<Block> = (stamps_ns.chunks_exact(BLOCK))
            .filter_map(Block::of)
            .collect();
        let regular = blocks.iter().filter(|block| block.is_regular).count();
        Self {
            rate_hz: median(&mut periods).map(f64::recip),
            changes: (2 * regular >= blocks.len()).then(|| changes(&blocks)),
            longest_gap: longest.map(|(from, to)| (seconds(from, to), from)),
        }
    }
}

impl Block {
    fn of(stamps_ns: &[i64]) -> Option<Self> {
        let pairs = stamps_ns.windows(2);
        let mut periods: Vec<f64> = pairs.map(|pair| seconds(pair[0], pair[1])).collect();
        let period_s = median(&mut periods).filter(|period| *period > 0.0)?;
        let mut apart: Vec<f64> = periods.iter().map(|p| (p - period_s).abs()).collect();
        Some(Self {
            at_ns: *stamps_ns.first()?,
            period_s,
            is_regular: median(&mut apart)? <= IRREGULAR * period_s,
        })
    }

    fn differs(&self, period_s: f64) -> bool {
        (self.period_s - period_s).abs() > LEAST_CHANGE * period_s.min(self.period_s)
    }
}

/// A change counts if the next block confirms it: the block in which the rate changes has either period.
fn changes(blocks: &[Block]) -> Vec<RateChange> {
    let mut changes = Vec::new();
    let Some(mut period_s) = blocks.first().map(|block| block.period_s) else {
        return changes;
    };
    for pair in blocks.windows(2) {
        let [block, next] = pair else { continue };
        if block.differs(period_s) && next.differs(period_s) && !next.differs(block.period_s) {
            changes.push(RateChange {
                at_ns: block.at_ns,
                from_hz: period_s.recip(),
                to_hz: block.period_s.recip(),
            });
            period_s = block.period_s;
        }
    }
    changes.truncate(MOST_LISTED);
    changes
}

fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn stamps(period_ms: impl Fn(i64) -> i64) -> Vec<i64> {
        let mut time = 1_700_000_000_000 * MS;
        let next = |k| {
            time += period_ms(k) * MS;
            time
        };
        (0..1000).map(next).collect()
    }

    #[test]
    fn a_rate_that_changes_and_stays_is_a_change() {
        let found = Rates::of(&stamps(|k| if k < 400 { 10 } else { 20 }));
        let changes = found.changes.unwrap();
        let [change] = changes[..] else {
            panic!("{changes:?}")
        };
        assert_eq!((change.from_hz, change.to_hz), (100.0, 50.0));
        let at_ms = (change.at_ns / MS) - 1_700_000_000_000;
        assert!((4000..=4500).contains(&at_ms), "{at_ms}");
    }

    #[test]
    fn gaps_and_jitter_are_no_changes_of_the_rate() {
        let with_gap = stamps(|k| if k == 500 { 700 } else { 10 + k % 2 });
        let found = Rates::of(&with_gap);
        assert_eq!(found.changes, Some(Vec::new()));
        let (gap_s, from_ns) = found.longest_gap.unwrap();
        assert!((gap_s - 0.7).abs() < 1e-9 && from_ns == with_gap[499]);
        assert_eq!(found.rate_hz.unwrap().round(), 91.0);
    }

    #[test]
    fn what_comes_irregularly_has_no_rate_that_could_change() {
        let on_change = stamps(|k| 3 + (k * 7919) % 600);
        assert_eq!(Rates::of(&on_change).changes, None);
        assert_eq!(
            Rates::of(&[]),
            Rates {
                changes: Some(Vec::new()),
                ..Rates::default()
            }
        );
        assert_eq!(Rates::of(&[5]).rate_hz, None);
    }
}
