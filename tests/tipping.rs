//! Onset, certainty and causes of lifts and tip-overs, compared with the contact forces of the simulation.

use std::collections::BTreeMap;
use std::fs;

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_analyze::report::findings;
use tipwatch_analyze::tables::parquet;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::state::Reason;
use tipwatch_tests::{analysed, data};

/// A wheel with less than this is off the ground in truth (N).
const OFF_GROUND_N: f64 = 1.0;

/// Returns the time at which each wheel of the simulated tip-over lifted for good (ns).
fn true_onsets() -> BTreeMap<String, i64> {
    let table = parquet::read(&data("tip_over.truth.parquet")).unwrap();
    let times = table.column("t_ns").unwrap().integers().unwrap();
    let onset = |wheel: &str| {
        let loads = table.column(&format!("load_{wheel}")).unwrap();
        let loads = loads.numbers().unwrap();
        let last_down = loads.iter().rposition(|&load| load >= OFF_GROUND_N)?;
        (last_down + 1 < loads.len()).then(|| (wheel.to_string(), times[last_down + 1]))
    };
    ["fl", "fr", "rl", "rr"]
        .into_iter()
        .filter_map(onset)
        .collect()
}

fn find<'a>(analysis: &'a Analysis, kind: EventKind, subject: &str) -> Option<&'a Event> {
    let mut events = analysis.events.iter();
    events.find(|event| event.kind == kind && event.subject == subject)
}

/// The load contributions are reported up to the last loads before the onset, though a machine that begins to tip has no valid
/// row there.
#[test]
fn causes_reach_the_onset() {
    for log in ["tip_over", "forklift", "side_reach"] {
        let analysis = analysed(&data(&format!("{log}.mcap")), Options::default());
        let rows = &analysis.rows;
        let told = analysis.events.iter();
        let told = told.filter_map(|event| Some((event, event.causes.as_ref()?)));
        let mut count = 0;
        for (event, causes) in told {
            count += 1;
            let last = (0..rows.len())
                .filter(|&row| rows.times_ns[row] <= event.start_ns)
                .rfind(|&row| rows.reasons[row].leave_loads());
            let last_ns = last.map(|row| rows.times_ns[row]);
            assert_eq!(
                Some(causes.at_ns),
                last_ns,
                "{log}: {:?} {}",
                event.kind,
                event.subject
            );
        }
        assert!(count > 0, "{log}");
    }
}

/// The wheel of `side_reach` carries load again from 6.34 s on, by the simulator's contact forces.
#[test]
fn val_the_end_of_a_lift_is_within_its_band() {
    let analysis = analysed(&data("side_reach.mcap"), Options::default());
    let lift = find(&analysis, EventKind::WheelLift, "rl").unwrap();
    let end_s = (lift.end_ns.unwrap() - analysis.rows.times_ns[0]) as f64 * 1e-9;
    let sigma_s = lift.end_sigma_s.unwrap();
    assert!(
        (end_s - 6.34).abs() < 2.0 * sigma_s && sigma_s < 0.2,
        "{end_s} +- {sigma_s}"
    );
}

#[test]
fn val_onsets_of_a_tip_over_are_found_within_a_tenth_of_a_second() {
    let analysis = analysed(&data("tip_over.mcap"), Options::default());
    let truth = true_onsets();
    assert_eq!(truth.keys().collect::<Vec<_>>(), ["fr", "rr"]);
    let path = data("tip_over.toml");
    let text = fs::read_to_string(&path).unwrap();
    let text = format!("{text}\n[uncertainty]\nroll_moment_distribution = 0.0\n");
    let file = MachineFile::from_text(&path, &text).unwrap();
    let log = data("tip_over.mcap");
    let with_known_split = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
    for (analysis, most_sigma_s, least) in [(&with_known_split, 0.2, 0.99), (&analysis, 0.4, 0.9)] {
        for (wheel, true_ns) in &truth {
            let lift = find(analysis, EventKind::WheelLift, wheel).unwrap();
            let error_s = (lift.start_ns - true_ns) as f64 * 1e-9;
            let sigma_s = lift.start_sigma_s.unwrap();
            assert!(error_s.abs() < 0.10, "{wheel}: {error_s} s");
            assert!(
                sigma_s < most_sigma_s && error_s.abs() < 3.0 * sigma_s,
                "{wheel}: {error_s} +- {sigma_s} s"
            );
            assert!(lift.certainty.unwrap() > least, "{lift:?}");
        }
    }
    // Both wheels off the left edge: no split could keep them down.
    let over = find(&analysis, EventKind::TipOver, "left").unwrap();
    assert!(over.worst > 0.5 && over.end_ns.is_none(), "{over:?}");
    assert!(over.certainty_any_split.unwrap() > 0.99, "{over:?}");
    let last = find(&analysis, EventKind::WheelLift, "fr").unwrap();
    assert_eq!(over.start_ns, last.start_ns);
    let first = find(&analysis, EventKind::WheelLift, "rr").unwrap();
    assert_eq!(first.any_split_ns, Some(over.start_ns));
    let lifted: Vec<&str> = (analysis.events.iter())
        .filter(|event| event.kind == EventKind::WheelLift)
        .map(|event| event.subject.as_str())
        .collect();
    assert_eq!(lifted, ["rr", "fr"]);
}

#[test]
fn a_log_that_ends_while_the_machine_tips_is_no_tip_over() {
    let options = Options {
        to_s: Some(5.45),
        ..Options::default()
    };
    let analysis = analysed(&data("tip_over.mcap"), options);
    let tipping = find(&analysis, EventKind::EdgeTipping, "left").unwrap();
    let rotation_rad = tipping.rotation_rad.unwrap();
    assert!(
        tipping.end_ns.is_none() && rotation_rad < 0.17,
        "{rotation_rad}"
    );
    assert!(find(&analysis, EventKind::TipOver, "left").is_none());
    let headline = &findings(&analysis)[0].headline;
    let expected = "The machine was tipping about the left edge when the log ended, from t = ";
    assert!(headline.starts_with(expected), "{headline}");
}

#[test]
fn causes_end_at_the_onset_and_add_up() {
    let analysis = analysed(&data("tip_over.mcap"), Options::default());
    let over = find(&analysis, EventKind::TipOver, "left").unwrap();
    let causes = over.causes.as_ref().unwrap();
    // up to the last row before the onset in which it does not tip yet, within the band of the onset
    assert!(causes.at_ns <= over.start_ns);
    let rows = &analysis.rows;
    let between = (0..rows.len()).filter(|&row| {
        let time_ns = rows.times_ns[row];
        causes.at_ns < time_ns && time_ns < over.start_ns
    });
    for row in between {
        assert!(rows.reasons[row].has(Reason::Tipping), "row {row}");
    }
    // The arm begins to move at 1 s; nothing moves before that.
    let since_s = (causes.since_ns - analysis.rows.times_ns[0]) as f64 * 1e-9;
    assert!(
        causes.since_is_steady && (0.4..2.0).contains(&since_s),
        "{since_s}"
    );
    assert_eq!(causes.shares[0].cause, "arm_weight");
    let share = |name: &str| {
        let found = causes.shares.iter().find(|share| share.cause == name);
        found.map(|share| share.percent)
    };
    // The rotation follows the onset: it takes nothing away before.
    assert!(
        share("platform_acceleration").unwrap().abs() < 5.0,
        "{causes:?}"
    );
    assert!(share("cornering").unwrap().abs() < 1.0, "{causes:?}");
    assert_eq!(share("lift_off"), None);
    let sum: f64 = causes.shares.iter().map(|share| share.percent).sum();
    assert!((sum - 100.0).abs() < 1e-6, "{sum}");
}

#[test]
fn without_a_steady_moment_causes_are_counted_from_two_seconds_before() {
    // The arm of this log moves from the first sample on.
    let analysis = analysed(&data("tiny_lift.mcap"), Options::default());
    let lift = find(&analysis, EventKind::WheelLift, "rl").unwrap();
    let causes = lift.causes.as_ref().unwrap();
    assert!(!causes.since_is_steady, "{causes:?}");
    // The lift begins less than two seconds after the first row.
    assert_eq!(causes.since_ns, analysis.rows.times_ns[0]);
    let sum: f64 = causes.shares.iter().map(|share| share.taken_n).sum();
    let lost_n = causes.otf_before_n - causes.otf_n;
    assert!((sum - lost_n).abs() < 1e-6 * lost_n, "{causes:?}");
}

/// Of wheels that carry nothing together the loads do not tell which one lifted last: its load alone has no passage through zero.
#[test]
fn the_last_wheel_off_an_edge_lifts_when_its_load_is_lost() {
    let analysis = analysed(&data("swinging_drive.mcap"), Options::default());
    let tipping = find(&analysis, EventKind::EdgeTipping, "left").unwrap();
    let lift = find(&analysis, EventKind::WheelLift, "fr").unwrap();
    assert!(lift.start_sigma_s.is_some(), "{lift:?}");
    assert_eq!(lift.start_sigma_s, tipping.start_sigma_s);
    assert_eq!(lift.start_ns, tipping.start_ns);
}

/// A machine that tips about an edge has no load on any wheel off it: those lifts are at least as certain, under any split.
#[test]
fn a_lift_is_as_certain_as_the_tipping_that_needs_it() {
    let mut compared = 0;
    for log in ["swinging_drive", "swing_lift", "tip_over"] {
        let analysis = analysed(&data(&format!("{log}.mcap")), Options::default());
        let machine = &analysis.machine;
        let of_kind = |kind| analysis.events.iter().filter(move |it| it.kind == kind);
        for tipping in of_kind(EventKind::EdgeTipping) {
            let edges = machine.polygon().edges().iter();
            let mut named = edges.filter(|edge| edge.name.to_lowercase() == tipping.subject);
            let edge = named.next().unwrap();
            let is_off = |event: &&Event| {
                let mut wheels = machine.wheels().iter().zip(&edge.carries);
                let is_wheel = |name: &str| name.to_lowercase() == event.subject;
                wheels.any(|(wheel, carries)| is_wheel(&wheel.name) && !carries)
            };
            let overlaps = |event: &&Event| {
                let until = |event: &Event| event.end_ns.unwrap_or(i64::MAX);
                event.start_ns < until(tipping) && tipping.start_ns < until(event)
            };
            for lift in of_kind(EventKind::WheelLift)
                .filter(is_off)
                .filter(overlaps)
            {
                assert!(lift.certainty >= tipping.certainty, "{lift:?} {tipping:?}");
                let under_any = (lift.certainty_any_split, tipping.certainty_any_split);
                assert!(under_any.0 >= under_any.1, "{lift:?} {tipping:?}");
                compared += 1;
            }
        }
    }
    assert!(compared >= 3, "{compared}");
}
