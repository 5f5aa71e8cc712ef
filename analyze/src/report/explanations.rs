//! Tables of what explains the loads: causes of events, sensitivity, models, stated uncertainties.

use super::findings::Scene;
use super::prevention::{limit_of, preventions};
use crate::analysis::Analysis;
use crate::analysis::model_comparison::ModelComparison;
use crate::analysis::sensitivity::SensitivityRow;
use crate::base::number::number;
use crate::page::html::{Bar, bars, table};

/// Parameters that the page lists.
const MOST_PARAMETERS: usize = 15;
/// Changes that the page lists.
const MOST_PREVENTIONS: usize = 8;

/// What took the load away, for each event that is about one.
pub(super) fn causes(analysis: &Analysis) -> String {
    let scene = Scene::of(analysis);
    let mut rows = Vec::new();
    for event in &analysis.events {
        let Some(causes) = &event.causes else {
            continue;
        };
        for share in causes
            .shares
            .iter()
            .filter(|share| share.percent.abs() >= 0.5)
        {
            rows.push(vec![
                format!("{} {}", event.kind.name(), scene.subject(event)),
                format!("{:.2}", scene.seconds(causes.since_ns)),
                format!("{:.2}", scene.seconds(causes.at_ns)),
                share.cause.replace('_', " "),
                number(share.taken_n),
                format!("{:.0}", share.percent),
            ]);
        }
    }
    if rows.is_empty() {
        return "<p>No event is about a load, or the model has no causes.</p>".into();
    }
    let headings = [
        "event",
        "from [s]",
        "to [s]",
        "cause",
        "OTF taken [N]",
        "share [%]",
    ];
    table(&headings, &rows)
}

/// The smallest changes that would have kept the worst wheel at its limit.
pub(super) fn prevention(analysis: &Analysis) -> String {
    let Some(found) = &analysis.sensitivity else {
        return "<p>The chosen model has no derivatives.</p>".into();
    };
    let machine = &analysis.machine;
    let wheel = &machine.wheels()[found.worst_wheel].name;
    let limit_n = number(limit_of(analysis, found.worst_wheel));
    let Some(row) = (found.rows.iter()).find(|row| row.wheel == found.worst_wheel) else {
        return String::new();
    };
    let what = format!(
        "Wheel {} came nearest to lifting, at t = {:.2} s with an OTF of {} N",
        super::html::escape(wheel),
        Scene::of(analysis).seconds(row.worst_ns),
        number(row.worst_otf_n)
    );
    if row.worst_otf_n >= limit_of(analysis, found.worst_wheel) {
        return format!(
            "<p>{what}: above its limit of {limit_n} N. There was nothing to prevent.</p>"
        );
    }
    let changes = preventions(analysis);
    if changes.is_empty() {
        return format!(
            "<p>{what}. No single change of posture, motion or load would have kept it at its limit of {limit_n} N, to first order.</p>"
        );
    }
    let bar = |change: &crate::report::prevention::Prevention| Bar {
        label: change.parameter.name(machine),
        share: change.effort,
        text: format!(
            "by {} {} from {} ({:.0} % of {})",
            short(change.change),
            change.parameter.unit(machine),
            short(change.value),
            100.0 * change.effort,
            change.effort_of
        ),
    };
    let listed: Vec<Bar> = changes.iter().take(MOST_PREVENTIONS).map(bar).collect();
    format!(
        "<p>{what}. Each of these changes by itself would have kept it at its limit of {limit_n} N, to first order; the smallest come \
         first, the bar is the change as a share of what it is compared with.</p>"
    ) + &bars(&listed)
}

/// What the load of the wheel that came nearest to lifting answers to.
pub(super) fn sensitivity(analysis: &Analysis) -> String {
    let Some(found) = &analysis.sensitivity else {
        return "<p>The chosen model has no derivatives.</p>".into();
    };
    let machine = &analysis.machine;
    let mut rows: Vec<&SensitivityRow> = (found.rows.iter())
        .filter(|row| row.wheel == found.worst_wheel)
        .collect();
    rows.sort_by(|a, b| b.variance_share.total_cmp(&a.variance_share));
    let Some(first) = rows.first() else {
        return String::new();
    };
    let seconds = Scene::of(analysis).seconds(first.worst_ns);
    let name = &machine.wheels()[found.worst_wheel].name;
    let said = format!(
        "<p>What the uncertainty of wheel {}'s OTF at t = {seconds:.2} s ({} N) is made of, by the stated uncertainties, to \
         first order; all signals and parameters stand in sensitivity.parquet.</p>",
        super::html::escape(name),
        number(first.worst_otf_n)
    );
    let optional = |value: Option<f64>| value.map_or("-".into(), short);
    let cells: Vec<Vec<String>> = (rows.iter().take(MOST_PARAMETERS))
        .map(|row| {
            vec![
                row.parameter.name(machine),
                row.parameter.unit(machine).into(),
                optional(row.nominal),
                short(row.sigma),
                short(row.derivative),
                optional(row.change_to_zero),
                format!("{:.1}", 100.0 * row.variance_share),
            ]
        })
        .collect();
    let headings = [
        "parameter",
        "unit",
        "value",
        "sigma",
        "OTF by it [N per unit]",
        "change to lift the wheel",
        "share of variance [%]",
    ];
    said + &table(&headings, &cells)
}

/// How the models differ, and what was taken as uncertain.
pub(super) fn models(analysis: &Analysis) -> String {
    let chosen = analysis.options.model.name();
    let comparisons = analysis
        .comparisons
        .iter()
        .map(|comparison| match comparison {
            Err(why) => format!("<p>Model {chosen}. {}.</p>", super::html::escape(why)),
            Ok(comparison) => difference(analysis, chosen, comparison),
        });
    let compared: String = comparisons.collect();
    let stated: Vec<Vec<String>> = (analysis.machine.uncertainty().by_key().iter())
        .map(|(key, sigma)| vec![(*key).into(), short(*sigma)])
        .collect();
    compared
        + "<p>One standard deviation of each parameter, as the machine file states it or by default:</p>"
        + &table(&["key of [uncertainty]", "value"], &stated)
}

/// How another model differs from the chosen one.
fn difference(analysis: &Analysis, chosen: &str, comparison: &ModelComparison) -> String {
    let wheels = comparison.wheels.iter().zip(analysis.machine.wheels());
    let cells: Vec<Vec<String>> = wheels
        .map(|(difference, wheel)| {
            vec![
                wheel.name.clone(),
                number(difference.mean_n),
                number(difference.rms_n),
                number(difference.largest_n),
            ]
        })
        .collect();
    let said = format!(
        "<p>Model {chosen}; OTF of model {} less it, over {} rows:</p>",
        comparison.other.name(),
        comparison.rows
    );
    said + &table(&["wheel", "mean [N]", "rms [N]", "largest [N]"], &cells)
}

/// Four digits.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => {
            let digits = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.3e}"),
    }
}
