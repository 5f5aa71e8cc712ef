//! The machine seen from above, at any time of the log and at its most important events.
//!
//! This file selects the numbers; `moment.js` draws them.

use maud::{Markup, html};
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use tipwatch_language::{say, word};
use tipwatch_mechanics::{Placement, Quantity, State};

use super::area::Area;
use super::findings::{Scene, led_to};
use super::{machine_view, sheet};
use crate::analysis::Analysis;
use crate::base::rows::Rows;
use crate::base::table::Table;
use crate::events::{Event, EventKind};
use crate::page::readable;

/// Events that get instants of their own.
const MOST_EVENTS: usize = 60;
/// Events that are drawn beside the slider, and in print.
const MOST_PICTURES: usize = 6;

/// Data of the drawing. Positions are in the contact plane, forward and left, in m.
#[derive(Debug, Serialize)]
pub(super) struct Moments {
    /// Word for one of the supports.
    word: &'static str,
    /// Texts of the script.
    texts: Texts,
    wheels: Vec<WheelFacts>,
    instants: Vec<Instant>,
    /// Of each wheel, and of each segment of the arm, its numbers at all instants, one after the other: numbers of a kind pack together.
    #[serde(rename = "wheels_at")]
    wheel_columns: Vec<ColumnsOfSix>,
    #[serde(rename = "arm_at")]
    arm_columns: Vec<ColumnsOfSix>,
    /// The instants of the slider's marks in order of time, with their labels.
    events: Vec<Mark>,
    /// The events that get a picture, as indices into `events`.
    pictures: Vec<usize>,
    /// The instant shown first: that of the most important event.
    first: usize,
}

/// Six numbers of one thing at all instants.
type ColumnsOfSix = [Vec<Option<f64>>; 6];

/// Lengths in a picture are rounded to centimetres: steps in a metre.
const LENGTHS: f64 = 1e2;

/// Texts of the drawing, with their values as names in braces.
#[derive(Debug, Serialize)]
struct Texts {
    head: [&'static str; 4],
    range: &'static str,
    unknown: &'static str,
    off: &'static str,
    invalid: &'static str,
    no_gravity: &'static str,
    gravity: &'static str,
    gravity_to: &'static str,
}

#[derive(Debug, Serialize)]
struct WheelFacts {
    name: String,
    radius: f64,
    at_rest: Option<f64>,
    limit: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Mark {
    instant: usize,
    label: String,
}

/// The rows of the slider, evenly spread over the log.
#[derive(Debug)]
pub(super) struct Instants {
    step: usize,
    /// Their indices in the log.
    indices: Vec<usize>,
    rows: Rows,
}

impl Instants {
    /// At most so many, those of events not counted.
    pub(super) fn new(table: &Table, most: usize) -> Self {
        Self {
            step: table.len().div_ceil(most).max(1),
            indices: Vec::new(),
            rows: table.no_rows(),
        }
    }

    /// Takes the next rows.
    pub(super) fn add(&mut self, rows: &Rows) {
        let first = rows.first.next_multiple_of(self.step);
        for row in (first..rows.first + rows.len()).step_by(self.step) {
            self.indices.push(row);
            self.rows.push(rows, row - rows.first);
        }
    }
}

/// One instant; unknown values are null.
#[derive(Debug, Serialize)]
struct Instant {
    t: f64,
    /// By wheel: x, y, load (N), its standard deviation (N), least and largest load under any split (N).
    #[serde(skip)]
    wheels: Vec<[Option<f64>; 6]>,
    /// The wheels that are off the ground by the events, as indices.
    off: Vec<usize>,
    zmp: [Option<f64>; 2],
    /// Centre of mass: x, y, height above the plane.
    com: [Option<f64>; 3],
    /// Component of gravity along the contact plane: its direction, and the sine of its angle.
    gravity: [Option<f64>; 2],
    /// Angle between gravity and the normal of the contact plane (degrees): the slope of the ground while all wheels stand
    /// on it, more while the machine tips.
    tilt: Option<f64>,
    /// Corners of the area on which the machine stands: x, y; empty where its supports are unknown.
    area: Vec<[Option<f64>; 2]>,
    /// Axles that swing about a pivot: x, y of either end.
    axles: Vec<[[Option<f64>; 2]; 2]>,
    /// By segment: x, y, height at either end.
    #[serde(skip)]
    arm: Vec<[Option<f64>; 6]>,
    /// Reasons why the row is invalid; empty if it is valid.
    reasons: String,
}

/// The section's content; the script that fills it reads the moments.
pub(super) fn section(moments: &Moments) -> Markup {
    let pictures = moments
        .pictures
        .iter()
        .map(|&event| &moments.events[event].label);
    html! {
        p.hint {
            (say!("From above, forward is up; from the right, forward is to the right; in space, drag to turn. The area of a disc shows \
            the load of a {}; a dashed ring shows its load at rest. Diamond: zero moment point (ZMP), where the resulting force of the \
            ground acts, with its path over the last two seconds. Ring with a cross: centre of mass. Thick lines: arm. The machine tips \
            about an edge when the ZMP reaches it.", moments.word))
        }
        div.moment.screen {
            svg.top-view id="moment" role="img" aria-label=(word!("The machine seen from above")) {}
            svg.top-view id="moment-side" role="img" aria-label=(word!("The machine seen from the right")) {}
            svg.top-view.turn id="moment-space" role="img" aria-label=(word!("The bodies of the machine in space; drag to turn")) {}
            div.controls {
                label {
                    (word!("Time "))
                    input type="range" id="moment-time" min="0" max=(moments.instants.len().saturating_sub(1)) value="0" step="1";
                }
                p {
                    button type="button" id="moment-before" { (word!("◀ event")) } " "
                    button type="button" id="moment-after" { (word!("event ▶")) }
                }
                p id="moment-text" aria-live="polite" {}
                table id="moment-loads" {}
            }
        }
        div.pictures {
            @for (place, label) in pictures.enumerate() {
                figure {
                    svg.top-view id=(format_args!("picture-{place}")) role="img" aria-label=(label) {}
                    figcaption { (label) }
                }
            }
        }
    }
}

impl Moments {
    pub(super) fn of(analysis: &Analysis, spread: &Instants) -> Self {
        let rows = &analysis.rows;
        let mut important: Vec<&Event> = (analysis.events.iter())
            .filter(|event| event.kind.is_observed())
            .collect();
        important.sort_by_key(|event| event.importance());
        important.truncate(MOST_EVENTS);
        let mut shown = spread.indices.clone();
        shown.extend(important.iter().map(|event| rows.at(shown_ns(event))));
        shown.extend(sheet::row(analysis));
        shown.extend(rows.len().checked_sub(1));
        shown.sort_unstable();
        shown.dedup();
        let instant = |event: &Event| shown.partition_point(|&row| row < rows.at(shown_ns(event)));
        let scene = Scene::of(analysis);
        let mut by_time: Vec<(usize, &Event)> = important.iter().copied().enumerate().collect();
        by_time.sort_by_key(|(_, event)| shown_ns(event));
        let events = by_time.iter().map(|(_, event)| Mark {
            instant: instant(event),
            label: say!(
                "{}, t = {:.2} s",
                scene.kind_and_subject(event),
                scene.seconds(shown_ns(event))
            ),
        });
        // the gravest of the events at one instant
        let mut pictured_rows = Vec::new();
        let mut pictures = Vec::new();
        for (importance, event) in important.iter().enumerate() {
            let row = rows.at(shown_ns(event));
            let is_own_story = led_to(&analysis.events, event).is_none();
            if is_own_story && pictures.len() < MOST_PICTURES && !pictured_rows.contains(&row) {
                pictured_rows.push(row);
                pictures.extend(by_time.iter().position(|(other, _)| *other == importance));
            }
        }
        pictures.sort_unstable();
        let instants = instants(analysis, spread, &shown);
        Self {
            wheel_columns: columns(instants.iter().map(|instant| &instant.wheels)),
            arm_columns: columns(instants.iter().map(|instant| &instant.arm)),
            word: scene.word.one,
            texts: Texts {
                head: [
                    word!("Load [N]"),
                    "± 2 σ [N]",
                    word!("Any split [N]"),
                    word!("At rest [N]"),
                ],
                range: word!("{from} to {to}"),
                unknown: word!("unknown"),
                off: word!("off the ground"),
                invalid: word!("invalid row: {reasons}"),
                no_gravity: word!("direction of gravity unknown"),
                gravity: word!("gravity leans {angle}°"),
                gravity_to: word!("gravity leans {angle}°, to:"),
            },
            wheels: wheel_facts(analysis),
            first: sheet::row(analysis)
                .map_or(0, |row| shown.partition_point(|&other| other < row)),
            pictures,
            events: events.collect(),
            instants,
        }
    }
}

/// The numbers of each of some things at all instants, one number after the other.
fn columns<'a>(
    instants: impl Iterator<Item = &'a Vec<[Option<f64>; 6]>> + Clone,
) -> Vec<ColumnsOfSix> {
    let count = instants.clone().next().map_or(0, Vec::len);
    let column = |place: usize, number: usize| -> Vec<Option<f64>> {
        let numbers = instants.clone().map(|things| things.get(place)?[number]);
        numbers.collect()
    };
    (0..count)
        .map(|place| std::array::from_fn(|number| column(place, number)))
        .collect()
}

/// Returns the time at which an event is shown (ns): a lift and a tipping at their onset, for a fall follows; a light wheel at
/// its worst.
fn shown_ns(event: &Event) -> i64 {
    match event.kind {
        EventKind::WheelLift | EventKind::EdgeTipping | EventKind::TipOver => event.start_ns,
        _ => event.worst_ns,
    }
}

fn wheel_facts(analysis: &Analysis) -> Vec<WheelFacts> {
    let machine = &analysis.machine;
    let limits = analysis.min_loads_n.as_deref().unwrap_or_default();
    let wheels = machine.wheels().iter().enumerate();
    wheels
        .map(|(index, wheel)| WheelFacts {
            name: wheel.name.clone(),
            radius: wheel.radius,
            at_rest: known(machine.reference().static_load[index], 1.0),
            limit: limits.get(index).and_then(|&limit| known(limit, 1.0)),
        })
        .collect()
}

fn instants(analysis: &Analysis, spread: &Instants, shown: &[usize]) -> Vec<Instant> {
    let (machine, table) = (&analysis.machine, &analysis.rows);
    let is_alone = |row: &&usize| spread.indices.binary_search(row).is_err();
    let alone: Vec<usize> = shown.iter().filter(is_alone).copied().collect();
    let windows = alone.par_iter().map(|&row| table.window(row..row + 1));
    let windows: Vec<Rows> = windows.collect();
    let mut placement = Placement::new(machine);
    let mut state = State::zero(machine);
    let has_sigma = table.has(Quantity::LoadSigma(0));
    let mut instants = Vec::with_capacity(shown.len());
    for &row in shown {
        let (rows, at) = match spread.indices.binary_search(&row) {
            Ok(at) => (&spread.rows, at),
            Err(_) => (&windows[alone.partition_point(|&other| other < row)], 0),
        };
        rows.states.get(at, &mut state);
        placement.place(&state);
        let value = |quantity| {
            let means_something = rows.reasons[at].leave_loads();
            let value = rows.value(quantity, at);
            if means_something { value } else { f64::NAN }
        };
        let place = |point: &Vector3<f64>| {
            let at = placement.on_plane(point);
            [known(at.x, LENGTHS), known(at.y, LENGTHS)]
        };
        let wheel = |(index, contact): (usize, &Vector3<f64>)| {
            let [x, y] = place(contact);
            let sigma = match has_sigma {
                true => known(value(Quantity::LoadSigma(index)), 1.0),
                false => None,
            };
            let newtons = |quantity| known(value(quantity), 1.0);
            [
                x,
                y,
                newtons(Quantity::Load(index)),
                sigma,
                newtons(Quantity::LoadLeast(index)),
                newtons(Quantity::LoadLargest(index)),
            ]
        };
        let ground = placement.contacts.iter().map(|c| placement.normal.dot(c));
        let ground = ground.sum::<f64>() / placement.contacts.len() as f64;
        let in_space = |point: &Vector3<f64>| {
            let [x, y] = place(point);
            [x, y, known(placement.normal.dot(point) - ground, LENGTHS)]
        };
        let (gravity, tilt) = gravity(&placement, &state.base.up);
        let area = Area::of(table, row, &state);
        let off = machine_view::off_ground(analysis, row);
        let corner = |at: &Vector2<f64>| [known(at.x, LENGTHS), known(at.y, LENGTHS)];
        instants.push(Instant {
            t: known(table.seconds(row), 1e3).unwrap_or_default(),
            wheels: placement.contacts.iter().enumerate().map(wheel).collect(),
            off: (off.iter().enumerate())
                .filter_map(|(wheel, is_off)| is_off.then_some(wheel))
                .collect(),
            zmp: [
                known(value(Quantity::ZmpX), LENGTHS),
                known(value(Quantity::ZmpY), LENGTHS),
            ],
            com: in_space(&placement.centre_of_mass),
            gravity,
            tilt,
            area: area.corners.iter().map(corner).collect(),
            axles: (area.axles.iter())
                .map(|[from, to]| [corner(from), corner(to)])
                .collect(),
            arm: (placement.arm_segments.iter())
                .map(|[from, to]| {
                    let ([a, b, c], [d, e, f]) = (in_space(from), in_space(to));
                    [a, b, c, d, e, f]
                })
                .collect(),
            reasons: reasons(analysis, row),
        });
    }
    instants
}

/// Direction of gravity along the contact plane (its length is the sine of the angle), and the angle to its normal in
/// degrees.
fn gravity(placement: &Placement<'_>, up: &Vector3<f64>) -> ([Option<f64>; 2], Option<f64>) {
    let down = -placement.on_plane(up);
    let cosine = placement.normal.dot(up).clamp(-1.0, 1.0);
    let angle = known(cosine.acos().to_degrees(), 1e2);
    ([known(down.x, 1e4), known(down.y, 1e4)], angle)
}

fn reasons(analysis: &Analysis, row: usize) -> String {
    let names: Vec<String> = (analysis.rows.reasons[row].iter())
        .map(|reason| readable(reason.name()))
        .collect();
    names.join(", ")
}

/// A value rounded to 1 / `per_unit`; `None` if it is not finite.
fn known(value: f64, per_unit: f64) -> Option<f64> {
    Some((value * per_unit).round() / per_unit).filter(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_kind_stand_together() {
        let at = |time: f64| -> Vec<[Option<f64>; 6]> {
            let thing = |place: f64| {
                std::array::from_fn(|number| Some(100.0 * place + 10.0 * number as f64 + time))
            };
            vec![thing(0.0), thing(1.0)]
        };
        let instants = [at(1.0), at(2.0), at(3.0)];
        let columns = columns(instants.iter());
        assert_eq!(columns.len(), 2);
        assert_eq!(columns[1][4], [141.0, 142.0, 143.0].map(Some));
        assert!(super::columns([].into_iter()).is_empty());
    }
}
