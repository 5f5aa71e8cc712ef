//! Data that the fit does not see: whole stretches of logs and whole weighings, never single rows.

use crate::identification::data::{Data, Instant, Source};

/// One of this many stretches, weighings or logs is held back.
const ONE_IN: usize = 4;
/// Shortest stretch (s), and the number of stretches that a log is cut into at most.
const LEAST_STRETCH_S: f64 = 1.0;
const MOST_STRETCHES: f64 = 24.0;
/// Fewest stretches of which one can be held back.
const LEAST_STRETCHES: f64 = 4.0;

/// Splits data into what is fitted and what is held back.
///
/// Rows next to a stretch that is held back are left out of both, so that no error that persists for a while is on
/// either side.
pub(crate) fn split(data: &Data) -> (Data, Data) {
    let empty = || Data {
        channels: data.channels.clone(),
        sources: Vec::new(),
    };
    let (mut fitted, mut held) = (empty(), empty());
    let logs = data.sources.iter().filter(|source| source.is_log).count();
    let weighings = data.sources.len() - logs;
    let mut counted = [0, 0];
    for source in &data.sources {
        let kind = usize::from(source.is_log);
        let place = counted[kind];
        counted[kind] += 1;
        let total = [weighings, logs][kind];
        if total >= ONE_IN {
            let to = if place % ONE_IN == ONE_IN - 2 {
                &mut held
            } else {
                &mut fitted
            };
            to.sources.push(source.clone());
        } else if source.is_log {
            let (kept, back) = stretches(source);
            fitted.sources.push(kept);
            held.sources.push(back);
        } else {
            fitted.sources.push(source.clone());
        }
    }
    held.sources.retain(|source| !source.instants.is_empty());
    (fitted, held)
}

fn stretches(log: &Source) -> (Source, Source) {
    let of = |instants| Source {
        name: log.name.clone(),
        is_log: true,
        instants,
    };
    let times = log.instants.iter().map(|instant| instant.time_s);
    let (start, end) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| {
        (a.min(t), b.max(t))
    });
    let count = ((end - start) / LEAST_STRETCH_S)
        .floor()
        .min(MOST_STRETCHES);
    if !(count >= LEAST_STRETCHES) {
        return (of(log.instants.clone()), of(Vec::new()));
    }
    let length = (end - start) / count;
    let guard = 0.1 * length;
    let is_held = |place: f64| place as usize % ONE_IN == ONE_IN - 2;
    let (mut kept, mut back): (Vec<Instant>, Vec<Instant>) = (Vec::new(), Vec::new());
    for instant in &log.instants {
        let at = (instant.time_s - start).min(end - start - 1e-9).max(0.0);
        let near = |time: f64| is_held((time / length).floor().clamp(0.0, count - 1.0));
        match is_held((at / length).floor()) {
            true => back.push(instant.clone()),
            false if near(at - guard) || near(at + guard) => {}
            false => kept.push(instant.clone()),
        }
    }
    (of(kept), of(back))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identification::data::Situation;

    fn source(times: impl Iterator<Item = f64>) -> Source {
        let instant = |time_s| Instant {
            time_s,
            supports: [].into(),
            situation: Situation::AtRest {
                positions: Vec::new(),
                slope: [0.0; 2],
                slope_sigma: 0.0,
            },
            readings: Vec::new(),
        };
        Source {
            name: "log".into(),
            is_log: true,
            instants: times.map(instant).collect(),
        }
    }

    #[test]
    fn whole_stretches_are_held_back_with_a_gap_on_either_side() {
        let data = Data {
            channels: Vec::new(),
            sources: vec![source((0..4000).map(|k| f64::from(k) * 0.01))],
        };
        let (fitted, held) = split(&data);
        let times = |data: &Data| -> Vec<f64> {
            data.sources[0].instants.iter().map(|i| i.time_s).collect()
        };
        let (fitted, held) = (times(&fitted), times(&held));
        assert!((800..1200).contains(&held.len()), "{}", held.len());
        for time in &fitted {
            let nearest = held
                .iter()
                .map(|other| (other - time).abs())
                .fold(f64::MAX, f64::min);
            assert!(nearest > 0.1, "{time}");
        }
    }

    #[test]
    fn nothing_of_a_short_log_is_held_back() {
        let data = Data {
            channels: Vec::new(),
            sources: vec![source((0..30).map(|k| f64::from(k) * 0.1))],
        };
        let (fitted, held) = split(&data);
        assert!(held.sources.is_empty() && fitted.sources[0].instants.len() == 30);
    }
}
