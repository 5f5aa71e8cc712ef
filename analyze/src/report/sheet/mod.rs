//! The first page: what happened, how sure it is and what it rests on, on one sheet of paper.

mod answers;
mod around;
mod course;
mod doubted;
mod witness;

use maud::{Markup, html};
use tipwatch_language::{say, told, word};

pub use doubted::doubted;

use super::findings::{BANDS, Incident, Scene, incidents};
use super::{machine_view, prevention, unstated_load};
use crate::analysis::Analysis;
use crate::analysis::calendar::Calendar;
use crate::base::file_hash::FileHash;
use crate::base::options::ModelKind;
use crate::events::support_words::SupportWord;
use crate::events::{Answer, Bound, Event, EventCauses};
use crate::page::{facts, number, probability, readable, table, whole};

/// A chance of the same event by another evaluation, from which a reader must know that it is another.
const DIFFERS: f64 = 0.1;
/// Causes on the sheet.
const MOST_CAUSES: usize = 3;

/// Tells the story of the log, in at most three sentences in the order in which a witness would tell it.
#[must_use]
pub fn story(analysis: &Analysis) -> Vec<String> {
    witness::sentences(analysis, &incidents(&analysis.events))
}

/// The sheet.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let incidents = incidents(&analysis.events);
    let gravest = incidents.first();
    html! {
        section.sheet id="summary" {
            h2 { (word!("Summary")) }
            @for sentence in witness::sentences(analysis, &incidents) { p.lead { (sentence) } }
            (facts(&answers::answers(analysis, &incidents)))
            (machine(analysis, gravest))
            (course::figure(analysis, &incidents))
            @if let Some(incident) = gravest {
                (around::figures(analysis, incident))
                @if incident.gravest().hides_onset() {
                    div { h3 { (word!("Causes")) } p { (Event::onset_not_shown()) } }
                } @else {
                    div.columns { (causes(analysis, incident)) (otherwise(analysis, incident)) (prevented(analysis, incident)) }
                }
            } @else if let Some((row, wheel)) = analysis.digest.lightest {
                (around::closest(analysis, row, wheel))
            }
            (signature(analysis))
            p.hint { (say!("{}. t counts seconds from the first row.", told(BANDS))) }
        }
    }
}

/// The row of the sheet's drawing: the onset of the gravest incident, else that of the smallest load compared with its load
/// at rest; `None` if no row has loads.
pub(super) fn row(analysis: &Analysis) -> Option<usize> {
    let incidents = incidents(&analysis.events);
    let onset = incidents
        .first()
        .map(|it| analysis.rows.at(it.gravest().start_ns));
    onset.or_else(|| analysis.digest.lightest.map(|(row, _)| row))
}

/// The drawings of a log as recorded and as supposed: both at the time that the sheet of the first shows.
pub(crate) fn drawn_machines([recorded, supposed]: [&Analysis; 2]) -> [Markup; 2] {
    let [of_recorded, of_supposed] =
        [recorded, supposed].map(|analysis| incidents(&analysis.events));
    let (gravest, own) = (of_recorded.first(), of_supposed.first());
    let second = match row(recorded) {
        Some(row) => {
            let row = supposed.rows.at(recorded.rows.times_ns[row]);
            let contradicted =
                own.is_some_and(|it| unstated_load::contradicts(supposed, it.gravest()));
            let seen = gravest.map(Incident::gravest);
            let pictures = machine_view::pictures(supposed, row, seen, contradicted);
            let row_s = supposed.rows.seconds(row);
            html! {
                @if let Some(pictures) = pictures {
                    h3 { (say!("The machine at the same time, t = {:.2} s", row_s)) }
                    (pictures)
                }
            }
        }
        None => machine(supposed, own),
    };
    [machine(recorded, gravest), second]
}

fn machine(analysis: &Analysis, gravest: Option<&Incident<'_>>) -> Markup {
    let Some(row) = row(analysis) else {
        return html! {};
    };
    let gravest = gravest.map(Incident::gravest);
    let contradicted = gravest.is_some_and(|event| unstated_load::contradicts(analysis, event));
    let Some(pictures) = machine_view::pictures(analysis, row, gravest, contradicted) else {
        return html! {};
    };
    let scene = Scene::of(analysis);
    let what = match gravest {
        Some(event) if event.hides_onset() => say!(
            "at the first sample that shows the fall: {}",
            scene.step(event)
        ),
        Some(event) => say!("at the onset: {}", scene.step(event)),
        None => say!(
            "when a {} carried least compared with its load at rest",
            SupportWord::of(&analysis.machine).one
        ),
    };
    let time = Calendar::of(analysis).utc(analysis.rows.times_ns[row]);
    let time = time.map_or(String::new(), |utc| format!(" ({utc})"));
    let row_s = analysis.rows.seconds(row);
    // the onset lies between two rows
    let onset = gravest.map(|event| (event, analysis.rows.seconds_at(event.start_ns)));
    let onset = onset.filter(|(event, onset_s)| {
        is_shown_otherwise(*onset_s, row_s) || event.start_bound == Bound::AtOrBefore
    });
    let onset = onset.map_or(String::new(), |(event, _)| {
        say!("; it began at {}", scene.start(event))
    });
    html! {
        h3 { (say!("The machine {what}, t = {:.2} s{time}", row_s)) (onset) }
        (pictures)
    }
}

/// Whether two times (s) differ for a reader, to whom hundredths of a second are shown.
fn is_shown_otherwise(one_s: f64, other_s: f64) -> bool {
    format!("{one_s:.2}") != format!("{other_s:.2}")
}

/// Renders the causes that took the load, in newtons.
fn causes(analysis: &Analysis, incident: &Incident<'_>) -> Markup {
    let Some((event, causes)) = incident
        .with_causes()
        .and_then(|event| Some((event, event.causes.as_ref()?)))
    else {
        let has_others = || incident.events.iter().any(|event| event.causes.is_some());
        let why = match incident.has_causes() {
            true => word!(
                "No load was lost between a moment before it and its beginning: the log does not show what took it."
            ),
            false if has_others() => word!(
                "The loads just before its beginning are not known: the log does not show what took the load."
            ),
            false if analysis.options.model == ModelKind::WholeBody => word!(
                "The log has no loads from before its beginning: it does not show what took the load."
            ),
            false => word!("The chosen model does not tell causes."),
        };
        return html! { div { h3 { (word!("Causes")) } p { (why) } } };
    };
    let scene = Scene::of(analysis);
    let title = say!("What took the load: {}", scene.step(event));
    let steady = match causes.since_is_steady {
        true => word!(" (steady)"),
        false => "",
    };
    let computed = match unstated_load::contradicts(analysis, incident.gravest()) {
        true => word!(", as computed for the stated machine, which does not show the fall"),
        false => "",
    };
    let fall = say!(
        "From t = {:.2} s{steady} to {:.2} s {} fell from {} to {} N{computed}.",
        scene.seconds(causes.since_ns),
        scene.seconds(causes.at_ns),
        scene.otf_of(event),
        answers::otf_with_band(analysis, event, causes.since_ns, causes.otf_before_n),
        answers::otf_with_band(analysis, event, causes.at_ns, causes.otf_n)
    );
    html! {
        div {
            h3 { (title) }
            (table(&[word!("Cause"), word!("Load taken [N]")], &largest(causes)))
            p.hint { (fall) @if let Some(open) = scene.not_shown(event, causes) { " " (open) "." } }
        }
    }
}

/// Renders the answers whether the incident would have happened otherwise: yes, no or open, with the probability.
fn otherwise(analysis: &Analysis, incident: &Incident<'_>) -> Markup {
    let Some(event) = incident.asked() else {
        let onset = analysis.rows.at(incident.gravest().start_ns);
        return match analysis.rows.machine_at(onset) {
            None => html! { div {
                h3 { (word!("Would it have happened otherwise?")) }
                p { (word!("Open: it is not known on which supports the machine stood when it began.")) }
            } },
            Some(_) => html! {},
        };
    };
    let scene = Scene::of(analysis);
    let rows = event.counterfactuals.iter().filter_map(|answer| {
        let chance = probability(answer.reply.probability?);
        Some(vec![
            html! { (scene.supposed(answer)) },
            html! { (readable(answer.reply.answer.name())) },
            whole(chance),
        ])
    });
    let mut rows: Vec<Vec<Markup>> = rows.collect();
    let mut answers = event.counterfactuals.iter();
    let mut hint = None;
    // two probabilities are an effect only beside that of the same evaluation
    if !rows.is_empty()
        && let Some(recorded) = answers.find_map(|answer| answer.reply.recorded_probability)
    {
        let answer = Answer::of(Some(recorded));
        let differs = |certainty: f64| (certainty - recorded).abs() > DIFFERS;
        hint = event.certainty.filter(|it| differs(*it)).map(|certainty| {
            say!(
                "The confidence of {} is that of another evaluation, with all evidence of the log: compare the chances of this table with each other alone.",
                probability(certainty)
            )
        });
        let cells = [
            html! { (word!("as recorded, by the same evaluation")) },
            html! { (readable(answer.name())) },
        ];
        let chance = whole(probability(recorded));
        rows.insert(0, cells.into_iter().chain([chance]).collect());
    }
    html! {
        div {
            h3 { (say!("Would it have happened otherwise: {}", scene.step(event))) }
            @if !rows.is_empty() { (table(&[word!("Supposed"), word!("Would it?"), word!("Chance that it would")], &rows)) }
            @if let Some(hint) = hint { p.hint { (hint) } }
            @for (suppositions, why) in scene.unanswered(&event.counterfactuals) {
                p { (say!("Open {suppositions}: {why}.")) }
            }
        }
    }
}

/// Renders the changes that would have prevented the incident; nothing where they were simulated over another incident, or over
/// what was over before its gravest event began.
fn prevented(analysis: &Analysis, incident: &Incident<'_>) -> Markup {
    let advice = analysis.advice.as_ref();
    let span_ns = advice.map(|advice| [advice.event_start_ns, advice.event_end_ns]);
    match span_ns.is_none_or(|span_ns| incident.gravest().overlaps(span_ns)) {
        true => prevention::brief(analysis),
        false => html! {},
    }
}

fn largest(causes: &EventCauses) -> Vec<Vec<String>> {
    let mut shares: Vec<_> = causes.shares.iter().collect();
    shares.sort_by(|a, b| b.taken_n.abs().total_cmp(&a.taken_n.abs()));
    let shares = shares.into_iter().take(MOST_CAUSES);
    shares
        .map(|share| vec![readable(share.cause), number(share.taken_n)])
        .collect()
}

fn signature(analysis: &Analysis) -> Markup {
    let from = &analysis.provenance;
    let blank = || "________________".to_string();
    let hash = |file: &FileHash| format!("{}: SHA-256 {}", file.path, file.hash_text());
    let files = from.log.iter().map(|file| (word!("Log"), hash(file)));
    let program = from
        .program
        .as_ref()
        .map_or(word!("hash unknown").into(), |file| {
            format!("SHA-256 {}", file.hash_text())
        });
    let rows = [
        (word!("Case"), from.case.clone().unwrap_or_else(blank)),
        (
            word!("Examiner"),
            from.examiner.clone().unwrap_or_else(blank),
        ),
        (
            word!("Date of the analysis, signature"),
            format!("{}  {}", blank(), blank()),
        ),
    ];
    let hashes = [
        (word!("Machine file"), hash(&from.machine_file)),
        ("URDF", hash(&from.urdf)),
        (
            word!("Program"),
            format!("tipwatch {}: {program}", from.tipwatch_version),
        ),
    ];
    facts(
        &rows
            .into_iter()
            .chain(files)
            .chain(hashes)
            .collect::<Vec<_>>(),
    )
}
