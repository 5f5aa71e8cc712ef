//! Basis of the results: methods, assumptions, validation, limitations of this analysis.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::machine::{Ground, Machine, Split, SupportKind};

use super::findings::reason_counts;
use super::unstated_load;
use crate::analysis::Analysis;
use crate::analysis::measured_loads::Contradiction;
use crate::base::options::{Estimator, ModelKind};
use crate::events::split_rule::measured_forces;
use crate::events::support_words::SupportWord;
use crate::page::{list, percent, readable, table};

/// The measured accuracy stands in one place, where a test keeps it true.
const README: &str = include_str!("../../../README.md");
/// Lost ranges listed; `summary.json` has all.
const MOST_LISTED: usize = 100;

/// Renders the methods by which the loads were computed.
pub(super) fn methods(analysis: &Analysis) -> Markup {
    let estimator = match analysis.options.estimator {
        Estimator::Smoother => word!("Smoother: each row uses earlier and later samples."),
        Estimator::Causal => {
            word!(
                "Causal estimator: each row uses earlier samples alone, as the live monitor does."
            )
        }
    };
    let model = match analysis.options.model {
        ModelKind::WholeBody => {
            word!("Forces and moments by recursive Newton-Euler dynamics over all bodies.")
        }
        ModelKind::VariableInertia => {
            word!("Analytic model with the inertia of the platform depending on its actuators.")
        }
        ModelKind::ClosedForm => {
            word!("Analytic model with a rigid platform and the suspension at mid stroke.")
        }
    };
    let contact = analysis.machine.contact();
    let split = match &contact.split {
        Split::RollMomentDistribution { share, .. } => say!(
            "What equilibrium leaves open of the load split follows from the stated rule: the front axle carries {:.0} % of \
             the load difference between the sides.",
            100.0 * share
        ),
        Split::Springs => say!(
            "What equilibrium leaves open of the load split follows from the stated rule: {} are springs \
            of their stiffness under a rigid frame.",
            SupportWord::of(&analysis.machine).many
        ),
    };
    let measured = measured_forces(&analysis.machine, analysis.torques.rows_by_forces).map(|of| {
        say!("Where the log has them, the measured forces of {of} determine the load split, and the rule has no effect.")
    });
    let items = [estimator.to_string(), model.to_string(), split];
    let items = items.into_iter().chain(measured).chain([
        word!("The envelope is the range of loads over all splits that equilibrium allows, without any rule.").into(),
        word!("Bands of two standard deviations (± 2 σ) propagate the stated uncertainties of signals and parameters to first order; \
         they hold under the stated split.").into(),
        word!("A finding's confidence is the probability, from the standard deviation of the OTF under the stated split, that the \
         limit was passed.").into(),
    ]);
    html! { (list(items)) }
}

/// Renders the validation: errors on logs with known loads, of machines of this kind.
pub(super) fn validation(machine: &Machine) -> Markup {
    let lines = validation_table();
    // head and rule come before the rows
    let (head, rows) = lines.split_at(lines.len().min(2));
    let kind = validated_kind(machine);
    let is_known = kind.is_some();
    let head = head.first().map_or(Vec::new(), |line| cells(line));
    let rows = rows.iter().map(|line| cells(line));
    let of_kind = |row: &Vec<String>| kind.is_none_or(|kind| row[0] == kind);
    let rows: Vec<Vec<String>> = rows.filter(of_kind).map(in_words).collect();
    let head = in_words(head);
    html! {
        @if !is_known { p { (word!("No machine of this kind was validated. These are the figures of other kinds.")) } }
        p {
            (word!("Root mean square error of the loads as a share of the mean load, clean / noisy sensors, against the contact forces \
             of an independent simulator. These figures hold for those machines and manoeuvres; they are not a bound for this \
             log. They do not hold after a machine has begun to tip. No log of a real tip-over with known loads was available."))
        }
        (table(&head, &rows))
    }
}

/// Kinds of machines of which loads were validated, as the first cells of the table name them.
const ON_FOUR_WHEELS: &str = "on four wheels";
const ON_BOGIES: &str = "on bogies";
const CRANE: &str = "crane on outriggers";
const FORKLIFT: &str = "forklift on three points";

/// The kind of a machine, if it was validated: what it stands on decides how equilibrium shares the load.
fn validated_kind(machine: &Machine) -> Option<&'static str> {
    let wheels = machine.wheels();
    let has = |kind: SupportKind| wheels.iter().any(|wheel| wheel.kind == kind);
    let swings = !machine.contact().free_joints.is_empty();
    match (swings, wheels.len()) {
        _ if has(SupportKind::Foot) => Some(CRANE),
        _ if has(SupportKind::TrackPoint) => None,
        (true, 4) => Some(FORKLIFT),
        (true, 5..) => Some(ON_BOGIES),
        (false, 4) => Some(ON_FOUR_WHEELS),
        _ => None,
    }
}

/// The cells of a line of the table.
fn cells(line: &str) -> Vec<String> {
    let cells = line.trim_matches('|').split('|');
    cells.map(|cell| without_links(cell.trim())).collect()
}

fn in_words(cells: Vec<String>) -> Vec<String> {
    let words = |cell: String| decimals(readable(&cell));
    cells.into_iter().map(words).collect()
}

/// "[text](address)" as its text: the addresses of the README lead nowhere from a report.
fn without_links(cell: &str) -> String {
    let mut text = String::new();
    let mut rest = cell;
    while let Some((before, (name, after))) = rest.split_once('[').and_then(|(before, after)| {
        let (name, after) = after.split_once("](")?;
        Some((before, (name, after.split_once(')')?.1)))
    }) {
        text += before;
        text += name;
        rest = after;
    }
    text + rest
}

/// Lines of the table of accuracy: head, rule, rows.
fn validation_table() -> Vec<&'static str> {
    let section = README.split("## Accuracy").nth(1).unwrap_or_default();
    let section = section.split("\n## ").next().unwrap_or_default();
    section
        .lines()
        .filter(|line| line.starts_with('|'))
        .collect()
}

/// Renders the limitations that a reader must know before relying on the results: only those that follow from this log and
/// machine.
pub(super) fn limitations(analysis: &Analysis) -> Markup {
    let mut sentences = of_model(analysis);
    sentences.extend(of_log(analysis));
    let findings: Vec<&str> = analysis.notes.iter().map(|note| &**note).collect();
    let losses = &analysis.losses;
    let lost: Vec<String> = losses.lines().take(MOST_LISTED).collect();
    html! {
        (list(&sentences))
        @if !findings.is_empty() { h3 { (word!("Notes of the analysis")) } (list(&findings)) }
        h3 { (word!("Losses of the log")) }
        @if lost.is_empty() {
            p { (word!("No damaged bytes were found in the parts of the log that were read.")) }
        } @else {
            p { (say!("{} bytes of the log were lost; ranges: {}", losses.bytes_lost(), losses.ranges.len())) }
            (list(&lost))
            @if losses.ranges.len() > MOST_LISTED {
                p { (say!("{} more lost ranges are in summary.json.", losses.ranges.len() - MOST_LISTED)) }
            }
        }
    }
}

/// About what a machine with an axle that swings about a pivot tips, and for how long its indicators say so.
pub(super) fn about_pivot(machine: &Machine) -> Option<&'static str> {
    let mut edges = machine.polygon().edges().iter();
    let is_astride = edges.any(|edge| machine.axles_astride(edge).next().is_some());
    is_astride.then(|| {
        word!("Over its sides the machine tips about a line to the pivot of an axle. Loads, moments, angles and the margin of the zero moment point are about it until the axle rests against its stop.")
    })
}

fn of_model(analysis: &Analysis) -> Vec<String> {
    let machine = &analysis.machine;
    let contact = machine.contact();
    let word = SupportWord::of(machine);
    let mut found = Vec::new();
    if contact.ground == Ground::Unknown && analysis.digest.open_split > 0.05 {
        found.push(say!(
            "The shape of the ground under the {} is unknown. Equilibrium leaves open how the load is shared: the envelope \
             of a {} is {} of its load at rest wide in the median.",
            word.many,
            word.one,
            percent(analysis.digest.open_split)
        ));
    }
    if !contact.tyres_deflect {
        found.push(match word.is_wheel() {
            true => {
                word!("No tyre stiffness is stated: how far the tyres deflect is left out.").into()
            }
            false => say!(
                "No stiffness of the {} is stated: how far they deflect is left out.",
                word.many
            ),
        });
    }
    if machine.suspension().is_none() && machine.linkages().is_empty() {
        found.push(say!(
            "No suspension is described: compliance between frame and {} is left out.",
            word.many
        ));
    }
    if let Some(about_pivot) = about_pivot(machine) {
        found.push(about_pivot.into());
        found.push(word!("The stop of the axle is not modelled, and what explains such a rotation (an unstated load, another mass) is not tried.").into());
    }
    found.push(
        word!("Flexibility of frame and arm, tyre camber and lateral tyre deflection are not modelled.")
            .into(),
    );
    if machine.payloads().is_empty() && machine.arm_mounting().is_some() {
        let spans = &analysis.load_comparison.contradictions;
        let but = match spans.iter().any(Contradiction::is_followed) {
            true => word!(" where these do not follow the measured ones"),
            false => "",
        };
        found.push(say!(
            "No payload is stated: whatever the arm held beyond the masses of the URDF is missing from the loads{but}."
        ));
    }
    if machine.tool().is_none() && machine.arm_mounting().is_some() {
        found.push(word!("No force on the tool was logged: a contact of the arm with the ground or a load would be invisible.").into());
    }
    found
}

fn of_log(analysis: &Analysis) -> Vec<String> {
    let has = |signal: &str| analysis.inputs.iter().any(|input| input.signal == signal);
    let mut found = Vec::new();
    if !has("imu") {
        found.push(word!("No inertial measurement unit (IMU) was recorded.").into());
    }
    if !has("odometry") {
        found.push(
            word!("No odometry was recorded: speed, path and cornering are unknown, and acceleration cannot be told apart from slope.").into(),
        );
    }
    if !analysis.digest.has_attitude {
        found.push(
            word!("No attitude was recorded: the slope is unknown (the loads do not need it).")
                .into(),
        );
    }
    if !analysis.coverage.is_whole() {
        found.push(say!(
            "{} in {} of the log.",
            unstated_load::known_loads(analysis),
            analysis.coverage
        ));
    }
    found.extend(
        reason_counts(analysis)
            .into_iter()
            .map(|(reason, count)| match count {
                1 => say!("One row is invalid because of {}.", readable(reason.name())),
                _ => say!(
                    "{count} rows are invalid because of {}.",
                    readable(reason.name())
                ),
            }),
    );
    let unused: u64 = analysis
        .inputs
        .iter()
        .map(|input| input.samples_implausible)
        .sum();
    if unused > 0 {
        found.push(say!("{unused} samples were implausible."));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_validation_figures_are_those_of_the_readme() {
        let lines = validation_table();
        assert!(lines.len() >= 6, "{lines:?}");
        assert!(lines[0].contains("manoeuvre") && lines[1].starts_with("|-"));
        assert!(lines[2..].iter().all(|line| line.contains('%')));
        // each kind has its rows, and each row is of a kind
        let kinds = [ON_FOUR_WHEELS, ON_BOGIES, CRANE, FORKLIFT];
        let of_rows: Vec<String> = lines[2..]
            .iter()
            .map(|line| cells(line).remove(0))
            .collect();
        assert!(kinds.iter().all(|kind| of_rows.iter().any(|it| it == kind)));
        assert!(of_rows.iter().all(|it| kinds.contains(&it.as_str())));
    }

    #[test]
    fn a_link_of_the_readme_is_its_text() {
        assert_eq!(without_links("[a](b/c.md), one; [d](e)"), "a, one; d");
        assert_eq!(without_links("no [link"), "no [link");
        let cells = validation_table().into_iter().flat_map(cells);
        assert!(!cells.collect::<String>().contains("]("));
    }
}
