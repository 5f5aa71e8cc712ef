//! Episodes: runs of rows in which a condition holds.

/// Shortest episode that counts as an event (ns).
pub(crate) const SHORTEST_NS: i64 = 50_000_000;
/// Episodes closer than this are merged (ns).
pub(crate) const MERGED_NS: i64 = 200_000_000;
/// Episodes closer than this are merged where nothing shows that they are two (ns).
const DOUBTFUL_NS: i64 = 500_000_000;

/// A run of rows, ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Episode {
    pub(super) first: usize,
    pub(super) last: usize,
}

impl Episode {
    /// Whether the episodes have a row in common.
    pub(super) fn overlaps(self, other: Self) -> bool {
        self.first <= other.last && other.first <= self.last
    }
}

pub(super) fn least(value: impl Fn(usize) -> f64, episode: Episode) -> (usize, f64) {
    let smaller = |best: (usize, f64), row: usize| match value(row) {
        value if value < best.1 => (row, value),
        _ => best,
    };
    (episode.first..=episode.last).fold((episode.first, f64::INFINITY), smaller)
}

pub(super) fn most(value: impl Fn(usize) -> f64, episode: Episode) -> (usize, f64) {
    let larger = |best: (usize, f64), row: usize| match value(row) {
        value if value > best.1 => (row, value),
        _ => best,
    };
    (episode.first..=episode.last).fold((episode.first, f64::NEG_INFINITY), larger)
}

/// Runs of rows for which `holds`: close ones merged, short ones dropped. A row lasts until the next one.
fn episodes(times_ns: &[i64], holds: impl Fn(usize) -> bool) -> Vec<Episode> {
    let until = |row: usize| times_ns[(row + 1).min(times_ns.len() - 1)];
    let mut joined: Vec<(Episode, i64)> = Vec::new();
    for row in (0..times_ns.len()).filter(|&row| holds(row)) {
        let lasts = until(row) - times_ns[row];
        match joined.last_mut() {
            Some((episode, held)) if times_ns[row] - until(episode.last) < MERGED_NS => {
                episode.last = row;
                *held += lasts;
            }
            _ => joined.push((
                Episode {
                    first: row,
                    last: row,
                },
                lasts,
            )),
        }
    }
    joined
        .into_iter()
        .filter(|(_, held)| *held >= SHORTEST_NS)
        .map(|(episode, _)| episode)
        .collect()
}

/// Finds the episodes within a run of rows.
pub(super) fn episodes_within(
    times_ns: &[i64],
    within: Episode,
    holds: impl Fn(usize) -> bool,
) -> Vec<Episode> {
    let Episode { first, last } = within;
    // A row lasts until the next one, so that belongs to the times of a run too.
    let times = &times_ns[first..(last + 2).min(times_ns.len())];
    let found = episodes(times, |row| first + row <= last && holds(first + row));
    let found = found.into_iter().map(|episode| Episode {
        first: first + episode.first,
        last: first + episode.last,
    });
    found.collect()
}

/// Merges episodes that are close, and between which the condition `may_hold` in every row within its error.
pub(super) fn joined(
    times_ns: &[i64],
    episodes: Vec<Episode>,
    may_hold: impl Fn(usize) -> bool,
) -> Vec<Episode> {
    let mut joined: Vec<Episode> = Vec::new();
    for episode in episodes {
        match joined.last_mut() {
            Some(before)
                if times_ns[episode.first] - times_ns[before.last] < DOUBTFUL_NS
                    && (before.last + 1..episode.first).all(&may_hold) =>
            {
                before.last = episode.last;
            }
            _ => joined.push(episode),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: i64 = 10_000_000;

    fn found(holds: &[(usize, usize)]) -> Vec<(usize, usize)> {
        let times: Vec<i64> = (0..200).map(|k| k * PERIOD_NS).collect();
        let inside = |row: usize| holds.iter().any(|&(a, b)| (a..=b).contains(&row));
        episodes(&times, inside)
            .into_iter()
            .map(|e| (e.first, e.last))
            .collect()
    }

    #[test]
    fn episodes_shorter_than_50_ms_do_not_count() {
        assert_eq!(found(&[(10, 14)]), [(10, 14)]);
        assert_eq!(found(&[(10, 13)]), []);
        assert_eq!(found(&[]), []);
    }

    #[test]
    fn episodes_within_a_run_keep_their_rows() {
        let times: Vec<i64> = (0..200).map(|k| k * PERIOD_NS).collect();
        let run = Episode {
            first: 50,
            last: 99,
        };
        let found = episodes_within(&times, run, |row| (20..=60).contains(&row) || row >= 95);
        let [a, b] = &found[..] else {
            panic!("{found:?}");
        };
        assert_eq!((a.first, a.last, b.first, b.last), (50, 60, 95, 99));
    }

    #[test]
    fn episodes_merge_over_a_gap_that_lies_within_the_error() {
        let times: Vec<i64> = (0..200).map(|k| k * PERIOD_NS).collect();
        let episode = |(first, last): (usize, usize)| Episode { first, last };
        let found = |may_hold: &dyn Fn(usize) -> bool, ends: [(usize, usize); 2]| {
            joined(&times, ends.map(episode).to_vec(), may_hold).len()
        };
        assert_eq!(found(&|_| true, [(10, 20), (50, 60)]), 1);
        assert_eq!(found(&|row| row != 30, [(10, 20), (50, 60)]), 2);
        assert_eq!(found(&|_| true, [(10, 20), (80, 90)]), 2);
    }

    #[test]
    fn episodes_less_than_200_ms_apart_merge() {
        assert_eq!(found(&[(10, 20), (40, 50)]), [(10, 50)]);
        assert_eq!(found(&[(10, 20), (41, 50)]), [(10, 20), (41, 50)]);
    }
}
