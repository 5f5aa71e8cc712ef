//! The edges of every limit of the guard: what is still accepted, and what is not any more, to the nanosecond and the sample.

use std::sync::OnceLock;

use tipwatch_live::guard::{Admitted, CheckedEstimator, Guard, Step};
use tipwatch_live::safety_limits::{
    DEADLINE_NS, DRIFT_WINDOW_NS, LOSS_WINDOW_NS, MAX_AUXILIARY_AGE_NS, MAX_CLOCK_LEAD_NS,
    MAX_DELAY_NS, MAX_DRIFT_NS, MAX_LOST_SAMPLES, MAX_STAMP_LEAD_NS, PERSISTENT, START_UP_NS,
    UNTIMED_SILENCE_NS,
};
use tipwatch_live::wire::session::{Session, StampClock, machine_hash};
use tipwatch_live::wire::topics::{Head, Kind, Wire, WireSample};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::{Amount, Component, Finding, Part};
use tipwatch_mechanics::machine::{FaultKind, Policy};
use tipwatch_mechanics::state::{SampleError, Sensor, Sensors};
use tipwatch_mechanics::verdict::{Conditions, InputFault};

use crate::support::feed::{machine, samples};
use crate::support::seal;

const MS: i64 = 1_000_000;
/// Beginning of the session (ns).
const START: i64 = 1_000_000 * MS;

struct World {
    machine: Machine,
    sensors: Sensors,
    session: Session,
    /// One sample of each kind, without heads.
    samples: Vec<WireSample>,
}

fn world() -> &'static World {
    static WORLD: OnceLock<World> = OnceLock::new();
    WORLD.get_or_init(|| {
        let (file, urdf) = machine("tiny");
        let (recording, samples) = samples("tiny");
        let stamp_ns = samples[0].time_ns;
        let session = Session {
            id: 7,
            machine_hash: machine_hash(&file, &urdf),
            pace: 1.0,
            clock: StampClock {
                stamp_ns,
                host_ns: START,
            },
            ..recording.session
        };
        let (machine, sensors) = session.machine(&file, &urdf).unwrap();
        World {
            machine,
            sensors,
            session,
            samples,
        }
    })
}

/// A guard, and what it is given next.
struct Bench {
    guard: Guard,
    sequence: u64,
    max_gap_ns: i64,
}

impl Bench {
    fn new() -> Self {
        Self::with(|_| {})
    }

    fn with(change: impl FnOnce(&mut Session)) -> Self {
        let world = world();
        let mut session = world.session.clone();
        change(&mut session);
        Self {
            guard: Guard::new(&session, &world.machine, &world.sensors, START),
            sequence: 0,
            max_gap_ns: (world.machine.estimator().max_gap * 1e9) as i64,
        }
    }

    /// The next sample of this kind, published then and measured `delay_ns` before.
    fn sample(&mut self, kind: Kind, published_ns: i64, delay_ns: i64) -> WireSample {
        let world = world();
        let mut samples = world.samples.iter();
        let mut wire = *samples.find(|sample| sample.kind == kind as u32).unwrap();
        wire.time_ns = world.session.clock.stamp_ns + published_ns - delay_ns - START;
        seal(&mut wire, &world.session, self.sequence, published_ns);
        self.sequence += 1;
        wire
    }

    /// Whether the guard takes a sample that is received at `now_ns`.
    fn takes(&mut self, wire: &WireSample, now_ns: i64) -> bool {
        self.judged(wire, now_ns, Ok(()))
    }

    fn judged(&mut self, wire: &WireSample, now_ns: i64, result: Result<(), SampleError>) -> bool {
        self.assessed(wire, now_ns, result, &[])
    }

    fn assessed(
        &mut self,
        wire: &WireSample,
        now_ns: i64,
        result: Result<(), SampleError>,
        findings: &[Finding],
    ) -> bool {
        match self.guard.admit(wire, now_ns) {
            Ok(Admitted::Sample(sample)) => {
                let _ = self.guard.assess(sample, result, findings);
                true
            }
            Ok(Admitted::End) => true,
            Err(_) => false,
        }
    }

    /// A faultless sample.
    fn good(&mut self, kind: Kind, published_ns: i64) {
        let wire = self.sample(kind, published_ns, 0);
        assert!(self.takes(&wire, published_ns));
    }

    fn found(&mut self, now_ns: i64) -> Conditions {
        self.guard.between_rows(now_ns)
    }

    fn is_fault(&mut self, fault: InputFault, now_ns: i64) -> bool {
        self.found(now_ns).faults.has(fault)
    }

    fn is_caution(&mut self, fault: InputFault, now_ns: i64) -> bool {
        self.found(now_ns).cautions.has(fault)
    }
}

#[test]
fn losses_count_within_their_window() {
    // as many as are tolerated, and one more
    for (lost, is_fault) in [(MAX_LOST_SAMPLES, false), (MAX_LOST_SAMPLES + 1, true)] {
        let mut bench = Bench::new();
        bench.good(Kind::Imu, START);
        bench.sequence += lost;
        bench.good(Kind::Imu, START + 10 * MS);
        assert_eq!(bench.guard.counts().lost, lost);
        assert_eq!(bench.is_fault(InputFault::Lost, START + 10 * MS), is_fault);
    }
    // twice as many as are half tolerated: together in the window, apart behind it
    for (apart_ns, is_fault) in [(LOSS_WINDOW_NS, true), (LOSS_WINDOW_NS + 1, false)] {
        let mut bench = Bench::new();
        bench.good(Kind::Imu, START);
        bench.sequence += MAX_LOST_SAMPLES;
        let then_ns = START + apart_ns;
        // the window is that of the session's start
        let mut wire = bench.sample(Kind::Imu, then_ns - 1, 0);
        assert!(bench.takes(&wire, then_ns));
        bench.sequence += 1;
        wire = bench.sample(Kind::Imu, then_ns, 0);
        assert!(bench.takes(&wire, then_ns));
        assert_eq!(
            bench.is_fault(InputFault::Lost, then_ns),
            is_fault,
            "{apart_ns}"
        );
    }
}

#[test]
fn samples_before_joining_are_no_losses() {
    let mut bench = Bench::new();
    bench.sequence = 1000;
    bench.good(Kind::Imu, START);
    let counts = bench.guard.counts();
    assert_eq!((counts.before_joining, counts.lost), (1000, 0));
}

/// A change of the next message that a guard refuses.
type Change = fn(&mut WireSample);

#[test]
fn refused_messages_are_a_fault_from_the_third_in_succession() {
    let changes: [(InputFault, Change); 2] = [
        (InputFault::Torn, |wire| wire.values[0] += 1.0),
        (InputFault::WrongSource, |wire| {
            wire.source = 8;
            wire.seal(wire.head());
        }),
    ];
    for (fault, change) in changes {
        let mut bench = Bench::new();
        let refused = |bench: &mut Bench| {
            let mut wire = bench.sample(Kind::Imu, START, 0);
            bench.sequence -= 1;
            change(&mut wire);
            assert!(!bench.takes(&wire, START));
            bench.is_fault(fault, START)
        };
        for _ in 1..PERSISTENT {
            assert!(!refused(&mut bench));
        }
        // a good one between them ends the succession
        bench.good(Kind::Imu, START);
        for _ in 1..PERSISTENT {
            assert!(!refused(&mut bench));
        }
        assert!(refused(&mut bench));
        assert_eq!(bench.guard.counts().refused, u64::from(2 * PERSISTENT - 1));
    }
}

#[test]
fn repeated_messages_are_a_fault_from_the_third_in_succession() {
    let mut bench = Bench::new();
    let first = bench.sample(Kind::Imu, START, 0);
    assert!(bench.takes(&first, START));
    for _ in 1..PERSISTENT {
        assert!(!bench.takes(&first, START));
        assert!(!bench.is_fault(InputFault::Disordered, START));
    }
    bench.good(Kind::Imu, START + MS);
    for _ in 1..PERSISTENT {
        assert!(!bench.takes(&first, START));
        assert!(!bench.is_fault(InputFault::Disordered, START));
    }
    assert!(!bench.takes(&first, START));
    assert!(bench.is_fault(InputFault::Disordered, START));
    let counts = bench.guard.counts();
    assert_eq!((counts.repeated, counts.refused), (5, 0));
}

#[test]
fn one_message_of_another_machine_is_a_fault() {
    let mut bench = Bench::new();
    let mut wire = bench.sample(Kind::Imu, START, 0);
    wire.machine_hash ^= 1;
    wire.seal(wire.head());
    assert!(!bench.takes(&wire, START));
    assert!(bench.is_fault(InputFault::WrongMachine, START));
}

#[test]
fn publication_may_be_a_scheduling_delay_ahead() {
    for (lead_ns, is_taken) in [(MAX_CLOCK_LEAD_NS, true), (MAX_CLOCK_LEAD_NS + 1, false)] {
        let mut bench = Bench::new();
        let wire = bench.sample(Kind::Imu, START + lead_ns, 0);
        assert_eq!(bench.takes(&wire, START), is_taken, "{lead_ns}");
    }
}

#[test]
fn delays_are_late_and_stale_beyond_their_limits() {
    let max_gap_ns = Bench::new().max_gap_ns;
    assert!(max_gap_ns > MAX_DELAY_NS);
    for (delay_ns, caution, fault) in [
        (MAX_DELAY_NS, false, false),
        (MAX_DELAY_NS + 1, true, false),
        (max_gap_ns, true, false),
        (max_gap_ns + 1, false, true),
    ] {
        let mut bench = Bench::new();
        let wire = bench.sample(Kind::Imu, START, delay_ns);
        assert!(bench.takes(&wire, START), "{delay_ns}");
        assert_eq!(
            bench.is_caution(InputFault::Stale, START),
            caution,
            "{delay_ns}"
        );
        assert_eq!(
            bench.is_fault(InputFault::Stale, START),
            fault,
            "{delay_ns}"
        );
    }
}

#[test]
fn stamps_may_be_ahead_of_their_publication_by_the_reading_of_two_clocks() {
    for (lead_ns, is_taken) in [
        (0, true),
        (1, true),
        (MAX_STAMP_LEAD_NS, true),
        (MAX_STAMP_LEAD_NS + 1, false),
    ] {
        let mut bench = Bench::new();
        for sent in 1..=PERSISTENT {
            let wire = bench.sample(Kind::Imu, START, -lead_ns);
            assert_eq!(bench.takes(&wire, START), is_taken, "{lead_ns}");
            let is_fault = !is_taken && sent == PERSISTENT;
            assert_eq!(bench.is_fault(InputFault::ClockJump, START), is_fault);
        }
    }
}

#[test]
fn stamps_and_publications_must_agree_on_the_time_between_two_samples() {
    let max_gap_ns = Bench::new().max_gap_ns;
    for (jump_ns, is_taken) in [(max_gap_ns, true), (max_gap_ns + 1, false)] {
        let mut bench = Bench::new();
        bench.good(Kind::Imu, START);
        // both delays are acceptable in themselves: stale at most
        let wire = bench.sample(Kind::Imu, START + 10 * MS, jump_ns);
        assert_eq!(bench.takes(&wire, START + 10 * MS), is_taken, "{jump_ns}");
        if !is_taken {
            // single jumps are no fault, and the next good sample ends their succession
            assert!(!bench.is_fault(InputFault::ClockJump, START + 10 * MS));
            bench.good(Kind::Imu, START + 20 * MS);
        }
    }
}

#[test]
fn stamps_run_at_the_pace_of_the_session() {
    for (pace, is_taken) in [(2.0, true), (1.0, false)] {
        let mut bench = Bench::with(|session| session.pace = pace);
        bench.good(Kind::Imu, START);
        // two seconds of the sensor in one of this computer
        let now_ns = START + 1000 * MS;
        let wire = bench.sample(Kind::Imu, now_ns, -1000 * MS);
        assert_eq!(bench.takes(&wire, now_ns), is_taken, "{pace}");
    }
}

#[test]
fn stamps_that_are_not_set_or_do_not_fit_a_log_are_refused() {
    for (time_ns, is_taken) in [
        (0, false),
        (1, true),
        (i64::from(i32::MAX) * 1000 * MS, true),
        ((i64::from(i32::MAX) + 1) * 1000 * MS, false),
        (-1, true),
    ] {
        let mut bench = Bench::with(|session| session.pace = 0.0);
        let mut wire = bench.sample(Kind::Imu, START, 0);
        wire.time_ns = time_ns;
        wire.seal(wire.head());
        assert_eq!(bench.takes(&wire, START), is_taken, "{time_ns}");
    }
}

#[test]
fn sensors_must_have_been_received_after_start_up() {
    for (after_ns, is_fault) in [(START_UP_NS, false), (START_UP_NS + 1, true)] {
        let mut bench = Bench::new();
        assert_eq!(
            bench.is_fault(InputFault::NeverReceived, START + after_ns),
            is_fault
        );
    }
    let mut untimed = Bench::with(|session| session.pace = 0.0);
    assert!(!untimed.is_fault(InputFault::NeverReceived, START + 10 * START_UP_NS));
}

#[test]
fn untimed_sessions_must_not_fall_silent() {
    for (silence_ns, is_fault) in [(UNTIMED_SILENCE_NS, false), (UNTIMED_SILENCE_NS + 1, true)] {
        let mut bench = Bench::with(|session| session.pace = 0.0);
        bench.good(Kind::Imu, START + 5 * MS);
        let now_ns = START + 5 * MS + silence_ns;
        assert_eq!(bench.is_fault(InputFault::Stale, now_ns), is_fault);
    }
    // nor do rows of one depend on the time of day
    let bench = Bench::with(|session| session.pace = 0.0);
    assert!(!bench.guard.is_timed());
    assert!(!bench.guard.is_late(START, START + 100 * DEADLINE_NS));
}

#[test]
fn age_of_a_sensor_is_judged_by_its_own_period() {
    let silent = |period_ms: i64, kind: Kind, age_ns: i64| {
        let mut bench = Bench::new();
        let others = [Kind::Imu, Kind::Joints, Kind::Odometry];
        let last_ns = START + 50 * period_ms * MS;
        for sent in 0..=50 {
            bench.good(kind, START + sent * period_ms * MS);
        }
        let now_ns = last_ns + age_ns;
        for other in others.into_iter().filter(|other| *other != kind) {
            bench.good(other, now_ns);
        }
        let found = bench.found(now_ns);
        [found.cautions, found.faults].map(|found| found.has(InputFault::Stale))
    };
    // 10 ms: late after three periods, stale after ten
    for (age_ns, expected) in [
        (30 * MS, [false, false]),
        (30 * MS + 1, [true, false]),
        (100 * MS, [true, false]),
        (100 * MS + 1, [false, true]),
    ] {
        assert_eq!(silent(10, Kind::Imu, age_ns), expected, "{age_ns}");
    }
    // 1 ms: the least times hold, which the scheduler alone may take
    for (age_ns, expected) in [
        (20 * MS, [false, false]),
        (20 * MS + 1, [true, false]),
        (50 * MS, [true, false]),
        (50 * MS + 1, [false, true]),
    ] {
        assert_eq!(silent(1, Kind::Imu, age_ns), expected, "{age_ns}");
    }
    // 2 s: odometry beside an IMU may be missing for long
    for (age_ns, expected) in [
        (MAX_AUXILIARY_AGE_NS, [false, false]),
        (MAX_AUXILIARY_AGE_NS + 1, [false, true]),
    ] {
        assert_eq!(silent(2000, Kind::Odometry, age_ns), expected, "{age_ns}");
    }
}

#[test]
fn rows_take_everything_found_once_and_stale_samples_are_a_fault() {
    let row_after = |waited_ns: i64| {
        let mut bench = Bench::new();
        for sent in 0..20 {
            for kind in [Kind::Imu, Kind::Odometry, Kind::Joints] {
                bench.good(kind, START + sent * 10 * MS);
            }
        }
        let published_ns = START + 200 * MS;
        for kind in [Kind::Imu, Kind::Odometry] {
            bench.good(kind, published_ns);
        }
        bench.guard.caution(InputFault::VerdictLate);
        let wire = bench.sample(Kind::Joints, published_ns, 0);
        let now_ns = published_ns + waited_ns;
        let Ok(Admitted::Sample(sample)) = bench.guard.admit(&wire, now_ns) else {
            panic!("refused");
        };
        let assessed = bench.guard.assess(sample, Ok(()), &[]);
        let found = bench.guard.complete_row(assessed);
        assert_eq!(bench.guard.counts().rows, 1);
        assert!(found.cautions.has(InputFault::VerdictLate));
        assert!(!bench.is_caution(InputFault::VerdictLate, published_ns));
        found.faults.has(InputFault::Stale)
    };
    assert!(!row_after(100 * MS));
    assert!(row_after(100 * MS + 1));
}

#[test]
fn results_are_late_beyond_the_deadline() {
    let guard = Bench::new().guard;
    assert!(!guard.is_late(START, START + DEADLINE_NS));
    assert!(guard.is_late(START, START + DEADLINE_NS + 1));
}

#[test]
fn results_of_the_estimator_count() {
    let mut bench = Bench::new();
    for sent in 1..=PERSISTENT {
        let wire = bench.sample(Kind::Imu, START, 0);
        assert!(bench.judged(&wire, START, Err(SampleError::NotLater)));
        let is_fault = sent == PERSISTENT;
        assert_eq!(bench.is_fault(InputFault::Disordered, START), is_fault);
    }
    assert_eq!(bench.guard.counts().refused, u64::from(PERSISTENT));
    let mut bench = Bench::new();
    let wire = bench.sample(Kind::Imu, START, 0);
    assert!(bench.judged(&wire, START, Err(SampleError::UnknownSensor)));
    assert!(bench.is_fault(InputFault::Torn, START));
}

#[test]
fn only_a_good_sample_makes_its_sensor_fresh() {
    let max_gap_ns = Bench::new().max_gap_ns;
    let now_ns = START + START_UP_NS + 1;
    let found = [finding(Policy::Invalid, Component::Value)];
    for (delay_ns, result, findings, is_fresh) in [
        (0, Ok(()), &[][..], true),
        (max_gap_ns, Ok(()), &[][..], true),
        (max_gap_ns + 1, Ok(()), &[][..], false),
        (0, Err(SampleError::NotLater), &[][..], false),
        (0, Err(SampleError::NotFinite), &[][..], false),
        (0, Ok(()), &found[..], false),
    ] {
        let mut bench = Bench::new();
        for kind in [Kind::Joints, Kind::Odometry] {
            bench.good(kind, now_ns);
        }
        let wire = bench.sample(Kind::Imu, now_ns, delay_ns);
        assert!(bench.assessed(&wire, now_ns, result, findings));
        assert_eq!(
            bench.is_fault(InputFault::NeverReceived, now_ns),
            !is_fresh,
            "{delay_ns} {result:?}"
        );
    }
}

/// A specific force out of range.
fn finding(policy: Policy, component: Component) -> Finding {
    Finding {
        sensor: Sensor::Imu,
        part: Part::SpecificForce,
        kind: FaultKind::OutOfRange,
        component,
        policy,
        since_ns: 0,
        possible_since_ns: 0,
        stamp_ns: 0,
        measure: 100.0,
        limit: 39.2,
        amount: Amount::default(),
        explanation: None,
    }
}

#[test]
fn implausible_values_count_from_the_third_in_succession_by_their_policy() {
    for (policy, caution, fault) in [
        (Policy::Invalid, false, true),
        (Policy::Widen, true, false),
        (Policy::Report, false, false),
    ] {
        let mut bench = Bench::new();
        let findings = [finding(policy, Component::Value)];
        let implausible = |bench: &mut Bench| {
            let wire = bench.sample(Kind::Imu, START, 0);
            assert!(bench.assessed(&wire, START, Ok(()), &findings));
            let found = bench.found(START);
            [found.cautions, found.faults].map(|found| found.has(InputFault::OutOfRange))
        };
        for _ in 1..PERSISTENT {
            assert_eq!(implausible(&mut bench), [false, false], "{policy:?}");
        }
        bench.good(Kind::Imu, START);
        for _ in 1..PERSISTENT {
            assert_eq!(implausible(&mut bench), [false, false], "{policy:?}");
        }
        assert_eq!(implausible(&mut bench), [caution, fault], "{policy:?}");
        assert_eq!(bench.guard.counts().refused, 0);
    }
}

#[test]
fn samples_of_another_length_are_torn() {
    let mut bench = Bench::new();
    let mut wire = bench.sample(Kind::Imu, START, 0);
    wire.value_count -= 1;
    wire.seal(wire.head());
    assert!(!bench.takes(&wire, START));
    assert!(bench.is_fault(InputFault::Torn, START));
}

#[test]
fn a_session_ends_with_its_last_message() {
    let mut bench = Bench::new();
    let mut wire = WireSample::end();
    seal(&mut wire, &world().session, 0, START);
    assert!(matches!(bench.guard.admit(&wire, START), Ok(Admitted::End)));
    bench.guard.note(InputFault::VerdictLate);
    assert!(bench.is_fault(InputFault::VerdictLate, START));
}

#[test]
fn joint_states_complete_rows_with_what_was_found() {
    let world = world();
    let mut bench = Bench::new();
    let (sensors, machine) = (&world.sensors, &world.machine);
    let mut checked = CheckedEstimator::new(&world.session, machine, sensors, START);
    let mut take = |wire: &WireSample| checked.take(machine, wire, START);
    for kind in [Kind::Imu, Kind::Odometry] {
        let wire = bench.sample(kind, START, 0);
        assert!(matches!(take(&wire), Step::Pending));
    }
    let wire = bench.sample(Kind::Joints, START - MS, MAX_DELAY_NS + 1);
    let Step::Row(row) = take(&wire) else {
        panic!("no row");
    };
    assert_eq!(
        (row.sample_sequence, row.sample_published_ns),
        (2, START - MS)
    );
    assert!(row.conditions.cautions.has(InputFault::Stale));
    // refused: no row
    assert!(matches!(take(&wire), Step::Pending));
    let mut end = WireSample::end();
    end.seal(Head {
        sequence: 3,
        ..wire.head()
    });
    assert!(matches!(take(&end), Step::Ended));
    assert_eq!(checked.guard.counts().rows, 1);
    assert_eq!(checked.estimate().time_ns, wire.time_ns);
}

/// Without an IMU odometry is no auxiliary: the estimate cannot go on without it.
#[test]
fn odometry_without_an_imu_is_stale_like_any_sensor() {
    let mut bench = Bench::new();
    let sensors = Sensors {
        imu: false,
        ..world().sensors.clone()
    };
    bench.guard = Guard::new(&world().session, &world().machine, &sensors, START);
    for sent in 0..=2 {
        bench.good(Kind::Odometry, START + sent * 2000 * MS);
    }
    let last_ns = START + 4000 * MS;
    for (age_ns, is_fault) in [(bench.max_gap_ns, false), (bench.max_gap_ns + 1, true)] {
        bench.good(Kind::Joints, last_ns + age_ns);
        assert_eq!(
            bench.is_fault(InputFault::Stale, last_ns + age_ns),
            is_fault
        );
    }
}

#[test]
fn periods_of_sensors_are_followed_slowly() {
    // from 10 to 20 ms: each interval moves the mean by a twentieth of the difference
    let period_ms = 20.0 - 10.0 * 0.95_f64.powi(20);
    let late_ns = (3.0 * period_ms * 1e6) as i64;
    for (age_ns, is_late) in [(late_ns - 1000, false), (late_ns + 1000, true)] {
        let mut bench = Bench::new();
        for sent in 0..=50 {
            bench.good(Kind::Imu, START + sent * 10 * MS);
        }
        for sent in 1..=20 {
            bench.good(Kind::Imu, START + 500 * MS + sent * 20 * MS);
        }
        let now_ns = START + 900 * MS + age_ns;
        for kind in [Kind::Joints, Kind::Odometry] {
            bench.good(kind, now_ns);
        }
        assert_eq!(
            bench.is_caution(InputFault::Stale, now_ns),
            is_late,
            "{age_ns}"
        );
    }
}

#[test]
fn delays_that_drift_are_a_caution() {
    for (delay_ns, drifts) in [(MAX_DRIFT_NS, false), (MAX_DRIFT_NS + 1, true)] {
        let mut bench = Bench::new();
        let second = DRIFT_WINDOW_NS;
        for (published_ns, delay_ns) in [(0, 0), (second, delay_ns), (2 * second, delay_ns)] {
            let now_ns = START + published_ns;
            let wire = bench.sample(Kind::Imu, now_ns, delay_ns);
            assert!(bench.takes(&wire, now_ns));
            let is_last = published_ns == 2 * second;
            let expected = drifts && is_last;
            assert_eq!(bench.is_caution(InputFault::ClockJump, now_ns), expected);
        }
    }
}
