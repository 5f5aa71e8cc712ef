//! The logs and machines as a table to work with: sorted and filtered by a script, a card for each machine.
//!
//! All of it is in the page, as packed columns of whole numbers; without scripts the page shows the first of the ranking.

use std::collections::BTreeMap;

use maud::{Markup, html};
use serde::Serialize;
use tipwatch_language::{is_english, message, say, told, word};

use super::analysed_log::log_link;
use super::ranking::{Group, Ranked};
use crate::analysis::margin::Moment;
use crate::events::EventKind;
use crate::events::LEAST_OF_A_FACT;
use crate::events::support_words::{SupportWord, support_word};
use crate::page::{self, Program, input_in_words, percent, probability, readable};
use crate::policy::facts::EXPOSURE_CAUSES;
use crate::screen::data_set::{contradicts_margin, doubted};
use crate::screen::outliers::{Comparison, Verdict};
use crate::screen::record::{Outcome, Record};

const SCRIPT: &str = include_str!("explorer.js");
/// Most of the packed data (bytes): of more logs the page holds the first of the ranking.
const MOST_BYTES: usize = 1_840_000;
/// Logs that are shown without scripts.
const SHOWN: usize = 20;
/// Logs of the ranking whose posture the page holds: of each it takes as much as all other numbers.
const MOST_POSTURES: usize = 5000;

/// The names of some values, each once, and of each row which one.
#[derive(Default)]
struct Names {
    names: Vec<String>,
    places: BTreeMap<String, u32>,
}

impl Names {
    fn place(&mut self, name: &str) -> u32 {
        if let Some(place) = self.places.get(name) {
            return *place;
        }
        let place = self.names.len() as u32;
        self.names.push(name.to_owned());
        self.places.insert(name.to_owned(), place);
        place
    }
}

/// A machine of the table.
#[derive(Serialize)]
struct Machine {
    name: String,
    kind: Option<String>,
    /// Quantities in which the machine stands out, and whether it is worse than usual in each.
    outliers: Vec<(String, bool)>,
}

/// Data that the script reads: columns of the same length, one value a log, by path. `null` is unknown. Of a large fleet the
/// columns are the memory of the page: numbers have 32 bits.
#[derive(Serialize, Default)]
struct Data<'a> {
    machines: Vec<Machine>,
    causes: Vec<String>,
    groups: Vec<&'static str>,
    /// Heads of the table's columns.
    heads: Vec<&'static str>,
    /// The other texts of the script, by name, with places for its numbers.
    words: BTreeMap<&'static str, &'static str>,
    /// Whether the decimal mark is a comma.
    comma: bool,
    kinds: Vec<String>,
    folders: Vec<String>,
    /// Number of logs that the page does not hold.
    left_out: usize,
    wheels: Vec<String>,
    /// Reasons of failures, and what is doubted.
    texts: Vec<String>,
    contradicted: &'static str,
    certainties: Vec<String>,
    machine: Vec<Option<u32>>,
    /// Days since 1970.
    day: Vec<Option<i32>>,
    folder: Vec<u32>,
    name: Vec<&'a str>,
    /// Digits of the report's folder; empty without a report.
    report: Vec<String>,
    group: Vec<u8>,
    rank: Vec<u32>,
    /// Number of logs behind the first of the rank that cannot be told from it.
    tied: Vec<u32>,
    /// Thousandths: margin and its standard deviation; hundredths: what it is at most by any split.
    margin: Vec<Option<i32>>,
    sigma: Vec<Option<i32>>,
    any: Vec<Option<i32>>,
    wheel: Vec<Option<u32>>,
    /// Hundredths of a second.
    lifted: Vec<i64>,
    /// Ten thousandths: certainty of the finding, of the surest if there are several, to sort by.
    sure: Vec<Option<i32>>,
    /// Text about the certainty.
    certainty: Vec<Option<u32>>,
    /// Seconds.
    exposed: Vec<Option<i32>>,
    computable: Vec<i32>,
    /// Thousandths.
    valid: Vec<Option<i32>>,
    /// Bits: 1 if the log decides nothing beside what was found, 2 if that contradicts the margin.
    marks: Vec<u8>,
    cause: Vec<Option<u8>>,
    /// Tenths of m/s, and degrees.
    speed: Vec<Option<i32>>,
    tilt: Vec<Option<i32>>,
    /// Names of joints with their units, the joints of a machine in one text.
    joints: Vec<String>,
    /// Of the first of the ranking: which joints, and their positions (degrees or hundredths of a metre).
    posture: Vec<Option<(u32, Vec<Option<i32>>)>>,
    /// A bit for each of the kinds of events.
    events: Vec<u8>,
    text: Vec<Option<u32>>,
}

/// Said of a margin above zero of a log in which a wheel lifted or the machine fell.
const CONTRADICTED: &str = message!(": contradicted by the finding");

/// The group of logs that could not be analysed, behind those of the ranking.
const FAILED: u8 = Group::ALL.len() as u8;

/// The section, and the program that works on it.
pub(super) fn explorer(
    ranked: &[Ranked<'_>],
    failed: &[(&Record, &str)],
    compared: &[Comparison],
) -> (Markup, Program) {
    let mut listed = ranked.len() + failed.len();
    let program = loop {
        let of_ranking = listed.min(ranked.len());
        let of_failed = (listed - of_ranking).min(failed.len());
        let mut data = data(&ranked[..of_ranking], &failed[..of_failed], compared);
        data.left_out = ranked.len() + failed.len() - listed;
        let program = Program::new(&data, SCRIPT);
        if program.length() <= MOST_BYTES || listed <= 1000 {
            break program;
        }
        listed = (listed as f64 * 0.95 * MOST_BYTES as f64 / program.length() as f64) as usize;
    };
    let all = ranked.len() + failed.len();
    let section = html! {
        p.hint {
            (word!("The worst margin is the smallest overturning force (OTF) of any wheel or support as a share of its static load, ± two \
                standard deviations: 0 when it is about to lift, 100 % at rest on level ground. It holds under the split of the load that \
                the machine file states. By another split the margin is at most what stands beside it: 0 % where a wheel or support is off \
                the ground however the load splits, while 100 % does not exclude that one lifted by another split. Logs in which the \
                machine tipped over come first, then those in which it tipped about an edge and those in which a wheel or support lifted, \
                the longest first, and where their times cannot be told apart, the deepest; then those that are not decided, with what is \
                less likely than not or may be ground that gave way; then the others, by their worst margin. Logs that cannot be told \
                apart by two standard deviations share a rank. "))
            @if ranked.len() > MOST_POSTURES {
                (say!("The posture is that of the first {MOST_POSTURES} logs; the data set has all. "))
            }
            @if listed < all {
                (say!("The page holds the first {listed} of {all} logs, and counts those of a machine among them; the data set has all \
                    (tipwatch query). "))
            }
        }
        div #explorer {
            @if ranked.is_empty() { p { (word!("No log could be analysed.")) } }
            @else { (first_of(ranked)) }
        }
    };
    (section, program)
}

/// The first of the ranking, for paper and readers without scripts.
fn first_of(ranked: &[Ranked<'_>]) -> Markup {
    let rows: Vec<Vec<Markup>> = ranked.iter().take(SHOWN).map(row).collect();
    let head = [
        word!("Rank"),
        word!("Machine"),
        word!("Log"),
        word!("Finding"),
        word!("Worst margin"),
        word!("At most by any split"),
        word!("Lifted"),
        word!("Computable time"),
        word!("Main cause of exposure"),
        word!("Day"),
    ];
    html! { div.ranking { (page::table(&head, &rows)) } }
}

fn row(ranked: &Ranked<'_>) -> Vec<Markup> {
    let log = &ranked.log;
    let worst = log.facts.worst.as_ref();
    let rank = match ranked.rank {
        (first, last) if first == last => first.to_string(),
        (first, last) => say!("{first} to {last}"),
    };
    let contradicted = match contradicts_margin(log.facts, log.events) {
        true => told(CONTRADICTED),
        false => "",
    };
    let margin = worst.map_or_else(
        || word!("not computable").to_owned(),
        |worst| match worst.sigma {
            None => say!("{} (uncertainty not computable)", percent(worst.margin)),
            Some(sigma) => format!("{} ± {}", percent(worst.margin), percent(2.0 * sigma)),
        },
    );
    let group = told(Group::ALL[ranked.group as usize].1);
    let cause = main_cause(log).map_or_else(String::new, |cause| readable(EXPOSURE_CAUSES[cause]));
    let any_split = log
        .facts
        .margin_any_split
        .map_or(word!("unknown").into(), percent);
    vec![
        html! { (rank) },
        html! { (log.machine()) },
        log_link(log),
        html! {
            (group)
            @if let Some((_, told)) = surest_finding(ranked) { " (" (told) ")" }
        },
        html! { (margin) (contradicted) },
        html! { (any_split) },
        html! { @if ranked.lifted_s > 0.0 { (page::time(ranked.lifted_s)) } },
        html! {
            (log.facts.coverage)
            @if log.is_undecided { strong.holes { (word!(": not decided")) } }
        },
        html! { (cause) },
        html! { (log.record.date().map_or_else(|| word!("unknown").into(), |date| date.to_string())) },
    ]
}

/// The cause with the most exposure, as a place in [`EXPOSURE_CAUSES`].
fn main_cause(log: &super::analysed_log::AnalysedLog<'_>) -> Option<usize> {
    let seconds = log.facts.exposure.exposed_by_cause_s.as_ref()?;
    let most = seconds
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(b.1))?;
    (*most.1 > 0.0).then_some(most.0)
}

fn data<'a>(
    ranked: &[Ranked<'a>],
    failed: &[(&'a Record, &'a str)],
    compared: &[Comparison],
) -> Data<'a> {
    let (mut folders, mut wheels, mut texts) =
        (Names::default(), Names::default(), Names::default());
    let (mut machines, mut certainties) = (Names::default(), Names::default());
    let mut joints = Names::default();
    let mut kinds = BTreeMap::new();
    let whole = |value: Option<f64>, scale: f64| value.map(|value| (value * scale).round() as i32);
    let mut data = Data {
        causes: EXPOSURE_CAUSES.map(readable).to_vec(),
        groups: Group::ALL.map(|(_, name)| told(name)).to_vec(),
        contradicted: told(CONTRADICTED),
        heads: heads(),
        words: words(),
        comma: !is_english(),
        kinds: EventKind::ALL
            .iter()
            .map(|&kind| SupportWord::OF_ANY_MACHINE.event(kind))
            .collect(),
        ..Data::default()
    };
    data.groups.push(word!("could not be analysed"));
    let mut identity = |data: &mut Data<'a>,
                        (record, name): (&'a Record, &'a str),
                        group: u8,
                        rank: (usize, usize)| {
        let folder = &record.path[..record.path.len() - name.len()];
        let machine = record.machine.as_ref().map(|machine| {
            let place = machines.place(&machine.name);
            kinds.insert(place, machine.kind.clone());
            place
        });
        let report = record.report_folder();
        let report = report.and_then(|folder| Some(folder.rsplit_once('/')?.1.to_owned()));
        data.machine.push(machine);
        data.day.push(record.day().map(|day| day.0));
        data.folder.push(folders.place(folder));
        data.name.push(name);
        data.report.push(report.unwrap_or_default());
        data.group.push(group);
        data.rank.push(rank.0 as u32);
        data.tied.push((rank.1 - rank.0) as u32);
    };
    // neighbours of one machine and day share most of their names, and pack well
    let mut by_path: Vec<(usize, &Ranked<'_>)> = ranked.iter().enumerate().collect();
    by_path.sort_by_key(|(_, log)| &log.log.record.path);
    for (place, log) in by_path {
        let (facts, events) = (log.log.facts, log.log.events);
        identity(
            &mut data,
            (log.log.record, log.log.name),
            log.group as u8,
            log.rank,
        );
        let worst = facts.worst.as_ref();
        let moment = worst.and_then(|worst| worst.moment.as_ref());
        let surest = surest_finding(log);
        let doubts = doubted(facts, events, input_in_words);
        let flags = EventKind::ALL.iter().enumerate();
        let flags = flags.filter(|(_, kind)| facts.has_event(**kind));
        data.margin
            .push(whole(worst.map(|worst| worst.margin), 1e3));
        data.sigma
            .push(whole(worst.and_then(|worst| worst.sigma), 1e3));
        data.any.push(whole(facts.margin_any_split, 1e2));
        data.wheel
            .push(worst.map(|worst| wheels.place(&support_word(&worst.wheel))));
        data.lifted.push((log.lifted_s * 100.0).round() as i64);
        data.sure
            .push(whole(surest.as_ref().map(|(stated, _)| *stated), 1e4));
        let told = surest.map(|(_, told)| certainties.place(&told));
        data.certainty.push(told);
        let is_contradicted = contradicts_margin(facts, events);
        data.marks
            .push(u8::from(log.log.is_undecided) + 2 * u8::from(is_contradicted));
        data.exposed.push(whole(facts.exposure.exposed_s, 1.0));
        data.computable
            .push(facts.coverage.computable_s.round() as i32);
        data.valid.push(whole(facts.coverage.valid_share, 1e3));
        data.cause
            .push(main_cause(&log.log).map(|cause| cause as u8));
        data.speed
            .push(whole(moment.and_then(|moment| moment.speed_m_s), 10.0));
        let tilt = moment.and_then(|moment| moment.tilt_rad);
        data.tilt.push(whole(tilt.map(f64::to_degrees), 1.0));
        let moment = moment.filter(|_| place < MOST_POSTURES);
        data.posture
            .push(moment.and_then(|moment| posture(moment, &mut joints)));
        data.events
            .push(flags.fold(0, |bits, (place, _)| bits | 1 << place));
        let doubts = (!doubts.is_empty()).then(|| texts.place(&doubts.join("; ")));
        data.text.push(doubts);
    }
    for &(record, name) in failed {
        let rank = ranked.len() + 1;
        identity(
            &mut data,
            (record, name),
            FAILED,
            (rank, ranked.len() + failed.len()),
        );
        let reason = match &record.result {
            Outcome::Failed { kind, reason } => {
                format!("{}: {reason}", kind.in_words())
            }
            Outcome::Analysed { .. } => String::new(),
        };
        for column in [
            &mut data.margin,
            &mut data.sigma,
            &mut data.any,
            &mut data.sure,
            &mut data.exposed,
            &mut data.valid,
            &mut data.speed,
            &mut data.tilt,
        ] {
            column.push(None);
        }
        data.wheel.push(None);
        data.posture.push(None);
        data.certainty.push(None);
        data.lifted.push(0);
        data.computable.push(0);
        data.marks.push(0);
        data.cause.push(None);
        data.events.push(0);
        data.text.push(Some(texts.place(&reason)));
    }
    let mut of_machine: BTreeMap<&str, Vec<(String, bool)>> = BTreeMap::new();
    for comparison in compared {
        if let Verdict::Outlier { is_worse } = comparison.verdict {
            let told = super::outliers::in_words(comparison);
            let of_machine = of_machine.entry(&comparison.machine).or_default();
            of_machine.push((told, is_worse));
        }
    }
    data.machines = machines
        .names
        .iter()
        .enumerate()
        .map(|(place, name)| Machine {
            name: name.clone(),
            kind: kinds.get(&(place as u32)).cloned().flatten(),
            outliers: of_machine.remove(name.as_str()).unwrap_or_default(),
        })
        .collect();
    data.folders = folders.names;
    data.wheels = wheels.names;
    data.joints = joints.names;
    data.texts = texts.names;
    data.certainties = certainties.names;
    data
}

/// Heads of the columns, in the order of the script.
fn heads() -> Vec<&'static str> {
    vec![
        word!("Rank"),
        word!("Machine"),
        word!("Log"),
        word!("Finding"),
        word!("Worst margin"),
        word!("At most by any split"),
        word!("Wheel or support"),
        word!("Lifted"),
        word!("Certainty of the finding"),
        word!("Computable"),
        word!("Main cause"),
        word!("Speed"),
        word!("Tilt"),
        word!("Posture"),
        word!("Day"),
        word!("Doubt or failure"),
    ]
}

/// The texts of the script, by the names that it has for them.
fn words() -> BTreeMap<&'static str, &'static str> {
    BTreeMap::from([
        ("unknown", word!("unknown")),
        ("not_computable", word!("not computable")),
        (
            "no_uncertainty",
            word!("{margin} (uncertainty not computable)"),
        ),
        ("undecided", word!(": not decided")),
        ("range", word!("{first} to {last}")),
        ("one_log", word!("1 log")),
        ("logs", word!("{count} logs")),
        ("shown", word!("{shown} of {all}")),
        ("page", word!("page {page} of {pages}")),
        ("all", word!("all")),
        ("machine", word!("Machine")),
        ("type", word!("Type")),
        ("finding", word!("Finding")),
        ("event", word!("Event")),
        ("cause", word!("Cause")),
        ("from", word!("From day")),
        ("to", word!("To day")),
        ("text", word!("Text")),
        ("clear", word!("Clear")),
        ("before", word!("‹ before")),
        ("after", word!("next ›")),
        (
            "no_history",
            word!("No log of this machine has both a margin and a date."),
        ),
        ("history", word!("Worst margin of each log over time")),
        ("unknown_time", word!("an unknown time")),
        ("at_least", word!("at least {time}")),
        (
            "card",
            word!(
                "{logs}, {computable} computable, {exposed} below the notice level, {lifted} with a wheel or support off the ground. {found}."
            ),
        ),
        (
            "left_out",
            word!("These are its logs among the first {rows} of {all} that the page holds."),
        ),
    ])
}

/// The posture of a machine; `None` of results of older versions, which do not say what is an angle.
fn posture(moment: &Moment, joints: &mut Names) -> Option<(u32, Vec<Option<i32>>)> {
    if moment.are_lengths.len() != moment.joints.len() {
        return None;
    }
    let named = moment.joints.iter().zip(&moment.are_lengths);
    let named =
        named.map(|(name, is_length)| format!("{name}{}", if *is_length { " m" } else { "°" }));
    let positions = moment.positions.iter().zip(&moment.are_lengths);
    let positions = positions.map(|(position, is_length)| {
        let scaled = position.map(|position| {
            if *is_length {
                100.0 * position
            } else {
                position.to_degrees()
            }
        });
        scaled.map(|position| position.round() as i32)
    });
    Some((
        joints.place(&named.collect::<Vec<_>>().join("\n")),
        positions.collect(),
    ))
}

/// Returns the certainty of the finding of a log, of the surest if there are several, under the stated split, and in words. Of an
/// undecided log the finding is the gravest event that may have happened, by name.
fn surest_finding(log: &Ranked<'_>) -> Option<(f64, String)> {
    let events = log.log.events;
    let may_be = || {
        let lifts = events.iter().filter(|event| event.kind.is_lift());
        let gravest = lifts.map(|event| event.kind).max()?;
        (log.group == Group::Undecided).then_some(gravest)
    };
    let kind = log.group.event().or_else(may_be)?;
    let found = || events.iter().filter(|event| event.kind == kind);
    let stated = found()
        .filter_map(|event| event.certainty)
        .reduce(f64::max)?;
    let any = found().filter_map(|event| event.certainty_any_split);
    let told = certainty(stated, any.reduce(f64::max));
    Some(match log.group {
        Group::Undecided => {
            let kind = SupportWord::OF_ANY_MACHINE.event(kind);
            (stated, say!("perhaps {kind}: {told}"))
        }
        _ => (stated, told),
    })
}

/// Describes the certainty of a finding under the stated split of the load, and whether the finding holds under every other
/// split.
fn certainty(surest: f64, under_every_split: Option<f64>) -> String {
    let otherwise = match under_every_split {
        None => word!("unknown under every split").into(),
        Some(certainty) if certainty < LEAST_OF_A_FACT => {
            word!("not shown under every split").into()
        }
        Some(certainty) => say!("{} under every split", probability(certainty)),
    };
    format!("{}, {otherwise}", probability(surest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_has_its_texts() {
        let ends = |c: char| !(c.is_alphanumeric() || c == '_');
        let mut used: Vec<&str> = Vec::new();
        for part in [SCRIPT.split("words."), SCRIPT.split("said('")] {
            used.extend(part.skip(1).filter_map(|rest| rest.split(ends).next()));
        }
        used.sort_unstable();
        used.dedup();
        assert_eq!(used, words().into_keys().collect::<Vec<_>>());
        assert_eq!(heads().len(), SCRIPT.matches("key: ").count());
    }

    #[test]
    fn a_lift_is_never_told_surer_than_in_its_report() {
        assert_eq!(
            certainty(0.9999, Some(0.9999)),
            "above 99.9 %, above 99.9 % under every split"
        );
        assert_eq!(
            certainty(0.89, Some(0.0)),
            "89 %, not shown under every split"
        );
        assert_eq!(certainty(0.89, None), "89 %, unknown under every split");
    }
}
