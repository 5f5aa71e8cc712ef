//! How small margins were, how long, and why.

use super::{Seen, by_machine, raw_table, time};
use crate::base::number::number;
use crate::page::html;
use crate::page::svg::{Chart, round_up};
use crate::policy::facts::{EXPOSURE_CAUSES, HISTOGRAM_EDGES};

/// Bins of margins: one below 0, twenty of a twentieth each, one above 1.
const BINS: usize = HISTOGRAM_EDGES.len() + 1;
const BIN_WIDTH: f64 = 0.05;

pub(super) fn margins(seen: &[Seen<'_>]) -> String {
    if seen.is_empty() {
        return String::new();
    }
    let mut logs = vec![0.0; BINS];
    for worst in seen.iter().filter_map(|log| log.facts.worst.as_ref()) {
        logs[HISTOGRAM_EDGES.partition_point(|&edge| edge <= worst.margin)] += 1.0;
    }
    let hours: Vec<f64> = (0..BINS)
        .map(|bin| {
            seen.iter()
                .map(|log| log.facts.exposure.margin_s[bin])
                .sum::<f64>()
                / 3600.0
        })
        .collect();
    let mut charts = histogram("Worst margin of each log: number of logs", &logs, "logs");
    charts.push_str(&histogram("Margin at any time: hours", &hours, "h"));
    charts.push_str(&small_margins(&hours));
    let unknown: f64 = seen.iter().map(|log| log.facts.exposure.unknown_s).sum();
    format!(
        "<p class=\"hint\">Dark: a wheel off the ground. The margin cannot be computed for {} of {}; that time is in no bar.</p>\n\
         <div class=\"grid\">{charts}</div>\n",
        time(unknown),
        time(seen.iter().map(|log| log.facts.duration_s).sum())
    )
}

fn histogram(title: &str, counts: &[f64], unit: &str) -> String {
    let top = round_up(counts.iter().copied().fold(0.0, f64::max));
    let mut chart = Chart::new(title, (-BIN_WIDTH, 1.0 + BIN_WIDTH), (0.0, top));
    bars(&mut chart, counts, unit);
    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
        chart.label_x(share, &format!("{:.0} %", 100.0 * share));
    }
    finish(chart, top)
}

/// The same for the margins that matter, at their own scale.
fn small_margins(hours: &[f64]) -> String {
    let minutes: Vec<f64> = hours.iter().map(|hours| 60.0 * hours).collect();
    let shown = &minutes[..6];
    let top = round_up(shown.iter().copied().fold(0.0, f64::max));
    let mut chart = Chart::new(
        "The same below 25 %: minutes",
        (-BIN_WIDTH, 0.25),
        (0.0, top),
    );
    bars(&mut chart, shown, "min");
    for share in [0.0, 0.1, 0.2] {
        chart.label_x(share, &format!("{:.0} %", 100.0 * share));
    }
    finish(chart, top)
}

fn bars(chart: &mut Chart, counts: &[f64], unit: &str) {
    for (bin, &count) in counts.iter().enumerate() {
        let from = (bin as f64 - 1.0) * BIN_WIDTH;
        let class = if bin == 0 { "below" } else { "bar" };
        let told = match bin {
            0 => format!("below 0: {} {unit}", number(count)),
            _ if bin + 1 == BINS => format!("above 100 %: {} {unit}", number(count)),
            _ => {
                let (low, high) = (100.0 * from, 100.0 * (from + BIN_WIDTH));
                format!("{low:.0} to {high:.0} %: {} {unit}", number(count))
            }
        };
        if count > 0.0 {
            chart.bar(from, from + BIN_WIDTH, count, class, &told);
        }
    }
}

fn finish(mut chart: Chart, top: f64) -> String {
    chart.guide_up(0.0);
    chart.label_y(0.0, "0");
    chart.label_y(top, &format!("{top}"));
    chart.caption_x("margin (share of the static load)");
    chart.finish()
}

pub(super) fn causes(seen: &[Seen<'_>]) -> String {
    let sums = |logs: &[Seen<'_>]| -> Vec<f64> {
        let mut sums = vec![0.0; EXPOSURE_CAUSES.len()];
        for by_cause in logs
            .iter()
            .filter_map(|log| log.facts.exposure.exposed_by_cause_s.as_ref())
        {
            for (sum, seconds) in sums.iter_mut().zip(by_cause) {
                *sum += seconds;
            }
        }
        sums
    };
    let all = sums(seen);
    let exposed: f64 = seen.iter().map(|log| log.facts.exposure.exposed_s).sum();
    if exposed == 0.0 {
        return "<p>No machine came below the notice level (a margin of 25 % where the machine file says nothing else).</p>\n".into();
    }
    let attributed: f64 = all.iter().sum();
    let mut order: Vec<usize> = (0..all.len()).filter(|&i| all[i] > 0.0).collect();
    order.sort_by(|&a, &b| all[b].total_cmp(&all[a]));
    let bars: String = order
        .iter()
        .map(|&i| {
            let share = 100.0 * all[i] / attributed;
            format!(
                "<span>{}</span><div class=\"track\"><div class=\"fill\" style=\"width:{share:.1}%\"></div></div><span class=\"number\">{} ({share:.1} %)</span>\n",
                EXPOSURE_CAUSES[i].replace('_', " "),
                time(all[i])
            )
        })
        .collect();
    let machines: Vec<Vec<String>> = by_machine(seen)
        .iter()
        .map(|(name, logs)| {
            let exposed = logs.iter().map(|log| log.facts.exposure.exposed_s).sum();
            let by_cause = sums(logs);
            let causes = order.iter().map(|&i| time(by_cause[i]));
            let first = [html::escape(name), time(exposed)];
            first.into_iter().chain(causes).collect()
        })
        .collect();
    let names = order.iter().map(|&i| EXPOSURE_CAUSES[i].replace('_', " "));
    let head: Vec<String> = ["machine".into(), "exposed".into()]
        .into_iter()
        .chain(names)
        .collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    format!(
        "<p class=\"hint\">Exposed is the time with a margin below the notice level (25 % where the machine file says nothing \
         else): {} in all. Each moment is shared out to what takes load from the worst wheel then, against the static load. \
         Posture is the weight of chassis, wheels and arm, placed otherwise than in the static posture.</p>\n\
         <div class=\"bars\">{bars}</div>\n{}",
        time(exposed),
        raw_table("causes", &head, &machines)
    )
}
