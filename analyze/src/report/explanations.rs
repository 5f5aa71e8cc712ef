//! Explanations of the loads: causes of events, sensitivity, models, stated uncertainties.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::Parameter;
use tipwatch_mechanics::state::Reason;

use super::findings::{Scene, led_to, worst_of_each_kind};
use super::parameter_words::{in_words, uncertainty_in_words, unit_in_words};
use crate::analysis::Analysis;
use crate::analysis::model_comparison::ModelComparison;
use crate::base::options::ModelKind;
use crate::events::support_words::SupportWord;
use crate::events::{Event, EventCauses};
use crate::page::{number, readable, short, table, table_of};

/// Most parameters listed.
const MOST_PARAMETERS: usize = 15;
/// Causes with a smaller share of the lost load are not listed (%).
const LEAST_PERCENT: f64 = 0.5;

/// For each event of a wheel or an edge, what took the load away; of many events, for the `most` worst of each kind.
pub(super) fn causes(analysis: &Analysis, most: usize) -> Markup {
    let scene = Scene::of(analysis);
    let (mut events, left_out) = worst_of_each_kind(told_once(analysis), scene.word, most);
    events.sort_by_key(|event| event.start_ns);
    // events of the same wheel at the same time have the same causes: a lift, and the tipping that begins with it
    let mut groups: Vec<(Vec<String>, &EventCauses)> = Vec::new();
    for event in events {
        // what lost no load before has no causes of a loss: that of a fall is its rotation
        let Some(causes) = event.causes.as_ref().filter(|it| it.is_loss()) else {
            continue;
        };
        let name = scene.kind_and_subject(event);
        let is_same = |other: &EventCauses| {
            (other.since_ns, other.at_ns) == (causes.since_ns, causes.at_ns)
                && other.otf_n.to_bits() == causes.otf_n.to_bits()
        };
        match groups.iter_mut().find(|(_, other)| is_same(other)) {
            Some((names, _)) => names.push(name),
            None => groups.push((vec![name], causes)),
        }
    }
    let mut rows = Vec::new();
    for (names, causes) in groups {
        let shares = causes.shares.iter();
        let listed = shares.filter(|share| share.percent.abs() >= LEAST_PERCENT);
        rows.extend(listed.enumerate().map(|(place, share)| {
            let once = |text: String| if place == 0 { text } else { String::new() };
            let seconds = |time_ns: i64| once(decimals(format!("{:.2}", scene.seconds(time_ns))));
            [
                (word!("Event"), once(names.join(", "))),
                (word!("From [s]"), seconds(causes.since_ns)),
                (word!("To [s]"), seconds(causes.at_ns)),
                (word!("Cause"), readable(share.cause)),
                (word!("OTF lost [N]"), number(share.taken_n)),
                (word!("Share [%]"), format!("{:.0}", share.percent)),
            ]
        }));
    }
    html! {
        @if rows.is_empty() {
            p { (say!("No event involves a {} load, or the chosen model does not compute load contributions.", scene.word.one)) }
        } @else {
            (table_of(rows))
            @if !left_out.is_empty() {
                p { (say!("These are the {most} worst events of each kind; the causes of all events are in events.parquet.")) }
            }
        }
    }
}

/// The events but those that led to a graver one, which has the same causes.
fn told_once(analysis: &Analysis) -> impl Iterator<Item = &Event> {
    let events = analysis.events.iter();
    events.filter(|event| led_to(&analysis.events, event).is_none())
}

/// Whether no row has loads of a machine that for certain did not tip.
fn tips_in_all_rows(analysis: &Analysis) -> bool {
    let mut loads = (analysis.rows.reasons.iter())
        .filter(|reasons| reasons.leave_loads())
        .peekable();
    loads.peek().is_some() && loads.all(|reasons| reasons.has(Reason::Tipping))
}

/// Returns the reason why the derivatives of the loads are unknown.
pub(super) fn no_derivatives(analysis: &Analysis) -> &'static str {
    match analysis.options.model {
        ModelKind::WholeBody if tips_in_all_rows(analysis) => word!(
            "There are no derivatives: in every row with loads the machine was or may have been tipping."
        ),
        ModelKind::WholeBody => {
            word!("There are no derivatives: in no valid row can they be computed.")
        }
        _ => word!("The chosen model does not compute derivatives."),
    }
}

/// Renders the sensitivity of the load of the wheel that came closest to lifting, to signals and parameters.
pub(super) fn sensitivity(analysis: &Analysis) -> Markup {
    let Some(found) = &analysis.sensitivity else {
        return html! { p { (no_derivatives(analysis)) } };
    };
    let machine = &analysis.machine;
    let rows = found.ranked();
    let Some(first) = rows.first() else {
        return html! { p { (no_derivatives(analysis)) } };
    };
    let optional = |value: Option<f64>| value.map_or("–".into(), short);
    let cells = rows.iter().take(MOST_PARAMETERS).map(|row| {
        let unit = unit_in_words(row.parameter.unit(machine));
        let share = decimals(format!("{:.1}", 100.0 * row.variance_share));
        [
            (word!("Parameter"), in_words(row.parameter, machine)),
            (word!("Unit"), unit.into()),
            (word!("Value"), optional(row.nominal)),
            ("σ", short(row.sigma)),
            (word!("dOTF/dparameter [N per unit]"), short(row.derivative)),
            (word!("Change to OTF = 0"), optional(row.change_to_zero)),
            (word!("Share of variance [%]"), share),
        ]
    });
    html! {
        p {
            (say!(
                "Contributions to the variance of the OTF of {} at t = {:.2} s ({} N), to first order, from the stated uncertainties. \
                 The file sensitivity.parquet has all signals and parameters.",
                SupportWord::named(&machine.wheels()[found.worst_wheel]),
                Scene::of(analysis).seconds(first.worst_ns),
                number(first.worst_otf_n)
            ))
        }
        (table_of(cells))
    }
}

/// Renders the differences between the models, and the stated uncertainties.
pub(super) fn models(analysis: &Analysis) -> Markup {
    let chosen = analysis.options.model.name();
    let stated_keys = stated_uncertainties(analysis);
    let stated = analysis.machine.uncertainty().by_key();
    let stated = stated.iter().map(|(key, sigma)| {
        let (words, unit) = uncertainty_in_words(key);
        let from = match stated_keys.contains_key(*key) {
            true => word!("machine file"),
            false => word!("default"),
        };
        vec![words.into(), short(*sigma), unit.into(), from.into()]
    });
    let stated: Vec<Vec<String>> = stated.collect();
    html! {
        @for comparison in &analysis.comparisons {
            @match comparison {
                Err(why) => p { (say!("Model {chosen}; {why}.")) },
                Ok(comparison) => (difference(analysis, chosen, comparison)),
            }
        }
        p { (word!("Standard deviation (σ) of every kind of parameter:")) }
        (table(&[word!("Uncertain"), word!("Standard deviation"), word!("Unit"), word!("From")], &stated))
    }
}

/// The uncertainties that the machine file states, by key.
fn stated_uncertainties(analysis: &Analysis) -> toml::Table {
    let file = toml::from_str::<toml::Table>(&analysis.sources.machine_file).unwrap_or_default();
    let stated = file.get("uncertainty").and_then(toml::Value::as_table);
    stated.cloned().unwrap_or_default()
}

/// Whether the uncertainty of a parameter is a default, which nothing in the machine file states.
pub(super) fn is_by_default(analysis: &Analysis, parameter: Parameter) -> bool {
    let machine = &analysis.machine;
    let key = parameter.uncertainty_key(machine);
    let key = key.filter(|_| machine.identified().is_none());
    key.is_some_and(|key| !stated_uncertainties(analysis).contains_key(key))
}

/// Renders the difference of another model from the chosen one.
fn difference(analysis: &Analysis, chosen: &str, comparison: &ModelComparison) -> Markup {
    let cells = analysis.machine.wheels().iter().filter_map(|wheel| {
        let difference = comparison.difference.get(&wheel.name.to_lowercase())?;
        let of = [difference.mean_n, difference.rms_n, difference.largest_n];
        let name = [wheel.name.clone()].into_iter();
        Some(name.chain(of.map(number)).collect())
    });
    let other = comparison.other.name();
    html! {
        p { (say!("OTF difference, model {other} minus model {chosen}, over {} rows:", comparison.rows)) }
        (table(&[SupportWord::of(&analysis.machine).head, word!("Mean [N]"), word!("RMS [N]"), word!("Largest [N]")], &cells.collect::<Vec<_>>()))
    }
}
