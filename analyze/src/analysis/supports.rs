//! Supports that come and go: the machine on each set of them, and the set of each row.

use anyhow::{Result, bail};
use tipwatch_language::{say, word};
use tipwatch_mechanics::Scope;
use tipwatch_mechanics::estimation::support_configuration::GroundGap;
use tipwatch_mechanics::machine::{Machine, SupportKind};

use crate::base::number::short;
use crate::base::options::{ModelKind, Options};
use crate::base::support_sets::{SupportSet, SupportSets};
use crate::load::LoadedLog;
use crate::load::supports::{SupportSpan, SupportTimeline, Unknown};

/// Refuses options that are only computed for a machine that is always on the same supports.
pub(super) fn check_options(loaded: &LoadedLog, options: &Options) -> Result<()> {
    if loaded.supports.is_none() {
        return Ok(());
    }
    if options.model != ModelKind::WholeBody {
        bail!(
            "model {}: expected a machine that is always on the same wheels, found supports that come and go; use the whole-body model",
            options.model.name()
        );
    }
    if options.monte_carlo.is_some() {
        bail!(
            "Monte Carlo study: expected a machine that is always on the same supports, found supports that come and go"
        );
    }
    Ok(())
}

/// The sets of rows at these times, and the machine that names the results on all of them; `None` for a machine that
/// is always on the same supports. The reference loads are those of the machine as recorded, whatever is supposed of it. What
/// the sets were is noted.
pub(super) fn of_rows(
    loaded: &mut LoadedLog,
    (recorded, suppose): (&Machine, &dyn Fn(Machine) -> Result<Machine, &'static str>),
    times_ns: &[i64],
    scope: Scope,
) -> Option<(Machine, SupportSets)> {
    let mut timeline = loaded.supports.take()?;
    let machine = &loaded.machine;
    let mut notes = Vec::new();
    let mut machines = Vec::new();
    let mut places = Vec::new();
    for on in &timeline.sets {
        match recorded.standing_on(on) {
            Ok(mut machine) => {
                if let Err(error) = machine.set_reference_loads() {
                    notes.push(say!(
                        "Utilisation on {} is unknown: {error}.",
                        machine.supports().names(on)
                    ));
                }
                match suppose(machine) {
                    Ok(machine) => {
                        places.push(Ok(machines.len()));
                        machines.push(machine);
                    }
                    Err(why) => places.push(Err(why.into())),
                }
            }
            Err(error) => places.push(Err(error.to_string())),
        }
    }
    for span in &mut timeline.spans {
        if let Ok(set) = span.set {
            span.set = places[set].clone().map_err(Unknown::Impossible);
        }
    }
    let named = machine.for_names_of(&machines);
    let at = |ns: i64| times_ns.partition_point(|&time| time < ns);
    let of_span = |span: &SupportSpan| at(span.from_ns)..at(span.to_ns);
    let is_taken = |span: &&SupportSpan| span.set == Err(Unknown::Ground(GroundGap::Taken));
    let taken = timeline.spans.iter().filter(is_taken).map(of_span);
    let spans = timeline.spans.iter();
    let spans = spans.map(|span| (of_span(span), span.set.clone().ok()));
    let sets = SupportSets {
        spans: spans.filter(|(rows, _)| !rows.is_empty()).collect(),
        taken: taken.collect(),
        sets: (machines.into_iter())
            .map(|machine| SupportSet::new(machine, &named, scope))
            .collect(),
        are_measured: true,
    };
    notes.extend(told(&named, &sets, &timeline, times_ns));
    loaded.notes.extend(notes);
    loaded.supports = Some(timeline);
    Some((named, sets))
}

/// Describes the supports of the machine over the log, and when they are unknown, in sentences.
fn told(
    named: &Machine,
    sets: &SupportSets,
    timeline: &SupportTimeline,
    times_ns: &[i64],
) -> Vec<String> {
    let seconds = |row: usize| {
        let row = row.min(times_ns.len() - 1);
        (times_ns[row] - times_ns[0]) as f64 * 1e-9
    };
    let duration = |rows: &std::ops::Range<usize>| seconds(rows.end) - seconds(rows.start);
    let mut notes = Vec::new();
    for (index, set) in sets.sets.iter().enumerate() {
        let of_set = sets.spans.iter().filter(|(_, of)| *of == Some(index));
        let mut total_s = 0.0;
        let mut first_s = f64::INFINITY;
        for (rows, _) in of_set {
            total_s += duration(rows);
            first_s = first_s.min(seconds(rows.start));
        }
        if !first_s.is_finite() {
            continue;
        }
        let wheels = set.machine.wheels();
        notes.push(say!(
            "On {} for {} s, first at t = {} s.",
            named.supports().names(set.machine.stands_on()),
            short(total_s),
            short(first_s)
        ));
        let on = |kind: SupportKind| wheels.iter().any(|wheel| wheel.kind == kind);
        if on(SupportKind::Foot) && (on(SupportKind::Wheel) || on(SupportKind::TrackPoint)) {
            notes.push(
                word!("Then wheels and other supports carry together. How they share the load depends on their stiffness and on how far \
                 the jacks are extended: the loads there assume springs of the stated (else equal) stiffness, and only the range \
                 over all splits (columns load_NAME_min and load_NAME_max) is certain.")
                    .into(),
            );
        }
    }
    let mut unknown: Vec<(String, f64)> = Vec::new();
    for span in &timeline.spans {
        let Err(why) = &span.set else {
            continue;
        };
        let at = |ns: i64| times_ns.partition_point(|&time| time < ns);
        let rows = at(span.from_ns)..at(span.to_ns);
        if rows.is_empty() {
            continue;
        }
        let why = match why {
            Unknown::Ground(GroundGap::Transition | GroundGap::Taken) => {
                word!("the weight passes from some supports to others").into()
            }
            Unknown::Ground(GroundGap::Missing(support)) => say!(
                "the signal of support {} is missing or too old",
                named.supports().support(*support).name
            ),
            Unknown::Ground(GroundGap::Carries(support)) => {
                let name = &named.supports().support(*support).name;
                say!("support {name} is reported as not set while its own sensor measures a load")
            }
            Unknown::Impossible(error) => {
                say!("the machine cannot stand on what is reported: {error}")
            }
        };
        let duration_s = duration(&rows);
        match unknown.iter_mut().find(|(known, _)| *known == why) {
            Some((_, total_s)) => *total_s += duration_s,
            None => unknown.push((why, duration_s)),
        }
    }
    for (why, total_s) in unknown {
        notes.push(say!(
            "For {} s the loads are unknown: {why}.",
            short(total_s)
        ));
    }
    notes
}
