//! How the margins of each machine change over time.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::seen::{Seen, by_machine};
use crate::page::percent;
use crate::page::svg::Chart;

/// Most machines with a chart, those with the smallest margins; the data set has all.
const MOST_MACHINES: usize = 48;
/// Most logs of a machine drawn one by one; of more logs only the lowest of each day.
const MOST_DOTS: usize = 150;
const DAY_NS: f64 = 86_400e9;
/// The smallest margin on the axis; smaller ones are drawn at its end.
const LOWEST: f64 = -0.5;

pub(super) fn machines(seen: &[Seen<'_>]) -> Markup {
    let mut machines: Vec<(f64, String, Vec<Point>)> = by_machine(seen)
        .into_iter()
        .map(|(name, logs)| {
            let points: Vec<Point> = logs.iter().filter_map(Point::of).collect();
            let least = points
                .iter()
                .map(|point| point.margin)
                .fold(f64::INFINITY, f64::min);
            (least, name, points)
        })
        .filter(|(_, _, points)| !points.is_empty())
        .collect();
    if machines.is_empty() {
        return html! { p { "No log has both a margin and a date." } };
    }
    machines.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    let days = machines
        .iter()
        .flat_map(|(_, _, points)| points.iter().map(|point| point.day));
    let first = days.clone().fold(f64::INFINITY, f64::min).floor();
    let last = days.fold(f64::NEG_INFINITY, f64::max).floor() + 1.0;
    let count = machines.len();
    let drawn: usize = machines.iter().map(|(_, _, points)| points.len()).sum();
    let undated = seen.len() - drawn;
    html! {
        p.hint {
            "A dot is the worst margin of a log, ± two standard deviations; it is black if a wheel or an edge had an event. "
            "The line connects the lowest margin of each day. Dashed: 0, where a wheel lifts. "
            @if count > MOST_MACHINES {
                "Shown are the " (MOST_MACHINES) " of " (count) " machines with the smallest margins. "
            }
            @if undated > 0 { (undated) " logs without a date or a margin are not drawn." }
        }
        div.grid {
            @for (_, name, points) in machines.iter().take(MOST_MACHINES) { (chart(name, points, (first, last))) }
        }
    }
}

struct Point {
    /// Days since 1970.
    day: f64,
    margin: f64,
    two_sigma: Option<f64>,
    has_event: bool,
    text: String,
}

impl Point {
    fn of(log: &Seen<'_>) -> Option<Self> {
        let date = log.record.day()?;
        let worst = log.facts.worst.as_ref()?;
        Some(Self {
            day: log.facts.start_ns as f64 / DAY_NS,
            margin: worst.margin,
            two_sigma: worst.sigma.map(|sigma| 2.0 * sigma),
            has_event: log.facts.has_findings(),
            text: format!("{}, {date}: {}", log.record.name(), percent(worst.margin)),
        })
    }
}

fn chart(name: &str, points: &[Point], days: (f64, f64)) -> Markup {
    let least = points.iter().map(|p| p.margin - p.two_sigma.unwrap_or(0.0));
    let floor = least.fold(-0.1, f64::min).max(LOWEST);
    let mut chart = Chart::new(name, days, (floor, 1.0));
    chart.guide(0.0);
    let mut lowest: BTreeMap<i64, &Point> = BTreeMap::new();
    for point in points {
        let day = lowest.entry(point.day.floor() as i64).or_insert(point);
        if point.margin < day.margin {
            *day = point;
        }
    }
    let line: Vec<(f64, f64)> = lowest
        .values()
        .map(|point| (point.day, point.margin))
        .collect();
    chart.line(&line, "lowest");
    let drawn: Vec<&Point> = match points.len() > MOST_DOTS {
        true => lowest.values().copied().collect(),
        false => points.iter().collect(),
    };
    for point in &drawn {
        if let Some(two_sigma) = point.two_sigma {
            chart.whisker(
                point.day,
                point.margin - two_sigma,
                point.margin + two_sigma,
            );
        }
    }
    for point in &drawn {
        let class = if point.has_event { "event" } else { "" };
        chart.dot(point.day, point.margin, class, &point.text);
    }
    for share in [0.0, 0.5, 1.0] {
        chart.label_y(share, &format!("{:.0} %", 100.0 * share));
    }
    chart.label_x(days.0, &date(days.0));
    if days.1 - days.0 > 1.0 {
        chart.label_x(days.1, &date(days.1 - 1.0));
    }
    chart.finish()
}

fn date(day: f64) -> String {
    let stamp = jiff::Timestamp::from_second((day * 86_400.0) as i64);
    stamp.map_or_else(
        |_| String::new(),
        |stamp| stamp.strftime("%Y-%m-%d").to_string(),
    )
}
