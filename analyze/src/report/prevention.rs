//! Prevention of the worst event: the simulated advice as a section and as a finding.

use std::collections::BTreeSet;

use maud::{Markup, html};
use tipwatch_language::{is_english, say, told, word};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Wheel;

use super::unstated_load;
use crate::analysis::Analysis;
use crate::analysis::advice::{Advice, BeforeAfter, SimulatedChange};
use crate::base::number::number;
use crate::base::options::ModelKind;
use crate::events::support_words::SupportWord;
use crate::events::{Answer, Event, Finding};
use crate::page::{Bar, bars, list, probability, readable, short, table, whole, with_sure_band};

/// Most changes shown in the chart and the table.
const MOST_SHOWN: usize = 8;
/// Most changes in a finding.
const MOST_IN_FINDING: usize = 3;

/// Rows of an event that are evaluated at once.
const ROWS_AT_ONCE: usize = 4096;

/// The section of the report.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let Some(advice) = &analysis.advice else {
        return html! { p { (without_advice(analysis)) } };
    };
    let word = SupportWord::of(&analysis.machine);
    let shown: Vec<&SimulatedChange> = advice.changes.iter().take(MOST_SHOWN).collect();
    let bar = |change: &&SimulatedChange| Bar {
        label: change.statement.clone(),
        share: change.effort,
        text: say!(
            "{:.0} % of {}",
            100.0 * change.effort,
            told(change.effort_of)
        ),
    };
    let seconds = |time_ns: i64| analysis.rows.seconds_at(time_ns);
    html! {
        p {
            (say!(
                "In the valid rows {} {} carried least: its overturning force (OTF) was {} N at t = {:.2} s, its limit is {} N. {}",
                word_of(analysis, &advice.wheel).one,
                display(analysis, &advice.wheel),
                number(advice.worst_otf_n),
                seconds(advice.worst_ns),
                number(advice.limit_n),
                conclusion(analysis, advice)
            ))
        }
        @if !shown.is_empty() {
            p {
                (say!(
                    "Each change was put back into the model and evaluated from t = {:.2} to {:.2} s ({} rows). It is the smallest amount \
                     with which every {} stays at its limit in every row, and the machine comes no nearer to an edge than it did. \
                     A bar shows the effort: the change as a share of its reference value.",
                    seconds(advice.from_ns),
                    seconds(advice.to_ns),
                    advice.rows,
                    word.one
                ))
            }
            (bars(&shown.iter().map(bar).collect::<Vec<_>>()))
            (results(analysis, &shown))
        }
        @if !advice.rejected.is_empty() {
            details {
                summary { (say!("Changes that were tried and do not hold ({})", advice.rejected.len())) }
                (list(advice.rejected.iter().map(|tried| format!("{}: {}", tried_in_words(&tried.name), tried.reason))))
            }
        }
        details {
            summary { (word!("Assumptions of the simulation")) }
            (list(assumptions(advice, word)))
        }
    }
}

/// The smallest changes, for the first page.
pub(super) fn brief(analysis: &Analysis) -> Markup {
    let advice = analysis.advice.as_ref();
    let changes = advice.into_iter().flat_map(|advice| &advice.changes);
    let changes: Vec<&SimulatedChange> = changes.take(MOST_IN_FINDING).collect();
    let rows = changes.iter().map(|change| {
        let chance = change.chance.map_or(word!("unknown").into(), probability);
        vec![
            html! { (change.statement) },
            html! { (least_otf(change)) },
            whole(chance),
        ]
    });
    let rows: Vec<Vec<Markup>> = rows.collect();
    let word = SupportWord::of(&analysis.machine).one;
    // a change that meets the limit in the simulation may miss it by what is uncertain
    let keeps = |change: &&SimulatedChange| Answer::of(change.chance) == Answer::Yes;
    let title = match changes.iter().all(keeps) {
        true => say!("Simulated: what would have kept every {word} at its limit"),
        false => say!("Simulated: with which every {word} just keeps its limit"),
    };
    html! {
        div {
            h3 { (title) }
            @if rows.is_empty() {
                p { (advice.map_or_else(|| without_advice(analysis), |advice| conclusion(analysis, advice))) }
            } @else {
                (table(&[word!("Change, alone"), word!("Smallest OTF [N]"), word!("Chance")], &rows))
                p.hint { (say!("Simulated over the whole incident, everything else as logged. Chance: that every {word} keeps its limit.")) }
            }
        }
    }
}

/// The stable name of a change in words.
fn tried_in_words(name: &str) -> String {
    match name {
        "arm.speed" => return word!("A slower arm").into(),
        "manoeuvre.speed" => return word!("Machine and arm slower").into(),
        "base.forward_acceleration" => return word!("Less braking and accelerating").into(),
        "base.yaw_rate" => return word!("A wider curve").into(),
        "tool.wrench" => return word!("Less force on the tool").into(),
        _ => {}
    }
    match name.rsplit_once('.') {
        Some((joint, "position (higher)")) => say!("Joint {joint} in its positive sense"),
        Some((joint, "position (lower)")) => say!("Joint {joint} in its negative sense"),
        Some((of, "mass")) => say!("Less mass of {}", of.replace('_', " ")),
        _ => name.into(),
    }
}

/// The finding, if a wheel fell below its limit in an event.
pub(super) fn finding(analysis: &Analysis) -> Option<Finding> {
    let advice = analysis.advice.as_ref()?;
    let wheel = display(analysis, &advice.wheel);
    let word = word_of(analysis, &advice.wheel);
    let others = SupportWord::of(&analysis.machine).many;
    let headline = match &advice.changes[..] {
        [] => format!(
            "{} {wheel}: {}",
            word.head,
            lower_first(&conclusion(analysis, advice))
        ),
        [first, ..] => {
            let (change, split) = (&first.statement, under_which_split(first));
            match (Answer::of(first.chance), first.chance) {
                (Answer::Yes, _) => say!(
                    "Simulated: {change} would have kept {} {wheel} and the others at their load limits{split}",
                    word.one
                ),
                (_, Some(chance)) => say!(
                    "Simulated: with {change}, {} {wheel} and the others just keep their load limits{split}; the chance that they would have kept them is {}",
                    word.one,
                    probability(chance)
                ),
                (_, None) => say!(
                    "Simulated: with {change}, {} {wheel} and the others just keep their load limits{split}; how likely they would have kept them is not known",
                    word.one
                ),
            }
        }
    };
    let evidence = advice.changes.iter().take(MOST_IN_FINDING).map(|change| {
        say!(
            "With {}{}: minimum OTF {} N (limit {} N), other {others} at least {} N, ZMP margin {}",
            change.statement,
            chance(change),
            least_otf(change),
            number(advice.limit_n),
            number(others_least(advice, change)),
            from_to(change.zmp_margin_m, "m")
        )
    });
    let mut evidence: Vec<String> = evidence.collect();
    evidence.push(
        word!("Assumes that everything else stays as logged (ground, motion of the base, other joints) and that nobody reacts")
            .into(),
    );
    Some(Finding { headline, evidence })
}

/// Describes the probability that a change succeeds.
fn chance(change: &SimulatedChange) -> String {
    let chance = change.chance.map(probability);
    chance.map_or(String::new(), |chance| say!(" (chance {chance})"))
}

/// The wheel or other support of this name in lower case.
fn named<'a>(analysis: &'a Analysis, wheel: &str) -> Option<&'a Wheel> {
    let machine = &analysis.machine;
    machine
        .wheel_named(wheel)
        .map(|wheel| &machine.wheels()[wheel])
}

/// The word for it.
fn word_of(analysis: &Analysis, wheel: &str) -> SupportWord {
    SupportWord::of_all(named(analysis, wheel).map(|spec| spec.kind))
}

/// Its name as in the machine file.
fn display<'a>(analysis: &'a Analysis, wheel: &'a str) -> &'a str {
    named(analysis, wheel).map_or(wheel, |spec| &spec.name)
}

fn without_advice(analysis: &Analysis) -> String {
    let word = SupportWord::of(&analysis.machine);
    let mut events = analysis.events.iter();
    if analysis.options.model != ModelKind::WholeBody {
        word!("The chosen model does not simulate changes.").into()
    } else if (analysis.events.iter()).any(|event| event.hides_onset() && event.is_fact()) {
        Event::onset_not_shown().into()
    } else if events.any(|event| unstated_load::contradicts(analysis, event)) {
        word!("Nothing was simulated: the loads of the machine as stated do not show the event.")
            .into()
    } else if analysis.events.iter().any(|event| event.kind.is_observed()) {
        let reasons = reasons(analysis).join(", ");
        say!(
            "Nothing was simulated: a change is simulated where loads are valid, and each row with a {} below its limit is not{}.",
            word.one,
            if reasons.is_empty() {
                reasons
            } else {
                format!(" ({reasons})")
            }
        )
    } else {
        say!(
            "No {} fell below its limit in an event; there was nothing to prevent.",
            word.one
        )
    }
}

/// Returns the reasons why rows of events with a wheel below its limit are not valid.
fn reasons(analysis: &Analysis) -> Vec<String> {
    let rows = &analysis.rows;
    let limits = analysis.min_loads_n.as_deref().unwrap_or_default();
    let limit_n = |wheel: usize| limits.get(wheel).copied().unwrap_or(0.0);
    let mut names = BTreeSet::new();
    for event in (analysis.events.iter()).filter(|event| event.kind.is_observed()) {
        let [from, to] = event.span_ns().map(|time_ns| rows.at(time_ns));
        let end = (to + 1).min(rows.len());
        for first in (from..end).step_by(ROWS_AT_ONCE) {
            let found = rows.window(first..(first + ROWS_AT_ONCE).min(end));
            let is_below = |row: usize| {
                let mut wheels = 0..analysis.machine.wheels().len();
                wheels.any(|wheel| found.value(Quantity::Otf(wheel), row) < limit_n(wheel))
            };
            for row in (0..found.len()).filter(|&row| is_below(row)) {
                let reasons = rows.reasons[first + row].iter();
                names.extend(reasons.map(|reason| readable(reason.name())));
            }
        }
    }
    names.into_iter().collect()
}

/// Summarises the simulation in one sentence.
fn conclusion(analysis: &Analysis, advice: &Advice) -> String {
    let word = SupportWord::of(&analysis.machine).one;
    match (&advice.not_simulated, advice.changes.len()) {
        (Some(why), _) => say!("{why}; no change was simulated."),
        (None, 0) => {
            say!("No single change within limits would have kept every {word} at its limit.")
        }
        (None, 1) => say!(
            "In a simulation, every {word} just keeps its limit with this change alone; the table has the chance that it would have kept it."
        ),
        (None, _) => say!(
            "In a simulation, every {word} just keeps its limit with each of these changes alone; the table has the chance that it would have kept it."
        ),
    }
}

fn results(analysis: &Analysis, changes: &[&SimulatedChange]) -> Markup {
    let head = [
        word!("Change"),
        word!("First order"),
        word!("Minimum OTF [N]"),
        word!("Chance"),
        &say!(
            "Every {}, minimum OTF [N]",
            SupportWord::of(&analysis.machine).one
        ),
        word!("ZMP margin [m]"),
        word!("Overturning moment [N m]"),
        word!("Holds under"),
    ];
    let cells = changes.iter().map(|change| {
        let wheels = change.wheels.iter().map(|(wheel, margins)| {
            let (before, after) = (margins.otf_n.before, margins.otf_n.after);
            format!(
                "{} {} → {}",
                display(analysis, wheel),
                number(before),
                number(after)
            )
        });
        vec![
            change.statement.clone(),
            (change.first_order).map_or("–".into(), |first| {
                format!("{}{}", signed(first), unit(change))
            }),
            least_otf(change),
            change.chance.map_or(word!("unknown").into(), probability),
            wheels.collect::<Vec<_>>().join(", "),
            from_to(change.zmp_margin_m, ""),
            from_to(change.overturning_moment_nm, ""),
            match change.holds_under_any_split {
                true => word!("any split").into(),
                false => word!("the stated split").to_string(),
            },
        ]
    });
    table(&head, &cells.collect::<Vec<_>>())
}

fn assumptions(advice: &Advice, word: SupportWord) -> Vec<String> {
    let mut all = advice.assumptions.clone();
    if advice.rows_left_out > 0 {
        all.push(say!(
            "{} rows of the window are left out because their state is unknown",
            advice.rows_left_out
        ));
    }
    if advice
        .changes
        .iter()
        .any(|change| !change.holds_under_any_split)
    {
        all.push(say!(
            "\"The stated split\": the result holds if the load is shared between the {} as the machine file states. \
             Another split that equilibrium allows could still lift a {}",
            word.many, word.one
        ));
    }
    all
}

fn under_which_split(change: &SimulatedChange) -> &'static str {
    match change.holds_under_any_split {
        true => word!(", under any load split"),
        false => word!(", under the stated load split"),
    }
}

/// The smallest OTF of the other wheels (N).
fn others_least(advice: &Advice, change: &SimulatedChange) -> f64 {
    let others = change
        .wheels
        .iter()
        .filter(|(wheel, _)| **wheel != advice.wheel);
    others.fold(f64::INFINITY, |least, (_, margins)| {
        least.min(margins.otf_n.after)
    })
}

/// Its smallest OTF (N) with its band.
fn least_otf(change: &SimulatedChange) -> String {
    let otf_n = change.least_otf_n;
    (change.otf_sigma_n).map_or_else(|| number(otf_n), |sigma_n| with_sure_band(otf_n, sigma_n))
}

fn from_to(of: BeforeAfter, unit: &str) -> String {
    let text = format!("{} → {} {unit}", number(of.before), number(of.after));
    text.trim_end().into()
}

/// A change with its sign; a share in per cent.
fn signed(change: f64) -> String {
    format!("{}{}", if change > 0.0 { "+" } else { "" }, short(change))
}

fn unit(change: &SimulatedChange) -> String {
    match change.unit {
        "-" => String::new(),
        unit => format!(" {unit}"),
    }
}

fn lower_first(text: &str) -> String {
    if !is_english() {
        return text.trim_end_matches('.').into();
    }
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_lowercase().to_string());
    first.unwrap_or_default() + letters.as_str().trim_end_matches('.')
}
