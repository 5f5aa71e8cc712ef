//! Loads, attitude and motion over the seconds around an incident, or around the smallest load of a log without one.

use maud::{Markup, html};
use tipwatch_language::{say, word};
use tipwatch_mechanics::{Placement, Quantity, State};

use crate::analysis::Analysis;
use crate::base::rows::Rows;
use crate::events::EventKind;
use crate::events::support_words::SupportWord;
use crate::page::svg::{Chart, round_up};
use crate::report::findings::Incident;
use crate::report::unstated_load;

/// Time before and after the incident, and the longest time that is drawn (s).
const BEFORE_S: f64 = 2.0;
const AFTER_S: f64 = 1.5;
const LONGEST_S: f64 = 30.0;
/// Of a tip-over, time that is drawn after its onset (s): what follows is the impact.
const FALL_S: f64 = 5.0;
/// Around the smallest load of a log without an event, time and rows before and after it that are drawn at least (s).
const CLOSEST_S: f64 = 5.0;
const FEWEST_ROWS: usize = 10;
/// Points of a curve.
const POINTS: usize = 260;
/// Classes of lines that can be told apart in black and white.
const LINES: [&str; 4] = ["line-a", "line-b", "line-c", "line-d"];
/// Most curves in a chart: the wheels of the incident first.
const MOST_WHEELS: usize = 4;

/// A named curve: time (s), value, half of its band.
type Named = (String, Vec<(f64, f64, f64)>);

/// What the figures are around.
struct Focus {
    /// Start and end (s).
    span_s: (f64, f64),
    mark: Mark,
    wheels: Vec<usize>,
    /// Title of the chart of the loads.
    loads: String,
}

/// The figures around the onset of an incident.
pub(super) fn figures(analysis: &Analysis, incident: &Incident<'_>) -> Markup {
    let rows = &analysis.rows;
    let last_s = rows.seconds(rows.len().saturating_sub(1));
    let seconds = |time_ns: i64| rows.seconds_at(time_ns);
    let gravest = incident.gravest();
    let from_s = (seconds(incident.start_ns()) - BEFORE_S).max(0.0);
    let ends = incident
        .events
        .iter()
        .map(|event| event.end_ns.map_or(last_s, seconds));
    let to_s = ends.fold(0.0, f64::max) + AFTER_S;
    // of a long incident the onset of what was gravest
    let from_s = from_s.max(seconds(gravest.start_ns) - 0.5 * LONGEST_S);
    let to_s = to_s.min(last_s).min(from_s + LONGEST_S);
    let to_s = match gravest.kind {
        EventKind::TipOver => to_s.min(seconds(gravest.start_ns) + FALL_S),
        _ => to_s,
    };
    let own = incident.events.iter();
    let own = own.filter_map(|event| analysis.machine.wheel_named(&event.subject));
    drawn(
        analysis,
        &Focus {
            span_s: (from_s, to_s),
            mark: Mark {
                at_s: seconds(gravest.start_ns),
                row: rows.at(gravest.start_ns),
                caption: match gravest.hides_onset() {
                    true => word!("t [s]; dashed upright: first shown"),
                    false => word!("t [s]; dashed upright: onset"),
                },
            },
            wheels: wheels(analysis, own, rows.at(gravest.start_ns)),
            loads: match unstated_load::contradicts(analysis, gravest) {
                true => word!("Loads of the stated machine, without the fall ± 2 σ [N]").into(),
                false => title_of_loads(analysis),
            },
        },
    )
}

/// The figures around the row in which a wheel carried least compared with its load at rest, of a log without an event.
pub(super) fn closest(analysis: &Analysis, row: usize, wheel: usize) -> Markup {
    let rows = &analysis.rows;
    let at_s = rows.seconds(row);
    let last = rows.len().saturating_sub(1);
    // of a sparse log so many rows that they show a course
    let far = [
        row.saturating_sub(FEWEST_ROWS),
        (row + FEWEST_ROWS).min(last),
    ];
    let [from_s, to_s] = far.map(|row| (rows.seconds(row) - at_s).abs());
    let reach_s = |rows_s: f64| rows_s.clamp(CLOSEST_S, 0.5 * LONGEST_S);
    let from_s = (at_s - reach_s(from_s)).max(0.0);
    let to_s = (at_s + reach_s(to_s)).min(rows.seconds(last));
    drawn(
        analysis,
        &Focus {
            span_s: (from_s, to_s),
            mark: Mark {
                at_s,
                row,
                caption: word!("t [s]; dashed upright: closest"),
            },
            wheels: wheels(analysis, [wheel].into_iter(), row),
            loads: title_of_loads(analysis),
        },
    )
}

fn title_of_loads(analysis: &Analysis) -> String {
    say!(
        "{} loads ± 2 σ [N]",
        SupportWord::of(&analysis.machine).head
    )
}

fn drawn(analysis: &Analysis, focus: &Focus) -> Markup {
    let rows = &analysis.rows;
    let (from_s, to_s) = focus.span_s;
    let at = |s: f64| rows.at(rows.times_ns[0].saturating_add((s * 1e9) as i64));
    let (first, end) = (at(from_s), at(to_s) + 1);
    let window = rows.window(first..end.min(rows.len()));
    let curves = Curves::of(analysis, &window, &focus.wheels, focus.mark.row);
    let (span, mark) = ((from_s, to_s.max(from_s + 0.1)), &focus.mark);
    html! {
        div.grid.four {
            (chart(&focus.loads, &curves.loads, span, mark, true))
            (chart(word!("Roll and pitch [°]"), &curves.attitude, span, mark, false))
            (chart(word!("Speed [m/s]"), &curves.speed, span, mark, false))
            (chart(word!("Yaw rate [°/s]"), &curves.yaw_rate, span, mark, false))
        }
    }
}

struct Curves {
    loads: Vec<Named>,
    attitude: Vec<Named>,
    speed: Vec<Named>,
    yaw_rate: Vec<Named>,
}

impl Curves {
    fn of(analysis: &Analysis, rows: &Rows, wheels: &[usize], marked: usize) -> Self {
        let machine = &analysis.machine;
        let has_sigma = analysis.rows.has(Quantity::LoadSigma(0));
        let named = |name: &str| (name.to_owned(), Vec::new());
        let mut found = Self {
            loads: wheels
                .iter()
                .map(|&wheel| named(&machine.wheels()[wheel].name))
                .collect(),
            attitude: vec![named(word!("roll")), named(word!("pitch"))],
            speed: vec![named(word!("speed"))],
            yaw_rate: vec![named(word!("yaw rate"))],
        };
        let mut placement = Placement::new(machine);
        let mut state = State::zero(machine);
        for row in evenly(rows.len(), marked.saturating_sub(rows.first)) {
            let time_s = analysis.rows.seconds(rows.first + row);
            let is_known = rows.reasons[row].leave_loads();
            for (curve, &wheel) in found.loads.iter_mut().zip(wheels) {
                let value = |quantity| {
                    if is_known {
                        rows.value(quantity, row)
                    } else {
                        f64::NAN
                    }
                };
                let sigma = if has_sigma {
                    value(Quantity::LoadSigma(wheel))
                } else {
                    f64::NAN
                };
                curve
                    .1
                    .push((time_s, value(Quantity::Load(wheel)), 2.0 * sigma));
            }
            rows.states.get(row, &mut state);
            placement.place(&state);
            let up = &state.base.up;
            // beyond half a turn it goes on
            let roll = up.y.atan2(up.z).to_degrees();
            let before = found.attitude[0].1.iter().rev().map(|point| point.1);
            let roll = match before.into_iter().find(|value| value.is_finite()) {
                Some(before) => roll + 360.0 * ((before - roll) / 360.0).round(),
                None => roll,
            };
            let pitch = (-up.x).atan2(up.y.hypot(up.z)).to_degrees();
            let yaw = placement
                .normal
                .dot(&placement.angular_velocity)
                .to_degrees();
            let values = [roll, pitch, state.base.velocity.x, yaw];
            let motion = found.speed.iter_mut().chain(&mut found.yaw_rate);
            let curves = found.attitude.iter_mut().chain(motion);
            for (curve, value) in curves.zip(values) {
                curve.1.push((time_s, value, f64::NAN));
            }
        }
        found
    }
}

/// Rows to draw of so many, evenly spread, with the marked one: the curve reaches what is said of it.
fn evenly(rows: usize, marked: usize) -> impl Iterator<Item = usize> {
    let step = rows.div_ceil(POINTS).max(1);
    (marked % step..rows).step_by(step)
}

/// Wheels of their own, and then others that stand in a row, so many as a chart shows.
fn wheels(analysis: &Analysis, own: impl Iterator<Item = usize>, row: usize) -> Vec<usize> {
    let all = analysis.machine.wheels();
    let mut chosen: Vec<usize> = Vec::new();
    // a raised wheel has no load to show
    let found = analysis.rows.window(row..row + 1);
    let stands = |wheel: &usize| found.value(Quantity::Load(*wheel), 0).is_finite();
    let others = (0..all.len()).filter(stands).chain(0..all.len());
    for wheel in own.chain(others) {
        if !chosen.contains(&wheel) && chosen.len() < MOST_WHEELS {
            chosen.push(wheel);
        }
    }
    chosen
}

/// The dashed upright: the onset, of a fall whose onset the log does not show the first row that shows it, or the smallest load.
struct Mark {
    at_s: f64,
    /// The row at this time, or the last before it.
    row: usize,
    caption: &'static str,
}

fn chart(title: &str, curves: &[Named], span: (f64, f64), mark: &Mark, from_zero: bool) -> Markup {
    let values = || {
        let points = curves.iter().flat_map(|(_, points)| points);
        points
            .map(|point| point.1)
            .filter(|value| value.is_finite())
    };
    let (Some(low), Some(high)) = (values().reduce(f64::min), values().reduce(f64::max)) else {
        return html! {};
    };
    let (low, high) = match from_zero {
        true => (0.0, round_up(high)),
        false => (-round_up(-low.min(-0.5)), round_up(high.max(0.5))),
    };
    let mut chart = Chart::quarter(title, span, (low, high));
    // the title names a single curve
    let is_named = curves.len() > 1;
    if is_named {
        chart = chart.with_names(curves.iter().map(|(name, _)| name.as_str()));
    }
    for (_, points) in curves {
        let band = points
            .iter()
            .map(|&(t, value, half)| (t, (value - half).max(low), value + half));
        chart.area(&band.collect::<Vec<_>>(), "band");
    }
    chart.mark_up(mark.at_s, "event");
    let mut names: Vec<(f64, &str, &str)> = Vec::new();
    for (index, (name, points)) in curves.iter().enumerate() {
        let class = LINES[index % LINES.len()];
        let line: Vec<(f64, f64)> = points.iter().map(|&(t, value, _)| (t, value)).collect();
        chart.curve(name, &line, class);
        let known = line.iter().rev().find(|(_, value)| value.is_finite());
        names.extend(known.map(|&(_, value)| (value, name.as_str(), class)));
    }
    if is_named {
        chart.names(names);
    }
    for share in [0.0, 0.5, 1.0] {
        let time = span.0 + share * (span.1 - span.0);
        chart.label_x(time, &format!("{time:.1}"));
    }
    let lowest = Some(low).filter(|low| *low < 0.0);
    for value in lowest.into_iter().chain([0.0, high]) {
        // ends that are close to zero would cover its label
        if value == 0.0 || value.abs() > 0.12 * (high - low) {
            chart.label_y(value, &value.to_string());
        }
    }
    chart.caption_x(mark.caption);
    chart.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of ten seconds at 1 kHz one row in 39 was drawn, and hardly ever the one that the sentence is about.
    #[test]
    fn the_row_that_is_marked_is_drawn() {
        for (rows, marked) in [(10_000, 5_017), (261, 1), (100, 99), (1, 0)] {
            let drawn: Vec<usize> = evenly(rows, marked).collect();
            assert!(drawn.contains(&marked), "{rows} {marked}");
            assert!(drawn.len() <= POINTS && drawn.iter().all(|&row| row < rows));
        }
        assert_eq!(evenly(0, 0).count(), 0);
    }
}
