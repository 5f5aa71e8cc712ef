//! Payloads whose mass is known row by row: a signal states it, or it is estimated from the force of the lift cylinder.

use std::path::{Path, PathBuf};

use tipwatch_binding::MachineFile;
use tipwatch_live::monitor::Monitor;
use tipwatch_live::replay::LogSamples;
use tipwatch_live::wire::opening::{Untimed, open_session};
use tipwatch_live::wire::refusal::{Refusal, SessionRefused};
use tipwatch_live::wire::session::{Session, StampClock};
use tipwatch_live::wire::topics::{EVENT_ROW, Kind, WireSample, WireSession, WireVerdict};
use tipwatch_mechanics::machine::{Commissioned, Proof, Proofs};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{InputFault, Level, Verdict};

use crate::support::{data, seal};

const START_NS: i64 = 1_000_000_000_000;
/// The centre of mass in the simulation of `lift_payload`, whose payload has 320 kg.
const AT_TOOL: &str = "link = \"tool\"\ncom = [0.405, -0.4313, -0.0134]\n";

/// The machine of `lift_payload` with text in its lift linkage and a payload whose mass is this.
pub(crate) fn with_payload(folder: &Path, force: &str, mass: &str) -> PathBuf {
    let text = std::fs::read_to_string(data("lift_payload.toml")).unwrap();
    let text = text.replacen(
        "name = \"lift\"\n",
        &format!("name = \"lift\"\n{force}\n"),
        1,
    );
    let text = format!("{text}\n[[payload]]\n{AT_TOOL}mass = {mass}\n");
    std::fs::copy(data("lift_payload.urdf"), folder.join("lift_payload.urdf")).unwrap();
    let path = folder.join("payload.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// A number of the log that stands in for a scale: 320 kg, whatever it is.
pub(crate) const SCALE: &str = "{ signal = { topic = \"/lift_cylinder/rod_pressure\", field = \"fluid_pressure\", scale = 1e-12, offset = 320.0 }, \
                         max_age = 0.5 }\nmass_sigma = 4.0";
pub(crate) const FORCE: &str = "force = { topic = \"/actuators\", joint = \"lift_rod\" }";
pub(crate) const PRESSURES: &str = "pressure = { \
     piston = { topic = \"/lift_cylinder/piston_pressure\", field = \"fluid_pressure\" }, \
     rod = { topic = \"/lift_cylinder/rod_pressure\", field = \"fluid_pressure\" }, \
     piston_area = 50.265e-4, rod_area = 34.361e-4 }";

struct Opened {
    file: MachineFile,
    samples: LogSamples,
    session: Session,
}

fn opened(machine: &Path) -> Opened {
    opened_of("lift_payload.mcap", machine)
}

fn opened_of(log: &str, machine: &Path) -> Opened {
    let file = MachineFile::read(machine).unwrap();
    let samples = LogSamples::read(&data(log), &file, None).unwrap();
    let first_ns = samples.samples().next().unwrap().1;
    let session = Session {
        id: 77,
        clock: StampClock {
            stamp_ns: first_ns,
            host_ns: START_NS,
        },
        ..samples.session.clone()
    };
    Opened {
        file,
        samples,
        session,
    }
}

/// The verdicts on the rows of a session, by the time since its begin (s). `change` changes a sample that tells of a payload; `None`
/// is lost before it was numbered.
fn rows(
    machine: &Path,
    change: impl Fn(f64, WireSample) -> Option<WireSample>,
) -> Vec<(f64, WireVerdict)> {
    rows_with(machine, Proofs::NONE, change)
}

/// Returns the verdicts as [`rows`] does, of a machine whose commissioning has proven `commissioned`.
fn rows_with(
    machine: &Path,
    commissioned: Proofs,
    mut change: impl FnMut(f64, WireSample) -> Option<WireSample>,
) -> Vec<(f64, WireVerdict)> {
    let change = |since_s: f64, wire: WireSample| match wire.kind == Kind::Payload as u32 {
        true => change(since_s, wire),
        false => Some(wire),
    };
    rows_of("lift_payload.mcap", machine, commissioned, change)
}

/// Returns the verdicts as [`rows`] does, of any log; `change` changes every sample.
pub(crate) fn rows_of(
    log: &str,
    machine: &Path,
    commissioned: Proofs,
    change: impl FnMut(f64, WireSample) -> Option<WireSample>,
) -> Vec<(f64, WireVerdict)> {
    steered(log, machine, commissioned, change, |_, _| {})
}

/// Returns the verdicts as [`rows_of`] does, of a monitor that `steer` steers after each sample.
fn steered(
    log: &str,
    machine: &Path,
    commissioned: Proofs,
    mut change: impl FnMut(f64, WireSample) -> Option<WireSample>,
    mut steer: impl FnMut(f64, &mut Monitor),
) -> Vec<(f64, WireVerdict)> {
    let Opened {
        file,
        samples,
        session,
    } = opened_of(log, machine);
    let urdf = file.urdf(None, None).unwrap();
    let (machine, sensors) = session.machine(&file, &urdf).unwrap();
    let anywhere = vec![Some([f64::NEG_INFINITY, f64::INFINITY]); machine.joints().len()];
    let commissioned = Commissioned::new(&machine, commissioned, anywhere);
    let monitor = Monitor::new(machine, &sensors, &session, START_NS);
    let mut monitor = monitor.commissioned(commissioned);
    let (mut found, mut sequence) = (Vec::new(), 0);
    for (sample, log_ns) in samples.samples() {
        let mut wire = WireSample::new(&sample, log_ns).unwrap();
        let now_ns = START_NS + log_ns - session.clock.stamp_ns;
        let since_s = (now_ns - START_NS) as f64 * 1e-9;
        let Some(changed) = change(since_s, wire) else {
            continue;
        };
        wire = changed;
        seal(&mut wire, &session, sequence, now_ns);
        sequence += 1;
        let mut publish = |verdict: &mut WireVerdict| {
            if verdict.event == EVENT_ROW {
                found.push((since_s, *verdict));
            }
            now_ns
        };
        let _ = monitor.take(&wire, now_ns, &mut publish);
        steer(since_s, &mut monitor);
    }
    found
}

fn is_unknown(verdict: &WireVerdict) -> bool {
    let is_unknown = verdict.row_reasons().has(Reason::ToolWrenchGap);
    if is_unknown {
        assert!(verdict.payload_mass_kg.is_nan() && verdict.load[0].is_nan());
        assert!(
            verdict.verdict().level >= Level::Unknown,
            "{:?}",
            verdict.verdict()
        );
    }
    is_unknown
}

/// Every row between these times has a mass of 320 kg, or none has.
fn assert_rows(rows: &[(f64, WireVerdict)], [from_s, to_s]: [f64; 2], is_known: bool) {
    let among = |(since_s, _): &&(f64, WireVerdict)| (from_s..to_s).contains(since_s);
    let among: Vec<_> = rows.iter().filter(among).collect();
    assert!(among.len() > 5, "{}", among.len());
    for (since_s, verdict) in among {
        assert_eq!(is_unknown(verdict), !is_known, "{since_s}");
        if is_known {
            assert!((verdict.payload_mass_kg - 320.0).abs() < 1e-3, "{since_s}");
            assert_eq!(verdict.payload_mass_sigma_kg, 4.0);
        }
    }
}

#[test]
fn a_scale_that_falls_silent_or_shows_an_error_value_leaves_the_loads_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_payload(folder.path(), "", SCALE);
    let is_off = |since_s: f64| (1.0..2.5).contains(&since_s);
    let silent = rows(&machine, |since_s, wire| (!is_off(since_s)).then_some(wire));
    assert_rows(&silent, [0.6, 1.4], true);
    // its last sample holds for half a second
    assert_rows(&silent, [1.6, 2.5], false);
    assert_rows(&silent, [2.6, 3.5], true);
    for wrong in [f64::NAN, 1e6, -5000.0] {
        let wrong = rows(&machine, |since_s, mut wire| {
            if is_off(since_s) {
                wire.values[0] = wrong;
            }
            Some(wire)
        });
        assert_rows(&wrong, [0.6, 1.0], true);
        assert_rows(&wrong, [1.1, 2.5], false);
        assert_rows(&wrong, [2.6, 3.5], true);
    }
}

/// A payload that is attached and weighs nothing is as uncertain as any other, and so are the loads.
#[test]
fn an_empty_scale_has_the_error_of_a_scale() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_payload(folder.path(), "", SCALE);
    let utilisation = |mass: f64| {
        let rows = rows(&machine, |_, mut wire| {
            wire.values[0] = mass;
            Some(wire)
        });
        let (_, verdict) = rows.last().unwrap();
        assert!((verdict.payload_mass_kg - mass).abs() < 1e-3);
        assert_eq!(verdict.payload_mass_sigma_kg, 4.0, "{mass}");
        verdict.utilisation
    };
    let (empty, nearly) = (utilisation(0.0), utilisation(1e-4));
    assert!((empty - nearly).abs() < 1e-5 * nearly, "{empty} {nearly}");
}

#[test]
fn a_lift_cylinder_weighs_the_payload_within_its_band() {
    let folder = tempfile::tempdir().unwrap();
    for force in [FORCE, PRESSURES] {
        let machine = with_payload(folder.path(), force, "\"estimate\"");
        let rows = rows(&machine, |_, wire| Some(wire));
        let (first, rest): (Vec<_>, Vec<_>) = rows.iter().partition(|(since_s, _)| *since_s < 0.75);
        let is_valid = |verdict: &WireVerdict| verdict.row_reasons().leave_valid();
        assert!(first.len() > 5 && first.iter().all(|(_, verdict)| !is_valid(verdict)));
        let known: Vec<_> = rest
            .iter()
            .filter(|(_, verdict)| !is_unknown(verdict))
            .collect();
        let outside = known.iter().filter(|(_, verdict)| {
            let (mass, sigma) = (verdict.payload_mass_kg, verdict.payload_mass_sigma_kg);
            // nothing else can make the row unknown
            !((mass - 320.0).abs() <= 2.0 * sigma)
        });
        let (outside, known, rest) = (outside.count(), known.len(), rest.len());
        let last = known;
        println!("{force}: {known} of {rest} rows known, {outside} outside two sigma");
        assert!(last > rest * 9 / 10, "{known} of {rest}");
        assert!(outside * 20 <= known, "{outside} of {known}");
        let (_, verdict) = rows.last().unwrap();
        println!(
            "{} +- {}",
            verdict.payload_mass_kg, verdict.payload_mass_sigma_kg
        );
        assert!(verdict.payload_mass_sigma_kg < 40.0);
    }
}

#[test]
fn a_lift_cylinder_whose_force_is_missing_leaves_the_loads_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_payload(folder.path(), FORCE, "\"estimate\"");
    let rows = rows(&machine, |since_s, wire| {
        (!(2.0..2.5).contains(&since_s)).then_some(wire)
    });
    let of = |from_s: f64, to_s: f64| {
        let rows = rows
            .iter()
            .filter(move |(since_s, _)| (from_s..to_s).contains(since_s));
        rows.map(|(_, verdict)| is_unknown(verdict))
            .collect::<Vec<_>>()
    };
    assert!(of(1.5, 2.0).iter().all(|unknown| !unknown));
    // a gap of a quarter of a second (max_gap) is bridged; weighing takes five samples, a fifth of a second apart
    let unknown = of(2.3, 3.2);
    assert!(
        unknown.len() > 5 && unknown.iter().all(|unknown| *unknown),
        "{unknown:?}"
    );
    assert!(of(3.6, 4.5).iter().all(|unknown| !unknown));
}

/// A scale, a force and a pressure that have stuck are not proven, though they were commissioned.
// requirement: TW-VERDICT-28
#[test]
fn what_weighs_a_payload_is_not_proven_before_it_has_changed() {
    let folder = tempfile::tempdir().unwrap();
    let is_open = |verdict: &WireVerdict| verdict.verdict().unproven.has(Proof::Payload);
    for (force, mass, signals) in [
        ("", SCALE, 1),
        (FORCE, "\"estimate\"", 1),
        (PRESSURES, "\"estimate\"", 2),
    ] {
        let machine = with_payload(folder.path(), force, mass);
        let open_in_the_end = |stuck: Option<u32>| {
            let mut first = None;
            let rows = rows_with(&machine, Proofs::ALL, |_, mut wire| {
                if stuck == Some(wire.stream) {
                    wire.values[0] = *first.get_or_insert(wire.values[0]);
                }
                Some(wire)
            });
            is_open(&rows.last().unwrap().1)
        };
        assert!(!open_in_the_end(None), "{force}");
        for signal in 0..signals {
            assert!(open_in_the_end(Some(signal)), "{force} {signal}");
        }
        let nobody = rows(&machine, |_, wire| Some(wire));
        assert!(is_open(&nobody.last().unwrap().1), "{force}");
    }
}

/// A scale that stops: of one that shows noise the noise is missing, and of any other nothing shows any more that it is measured.
// requirement: TW-FAULT-10, TW-VERDICT-28
#[test]
fn a_scale_that_stops_is_frozen_or_not_proven() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_payload(folder.path(), "", SCALE);
    let stops_s = 3.0;
    let judged = |show: &dyn Fn(f64) -> f64, stops: bool| {
        let mut last = 0.0;
        let rows = rows_with(&machine, Proofs::ALL, |since_s, mut wire| {
            if since_s < stops_s || !stops {
                last = show(since_s);
            }
            wire.values[0] = last;
            Some(wire)
        });
        let end = rows.last().unwrap().1;
        let is_frozen = end.verdict().held.faults.has(InputFault::Frozen);
        let is_open = end.verdict().unproven.has(Proof::Payload);
        let was_open = |(since_s, row): &(f64, WireVerdict)| {
            (1.0..stops_s).contains(since_s) && row.verdict().unproven.has(Proof::Payload)
        };
        assert!(!rows.iter().any(was_open));
        assert!(stops || end.verdict().level != Level::Fault);
        [is_frozen, is_open, is_unknown(&end)]
    };
    let noisy = |since_s: f64| 320.0 + 2.0 * noise(since_s);
    let coarse = |since_s: f64| (320.5 + 0.4 * noise(since_s)).round();
    assert_eq!(judged(&noisy, false), [false, false, false]);
    assert_eq!(judged(&coarse, false), [false, false, false]);
    assert_eq!(judged(&noisy, true), [true, true, true]);
    assert_eq!(judged(&coarse, true), [false, true, false]);
}

/// The slew slips by a quarter of a turn, and a person trusts it as it is. It was commissioned; that is no proof of where it is now.
// requirement: TW-VERDICT-28, TW-VERDICT-31
#[test]
fn a_joint_that_only_a_person_trusts_is_not_proven() {
    let machine = data("commissioning.toml");
    let opened = opened_of("commissioning.mcap", &machine);
    let urdf = opened.file.urdf(None, None).unwrap();
    let (checked, sensors) = opened.session.machine(&opened.file, &urdf).unwrap();
    let slew = checked.joints().iter().position(|it| it.name == "slew");
    let slew = slew.unwrap();
    let stream = &sensors.joints[0].joints;
    let place = stream.iter().position(|joint| *joint == slew).unwrap();
    let slew = Proof::Joint(slew);
    let judged = |slips_s: f64| {
        let change = |since_s: f64, mut wire: WireSample| {
            if wire.kind == Kind::Joints as u32 && since_s > slips_s {
                wire.values[place] += std::f64::consts::FRAC_PI_2;
            }
            Some(wire)
        };
        let mut is_trusted = false;
        let trust = |since_s: f64, monitor: &mut Monitor| {
            if since_s > slips_s + 3.0 && !std::mem::replace(&mut is_trusted, true) {
                monitor.trust([slew].into_iter().collect());
            }
        };
        let rows = steered("commissioning.mcap", &machine, Proofs::ALL, change, trust);
        let at = |at_s: f64| rows.iter().find(|(since_s, _)| *since_s > at_s).unwrap().1;
        let is_doubted = |row: WireVerdict| Proofs::from_bits(row.doubted).has(slew);
        [3.0, 5.5, 8.0].map(|at_s| (is_doubted(at(at_s)), at(at_s).verdict().unproven.has(slew)))
    };
    assert_eq!(judged(f64::INFINITY), [(false, false); 3]);
    let [before, slipped, trusted] = judged(4.0);
    assert_eq!(
        (before, slipped.0, trusted),
        ((false, false), true, (false, true))
    );
}

/// A person trusts a signal, motion proves it, and a person trusts the lift, or the signal again, which has not failed since: what
/// the motion has proven since stays proven.
// requirement: TW-VERDICT-28, TW-VERDICT-31
#[test]
fn a_later_acknowledgement_takes_no_proof_back() {
    let machine = data("commissioning.toml");
    let opened = opened_of("commissioning.mcap", &machine);
    let urdf = opened.file.urdf(None, None).unwrap();
    let (checked, _) = opened.session.machine(&opened.file, &urdf).unwrap();
    let joints = checked.joints().iter();
    let lift = Proof::Joint(joints.clone().position(|it| it.name == "lift").unwrap());
    let judged = |trusts: &[(f64, Proof)]| {
        let mut next = trusts.iter().peekable();
        let trust = |since_s: f64, monitor: &mut Monitor| {
            while let Some((_, signal)) = next.next_if(|(at_s, _)| since_s > *at_s) {
                monitor.trust([*signal].into_iter().collect());
            }
        };
        let same = |_, wire| Some(wire);
        steered("commissioning.mcap", &machine, Proofs::ALL, same, trust)
    };
    let is_open = |row: &WireVerdict, signal| row.verdict().unproven.has(signal);
    let mut proven_later = joints
        .enumerate()
        .map(|(joint, _)| Proof::Joint(joint))
        .chain([Proof::AngularVelocity])
        .filter(|signal| *signal != lift)
        .filter_map(|signal| {
            let rows = judged(&[(0.5, signal)]);
            let mut since = rows.iter().skip_while(|(at_s, _)| *at_s < 0.6);
            let was_open = since.next().is_some_and(|(_, row)| is_open(row, signal));
            let (proven_s, _) = since.find(|(_, row)| was_open && !is_open(row, signal))?;
            let second_s = proven_s + 0.5;
            (second_s + 1.0 < rows.last()?.0).then_some((signal, second_s))
        });
    let (signal, second_s) = proven_later.next().unwrap();
    for second in [lift, signal] {
        let twice = judged(&[(0.5, signal), (second_s, second)]);
        for (at_s, row) in twice.iter().filter(|(at_s, _)| *at_s > second_s) {
            assert!(!is_open(row, signal), "{signal:?} {second:?} {at_s}");
        }
    }
}

/// White noise by the time, from -1 to 1.
fn noise(since_s: f64) -> f64 {
    2.0 * ((since_s * 1e3 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
}

/// The measured loads of all jacks of a crane stop while its boom moves, and one of them hides that its foot is lifted.
// requirement: TW-FAULT-10, TW-VERDICT-28
#[test]
fn jacks_that_stop_are_frozen_and_hide_no_lifted_foot() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(data("crane.toml")).unwrap();
    let text = text.replace(
        "[contact]\n",
        "[contact]\nground = \"plane\"\ntyre_stiffness = 2.0e6\n",
    );
    let text = text.replace("force_sigma =", "stiffness = 2.0e6\nforce_sigma =");
    let text = text.replace(
        "[uncertainty]\n",
        "[uncertainty]\nwheel_position = 0.001\nwheel_radius = 0.001\n",
    );
    let commissioned = Proofs::ALL.without([Proof::Ground].into_iter().collect());
    std::fs::copy(data("crane.urdf"), folder.path().join("crane.urdf")).unwrap();
    let machine = folder.path().join("crane.toml");
    std::fs::write(&machine, text).unwrap();
    let judged = |begins_s: f64, stops_s: f64| {
        let mut last = [f64::NAN; 4];
        rows_of("crane.mcap", &machine, commissioned, |since_s, mut wire| {
            if since_s < begins_s {
                return None;
            }
            if wire.kind == Kind::Actuator as u32 {
                let last = &mut last[wire.stream as usize];
                if since_s < stops_s || last.is_nan() {
                    *last = wire.values[0];
                }
                wire.values[0] = *last;
            }
            (since_s < 26.0).then_some(wire)
        })
    };
    let found = |rows: &[(f64, WireVerdict)], from_s: f64, to_s: f64| {
        let rows = rows
            .iter()
            .filter(|(at_s, _)| (from_s..to_s).contains(at_s));
        rows.map(|(at_s, row)| (*at_s, row.verdict()))
            .collect::<Vec<_>>()
    };
    let is_open = |verdict: &Verdict| verdict.unproven.has(Proof::ActuatorForces);
    let is_frozen = |verdict: &Verdict| verdict.held.cautions.has(InputFault::Frozen);
    let sound = judged(0.0, f64::INFINITY);
    for (at_s, verdict) in found(&sound, 1.0, 26.0) {
        assert!(!is_open(&verdict) && !is_frozen(&verdict), "{at_s}");
    }
    // the ground is stated, and the jacks are measured
    assert!(
        found(&sound, 1.0, 16.0)
            .iter()
            .any(|(_, it)| it.level == Level::Safe)
    );
    let stopped = judged(0.0, 16.0);
    // a second shows nothing more, and a hundred samples are too many
    for (at_s, verdict) in found(&stopped, 17.1, 26.0) {
        assert!(is_open(&verdict), "{at_s}");
    }
    for (at_s, verdict) in found(&stopped, 21.5, 26.0) {
        assert!(is_frozen(&verdict), "{at_s}");
    }
    let is_danger = |(_, it): &(f64, Verdict)| it.level == Level::Danger;
    let is_found = |rows: &[(f64, WireVerdict)]| found(rows, 20.9, 24.0).iter().any(is_danger);
    assert!(is_found(&stopped));
    // in a session that begins on the jacks, before it or before they have shown their noise
    assert!(is_found(&judged(14.0, f64::INFINITY)));
    for stops_s in [14.0, 14.1, 14.3, 14.6] {
        let stopped = judged(14.0, stops_s);
        assert!(is_found(&stopped), "{stops_s}");
        for (at_s, verdict) in found(&stopped, 17.1, 26.0) {
            assert!(is_open(&verdict), "{stops_s}: {at_s}");
        }
    }
}

#[test]
fn a_session_that_cannot_weigh_its_payload_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |opened: &Opened, change: &dyn Fn(&mut Session)| {
        let mut session = opened.session.clone();
        change(&mut session);
        let urdf = opened.file.urdf(None, None).unwrap();
        let wire = WireSession::try_from(&session).unwrap();
        let error = open_session(&wire, &opened.file, &urdf, Untimed::Refused).err();
        error.map(|error| SessionRefused::of(&error).reason)
    };
    for (force, mass, count) in [
        ("", SCALE, 1),
        (FORCE, "\"estimate\"", 1),
        (PRESSURES, "\"estimate\"", 2),
    ] {
        let opened = opened(&with_payload(folder.path(), force, mass));
        assert_eq!(opened.session.payload_signals.len(), count);
        assert_eq!(refused(&opened, &|_| {}), None);
        let none = |session: &mut Session| _ = session.payload_signals.pop();
        assert_eq!(refused(&opened, &none), Some(Refusal::SensorMissing));
        let more = |session: &mut Session| session.payload_signals.push(7);
        assert_eq!(refused(&opened, &more), Some(Refusal::SensorUnknown));
    }
    // no force tells the mass
    let machine = with_payload(folder.path(), "", "\"estimate\"");
    let file = MachineFile::read(&machine).unwrap();
    let read = LogSamples::read(&data("lift_payload.mcap"), &file, None);
    let error = read.unwrap_err();
    assert_eq!(SessionRefused::of(&error).reason, Refusal::Unsuitable);
}
