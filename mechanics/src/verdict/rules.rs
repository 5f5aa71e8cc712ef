//! Tests of the rules of the verdict, as the book states them, through what a caller sees.

use super::{
    Basis, Conditions, HeldProblems, InputFault, InputFaults, Judge, Latch, Level, RowFacts,
};
use crate::machine::{LimitsSpec, Proof, Proofs};
use crate::state::{Reason, Reasons};

const PERIOD_NS: i64 = 10_000_000;

/// A judge that is given a row every 10 ms.
struct Rows {
    judge: Judge,
    next: RowFacts,
}

impl Rows {
    fn new() -> Self {
        Self {
            judge: Judge::new(&LimitsSpec::default()),
            next: RowFacts {
                time_ns: 0,
                reasons: Reasons::NONE,
                utilisation: 0.1,
                is_wheel_unloaded: false,
                rotates: false,
                takes_support: false,
                unproven: Proofs::NONE,
                conditions: Conditions::default(),
                is_acknowledged: false,
            },
        }
    }

    /// A judge that calls the machine safe.
    fn safe() -> Self {
        let mut rows = Self::new();
        assert_eq!(rows.good(20), Level::Safe);
        rows
    }

    fn give(&mut self, change: impl FnOnce(&mut RowFacts)) -> Level {
        self.next.time_ns += PERIOD_NS;
        let mut row = self.next;
        change(&mut row);
        self.judge.row(&row).level
    }

    fn good(&mut self, count: usize) -> Level {
        (0..count).for_each(|_| {
            self.give(|_| ());
        });
        self.judge.verdict().level
    }

    fn with(&mut self, reason: Reason) -> Level {
        self.give(|row| {
            row.reasons.add(reason);
            row.utilisation = f64::NAN;
        })
    }

    fn latched(&self) -> Level {
        self.judge.verdict().latched_level
    }
}

// requirement: TW-VERDICT-09
#[test]
fn caution_is_a_warning_for_a_second_and_no_more() {
    let mut rows = Rows::safe();
    let late = |row: &mut RowFacts| row.conditions.cautions.add(InputFault::Stale);
    assert_eq!(rows.give(late), Level::Warning);
    assert_eq!(rows.good(99), Level::Warning);
    assert_eq!(rows.judge.verdict().held.cautions, InputFault::Stale.into());
    assert_eq!(rows.good(1), Level::Safe);
    assert_eq!(rows.judge.verdict().held, HeldProblems::default());
    // of a machine in danger it changes nothing, and nothing of it is latched
    rows.give(|row| row.utilisation = 1.5);
    assert_eq!(rows.give(late), Level::Danger);
    let mut rows = Rows::safe();
    rows.give(late);
    assert_eq!(rows.latched(), Level::Warning);
    assert_eq!(rows.judge.alarms(), 0);
}

// requirement: TW-VERDICT-12, TW-FAULT-22
#[test]
fn failure_of_the_model_is_a_latched_fault() {
    for reason in [
        Reason::LinkageOpen,
        Reason::NoGroundContact,
        Reason::NotFinite,
    ] {
        let mut rows = Rows::safe();
        assert_eq!(rows.with(reason), Level::Fault, "{reason:?}");
        assert!(rows.judge.verdict().held.reasons.has(reason));
        assert_eq!(rows.good(200), Level::Safe);
        assert_eq!(rows.latched(), Level::Fault, "{reason:?}");
        rows.give(|row| row.is_acknowledged = true);
        assert_eq!(rows.latched(), Level::Safe);
        // also if a utilisation was computed
        let known = |row: &mut RowFacts| row.reasons.add(reason);
        assert_eq!(Rows::safe().give(known), Level::Fault, "{reason:?}");
    }
}

/// A machine falls: the loads are known, a wheel is off the ground, and the band about them is not.
// requirement: TW-VERDICT-05, TW-VERDICT-12
#[test]
fn unloaded_wheel_without_utilisation_is_danger_and_no_failure_of_the_model() {
    for mut rows in [Rows::new(), Rows::safe()] {
        for utilisation in [f64::NAN, f64::INFINITY] {
            let falls = |row: &mut RowFacts| {
                (row.utilisation, row.is_wheel_unloaded) = (utilisation, true);
            };
            assert_eq!(rows.give(falls), Level::Danger);
            assert_eq!(rows.latched(), Level::Danger);
            assert_eq!(rows.judge.verdict().held, HeldProblems::default());
        }
    }
    // a reason why the loads are wrong is one all the same
    let mut rows = Rows::safe();
    let fails = |row: &mut RowFacts| {
        row.reasons.add(Reason::NotFinite);
        (row.utilisation, row.is_wheel_unloaded) = (f64::NAN, true);
    };
    assert_eq!(rows.give(fails), Level::Fault);
}

/// Where the loads are known and the band about them is not, as in a session that begins while the machine falls.
// requirement: TW-VERDICT-12
#[test]
fn unknown_uncertainty_of_known_loads_is_unknown_and_no_failure_of_the_model() {
    for mut rows in [Rows::new(), Rows::safe()] {
        for utilisation in [f64::NAN, f64::INFINITY] {
            let unsure = |row: &mut RowFacts| row.utilisation = utilisation;
            assert_eq!(rows.give(unsure), Level::Unknown);
            assert_eq!(rows.latched(), Level::Unknown);
            assert_eq!(rows.judge.verdict().held, HeldProblems::default());
        }
        assert_eq!(rows.judge.alarms(), 0);
        // nor does it take a danger away, however long it lasts
        rows.give(|row| row.utilisation = 1.5);
        for _ in 0..300 {
            assert_eq!(rows.give(|row| row.utilisation = f64::NAN), Level::Danger);
        }
    }
}

// requirement: TW-VERDICT-13
#[test]
fn gross_input_is_a_fault_at_once_and_from_the_start() {
    assert_eq!(Rows::new().with(Reason::GrossInput), Level::Fault);
    let mut rows = Rows::safe();
    assert_eq!(rows.with(Reason::GrossInput), Level::Fault);
    // whatever else is known of the row
    let mut rows = Rows::safe();
    let gross = |row: &mut RowFacts| row.reasons.add(Reason::GrossInput);
    assert_eq!(rows.give(gross), Level::Fault);
}

// requirement: TW-VERDICT-14
#[test]
fn unknown_supports_are_never_safe() {
    let mut rows = Rows::safe();
    for _ in 0..500 {
        assert_eq!(rows.with(Reason::SupportsUnknown), Level::Unknown);
    }
    // known loads of unknown supports are not known
    let moving = |row: &mut RowFacts| row.reasons.add(Reason::SupportsUnknown);
    assert_eq!(rows.give(moving), Level::Unknown);
    assert_eq!(rows.good(9), Level::Unknown);
    assert_eq!(rows.good(1), Level::Safe);
}

/// Its loads are those of danger.
fn danger(row: &mut RowFacts) {
    row.utilisation = 2.8;
}

/// Supports take the weight that were in the air before.
fn passes(row: &mut RowFacts) {
    row.reasons.add(Reason::SupportsUnknown);
    (row.utilisation, row.takes_support) = (f64::NAN, true);
}

/// Jacks are retracted: the wheels touch the ground before the switches tell so, and the blow shows as danger on the feet.
// requirement: TW-VERDICT-14
#[test]
fn danger_by_loads_that_has_just_begun_is_of_the_supports_that_take_the_weight() {
    for count in [1, 5, 90] {
        let mut rows = Rows::safe();
        (0..count).for_each(|_| assert_eq!(rows.give(danger), Level::Danger));
        assert_eq!(rows.latched(), Level::Danger);
        assert_eq!(rows.give(passes), Level::Unknown, "{count}");
        assert_eq!(rows.latched(), Level::Unknown);
        assert_eq!(rows.good(20), Level::Safe);
        assert_eq!(rows.latched(), Level::Safe);
    }
    // an alarm of before stays, acknowledged or not
    let mut rows = Rows::safe();
    rows.give(danger);
    rows.good(200);
    rows.give(danger);
    rows.give(passes);
    assert_eq!(rows.latched(), Level::Danger);
}

// requirement: TW-VERDICT-14
#[test]
fn danger_that_lasts_or_rotates_is_no_change_of_supports() {
    let unknown = |row: &mut RowFacts| {
        passes(row);
        row.takes_support = false;
    };
    // longer than the time in which the weight passes
    let mut rows = Rows::safe();
    for _ in 0..101 {
        rows.give(danger);
    }
    assert_eq!(rows.give(passes), Level::Danger);
    // what failed meanwhile stays latched
    let mut rows = Rows::safe();
    rows.give(danger);
    rows.give(|row| row.reasons.add(Reason::LinkageOpen));
    rows.give(passes);
    assert!(matches!(rows.latched(), Level::Danger | Level::Fault));
    // and what fails then
    let mut rows = Rows::safe();
    rows.give(danger);
    rows.give(|row| {
        passes(row);
        row.conditions.faults.add(InputFault::Lost);
    });
    rows.give(passes);
    rows.good(200);
    assert_eq!(rows.latched(), Level::Danger);
    // a foot leaves the ground, and no other support is set
    let mut rows = Rows::safe();
    rows.give(danger);
    assert_eq!(rows.give(unknown), Level::Danger);
    assert_eq!(rows.latched(), Level::Danger);
    // the platform falls, before its supports are set or then
    let mut rows = Rows::safe();
    rows.give(danger);
    rows.give(|row| row.rotates = true);
    assert_eq!(rows.give(passes), Level::Danger);
    let mut rows = Rows::safe();
    rows.give(danger);
    let falls = |row: &mut RowFacts| {
        passes(row);
        row.rotates = true;
    };
    assert_eq!(rows.give(falls), Level::Danger);
    assert_eq!(rows.latched(), Level::Danger);
}

/// A switch chatters while the loads stay those of danger.
// requirement: TW-VERDICT-14
#[test]
fn danger_is_taken_back_again_only_after_a_second_known_without_danger() {
    let taken_back_again = |between: &dyn Fn(&mut Rows)| {
        let mut rows = Rows::safe();
        rows.give(danger);
        rows.give(passes);
        assert_eq!(rows.latched(), Level::Unknown);
        between(&mut rows);
        rows.give(danger);
        rows.give(passes);
        rows.latched() == Level::Unknown
    };
    assert!(!taken_back_again(&|_| ()));
    for (count, expected) in [(100, false), (101, true)] {
        let between = |rows: &mut Rows| {
            rows.good(count);
        };
        assert_eq!(taken_back_again(&between), expected, "{count}");
    }
    // a row that is not known between them
    let unknown = |rows: &mut Rows| {
        rows.good(60);
        rows.with(Reason::Settling);
        rows.good(60);
    };
    assert!(!taken_back_again(&unknown));
}

// requirement: TW-VERDICT-14, TW-VERDICT-18
#[test]
fn acknowledgement_of_a_danger_that_is_taken_back_is_one_of_the_alarm_before_it() {
    for (row_of_it, latched) in [
        (None, Level::Danger),
        (Some(1), Level::Safe),
        (Some(2), Level::Safe),
    ] {
        let mut rows = Rows::safe();
        rows.give(danger);
        rows.good(200);
        for (index, change) in [danger, danger, passes].into_iter().enumerate() {
            rows.give(|row| {
                change(row);
                row.is_acknowledged = row_of_it == Some(index);
            });
        }
        rows.good(20);
        assert_eq!(rows.latched(), latched, "{row_of_it:?}");
    }
}

// requirement: TW-VERDICT-10
#[test]
fn implausible_signals_are_a_fault_from_the_third_row() {
    for reason in [
        Reason::JointsFault,
        Reason::ImuFault,
        Reason::OdometryFault,
        Reason::ToolWrenchFault,
    ] {
        let mut rows = Rows::safe();
        let levels = [(); 3].map(|()| rows.with(reason));
        let expected = [Level::Unknown, Level::Unknown, Level::Fault];
        assert_eq!(levels, expected, "{reason:?}");
        // nothing to acknowledge: the model did not fail
        rows.good(200);
        assert_eq!(rows.latched(), Level::Safe, "{reason:?}");
    }
}

// requirement: TW-VERDICT-26
#[test]
fn a_doubt_takes_no_alarm_away_and_nothing_is_safe_beside_it() {
    for (utilisation, level) in [
        (0.1, Level::Unknown),
        (0.8, Level::Unknown),
        (0.95, Level::Warning),
        (1.2, Level::Danger),
    ] {
        let mut rows = Rows::safe();
        for _ in 0..500 {
            let found = rows.give(|row| {
                row.utilisation = utilisation;
                row.reasons.add(Reason::Contradiction);
            });
            assert_eq!(found, level);
        }
        assert!(rows.judge.verdict().held.reasons.has(Reason::Contradiction));
    }
    // held for a second, and then forgotten
    let mut rows = Rows::safe();
    rows.give(|row| row.reasons.add(Reason::Contradiction));
    assert_eq!(rows.good(99), Level::Unknown);
    assert_eq!(rows.good(1), Level::Safe);
    assert_eq!(rows.judge.verdict().held, HeldProblems::default());
    // an alarm that begins beside a doubt counts, and is latched
    let mut rows = Rows::safe();
    rows.give(|row| {
        row.utilisation = 1.2;
        row.reasons.add(Reason::Contradiction);
    });
    assert_eq!(rows.latched(), Level::Danger);
}

// requirement: TW-VERDICT-28
#[test]
fn only_what_is_proven_is_safe() {
    let ground: Proofs = [Proof::Ground].into_iter().collect();
    let mut rows = Rows::new();
    rows.next.unproven = ground;
    assert_eq!(rows.good(500), Level::Assumed);
    let verdict = rows.judge.verdict();
    assert_eq!((verdict.basis, verdict.unproven), (Basis::Assumed, ground));
    // what was seen since proves it
    rows.next.unproven = Proofs::NONE;
    assert_eq!(rows.good(1), Level::Safe);
    assert_eq!(rows.judge.verdict().basis, Basis::Proven);
    // alarms are alarms, proven or not
    rows.next.unproven = ground;
    for (utilisation, level) in [
        (0.8, Level::Notice),
        (0.95, Level::Warning),
        (1.2, Level::Danger),
    ] {
        assert_eq!(rows.give(|row| row.utilisation = utilisation), level);
        assert_eq!(rows.judge.verdict().basis, Basis::Assumed);
    }
    // a doubt is more than an assumption
    let mut rows = Rows::new();
    rows.next.unproven = ground;
    rows.good(20);
    let doubted = |row: &mut RowFacts| row.reasons.add(Reason::Contradiction);
    assert_eq!(rows.give(doubted), Level::Unknown);
    assert_eq!(rows.judge.verdict().basis, Basis::Doubted);
    // and between rows what is found casts doubt on what was proven
    let rows = Rows::safe();
    let stale = Conditions {
        cautions: InputFault::Stale.into(),
        ..Conditions::default()
    };
    let between = rows.judge.between_rows(stale, false);
    assert_eq!(between.basis, Basis::Doubted);
}

// requirement: TW-VERDICT-28
#[test]
fn levels_are_in_the_order_of_urgency() {
    let mut sorted = Level::ALL;
    sorted.sort();
    use Level::{Assumed, Danger, Fault, Notice, Safe, Unknown, Warning};
    let urgency = [Unknown, Safe, Assumed, Notice, Warning, Danger, Fault];
    assert_eq!(sorted, urgency);
    // an alarm that only was assumed to be over is over once a person has acknowledged it
    let mut rows = Rows::new();
    rows.next.unproven = Proofs::ALL;
    rows.good(20);
    rows.give(|row| row.utilisation = 1.2);
    rows.good(200);
    assert_eq!(rows.latched(), Danger);
    rows.give(|row| row.is_acknowledged = true);
    assert_eq!(rows.latched(), Assumed);
}

// requirement: TW-VERDICT-11
#[test]
fn every_kind_of_gap_is_a_fault_once_a_row_was_good() {
    for reason in [
        Reason::JointsGap,
        Reason::ImuGap,
        Reason::OdometryGap,
        Reason::ToolWrenchGap,
    ] {
        let mut starting = Rows::new();
        assert_eq!(starting.with(reason), Level::Unknown, "{reason:?}");
        let mut rows = Rows::new();
        rows.good(1);
        assert_eq!(rows.with(reason), Level::Fault, "{reason:?}");
        rows.good(200);
        assert_eq!(rows.latched(), Level::Safe, "{reason:?}");
    }
}

// requirement: TW-VERDICT-04
#[test]
fn utilisation_that_is_not_a_number_releases_no_alarm() {
    let mut rows = Rows::safe();
    rows.give(|row| row.utilisation = 1.2);
    rows.good(99);
    // the delay starts anew
    rows.with(Reason::Settling);
    assert_eq!(rows.good(100), Level::Danger);
    assert_eq!(rows.good(1), Level::Safe);
}

// requirement: TW-VERDICT-04
#[test]
fn alarm_at_the_edge_of_its_band_is_not_released() {
    let limits = LimitsSpec::default();
    let edge = limits.limit - super::limits::RELEASE_BELOW;
    for (utilisation, level) in [
        (edge, Level::Danger),
        (f64::from_bits(edge.to_bits() - 1), Level::Warning),
    ] {
        let mut rows = Rows::safe();
        rows.give(|row| row.utilisation = limits.limit);
        for _ in 0..300 {
            rows.give(|row| row.utilisation = utilisation);
        }
        assert_eq!(rows.judge.verdict().level, level);
    }
}

// requirement: TW-VERDICT-03
#[test]
fn each_threshold_raises_its_level_when_it_is_reached() {
    let limits = LimitsSpec::default();
    for (threshold, level, below) in [
        (limits.notice, Level::Notice, Level::Safe),
        (limits.warning, Level::Warning, Level::Notice),
        (limits.limit, Level::Danger, Level::Warning),
    ] {
        let mut rows = Rows::safe();
        let under = f64::from_bits(threshold.to_bits() - 1);
        assert_eq!(rows.give(|row| row.utilisation = under), below);
        assert_eq!(rows.give(|row| row.utilisation = threshold), level);
    }
}

// requirement: TW-VERDICT-15
#[test]
fn three_rows_of_danger_outweigh_signals_that_become_implausible() {
    let broken = |rows: &mut Rows| {
        rows.give(|row| {
            row.utilisation = f64::NAN;
            row.reasons.add(Reason::NoGroundContact);
            row.conditions.faults.add(InputFault::OutOfRange);
        })
    };
    for (danger_rows, level) in [(2, Level::Fault), (3, Level::Danger)] {
        let mut rows = Rows::safe();
        for _ in 0..danger_rows {
            rows.give(|row| row.utilisation = 1.2);
        }
        assert_eq!(broken(&mut rows), level, "{danger_rows}");
    }
    // input that does not arrive, as the rows show it
    assert_eq!(rows_in_danger().with(Reason::ImuGap), Level::Fault);
    assert_eq!(rows_in_danger().with(Reason::ImuFault), Level::Danger);
    // samples that are left out arrive, until one is used again
    let mut rows = rows_in_danger();
    for _ in 0..5 {
        let level = rows.give(|row| {
            row.utilisation = f64::NAN;
            row.reasons.add(Reason::JointsFault);
            row.reasons.add(Reason::JointsGap);
        });
        assert_eq!(level, Level::Danger);
    }
    assert_eq!(rows.with(Reason::JointsGap), Level::Danger);
    assert_eq!(rows.good(50), Level::Danger);
    assert_eq!(rows.judge.verdict().basis, Basis::Doubted);
    assert_eq!(rows.with(Reason::JointsGap), Level::Fault);
    // rows that tip count, rows below the limit do not
    let mut rows = Rows::safe();
    for _ in 0..3 {
        rows.with(Reason::Tipping);
    }
    assert_eq!(broken(&mut rows), Level::Danger);
    let mut rows = rows_in_danger();
    rows.good(200);
    assert_eq!(broken(&mut rows), Level::Fault);
}

/// A machine that has been in danger for several rows.
fn rows_in_danger() -> Rows {
    let mut rows = Rows::safe();
    for _ in 0..5 {
        rows.give(|row| row.utilisation = 1.2);
    }
    rows
}

// requirement: TW-VERDICT-15
#[test]
fn only_faults_of_values_leave_a_machine_in_danger() {
    for fault in InputFault::ALL {
        let mut rows = rows_in_danger();
        let level = rows.give(|row| row.conditions.faults.add(fault));
        let expected = if fault.is_about_values() {
            Level::Danger
        } else {
            Level::Fault
        };
        assert_eq!(level, expected, "{}", fault.name());
        let between = rows.judge.between_rows(
            Conditions {
                faults: fault.into(),
                ..Conditions::default()
            },
            false,
        );
        assert_eq!(between.level, expected, "{}", fault.name());
        assert!(between.held.faults.has(fault));
    }
}

// requirement: TW-VERDICT-27
#[test]
fn measured_rotation_is_danger_whatever_else_is_wrong() {
    for fault in InputFault::ALL {
        for reason in Reason::ALL {
            let mut rows = Rows::safe();
            let level = rows.give(|row| {
                row.rotates = true;
                row.reasons.add(reason);
                row.utilisation = f64::NAN;
                row.conditions.faults.add(fault);
            });
            assert_eq!(level, Level::Danger, "{} {}", fault.name(), reason.name());
            assert!(rows.judge.verdict().held.faults.has(fault));
            let stale = Conditions {
                faults: fault.into(),
                ..Conditions::default()
            };
            assert_eq!(rows.judge.between_rows(stale, true).level, Level::Danger);
        }
    }
    // without a row, too, and no longer than it stands
    let mut rows = Rows::safe();
    let between = rows.judge.between_rows(Conditions::default(), true);
    assert_eq!(between.level, Level::Danger);
    rows.give(|row| row.rotates = true);
    rows.good(200);
    assert_eq!(rows.judge.verdict().level, Level::Safe);
    assert_eq!(rows.judge.latch(), Latch::raised(Level::Danger));
}

// requirement: TW-VERDICT-16
#[test]
fn between_rows_nothing_gets_better() {
    let mut rows = Rows::safe();
    rows.give(|row| row.utilisation = 1.2);
    let none = rows.judge.between_rows(Conditions::default(), false);
    assert_eq!(none, rows.judge.verdict());
    let caution = Conditions {
        cautions: InputFault::Stale.into(),
        ..Conditions::default()
    };
    let verdict = rows.judge.between_rows(caution, false);
    assert_eq!(verdict.level, Level::Danger);
    assert_eq!(verdict.held.cautions, InputFault::Stale.into());
    let fault = Conditions {
        faults: InputFault::Lost.into(),
        ..caution
    };
    let verdict = rows.judge.between_rows(fault, false);
    assert_eq!(verdict.level, Level::Fault);
    assert_eq!(verdict.latched_level, Level::Fault);
    assert_eq!(verdict.held.faults, InputFault::Lost.into());
    assert_eq!(rows.judge.verdict().level, Level::Danger);
}

// requirement: TW-VERDICT-18
#[test]
fn unknown_level_does_not_end_an_alarm_and_a_higher_one_is_another() {
    let mut rows = Rows::safe();
    rows.give(|row| row.utilisation = 1.2);
    assert_eq!(rows.judge.latch(), Latch::raised(Level::Danger));
    // the level is Danger as long as nothing else is known
    for _ in 0..300 {
        assert_eq!(rows.with(Reason::Settling), Level::Danger);
    }
    rows.give(|row| row.is_acknowledged = true);
    assert!(rows.judge.latch().is_acknowledged);
    // the model fails: a higher alarm, that nobody has acknowledged
    rows.good(200);
    rows.give(|row| row.utilisation = 1.2);
    assert_eq!(rows.judge.alarms(), 2);
    rows.good(150);
    assert_eq!(rows.with(Reason::LinkageOpen), Level::Fault);
    assert_eq!(rows.judge.latch(), Latch::raised(Level::Fault));
    assert_eq!(rows.judge.alarms(), 3);
}

// requirement: TW-VERDICT-19
#[test]
fn failure_of_the_model_outranks_an_alarm_that_goes_on() {
    let mut rows = Rows::safe();
    rows.give(|row| row.utilisation = 1.2);
    assert_eq!(rows.judge.latch(), Latch::raised(Level::Danger));
    assert_eq!(rows.with(Reason::LinkageOpen), Level::Fault);
    assert_eq!(rows.judge.latch(), Latch::raised(Level::Fault));
    assert_eq!(rows.judge.alarms(), 2);
}

// requirement: TW-VERDICT-18, TW-VERDICT-21
#[test]
fn acknowledgement_without_an_alarm_does_nothing() {
    let mut rows = Rows::safe();
    rows.give(|row| row.is_acknowledged = true);
    assert_eq!(rows.judge.latch(), Latch::default());
    // and none for the alarm that the same row raises
    rows.give(|row| {
        row.is_acknowledged = true;
        row.utilisation = 1.2;
    });
    assert_eq!(rows.judge.latch(), Latch::raised(Level::Danger));
}

// requirement: TW-VERDICT-22
#[test]
fn unknown_numbers_are_never_safe() {
    for level in Level::ALL {
        assert_eq!(Level::from_number(level as u32), level);
    }
    for number in [7, 8, 255, 1 << 20, u32::MAX] {
        assert_eq!(Level::from_number(number), Level::Fault);
    }
    let unknown = InputFaults::from_bits(1 << 31);
    assert!(!unknown.is_empty());
    assert_eq!(unknown.bits(), 1 << 31);
    let mut rows = Rows::safe();
    let level = rows.give(|row| row.conditions.faults = unknown);
    assert_eq!(level, Level::Fault);
}

// requirement: TW-VERDICT-23
#[test]
fn lift_off_is_announced_at_three_levels_only() {
    let names = [
        "unknown", "safe", "notice", "warning", "danger", "fault", "assumed",
    ];
    assert_eq!(Level::ALL.map(Level::name), names);
    let announcing = Level::ALL.map(Level::announces_lift_off);
    assert_eq!(announcing, [false, false, true, true, true, false, false]);
}

#[test]
fn sets_of_faults_hold_what_was_added() {
    let mut set = InputFaults::NONE;
    assert!(set.is_empty());
    set.add(InputFault::Stale);
    set.add(InputFault::Stale);
    let mut other = InputFaults::from(InputFault::Torn);
    assert_eq!(other.iter().collect::<Vec<_>>(), [InputFault::Torn]);
    other.add_all(set);
    let faults = [InputFault::Stale, InputFault::Torn];
    assert_eq!(other.iter().collect::<Vec<_>>(), faults);
    assert_eq!(InputFaults::from_bits(other.bits()), other);
    assert!(!other.has(InputFault::Lost));
    let mut names: Vec<_> = InputFault::ALL.map(InputFault::name).into();
    names.dedup();
    assert_eq!(names.len(), InputFault::ALL.len());
}
