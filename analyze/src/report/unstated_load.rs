//! Explanations of a rotation about an edge with their evidence, and the unstated mass on the tool, as a section and as findings.

use maud::{Markup, html};
use tipwatch_language::{say, word};

use crate::analysis::Analysis;
use crate::analysis::unstated_load::{ExplainedFall, Explanation, LoadEstimates, MassEstimate};
use crate::base::number::{number, readable};
use crate::events::support_words::{SupportWord, edge_word};
use crate::events::{Event, Finding, LEAST_OF_A_FACT, ShownBy};
use crate::page::{probability, short, table, with_sure_band};

/// Explanations that are less probable are not listed.
const LEAST_PROBABILITY: f64 = 1e-3;
/// Most explanations in the table.
const MOST_SHOWN: usize = 8;

/// Whether the machine as stated does not show an event: by its loads, wheels carried that were in the air.
pub(super) fn contradicts(analysis: &Analysis, event: &Event) -> bool {
    let is_own =
        |fall: &&ExplainedFall| fall.edge == event.subject && fall.onset_ns == event.start_ns;
    let explained = analysis.explained_falls.iter().find(is_own);
    event.shown_by == Some(ShownBy::Rotation) || explained.is_some_and(|fall| !fall.is_as_stated())
}

/// Returns the warning beside loads of a machine whose fall they do not show; `None` where they may be read as they are.
pub(super) fn warning(analysis: &Analysis) -> Option<Markup> {
    let fall = analysis
        .events
        .iter()
        .find(|event| contradicts(analysis, event))?;
    let from_s = analysis.rows.seconds_at(fall.start_ns);
    Some(html! {
        p {
            strong {
                (say!(
                    "These are the loads of the machine as stated. They do not show its fall about the {} edge from t = {from_s:.2} s: \
                     {} off that edge were in the air, whatever load is computed for them.",
                    edge_word(&fall.subject),
                    SupportWord::of(&analysis.machine).many
                ))
            }
        }
    })
}

/// Names the computed loads, to be followed by the time: where the machine as stated does not show an event, they are those
/// computed for it.
pub(super) fn known_loads(analysis: &Analysis) -> String {
    let head = SupportWord::of(&analysis.machine).head;
    let mut events = analysis.events.iter();
    match events.any(|event| contradicts(analysis, event)) {
        true => say!("{head} loads are computed for the stated machine"),
        false => say!("{head} loads are known"),
    }
}

/// The section; `None` without a rotation about an edge.
pub(super) fn section(analysis: &Analysis) -> Option<Markup> {
    let falls = &analysis.explained_falls;
    (!falls.is_empty()).then(|| {
        html! {
            p {
                (say!(
                    "While the machine rotates about an edge, the {} off it carry nothing: the moment that the model computes \
                     about the edge is its error. Before the lift, the lean of the platform on its tyres shows the moment, too. Each \
                     explanation was fitted to both; its probability is that among the explanations tried, each kind equally \
                     probable beforehand.",
                    SupportWord::of(&analysis.machine).many
                ))
            }
            @for fall in falls { (of_fall(analysis, fall)) }
        }
    })
}

fn of_fall(analysis: &Analysis, fall: &ExplainedFall) -> Markup {
    let onset_s = analysis.rows.seconds_at(fall.onset_ns);
    let shown = fall.explanations.iter().take(MOST_SHOWN);
    let shown = shown.filter(|explanation| explanation.probability >= LEAST_PROBABILITY);
    let cells = shown.map(|explanation| {
        vec![
            name(explanation),
            probability(explanation.probability),
            short(explanation.log_evidence),
            amounts(explanation),
        ]
    });
    html! {
        h3 { (say!("About the {} edge from t = {onset_s:.2} s", edge_word(&fall.edge))) }
        @if let Some(why) = &fall.not_estimated {
            p { (say!("Nothing was estimated: {why}.")) }
        } @else {
            p {
                (say!(
                    "{} rows of the rotation up to {:.1}°, {} rows before the lift.",
                    fall.rows,
                    fall.rotation_rad.to_degrees(),
                    fall.lean_rows
                ))
            }
            (table(&[word!("Explanation"), word!("Probability"), word!("Log evidence"), word!("Amounts ± 2 σ")], &cells.collect::<Vec<_>>()))
            @if let Some(load) = &fall.load { (of_load(load)) }
        }
    }
}

/// The estimates of the mass beside each other.
fn of_load(load: &LoadEstimates) -> Markup {
    let all = [
        (word!("Lean on the tyres before the lift"), load.by_lean),
        (word!("Moment about the edge at the onset"), load.by_onset),
        (
            word!("Moment about the edge during the rotation"),
            load.by_fall,
        ),
        (word!("All of them"), load.combined),
    ];
    let cells = all.iter().filter_map(|(name, estimate)| {
        let MassEstimate { mass_kg, sigma_kg } = (*estimate)?;
        let [least, most] = estimate.as_ref()?.band_kg();
        Some(vec![
            (*name).to_string(),
            number(mass_kg),
            number(sigma_kg),
            say!("{} to {}", number(least), number(most)),
        ])
    });
    let mass = say!("Mass beyond the stated one on {}", load.link);
    let head = [&mass, "kg", "σ [kg]", word!("Two standard deviations [kg]")];
    html! {
        (table(&head, &cells.collect::<Vec<_>>()))
        p { (agreement(load)) }
        @if let Some(why) = &load.no_lean { p { (say!("No estimate by the lean: {why}.")) } }
    }
}

fn agreement(load: &LoadEstimates) -> String {
    match (&load.agreement, load.combined) {
        (None, _) => word!("There is one estimate only.").into(),
        (Some(agreement), Some(_)) => say!(
            "The estimates agree (chi-square {} with {}, probability of more {}).",
            short(agreement.chi_square),
            degrees_of_freedom(agreement.degrees),
            probability(agreement.probability)
        ),
        (Some(agreement), None) => say!(
            "The estimates contradict each other (chi-square {} with {}, probability of more {}), so they \
             are not combined: a load on the tool alone does not explain the log.",
            short(agreement.chi_square),
            degrees_of_freedom(agreement.degrees),
            probability(agreement.probability)
        ),
    }
}

fn degrees_of_freedom(count: usize) -> String {
    match count {
        1 => word!("one degree of freedom").into(),
        count => say!("{count} degrees of freedom"),
    }
}

/// An explanation is told beside the most probable one from this probability on.
const NOT_IMPROBABLE: f64 = 0.05;
/// A log contradicts the machine as stated if that is less probable than this.
const MOST_CONTRADICTED: f64 = 0.01;

/// A finding for each rotation about an edge that could be explained.
pub(super) fn findings(analysis: &Analysis) -> Vec<Finding> {
    let falls = analysis.explained_falls.iter();
    falls.filter_map(|fall| finding(analysis, fall)).collect()
}

/// For each rotation about an edge what explains it, with the probability of each explanation and of the machine as stated.
pub(super) fn explained(analysis: &Analysis) -> impl Iterator<Item = String> {
    let falls = analysis.explained_falls.iter();
    falls.filter_map(|fall| {
        let headline = finding(analysis, fall)?.headline;
        Some(say!("{headline}. Probabilities: {}.", probabilities(fall)))
    })
}

/// The explanations with their probabilities: the machine as stated, those that are not improbable, and the others together.
fn probabilities(fall: &ExplainedFall) -> String {
    let is_listed =
        |it: &&Explanation| it.kind == "stated_machine" || it.probability >= NOT_IMPROBABLE;
    let (listed, others): (Vec<_>, Vec<_>) = fall.explanations.iter().partition(is_listed);
    let mut all: Vec<String> = listed
        .iter()
        .map(|it| format!("{} {}", name(it), probability(it.probability)))
        .collect();
    if !others.is_empty() {
        let together: f64 = others.iter().map(|it| it.probability).sum();
        all.push(say!(
            "{} others together {}",
            others.len(),
            probability(together)
        ));
    }
    all.join(", ")
}

/// Returns the findings about the rotations that the machine as stated does not explain.
pub(super) fn not_as_stated(analysis: &Analysis) -> impl Iterator<Item = Finding> {
    let falls = analysis.explained_falls.iter();
    let falls = falls.filter(|fall| !fall.is_as_stated());
    falls.filter_map(|fall| finding(analysis, fall))
}

fn finding(analysis: &Analysis, fall: &ExplainedFall) -> Option<Finding> {
    let best = fall.told()?;
    let about = say!(
        "The rotation about the {} edge at t = {:.2} s",
        edge_word(&fall.edge),
        analysis.rows.seconds_at(fall.onset_ns)
    );
    let chance = say!(
        "(probability {} among the explanations tried)",
        probability(best.probability)
    );
    let load = fall.load.as_ref().and_then(|load| load.combined);
    let stated = fall.stated().map_or(0.0, |it| it.probability);
    let headline = match (best.kind, load) {
        // one explanation among several is no statement of fact
        ("stated_machine", _) if best.probability < LEAST_OF_A_FACT => {
            say!(
                "{about}: the log does not tell between several explanations; the machine as stated is one of them {chance}"
            )
        }
        ("stated_machine", _) => {
            say!("{about} is explained by the machine as stated {chance}")
        }
        (kind, load)
            if best.probability < LEAST_OF_A_FACT
                || load.is_none() && stated > MOST_CONTRADICTED && kind != "none_of_these" =>
        {
            let most_probable = match kind {
                "none_of_these" => word!("none that was tried").into(),
                _ => with_amounts(best),
            };
            say!(
                "{about}: the log does not tell between several explanations; the most probable: {most_probable} {chance}"
            )
        }
        ("load_on_tool", Some(mass)) => {
            let [least, most] = mass.band_kg();
            let more = if mass.mass_kg < 0.0 {
                word!("less than stated")
            } else {
                word!("more than stated")
            };
            let [least, most] = if mass.mass_kg < 0.0 {
                [-most, -least]
            } else {
                [least, most]
            };
            say!(
                "{about}: {:.0} kg {more} on the tool explain it ({least:.0} to {most:.0} kg, two standard \
                 deviations) {chance}",
                mass.mass_kg.abs()
            )
        }
        ("none_of_these", _) => {
            say!(
                "{about} is explained neither by the machine as stated nor by anything else that was tried {chance}; a pull or push \
                 that changes with time and ground that gives way are not among it"
            )
        }
        _ => say!(
            "{about} contradicts the stated machine; most probable explanation: {} {chance}",
            with_amounts(best)
        ),
    };
    let headline = with_next(headline, fall, best);
    let mut evidence = Vec::new();
    if let Some(load) = &fall.load {
        let ways = [
            (
                word!("by the lean on the tyres before the lift"),
                load.by_lean,
            ),
            (
                word!("by the moment about the edge at the onset"),
                load.by_onset,
            ),
            (word!("during the rotation"), load.by_fall),
        ];
        let ways = ways.iter().filter_map(|(way, estimate)| {
            let MassEstimate { mass_kg, sigma_kg } = (*estimate)?;
            let lighter = if mass_kg < 0.0 { word!(" less") } else { "" };
            let band_kg = 2.0 * sigma_kg;
            Some(say!(
                "{way} {:.0} ± {band_kg:.0} kg{lighter}",
                mass_kg.abs()
            ))
        });
        let ways: Vec<String> = ways.collect();
        evidence.push(say!(
            "Mass on the tool beyond the stated one: {}. {}",
            ways.join(", "),
            agreement(load)
        ));
    }
    let others = (fall.explanations.iter())
        .filter(|other| *other != best && other.probability >= LEAST_PROBABILITY)
        .take(3);
    let others = others.map(|other| format!("{} {}", name(other), probability(other.probability)));
    let others: Vec<String> = others.collect();
    if !others.is_empty() {
        evidence.push(say!("Next explanations: {}", others.join(", ")));
    }
    Some(Finding { headline, evidence })
}

/// A headline that tells a rotation with one explanation, and the next one if it is not improbable: what is not told is taken to be
/// excluded.
fn with_next(headline: String, fall: &ExplainedFall, best: &Explanation) -> String {
    let mut others = fall.explanations.iter().filter(|other| *other != best);
    match others.next() {
        Some(next) if best.kind != "stated_machine" && next.probability >= NOT_IMPROBABLE => say!(
            "{headline}; next: {} (probability {})",
            with_amounts(next),
            probability(next.probability)
        ),
        _ => headline,
    }
}

fn with_amounts(explanation: &Explanation) -> String {
    match amounts(explanation) {
        none if none.is_empty() => name(explanation),
        amounts => format!("{} ({amounts})", name(explanation)),
    }
}

fn amounts(explanation: &Explanation) -> String {
    let amounts = explanation.amounts.iter().map(|amount| {
        // a negative mass is one that is missing
        let is_missing = amount.unit == "kg" && amount.value < 0.0;
        let size = if is_missing {
            -amount.value
        } else {
            amount.value
        };
        let value = with_sure_band(size, amount.sigma);
        let less = if is_missing {
            word!(" less than stated")
        } else {
            ""
        };
        format!("{} {value} {}{less}", readable(amount.name), amount.unit)
    });
    amounts.collect::<Vec<_>>().join(", ")
}

/// An explanation in words.
fn name(explanation: &Explanation) -> String {
    let subject = explanation.subject.as_deref().unwrap_or_default();
    match explanation.kind {
        "stated_machine" => word!("the machine as stated").into(),
        "load_on_tool" => word!("a load on the tool").into(),
        "force_on_tool" => word!("a level force on the tool").into(),
        "centre_of_mass" => say!("another centre of mass of {subject}"),
        "mass" => say!("another mass of {subject}"),
        "imu_rotation" => word!("an IMU mounted at an angle").into(),
        "encoder_offset" => say!("an offset of encoder {subject}"),
        "encoder_stopped" => say!("encoder {subject} stopped"),
        "encoder_sign" => say!("encoder {subject} with the opposite sign"),
        "imu_sign" => say!("IMU {} with the opposite sign", readable(subject)),
        "wheel_radius" => say!("a sunk or flat wheel {subject}"),
        _ => word!("none of these").into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the text about a rotation whose explanations have these probabilities.
    fn told(explanations: &[(&'static str, f64)]) -> String {
        let fall = ExplainedFall::by(explanations);
        with_next("told".into(), &fall, &fall.explanations[0])
    }

    #[test]
    fn the_machine_as_stated_has_its_probability_among_the_explanations() {
        let all = [
            ("load_on_tool", 0.9),
            ("imu_rotation", 0.06),
            ("stated_machine", 0.02),
            ("none_of_these", 0.015),
            ("mass", 0.005),
        ];
        assert_eq!(
            probabilities(&ExplainedFall::by(&all)),
            "a load on the tool 90 %, an IMU mounted at an angle 6 %, the machine as stated 2 %, 2 others together 2 %"
        );
    }

    #[test]
    fn an_explanation_that_is_not_excluded_is_told_beside_the_most_probable_one() {
        let close = told(&[("encoder_offset", 0.63), ("load_on_tool", 0.37)]);
        assert_eq!(close, "told; next: a load on the tool (probability 37 %)");
        let excluded = told(&[("load_on_tool", 0.99), ("encoder_offset", 0.01)]);
        assert_eq!(excluded, "told");
        // of the machine as stated the headline says what else there is
        let stated = told(&[("stated_machine", 0.4), ("imu_rotation", 0.3)]);
        assert_eq!(stated, "told");
    }
}
