//! Several attempts at all figures, and what they say together.

use super::figure::Measured;
use super::table::Table;

/// A figure that is lower than before is a loss only if it is in this many attempts on free processors.
const DECISIVE: usize = 2;
/// Number of attempts after which no further one is made.
const MOST: usize = 4;
/// Processors of which a smaller share is free are not free: then program and peer do not have the same chances, because
/// the program uses all of them and most peers use one. One thread of others on two processors leaves 75 to 80 %.
/// Processors that are slower still when all of them work are never free; there no loss is found.
const FREE_SHARE: f64 = 0.85;
/// A ratio below this share of the last release's is a loss.
const LEAST_SHARE: f64 = 2.0 / 3.0;

/// The best ratio of each figure in all attempts, because other work on the computer tends to lower it.
#[derive(Debug, Default)]
pub struct Attempts {
    best: Measured,
    count: usize,
    on_free_processors: usize,
}

/// Judgement on the attempts so far. A loss has a line for each figure that fell.
#[derive(Debug, PartialEq)]
pub enum Judgement {
    /// No figure fell below its bound.
    Kept,
    /// Some figures fell, and another attempt may tell why.
    Again(Vec<String>),
    /// Some figures fell on free processors, too.
    Lost(Vec<String>),
    /// Some figures fell, but hardly ever on free processors: nothing can be said.
    Undecided(Vec<String>),
}

impl Attempts {
    /// Adds an attempt, with the least share of the processors that was free before and after it.
    pub fn add(&mut self, measured: &Measured, free_share: f64) {
        self.best.keep_larger(measured);
        self.count += 1;
        self.on_free_processors += usize::from(free_share >= FREE_SHARE);
    }

    /// The best ratio of each figure.
    #[must_use]
    pub fn best(&self) -> &Measured {
        &self.best
    }

    /// Compares with the last release of the table.
    #[must_use]
    pub fn judge(&self, table: &Table) -> Judgement {
        let fell = table.worse(&self.best, LEAST_SHARE);
        if fell.is_empty() {
            Judgement::Kept
        } else if self.on_free_processors >= DECISIVE {
            Judgement::Lost(fell)
        } else if self.count >= MOST {
            Judgement::Undecided(fell)
        } else {
            Judgement::Again(fell)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{FIGURES, measured};

    const NAME: &str = FIGURES[0].name;

    fn last_release() -> Table {
        let mut table = Table::default();
        table.record("0.1.0", &measured(NAME, 6.0));
        table
    }

    /// The judgement after each of these attempts: a ratio, and the share of free processors.
    fn judged(attempts: &[(f64, f64)]) -> Vec<Judgement> {
        let (table, mut so_far) = (last_release(), Attempts::default());
        let judge = |&(ratio, free_share): &(f64, f64)| {
            so_far.add(&measured(NAME, ratio), free_share);
            so_far.judge(&table)
        };
        attempts.iter().map(judge).collect()
    }

    #[test]
    fn a_good_attempt_is_enough() {
        assert_eq!(judged(&[(4.1, 0.3)]), [Judgement::Kept]);
        let after_a_bad_one = judged(&[(3.9, 1.0), (4.1, 1.0)]);
        assert!(matches!(after_a_bad_one[0], Judgement::Again(_)));
        assert_eq!(after_a_bad_one[1], Judgement::Kept);
    }

    #[test]
    fn a_loss_is_seen_twice_on_free_processors() {
        let found = judged(&[(3.9, 1.0), (3.8, 0.5), (3.9, 0.9)]);
        assert!(matches!(found[1], Judgement::Again(_)));
        let Judgement::Lost(lines) = &found[2] else {
            panic!("{found:?}");
        };
        assert_eq!(lines.len(), 1);
        assert!(lines[0].contains("found 3.90"), "{}", lines[0]);
    }

    #[test]
    fn without_free_processors_nothing_is_said() {
        let found = judged(&[(1.0, 0.5), (1.0, 0.84), (1.0, 1.0), (1.0, 0.5)]);
        assert!(matches!(found[3], Judgement::Undecided(_)));
    }
}
