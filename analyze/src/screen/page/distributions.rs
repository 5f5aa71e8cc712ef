//! Distributions of the margins, and the causes of small ones.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};

use super::analysed_log::{AnalysedLog, exposed as exposed_in_words, exposed_s, listed_machines};
use crate::page::svg::{Chart, round_up};
use crate::page::{Bar, bars, logs as in_logs, percent, readable, table, time};
use crate::policy::facts::{EXPOSURE_CAUSES, HISTOGRAM_EDGES};

/// Bins of margins: one below 0, twenty of a twentieth each, one above 1.
const BINS: usize = HISTOGRAM_EDGES.len() + 1;
const BIN_WIDTH: f64 = 0.05;

pub(super) fn margins(seen: &[AnalysedLog<'_>]) -> Option<Markup> {
    if seen.is_empty() {
        return None;
    }
    let mut logs = vec![0.0; BINS];
    for worst in seen.iter().filter_map(|log| log.facts.worst.as_ref()) {
        logs[HISTOGRAM_EDGES.partition_point(|&edge| edge <= worst.margin)] += 1.0;
    }
    let seconds = |bin: usize| {
        seen.iter()
            .filter_map(|log| log.facts.exposure.margin_s.as_ref())
            .map(|margin_s| margin_s[bin])
            .sum::<f64>()
    };
    let hours: Vec<f64> = (0..BINS).map(|bin| seconds(bin) / 3600.0).collect();
    let unknown: f64 = seen.iter().map(|log| log.facts.exposure.unknown_s).sum();
    let all: f64 = seen.iter().map(|log| log.facts.coverage.covered_s).sum();
    Some(html! {
        p.hint {
            (say!("Bars below 0: a wheel or support is off the ground. The margin cannot be computed for {} of {}; this time is not shown.",
                time(unknown), time(all)))
        }
        div.grid {
            (histogram(word!("Number of logs by worst margin"), &logs, &|logs| in_logs(logs as usize)))
            (histogram(word!("Hours of operation by margin"), &hours, &|hours| time(3600.0 * hours)))
            (small_margins(&hours))
        }
    })
}

fn histogram(title: &str, counts: &[f64], in_words: &dyn Fn(f64) -> String) -> Markup {
    let top = round_up(counts.iter().copied().fold(0.0, f64::max));
    let mut chart = Chart::new(title, (-BIN_WIDTH, 1.0 + BIN_WIDTH), (0.0, top));
    add_bars(&mut chart, counts, in_words);
    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
        chart.label_x(share, &format!("{:.0} %", 100.0 * share));
    }
    finish(chart, top)
}

/// The small margins at a scale of their own.
fn small_margins(hours: &[f64]) -> Markup {
    let minutes: Vec<f64> = hours.iter().map(|hours| 60.0 * hours).collect();
    let shown = &minutes[..6];
    let top = round_up(shown.iter().copied().fold(0.0, f64::max));
    let mut chart = Chart::new(
        word!("Minutes of operation with a margin below 25 %"),
        (-BIN_WIDTH, 0.25),
        (0.0, top),
    );
    add_bars(&mut chart, shown, &|minutes| time(60.0 * minutes));
    for share in [0.0, 0.1, 0.2] {
        chart.label_x(share, &format!("{:.0} %", 100.0 * share));
    }
    finish(chart, top)
}

fn add_bars(chart: &mut Chart, counts: &[f64], in_words: &dyn Fn(f64) -> String) {
    for (bin, &count) in counts.iter().enumerate() {
        let from = (bin as f64 - 1.0) * BIN_WIDTH;
        let class = if bin == 0 { "below" } else { "bar" };
        let margins = match bin {
            0 => word!("below 0").to_owned(),
            _ if bin + 1 == BINS => word!("above 100 %").into(),
            _ => {
                let (low, high) = (100.0 * from, 100.0 * (from + BIN_WIDTH));
                say!("{low:.0} to {high:.0} %")
            }
        };
        let text = format!("{margins}: {}", in_words(count));
        if count > 0.0 {
            chart.bar(from, from + BIN_WIDTH, count, class, &text);
        }
    }
}

fn finish(mut chart: Chart, top: f64) -> Markup {
    chart.guide_up(0.0);
    chart.label_y(0.0, "0");
    chart.label_y(top, &decimals(format!("{top}")));
    chart.caption_x(word!("Margin (share of the static load)"));
    chart.finish()
}

pub(super) fn causes(seen: &[AnalysedLog<'_>]) -> Markup {
    let all = by_cause(seen);
    let Some((exposed, is_unknown_of_some)) = exposed_s(seen) else {
        return html! { p { (word!("The margin of no log is known, and so no time below the notice level.")) } };
    };
    if exposed == 0.0 {
        return html! {
            p {
                (word!("No machine came below the notice level (a margin of 25 % unless the machine file sets another) in the \
                    time that is computable."))
                @if is_unknown_of_some { (word!(" The margins of some logs are not known.")) }
            }
        };
    }
    let attributed: f64 = all.iter().sum();
    let mut order: Vec<usize> = (0..all.len()).filter(|&i| all[i] > 0.0).collect();
    order.sort_by(|&a, &b| all[b].total_cmp(&all[a]));
    let name = |i: &usize| readable(EXPOSURE_CAUSES[*i]);
    let bar = |i: &usize| {
        let share = all[*i] / attributed;
        Bar {
            label: name(i),
            share,
            text: format!("{} ({})", time(all[*i]), percent(share)),
        }
    };
    let (machines, note) = listed_machines(seen);
    let machines = machines.into_iter().map(|(machine, logs)| {
        let sums = by_cause(&logs);
        let causes = order.iter().map(|&i| time(sums[i]));
        [machine, exposed_in_words(&logs)]
            .into_iter()
            .chain(causes)
            .collect()
    });
    let head = [word!("Machine").into(), word!("Exposed").into()]
        .into_iter()
        .chain(order.iter().map(name));
    html! {
        p.hint {
            (say!("Exposure is the time with a margin below the notice level (25 % unless the machine file sets another): {} in total. \
                Each instant is divided among the causes that take load from the worst wheel, relative to its static load. Posture is \
                the effect of the weight of chassis, wheels and arm in positions other than the static posture.", exposed_in_words(seen)))
        }
        (bars(&order.iter().map(bar).collect::<Vec<_>>()))
        (note)
        (table(&head.collect::<Vec<String>>(), &machines.collect::<Vec<_>>()))
    }
}

/// Exposure to each cause over all logs (s).
fn by_cause(seen: &[AnalysedLog<'_>]) -> Vec<f64> {
    let mut sums = vec![0.0; EXPOSURE_CAUSES.len()];
    let exposures = seen.iter().map(|log| &log.facts.exposure);
    for by_cause in exposures.filter_map(|exposure| exposure.exposed_by_cause_s.as_ref()) {
        for (sum, seconds) in sums.iter_mut().zip(by_cause) {
            *sum += seconds;
        }
    }
    sums
}
