//! The questions that an expert asks first, and their answers.

use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::machine::{Ground, NoteKind};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{MachineSpec, Parameter, Quantity};

use super::doubted::doubted;
use crate::analysis::Analysis;
use crate::analysis::calendar::Calendar;
use crate::analysis::sensitivity::SensitivityTable;
use crate::events::split_rule::{is_stated, measured_forces, sharing, split_rule};
use crate::events::support_words::SupportWord;
use crate::events::{Answer, Bound, Event, EventKind, EventTimes, ShownBy, TIP_OVER_RAD};
use crate::page::{band, capital, number, percent, probability, with_sure_band};
use crate::report::deciding::Deciding;
use crate::report::explanations;
use crate::report::findings::{Incident, Scene, enumerated, input_list};
use crate::report::in_band;
use crate::report::parameter_words::in_words;
use crate::report::unstated_load;

/// Most that a result hangs on, besides the first.
const MOST_NEXT: usize = 2;
/// Uneven ground is told up to this (m).
const UNEVEN_M: f64 = 0.1;
/// Most losses told.
const MOST_LOST: usize = 2;
/// Most gaps of signals told, the longest first.
const MOST_GAPS: usize = 3;
/// From this probability on a step is told without it.
const SURE: f64 = 0.95;

/// Question and answer, in the order of their importance.
pub(super) fn answers(
    analysis: &Analysis,
    incidents: &[Incident<'_>],
) -> Vec<(&'static str, String)> {
    let word = SupportWord::of(&analysis.machine);
    let mut all = vec![
        (word!("Did it tip over?"), tipped_over(analysis)),
        (which_lifted(word), lifted(analysis)),
        (word!("When was it?"), when(analysis, incidents)),
        (word!("How sure is this?"), certainty(analysis, incidents)),
    ];
    // without it the loads and causes of a fall that the stated machine does not explain read as facts
    let explained = unstated_load::explained(analysis);
    all.extend(explained.map(|text| (word!("What explains the fall?"), text)));
    all.extend(
        hangs_on(analysis, incidents).map(|text| (word!("On what does it hang most?"), text)),
    );
    all.extend([
        (word!("Under which assumptions?"), assumptions(analysis)),
        (word!("What is lost of the log?"), lost(analysis)),
        (word!("Is the machine known?"), readiness(analysis)),
    ]);
    all
}

/// Under which condition a step is told, and how sure it is where a reader would take it for surer than it is.
pub(super) fn reserve(scene: &Scene, event: &Event) -> String {
    in_brackets(conditions(scene, event).chain(doubt(event.certainty)))
}

/// Under which condition a step is told that has its band beside it.
pub(super) fn condition(scene: &Scene, event: &Event) -> String {
    in_brackets(conditions(scene, event))
}

fn conditions(scene: &Scene, event: &Event) -> impl Iterator<Item = String> {
    let of_stated = scene.of_stated_machine(event).map(str::to_owned);
    scene.condition(event).into_iter().chain(of_stated)
}

fn in_brackets(reserves: impl Iterator<Item = String>) -> String {
    let reserves: Vec<String> = reserves.collect();
    match reserves.is_empty() {
        true => String::new(),
        false => format!(" ({})", reserves.join("; ")),
    }
}

/// A confidence that a reader must know.
pub(super) fn doubt(certainty: Option<f64>) -> Option<String> {
    let doubtful = certainty.filter(|certainty| *certainty < SURE);
    doubtful.map(|certainty| say!("confidence {}", probability(certainty)))
}

fn which_lifted(word: SupportWord) -> &'static str {
    match word.is_wheel() {
        true => word!("Which wheels left the ground?"),
        false => word!("What left the ground?"),
    }
}

/// Returns the reason why nothing is known of the machine's stability; `None` if something is.
fn nothing_known(analysis: &Analysis) -> Option<String> {
    if let Some(gross) = analysis.gross_inputs.first() {
        return Some(say!("Unknown: {}", gross.headline));
    }
    let is_nothing = !(0..analysis.rows.len()).any(|row| analysis.rows.reasons[row].leave_loads());
    is_nothing.then(|| {
        say!(
            "Unknown: {} loads cannot be computed in any row.",
            SupportWord::of(&analysis.machine).one
        )
    })
}

/// The scope of a log that is known as a whole.
const WHOLE_LOG: &str = message!("in this log");

/// [`WHOLE_LOG`], or in the part of its time that is known.
pub(super) fn scope(analysis: &Analysis) -> String {
    part(analysis).unwrap_or_else(|| told(WHOLE_LOG).into())
}

/// The part of the log's time that is known; `None` if all of it is.
fn part(analysis: &Analysis) -> Option<String> {
    let word = SupportWord::of(&analysis.machine).one;
    let coverage = &analysis.coverage;
    match (coverage.lift_not_excluded_s(), coverage.between_rows) {
        (Some(seconds), _) => {
            return Some(say!(
                "at the rows of this sparse log ({coverage} with known {word} loads); between them a lift, and what may follow from it, cannot be excluded for {seconds:.1} s"
            ));
        }
        (None, Some(_)) if coverage.is_whole() => {
            return Some(word!(
                "in this sparse log, given the stated greatest rates and accelerations between its rows"
            )
            .into());
        }
        _ => {}
    }
    match coverage.is_whole() {
        true if analysis.losses.end_is_lost() => Some(say!(
            "was found up to t = {:.2} s; the end of the log is lost, and what happened afterwards is not known",
            analysis.rows.seconds(analysis.rows.len() - 1)
        )),
        true => None,
        false => Some(say!(
            "in the {coverage} of the log with known {word} loads; nothing is known of the rest"
        )),
    }
}

fn of_kind(analysis: &Analysis, kind: EventKind) -> impl Iterator<Item = &Event> {
    analysis
        .events
        .iter()
        .filter(move |event| event.kind == kind)
}

fn tipped_over(analysis: &Analysis) -> String {
    let scene = Scene::of(analysis);
    let at = |event: &Event| say!("from {}", scene.start(event));
    // what is measured directly holds whatever is wrong with the loads
    if let Some(event) = of_kind(analysis, EventKind::TipOver).find(|event| event.is_fact())
        && (event.measured_rotation.is_some() || nothing_known(analysis).is_none())
    {
        let (edge, at) = (scene.subject(event), at(event));
        let tilt = at_least_degrees(event);
        let unseen = match event.shown_by {
            Some(ShownBy::Rotation) => word!(" The computed loads do not show it."),
            _ => "",
        };
        return say!("Yes, about the {edge} edge, {at}: its tilt grew by at least {tilt}.{unseen}");
    }
    if let Some(event) = open_tip_over(analysis.events.iter())
        && (event.measured_rotation.is_some() || nothing_known(analysis).is_none())
    {
        return may_have_tipped(&scene, event);
    }
    if let Some(unknown) = nothing_known(analysis) {
        return unknown;
    }
    let scope = scope(analysis);
    let tipping = of_kind(analysis, EventKind::EdgeTipping);
    let mut tipping: Vec<&Event> = tipping.filter(|event| event.is_fact()).collect();
    tipping.sort_by_key(|event| event.end_ns.is_some());
    match tipping.first() {
        Some(event) if event.end_ns.is_none() && scene.goes_on => say!(
            "Not known: it was tipping about the {} edge {} at the last row, and no tilt of {:.0}° about that edge was seen.",
            scene.subject(event),
            at(event),
            TIP_OVER_RAD.to_degrees()
        ),
        Some(event) if event.end_ns.is_none() => say!(
            "Not known: it was tipping about the {} edge {} when the log ends, and no tilt of {:.0}° about that edge was seen.",
            scene.subject(event),
            at(event),
            TIP_OVER_RAD.to_degrees()
        ),
        Some(event) => say!(
            "{}. But it was tipping about the {} edge {}{}.",
            capital(&no_tip_over(analysis, &scope)),
            scene.subject(event),
            at(event),
            reserve(&scene, event)
        ),
        None => format!("{}.", capital(&no_tip_over(analysis, &scope))),
    }
}

/// The likeliest rotation as far as that of a tip-over of which it is open whether the machine tipped, or the ground gave way under
/// it.
pub(super) fn open_tip_over<'a>(events: impl Iterator<Item = &'a Event>) -> Option<&'a Event> {
    let open = events.filter(|event| {
        let is_open = event.is_open() || Answer::of(event.certainty) == Answer::Open;
        event.kind == EventKind::TipOver && !event.is_fact() && is_open
    });
    open.max_by(|a, b| {
        let [a, b] = [a, b].map(|event| event.certainty.unwrap_or(0.0));
        a.total_cmp(&b)
    })
}

/// Tells a rotation of which it is open whether the machine tipped over.
pub(super) fn may_have_tipped(scene: &Scene, event: &Event) -> String {
    say!(
        "Not known whether the machine tipped over: the platform rotated by at least {} about the {} edge from {}; the probability that the machine tipped over is {}.",
        at_least_degrees(event),
        scene.subject(event),
        scene.start(event),
        event.certainty.map_or(word!("unknown").into(), probability)
    )
}

/// States that nothing tipped over in a scope, unless that is open, as the end of a sentence.
pub(super) fn no_tip_over(analysis: &Analysis, scope: &str) -> String {
    if open_tip_over(analysis.events.iter()).is_some() {
        return word!("whether the machine tipped over is not known").into();
    }
    // what turns over shows that to gyro or attitude, whatever the loads are
    let is_excluded = || in_band::are_known(analysis) && in_band::lifts(analysis).is_empty();
    match is_watched(analysis) || is_excluded() {
        true => say!("no tip-over {scope}"),
        false => say!("as computed, no tip-over {scope}"),
    }
}

/// Whether gyro or attitude would have shown a rotation.
fn is_watched(analysis: &Analysis) -> bool {
    let has_imu = analysis.inputs.iter().any(|input| input.signal == "imu");
    has_imu || analysis.digest.has_attitude
}

/// Returns the angle by which a machine tipped over at least, in whole degrees: rounded down, for it might not have been more.
pub(super) fn at_least_degrees(event: &Event) -> String {
    // of a whole number the last bits may be missing
    format!("{:.0}°", (event.worst.to_degrees() + 1e-9).floor())
}

/// The lifts of one wheel.
struct Lifted {
    name: String,
    /// Time of the first lift.
    start: String,
    times: usize,
    /// Time at which the wheel was off the ground behind unknown rows, again or still (s).
    seen: Option<f64>,
    /// Whether all lifts depend on the load split.
    depends: bool,
    /// Certainty of the first lift.
    certainty: Option<f64>,
}

fn lifted(analysis: &Analysis) -> String {
    if nothing_known(analysis).is_some() {
        return word!("Unknown.").into();
    }
    let scene = Scene::of(analysis);
    let lifts = of_kind(analysis, EventKind::WheelLift);
    let mut events: Vec<&Event> = lifts.filter(|event| event.is_fact()).collect();
    events.sort_by_key(|event| event.start_ns);
    let mut wheels: Vec<Lifted> = Vec::new();
    for event in events {
        let name = scene.subject(event);
        let depends = event.split_dependent != Some(false);
        // a lift that is certain from some time on may rest on the split before
        let start = match event.any_split_ns {
            Some(_) => format!(
                "{}{}",
                scene.start(event),
                scene.split_clauses(event).concat()
            ),
            None => scene.start(event),
        };
        match wheels.iter_mut().find(|wheel| wheel.name == name) {
            Some(wheel) => {
                match event.start_bound {
                    Bound::AtOrBefore => wheel.seen = Some(scene.seconds(event.start_ns)),
                    _ => wheel.times += 1,
                }
                wheel.depends &= depends;
            }
            None => wheels.push(Lifted {
                name,
                start,
                times: 1,
                seen: None,
                depends,
                certainty: event.certainty,
            }),
        }
    }
    let by_falls = off_by_falls(analysis, &scene, &wheels);
    wheels.extend(by_falls);
    let text = |wheel: &Lifted| {
        let Lifted { name, start, .. } = wheel;
        let doubt = doubt(wheel.certainty).map_or(String::new(), |doubt| format!(", {doubt}"));
        let seen = wheel.seen;
        let seen = seen.map_or(String::new(), |at_s| {
            say!("; at t = {at_s:.2} s again or still")
        });
        match wheel.times {
            1 => say!("{name} (from {start}{doubt}{seen})"),
            times => say!("{name} ({times} times, first from {start}{doubt}{seen})"),
        }
    };
    let of = |depends: bool| -> Vec<String> {
        wheels
            .iter()
            .filter(|wheel| wheel.depends == depends)
            .map(text)
            .collect()
    };
    let (sure, by_rule) = (of(false), of(true));
    let is_stated = is_stated(&analysis.machine);
    let mut sentences = Vec::new();
    if !sure.is_empty() {
        sentences.push(format!("{}.", sure.join(", ")));
    }
    if !by_rule.is_empty() {
        sentences.push(match is_stated {
            true => format!("{}.", by_rule.join(", ")),
            false => say!(
                "If {}: {}.",
                split_rule(&analysis.machine),
                by_rule.join(", ")
            ),
        });
    }
    let beyond = off_by_stops(analysis, &scene, &wheels);
    if !beyond.is_empty() {
        let names = enumerated(&beyond);
        let text = match wheels.is_empty() {
            true => say!("Beyond the stop of its axle {} left the ground", names),
            false => say!("Beyond the stop of its axle {} left the ground, too", names),
        };
        sentences.push(format!("{text}."));
    }
    let open = match is_stated {
        true => Vec::new(),
        false => could_have_lifted(analysis, &wheels, &beyond),
    };
    let is_none = wheels.is_empty() && beyond.is_empty();
    let mut in_band = in_band::lifts(analysis);
    in_band.retain(|(wheel, _)| !is_told(analysis, *wheel, &wheels, &beyond));
    if is_none {
        let is_certain = open.is_empty() && in_band.is_empty() && in_band::are_known(analysis);
        sentences.push(none(part(analysis), is_certain));
    }
    if !in_band.is_empty() {
        let of = in_band::all_in_words(analysis, &in_band);
        sentences.push(match is_none {
            true => say!("Within the bands a lift cannot be excluded ({of})."),
            false => say!("Within the bands a lift of these, too, cannot be excluded ({of})."),
        });
    }
    let sharing = sharing(&analysis.machine);
    if !open.is_empty() {
        let names = open
            .iter()
            .map(|&wheel| &*analysis.machine.wheels()[wheel].name);
        let ways = Deciding::of(analysis, &open).into_iter();
        sentences.push(say!(
            "Without knowing how the {sharing} a lift of {} cannot be excluded; {} would decide.",
            names.collect::<Vec<_>>().join(word!(" or ")),
            ways.map(Deciding::short)
                .collect::<Vec<_>>()
                .join(word!(" or "))
        ));
    } else if is_none && in_band.is_empty() && !is_stated {
        sentences.push(say!(
            "This holds however the {sharing}, tolerances of the inputs aside."
        ));
    }
    if analysis.rows.supports().is_some() {
        sentences.push(
            word!(
                "What was off the ground while the machine stood on other supports is not counted."
            )
            .into(),
        );
    }
    sentences.join(" ")
}

/// States that nothing lifted. Where another split, or a load within its band, could have lifted something, the statement is
/// limited to what was computed.
fn none(part: Option<String>, is_certain: bool) -> String {
    if part.is_none() && !is_certain {
        return word!("None as computed.").into();
    }
    let scope = part.unwrap_or_else(|| told(WHOLE_LOG).into());
    match is_certain {
        true => say!("None {scope}."),
        false => say!("As computed, none {scope}."),
    }
}

/// Wheels off the edge of a measured tip-over of which no load shows that they left the ground: they had when it began.
fn off_by_falls(analysis: &Analysis, scene: &Scene, lifted: &[Lifted]) -> Vec<Lifted> {
    let machine = &analysis.machine;
    let mut more: Vec<Lifted> = Vec::new();
    // on other supports, its edges are others
    if analysis.rows.supports().is_some() {
        return more;
    }
    for fall in of_kind(analysis, EventKind::TipOver).filter(|fall| fall.is_fact()) {
        let edge = machine.edge_named(&fall.subject);
        let edge = edge.filter(|_| fall.measured_rotation.is_some() && fall.other_edge().is_none());
        let Some(edge) = edge else { continue };
        let stays = machine.stays_on_ground(&machine.polygon().edges()[edge]);
        let started = Event {
            start_bound: Bound::AtOrBefore,
            ..fall.clone()
        };
        for (wheel, _) in machine
            .wheels()
            .iter()
            .zip(stays)
            .filter(|(_, stays)| !stays)
        {
            if lifted
                .iter()
                .chain(&more)
                .any(|known| known.name == wheel.name)
            {
                continue;
            }
            more.push(Lifted {
                name: wheel.name.clone(),
                start: scene.start(&started),
                times: 1,
                seen: None,
                depends: false,
                certainty: fall.certainty,
            });
        }
    }
    more
}

/// Wheels, in words, of which no load shows that they left the ground, but a fall beyond the stop of their axle.
fn off_by_stops(analysis: &Analysis, scene: &Scene, lifted: &[Lifted]) -> Vec<String> {
    let falls = of_kind(analysis, EventKind::TipOver).filter(|event| event.is_fact());
    let off: Vec<String> = falls.flat_map(|event| scene.off_by_stops(event)).collect();
    let wheels = analysis.machine.wheels().iter();
    let others = wheels.filter(|wheel| !lifted.iter().any(|known| known.name == wheel.name));
    let named = others.map(SupportWord::named);
    named.filter(|named| off.contains(named)).collect()
}

/// Whether the report states that a wheel left the ground.
fn is_told(analysis: &Analysis, wheel: usize, lifted: &[Lifted], beyond: &[String]) -> bool {
    let facts = &analysis.machine.wheels()[wheel];
    lifted.iter().any(|known| known.name == facts.name)
        || beyond.contains(&SupportWord::named(facts))
}

/// Wheels that did not lift as computed, nor by the stop of their axle, and carry no load under some split.
fn could_have_lifted(analysis: &Analysis, lifted: &[Lifted], beyond: &[String]) -> Vec<usize> {
    let machine = &analysis.machine;
    let could_unload = |wheel: &usize| {
        analysis.digest.wheels[*wheel].could_unload && !is_told(analysis, *wheel, lifted, beyond)
    };
    (0..machine.wheels().len()).filter(could_unload).collect()
}

fn certainty(analysis: &Analysis, incidents: &[Incident<'_>]) -> String {
    let scene = Scene::of(analysis);
    let mut sentences = Vec::new();
    match incidents.first().map(Incident::gravest) {
        Some(event) => {
            let what = scene.step(event);
            sentences.push(match (event.certainty, contradicted(event)) {
                (Some(certainty), Some((signals, right))) => say!(
                    "Confidence in \"{what}\": {}, because signals contradict each other then or later ({signals}): the probability that the loads are right all the same is {}. The rest is from the stated uncertainties{}.",
                    probability(certainty),
                    probability(right),
                    scene.split_in_certainty(event)
                ),
                (Some(certainty), None) => say!(
                    "Confidence in \"{what}\": {}, from the stated uncertainties{}.",
                    probability(certainty),
                    scene.split_in_certainty(event)
                ),
                (None, _) => say!("No confidence could be computed for \"{what}\"."),
            });
        }
        None => sentences.extend(
            (analysis.digest.lightest).map(|(row, wheel)| from_limit(analysis, row, wheel)),
        ),
    }
    sentences.extend(doubted(analysis));
    let faults = analysis
        .notes
        .iter()
        .filter(|note| note.kind == NoteKind::InputFault);
    if faults.count() > 0 {
        sentences.push(
            word!("An input contradicts the machine file (see Limitations): do not rely on this.")
                .into(),
        );
    }
    sentences.join(" ")
}

/// Signals that contradict each other during an event and make it less sure, and the probability that its loads are right.
fn contradicted(event: &Event) -> Option<(String, f64)> {
    let doubt = event.doubt.as_ref();
    let doubt = doubt.filter(|doubt| doubt.loads_are_right < SURE)?;
    Some((input_list(&doubt.subjects), doubt.loads_are_right))
}

/// The assumption that moves the result most.
fn hangs_on(analysis: &Analysis, incidents: &[Incident<'_>]) -> Option<String> {
    let gravest = incidents.first().map(Incident::gravest);
    let sensitivity = analysis.sensitivity.as_ref();
    let first = sensitivity.and_then(|found| Some((found, *found.ranked().first()?)));
    // without derivatives, a rotation that is measured rests on no load either
    let is_by_rotation = gravest.is_some_and(|event| {
        event.is_measured() && (first.is_none() || unstated_load::contradicts(analysis, event))
    });
    if is_by_rotation {
        return Some(
            word!("On gyro and attitude, which measured the rotation: on no mass and no load of the machine file.").into(),
        );
    }
    let Some((found, first)) = first else {
        return Some(say!(
            "Not known. {}",
            explanations::no_derivatives(analysis)
        ));
    };
    let machine = &analysis.machine;
    let two_sigma = 2.0 * first.sigma;
    let change_n = first.two_sigma_change_n();
    let wheel = &machine.wheels()[found.worst_wheel].name;
    let named = SupportWord::named(&machine.wheels()[found.worst_wheel]);
    // how fast the load fell before the lift tells how much earlier or later it would have been zero
    let lift = incidents
        .iter()
        .flat_map(|it| it.events.iter().copied())
        .find(|event| event.kind == EventKind::WheelLift && event.subject == wheel.to_lowercase());
    let limit_n = analysis
        .min_loads_n
        .as_ref()
        .map(|limits| limits[found.worst_wheel]);
    // a lift that begins with a rotation about an edge is dated by that, and a lead may count from another wheel
    let all = || incidents.iter().flat_map(|it| &it.events);
    let is_by_rotation = |lift: &&Event| {
        all().any(|it| it.kind == EventKind::EdgeTipping && it.start_ns == lift.start_ns)
    };
    let lead_s = lift
        .filter(|lift| !is_by_rotation(lift) && lift.lead_from.as_ref() == Some(&lift.subject))
        .and_then(|event| event.lead_s);
    let shift = lead_s.filter(|lead_s| *lead_s > 0.0).zip(limit_n);
    let shift_s = shift.map(|(lead_s, limit_n)| change_n * lead_s / limit_n);
    let shift = match shift_s {
        Some(shift_s) if shift_s < 0.005 => word!(", and its lift by less than 0.01 s").into(),
        Some(shift_s) => say!(", and its lift by about {shift_s:.2} s"),
        None => String::new(),
    };
    let parameter = in_words(first.parameter, machine);
    let of_samples = found.share_of_samples();
    let begin = match of_samples > first.variance_share {
        true => say!(
            "The errors of the samples themselves: {} of the variance of the load of {named}. Of what is constant, {parameter}",
            percent(of_samples)
        ),
        false => capital(&parameter),
    };
    let next = found.ranked().into_iter().skip(1).take(MOST_NEXT);
    let next: Vec<String> = next
        .filter(|row| row.variance_share > 0.0)
        .map(|row| {
            let change = band(row.two_sigma_change_n());
            format!("{} (± {change} N)", in_words(row.parameter, machine))
        })
        .collect();
    let next = match next.is_empty() {
        true => String::new(),
        false => say!(" Next: {}.", next.join(", ")),
    };
    let ground = even_ground(analysis, found).unwrap_or_default();
    let doubted = gravest.and_then(contradicted);
    let doubted = doubted.map_or(String::new(), |(signals, _)| {
        say!("That the loads are right although signals contradict each other then or later ({signals}). If they are: ")
    });
    let measured = match gravest {
        Some(event) if event.is_measured() => {
            word!("The rotation is measured by gyro and attitude and hangs on no load. Before it: ")
        }
        _ => "",
    };
    Some(say!(
        "{doubted}{measured}{begin}, known to ± {}{}: that alone moves the load of {named} by ± {} N{shift}.{next}{ground}",
        amount(two_sigma, first.parameter.unit(machine)),
        match explanations::is_by_default(analysis, first.parameter) {
            true => word!(" (by default: the machine file does not say how well)"),
            false => "",
        },
        band(change_n)
    ))
}

/// Describes how uneven the ground would have to be under the worst wheel, where the ground is taken as flat: no standard
/// deviation covers that.
fn even_ground(analysis: &Analysis, found: &SensitivityTable) -> Option<String> {
    let machine = &analysis.machine;
    if machine.contact().ground != Ground::Plane {
        return None;
    }
    // a larger wheel is one on higher ground
    let is_its_radius = |parameter: Parameter| match parameter {
        Parameter::WheelRadius(id) => machine.place_of(id) == Some(found.worst_wheel),
        _ => false,
    };
    let mut rows = found.rows.iter();
    let row = rows.find(|row| row.wheel == found.worst_wheel && is_its_radius(row.parameter))?;
    let change_m = row.change_to_zero?;
    let named = SupportWord::named(&machine.wheels()[found.worst_wheel]);
    let mm = 1e3 * change_m.abs();
    (change_m.abs() < UNEVEN_M).then(|| match change_m > 0.0 {
        true => say!(
            " The ground is taken as flat: {mm:.0} mm higher under {named} alone, and its least load would have been zero."
        ),
        false => say!(
            " The ground is taken as flat: {mm:.0} mm lower under {named} alone, and its least load would have been zero."
        ),
    })
}

/// The half width of a band with its unit; what has none is a share.
fn amount(half_width: f64, unit: &str) -> String {
    match unit {
        "-" => format!("{} %", band(100.0 * half_width)),
        unit => format!("{} {unit}", band(half_width)),
    }
}

/// Describes the missing parts of the log.
fn lost(analysis: &Analysis) -> String {
    let scene = Scene::of(analysis);
    let mut sentences = Vec::new();
    let losses = &analysis.losses;
    if losses.end_is_lost() {
        let last = analysis.rows.len().saturating_sub(1);
        let last_s = analysis.rows.seconds(last);
        sentences.push(say!(
            "The end of the log: nothing is known after t = {last_s:.2} s."
        ));
    }
    if scene.goes_on {
        sentences.push(say!(
            "Joints: their messages end at t = {:.2} s, the log {:.2} s later; nothing is computed between.",
            scene.seconds(analysis.rows.times_ns.last().copied().unwrap_or_default()),
            analysis.coverage.after_rows_s
        ));
    }
    match losses.is_empty() {
        true => sentences.push(word!("No damage was found in what was read.").into()),
        false => sentences.extend(
            losses
                .lines()
                .take(MOST_LOST)
                .map(|line| format!("{line}.")),
        ),
    }
    let mut gaps: Vec<&Event> = of_kind(analysis, EventKind::InputGap).collect();
    gaps.sort_by_key(|gap| gap.start_ns.saturating_sub(gap.end_ns.unwrap_or(i64::MAX)));
    let more = gaps.len().saturating_sub(MOST_GAPS);
    let named = gaps.iter().take(MOST_GAPS).map(|gap| {
        let (subject, from_s) = (scene.subject(gap), scene.seconds(gap.start_ns));
        match gap.end_ns {
            Some(end_ns) => say!(
                "{subject} from t = {from_s:.2} to {:.2} s",
                scene.seconds(end_ns)
            ),
            None => say!("{subject} from t = {from_s:.2} s on"),
        }
    });
    let mut named: Vec<String> = named.collect();
    if more > 0 {
        named.push(say!("and {more} more"));
    }
    if !named.is_empty() {
        sentences.push(say!("Without data: {}.", named.join(", ")));
    }
    let loads = unstated_load::known_loads(analysis);
    sentences.push(match analysis.coverage.on_side_s > 0.0 {
        _ if scene.is_sparse => say!(
            "{loads} at the rows of this sparse log ({}), and only bounded between them.",
            analysis.coverage
        ),
        true => say!("{loads} in {}.", analysis.coverage),
        false => say!("{loads} in {} of the log.", analysis.coverage),
    });
    let rows = analysis.rows.reasons.iter();
    let falls = rows.filter(|it| it.leave_loads() && it.has(Reason::Tipping));
    match falls.count() {
        0 => {}
        count => sentences.push(say!(
            "In {} of {} rows the machine was or may have been tipping: loads there are not accurate.",
            count,
            analysis.rows.len()
        )),
    }
    sentences.join(" ")
}

/// Describes whether sensors were commissioned and the machine was weighed.
fn readiness(analysis: &Analysis) -> String {
    let commissioned = &analysis.provenance.commissioning;
    let weighed = match (analysis.machine.identified(), weighings(analysis)) {
        (Some(_), _) => {
            word!("its parameters were identified from measurements (see Limitations)").into()
        }
        (None, 0) => {
            word!("its masses are those of the machine file: no measurement has corrected them")
                .into()
        }
        (None, count) => say!(
            "weighed (weighings in the machine file: {count}); its masses are those of the machine file: tipwatch check-machine compares them with the weighings"
        ),
    };
    let mut notes = analysis.notes.iter();
    let guessed = match notes.any(|note| note.kind == NoteKind::Unconfirmed) {
        true => word!(" Values that nobody has confirmed are guesses (see Limitations)."),
        false => "",
    };
    say!("Commissioning: {commissioned}; {weighed}.{guessed}")
}

/// Number of weighings in the machine file.
fn weighings(analysis: &Analysis) -> usize {
    let spec = MachineSpec::from_toml(&analysis.sources.machine_file, "machine file");
    let weighed = spec.ok().and_then(|spec| spec.weighed);
    weighed.map_or(0, |weighed| weighed.weighings().len())
}

/// The overturning force (OTF) of the support of an event at a time, with its band (N); the number alone without one, and of an
/// edge.
pub(super) fn otf_with_band(analysis: &Analysis, event: &Event, at_ns: i64, otf_n: f64) -> String {
    let is_of_support = matches!(event.kind, EventKind::WheelLight | EventKind::WheelLift);
    let wheel = analysis.machine.wheel_named(&event.subject);
    let sigma_n = wheel.filter(|_| is_of_support).map(|wheel| {
        let row = analysis.rows.at(at_ns);
        let found = analysis.rows.window(row..row + 1);
        found.value(Quantity::OtfSigma(wheel), 0)
    });
    match sigma_n.filter(|sigma_n| sigma_n.is_finite()) {
        Some(sigma_n) => with_sure_band(otf_n, sigma_n),
        None => number(otf_n),
    }
}

/// Describes how far the load of a wheel at a row is from its limit, in standard deviations.
fn from_limit(analysis: &Analysis, row: usize, wheel: usize) -> String {
    let found = analysis.rows.window(row..row + 1);
    let limits = analysis.min_loads_n.as_ref();
    let limit_n = limits.map_or(0.0, |limits| limits[wheel]);
    let load_n = found.value(Quantity::Load(wheel), 0);
    let sigma_n = found.value(Quantity::LoadSigma(wheel), 0);
    let named = SupportWord::named(&analysis.machine.wheels()[wheel]);
    let limit = match limit_n > 0.0 {
        true => word!("its limit"),
        false => word!("zero"),
    };
    match sigmas_above(load_n, sigma_n, limit_n) {
        None if sigma_n == 0.0 => {
            word!("The stated uncertainties leave the smallest load no band.").into()
        }
        None => word!("The uncertainty of the smallest load is not known.").into(),
        Some(sigmas) if sigmas < 0.0 => {
            let sigmas = -sigmas;
            say!(
                "The smallest load compared with that at rest, of {named}, is {sigmas:.1} standard deviations below {limit}."
            )
        }
        Some(sigmas) => say!(
            "The smallest load compared with that at rest, of {named}, is {sigmas:.1} standard deviations above {limit}."
        ),
    }
}

/// By how many standard deviations a load is above a limit; `None` without a band.
fn sigmas_above(load_n: f64, sigma_n: f64, limit_n: f64) -> Option<f64> {
    let sigmas = (load_n - limit_n) / sigma_n;
    sigmas.is_finite().then_some(sigmas)
}

fn assumptions(analysis: &Analysis) -> String {
    let contact = analysis.machine.contact();
    let wheels = analysis.digest.wheels.iter();
    let lowest = wheels.filter_map(|wheel| wheel.lowest);
    let is_open: Vec<bool> = lowest.map(|lowest| lowest.is_split_open).collect();
    let split = match is_open.is_empty() || is_open.contains(&true) {
        true => split_rule(&analysis.machine),
        false => word!("by equilibrium alone").into(),
    };
    let ground = match contact.ground {
        Ground::Unknown => say!(
            "the {}' points of contact lie where the model puts them (the shape of the ground is unknown)",
            SupportWord::of(&analysis.machine).many
        ),
        Ground::Plane => {
            word!("that the ground is flat is stated in the machine file and was not observed")
                .into()
        }
    };
    let measured = measured_forces(&analysis.machine, analysis.torques.rows_by_forces);
    let measured = measured.map_or(String::new(), |of| {
        say!("by the measured forces of {of}, elsewhere ")
    });
    say!(
        "Masses and geometry as stated in machine file and URDF; load split: {measured}{split}; {ground}; rigid frame and arm."
    )
}

fn when(analysis: &Analysis, incidents: &[Incident<'_>]) -> String {
    let scene = Scene::of(analysis);
    let calendar = Calendar::of(analysis);
    let times = &analysis.rows.times_ns;
    let after_ns = (analysis.coverage.after_rows_s * 1e9) as i64;
    let (Some(first), Some(last)) = (
        times.first().and_then(|&t| calendar.utc(t)),
        times
            .last()
            .and_then(|&t| calendar.utc(t.saturating_add(after_ns))),
    ) else {
        return say!("Unknown: {}.", calendar.source());
    };
    let event = incidents.first().map(Incident::gravest).and_then(|event| {
        let what = scene.step(event);
        let start = calendar.utc(event.start_ns)?;
        let margin = EventTimes::margin(event);
        Some(say!("{} at {start}{margin}. ", capital(&what)))
    });
    say!(
        "{}The log covers {first} to {last}, {}.",
        event.unwrap_or_default(),
        calendar.source()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_without_a_band_is_no_number_of_standard_deviations_from_its_limit() {
        assert_eq!(sigmas_above(500.0, 100.0, 200.0), Some(3.0));
        assert_eq!(sigmas_above(100.0, 100.0, 200.0), Some(-1.0));
        for sigma_n in [0.0, f64::NAN] {
            assert_eq!(sigmas_above(200.0, sigma_n, 200.0), None);
            assert_eq!(sigmas_above(500.0, sigma_n, 200.0), None);
        }
    }

    #[test]
    fn what_cannot_be_excluded_is_not_excluded() {
        assert_eq!(none(None, true), "None in this log.");
        assert_eq!(none(None, false), "None as computed.");
    }

    #[test]
    fn a_tip_over_as_likely_as_not_is_open() {
        let event = |kind, certainty| Event {
            certainty: Some(certainty),
            ..Event::blank(kind, 0, "right".into())
        };
        let found = |events: &[Event]| open_tip_over(events.iter()).map(|event| event.certainty);
        let half = event(EventKind::TipOver, 0.499_95);
        let less = event(EventKind::TipOver, 0.2);
        assert_eq!(found(&[less, half]), Some(Some(0.499_95)));
        let fact = event(EventKind::TipOver, 0.9999);
        let unlikely = event(EventKind::TipOver, 1e-6);
        assert_eq!(
            found(&[fact, unlikely, event(EventKind::EdgeTipping, 0.4)]),
            None
        );
    }

    #[test]
    fn a_least_tilt_is_rounded_down() {
        let tilted = |degrees: f64| Event {
            worst: degrees.to_radians(),
            ..Event::blank(EventKind::TipOver, 0, "left".into())
        };
        assert_eq!(at_least_degrees(&tilted(49.7)), "49°");
        assert_eq!(at_least_degrees(&tilted(10.0)), "10°");
    }
}
