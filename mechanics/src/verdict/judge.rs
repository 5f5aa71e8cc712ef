//! The judge: turns a sequence of rows into verdicts.

use super::alarm::Alarm;
use super::basis::Basis;
use super::input_fault::{InputFault, InputFaults};
use super::latch::Latch;
use super::level::Level;
use super::limits::{GOOD_ROWS, HOLD_NS, PERSISTENT, START_UP_NS};
use crate::machine::{LimitsSpec, Proofs};
use crate::state::{Reason, Reasons};

/// Input problems found since the preceding row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Conditions {
    /// Faults that make the input unusable: [`Level::Fault`].
    pub faults: InputFaults,
    /// Faults that make it doubtful: at least [`Level::Warning`].
    pub cautions: InputFaults,
}

/// The facts on which the verdict for a row is based.
#[derive(Debug, Clone, Copy)]
pub struct RowFacts {
    /// Time of the row (ns), later than that of the preceding row.
    pub time_ns: i64,
    /// Reasons for which the row is invalid, including those of its outcome.
    pub reasons: Reasons,
    /// U of the worst wheel; NaN where unknown.
    pub utilisation: f64,
    /// Whether a wheel carries nothing: its OTF is not positive, whatever the utilisation.
    pub is_wheel_unloaded: bool,
    /// Whether the platform falls, by gyro and attitude alone: danger, whatever is wrong with the rest.
    pub rotates: bool,
    /// Whether supports take the weight that were in the air on the last set of supports that was known, and none of that set alone has
    /// left the ground.
    pub takes_support: bool,
    /// Proofs that the loads depend on and that are still missing.
    pub unproven: Proofs,
    /// Input problems since the preceding row.
    pub conditions: Conditions,
    /// Whether the alarm has been acknowledged since the preceding row.
    pub is_acknowledged: bool,
}

/// The stability verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Verdict {
    /// Current level.
    pub level: Level,
    /// Level to act on: Danger and model failures persist until they have ended and have been acknowledged.
    pub latched_level: Level,
    /// Evidence behind the level: doubted, assumed or proven.
    pub basis: Basis,
    /// Proofs that the loads depend on and that are still missing.
    pub unproven: Proofs,
    /// Faults, cautions and reasons behind a level of fault, a level that cautions raise, or a doubt about the level. A level
    /// outlasts its causes.
    pub held: HeldProblems,
}

/// Everything found since a fault or a caution began to be held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct HeldProblems {
    /// Faults of the input.
    pub faults: InputFaults,
    /// Cautions about the input.
    pub cautions: InputFaults,
    /// Reasons of the rows that failed, and a contradiction between signals.
    pub reasons: Reasons,
}

/// Computes the verdict for every row.
#[derive(Debug, Clone, Default)]
pub struct Judge {
    notice: Alarm,
    warning: Alarm,
    danger: Alarm,
    first_row_ns: Option<i64>,
    was_valid: bool,
    good_rows: u32,
    implausible_rows: u32,
    /// Time of the last row with a fault (ns), while the fault is held.
    fault_ns: Option<i64>,
    /// Time of the last row with a caution (ns), while it is held.
    caution_ns: Option<i64>,
    /// Time of the last row whose signals contradict each other (ns), while that is held.
    doubt_ns: Option<i64>,
    held: HeldProblems,
    /// Faults of signals whose implausible samples are left out.
    left_out: Reasons,
    /// Whether samples failed to arrive since the fault began to be held.
    is_missing: bool,
    /// Consecutive rows in danger before the failure, if there is one.
    danger_rows: u32,
    /// Whether the platform rotated about an edge in the last row.
    rotates: bool,
    /// What was before the last danger by loads began.
    before_danger: Option<BeforeDanger>,
    /// Whether a danger was taken back, and no rows have been known without danger for the hold time since.
    has_withdrawn: bool,
    latch: Latch,
    /// Whether a known level below that of the latched alarm has been reached since the alarm was raised.
    is_over: bool,
    /// Whether the alarm was taken over from the session before or from the disk, and no alarm was raised since.
    is_inherited: bool,
    alarms: u64,
    verdict: Verdict,
}

/// Alarms before a danger began.
#[derive(Debug, Clone, Copy)]
struct BeforeDanger {
    /// Time of the first row in danger (ns).
    since_ns: i64,
    /// Notice, warning and danger.
    alarms: [Alarm; 3],
    latch: Latch,
    is_over: bool,
    is_inherited: bool,
}

/// Assessment of a single row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RowAssessment {
    /// Its utilisation is valid.
    Known,
    /// The machine tips: the utilisation is not needed.
    Tipping,
    /// Not enough information yet.
    Unknown,
    /// The signals or the model have failed.
    Failed,
}

impl Judge {
    /// A judge before its first row.
    #[must_use]
    pub fn new(limits: &LimitsSpec) -> Self {
        Self {
            notice: Alarm::new(limits.notice),
            warning: Alarm::new(limits.warning),
            danger: Alarm::new(limits.limit),
            ..Self::default()
        }
    }

    /// The verdict on the last row.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// The latched alarm.
    #[must_use]
    pub fn latch(&self) -> Latch {
        self.latch
    }

    /// Number of alarms raised so far. A larger number is another alarm: an acknowledgement of the one before does
    /// not count for it.
    #[must_use]
    pub fn alarms(&self) -> u64 {
        self.alarms
    }

    /// Takes over a latched alarm before the first row: from the session before, or from the disk. Whether it is over
    /// is not known until a row says so.
    pub fn resume(&mut self, latch: Latch) {
        self.latch = latch;
        self.is_over = false;
        self.is_inherited = latch.level.is_some();
        self.verdict.latched_level = latch.over(self.verdict.level);
    }

    /// The verdict between rows: that of the last row, or worse because of conditions found since, or because the platform
    /// `rotates` about an edge now. It is held from the next row on if that row is given the same.
    #[must_use]
    pub fn between_rows(&self, conditions: Conditions, rotates: bool) -> Verdict {
        let mut held = self.held;
        held.faults.add_all(conditions.faults);
        held.cautions.add_all(conditions.cautions);
        let level = if rotates {
            Level::Danger
        } else if !conditions.faults.is_empty() {
            self.fault_level(&held)
        } else if !conditions.cautions.is_empty() {
            self.verdict.level.max(Level::Warning)
        } else {
            self.verdict.level
        };
        let is_worse = rotates || !conditions.faults.is_empty() || !conditions.cautions.is_empty();
        Verdict {
            level,
            latched_level: level.max(self.verdict.latched_level),
            basis: match is_worse {
                true => Basis::Doubted,
                false => self.verdict.basis,
            },
            unproven: self.verdict.unproven,
            held,
        }
    }

    /// The verdict on a row.
    pub fn row(&mut self, row: &RowFacts) -> Verdict {
        let first = *self.first_row_ns.get_or_insert(row.time_ns);
        self.rotates = row.rotates;
        self.implausible_rows = if row.reasons.have_signal_fault() {
            self.implausible_rows.saturating_add(1)
        } else {
            0
        };
        let standing = self.standing(row, row.time_ns.saturating_sub(first));
        let is_faulty = standing == RowAssessment::Failed || !row.conditions.faults.is_empty();
        if row.takes_support && standing == RowAssessment::Unknown && !is_faulty {
            self.withdraw_danger(row.time_ns);
        }
        let before = self.before_danger(row.time_ns);
        match standing {
            RowAssessment::Known if !row.is_wheel_unloaded => {
                self.each_alarm(|alarm| alarm.take(row.utilisation, row.time_ns));
            }
            RowAssessment::Known | RowAssessment::Tipping => {
                self.each_alarm(|alarm| alarm.take(f64::INFINITY, row.time_ns));
            }
            RowAssessment::Unknown | RowAssessment::Failed => self.each_alarm(Alarm::skip),
        }
        self.has_withdrawn &= !self.danger.is_low(row.time_ns);
        if standing == RowAssessment::Tipping || is_faulty {
            self.before_danger = None;
        } else if standing == RowAssessment::Known && before.is_some() {
            self.before_danger = before.filter(|_| self.danger.is_on());
        }
        let is_good = standing == RowAssessment::Known && !is_faulty;
        self.was_valid |= is_good;
        self.good_rows = if is_good {
            self.good_rows.saturating_add(1)
        } else {
            0
        };
        let is_ready = self.good_rows >= GOOD_ROWS;
        hold(&mut self.fault_ns, is_faulty, is_ready, row.time_ns);
        let is_doubtful = !row.conditions.cautions.is_empty();
        hold(&mut self.caution_ns, is_doubtful, true, row.time_ns);
        let is_contradicted = row.reasons.have_doubt();
        hold(&mut self.doubt_ns, is_contradicted, true, row.time_ns);
        self.hold_problems(row, standing);
        if is_good || standing == RowAssessment::Tipping {
            self.danger_rows = match self.danger.is_on() {
                true => self.danger_rows.saturating_add(1),
                false => 0,
            };
        }
        let basis = self.basis(is_ready, row.unproven);
        let level = self.level(is_ready, basis);
        let is_of_inputs = row.reasons.have_gap() || row.reasons.have_signal_fault();
        let model_failed = standing == RowAssessment::Failed && !is_of_inputs;
        self.update_latch(level, model_failed, row.is_acknowledged);
        self.verdict = Verdict {
            level,
            latched_level: self.latch.over(level),
            basis,
            unproven: row.unproven,
            held: self.held,
        };
        self.verdict
    }

    /// Adds what was found in this row, and forgets what is no longer held.
    fn hold_problems(&mut self, row: &RowFacts, standing: RowAssessment) {
        self.held.faults.add_all(row.conditions.faults);
        self.held.cautions.add_all(row.conditions.cautions);
        self.left_out = row.reasons.left_out(self.left_out);
        if standing == RowAssessment::Failed {
            self.held.reasons.add_all(row.reasons);
            self.is_missing |= row.reasons.have_gap_besides(self.left_out);
        }
        if self.fault_ns.is_none() {
            (self.held.faults, self.held.reasons) = (InputFaults::NONE, Reasons::NONE);
            self.is_missing = false;
        }
        if self.doubt_ns.is_some() {
            self.held.reasons.add(Reason::Contradiction);
        }
        if self.caution_ns.is_none() {
            self.held.cautions = InputFaults::NONE;
        }
    }

    /// The level during a fault. A machine that overturns leaves the range in which its sensors and the model
    /// hold: it stays in danger, unless the samples themselves fail to arrive. Samples that are left out because their values are
    /// implausible have arrived.
    fn fault_level(&self, held: &HeldProblems) -> Level {
        let was_in_danger = self.danger.is_on() && self.danger_rows >= PERSISTENT;
        let arrives = !self.is_missing && held.faults.iter().all(InputFault::is_about_values);
        if was_in_danger && arrives {
            Level::Danger
        } else {
            Level::Fault
        }
    }

    fn standing(&self, row: &RowFacts, elapsed_ns: i64) -> RowAssessment {
        let reasons = row.reasons;
        if row.rotates {
            return RowAssessment::Tipping;
        }
        if reasons.has(Reason::GrossInput) || self.implausible_rows >= PERSISTENT {
            return RowAssessment::Failed;
        }
        if reasons.have_gap() {
            // Before the first valid row, sensors may still be starting.
            let is_starting = !self.was_valid && elapsed_ns <= START_UP_NS;
            return if is_starting {
                RowAssessment::Unknown
            } else {
                RowAssessment::Failed
            };
        }
        if reasons.have_signal_fault() {
            return RowAssessment::Unknown;
        }
        if reasons.has(Reason::SupportsUnknown) {
            return RowAssessment::Unknown;
        }
        if reasons.has(Reason::LinkageOpen)
            || reasons.has(Reason::NotFinite)
            || reasons.has(Reason::NoGroundContact)
        {
            return RowAssessment::Failed;
        }
        if reasons.has(Reason::Settling) {
            return RowAssessment::Unknown;
        }
        if reasons.has(Reason::Tipping) {
            return RowAssessment::Tipping;
        }
        // In a valid row without utilisation the loads are known, and their uncertainty is not. Of a wheel that carries nothing it
        // need not be.
        if row.utilisation.is_finite() || row.is_wheel_unloaded {
            RowAssessment::Known
        } else {
            RowAssessment::Unknown
        }
    }

    /// What is before a danger that may begin in the row at this time; `None` while there is one, and where it is not taken back: a
    /// switch that chatters takes back one danger only.
    fn before_danger(&self, time_ns: i64) -> Option<BeforeDanger> {
        (!self.danger.is_on() && !self.has_withdrawn).then_some(BeforeDanger {
            since_ns: time_ns,
            alarms: [self.notice, self.warning, self.danger],
            latch: self.latch,
            is_over: self.is_over,
            is_inherited: self.is_inherited,
        })
    }

    /// Takes back a danger by loads that has just begun: the weight was passing to other supports already, before they told so, and
    /// the loads were those without them. A platform that falls rotates: that stays danger. Who acknowledged the danger has seen the
    /// alarm before it.
    fn withdraw_danger(&mut self, time_ns: i64) {
        let before = self.before_danger.take();
        let has_just_begun = |it: &BeforeDanger| time_ns.saturating_sub(it.since_ns) < HOLD_NS;
        let Some(before) = before.filter(has_just_begun) else {
            return;
        };
        [self.notice, self.warning, self.danger] = before.alarms;
        let is_acknowledged = self.latch.is_acknowledged;
        self.latch = before.latch;
        if is_acknowledged {
            self.latch.acknowledge();
        }
        (self.is_over, self.is_inherited) = (before.is_over, before.is_inherited);
        self.danger_rows = 0;
        self.has_withdrawn = true;
    }

    fn each_alarm(&mut self, act: impl Fn(&mut Alarm)) {
        for alarm in [&mut self.notice, &mut self.warning, &mut self.danger] {
            act(alarm);
        }
    }

    /// Alarms are raised from the first trustworthy row; safe requires several. A doubt takes no alarm away, and nothing is
    /// safe beside it.
    fn level(&self, is_ready: bool, basis: Basis) -> Level {
        let alarm = if self.danger.is_on() {
            Level::Danger
        } else if self.warning.is_on() || self.caution_ns.is_some() {
            Level::Warning
        } else if !is_ready || self.doubt_ns.is_some() {
            Level::Unknown
        } else if self.notice.is_on() {
            Level::Notice
        } else if basis == Basis::Proven {
            Level::Safe
        } else {
            Level::Assumed
        };
        if self.rotates {
            Level::Danger
        } else if self.fault_ns.is_some() {
            self.fault_level(&self.held)
        } else {
            alarm
        }
    }

    /// Returns the evidence behind the verdict. A doubt or a fault counts as long as it keeps the level.
    fn basis(&self, is_ready: bool, unproven: Proofs) -> Basis {
        let is_doubtful =
            self.doubt_ns.is_some() || self.caution_ns.is_some() || self.fault_ns.is_some();
        match (is_ready && !is_doubtful, unproven.is_empty()) {
            (false, _) => Basis::Doubted,
            (true, false) => Basis::Assumed,
            (true, true) => Basis::Proven,
        }
    }

    /// Raises, acknowledges and releases the latched alarm. An alarm that begins again after it was over, or after it was
    /// taken over, is another alarm. An unknown level does not end an alarm.
    fn update_latch(&mut self, level: Level, model_failed: bool, is_acknowledged: bool) {
        // of the alarm before this row: that of this row nobody has seen
        if is_acknowledged {
            self.latch.acknowledge();
        }
        let begins = level == Level::Danger || model_failed;
        let is_higher = self.latch.level.is_none_or(|latched| latched < level);
        if begins && (is_higher || self.is_over || self.is_inherited) {
            self.latch = Latch::raised(self.latch.over(level));
            self.is_over = false;
            self.is_inherited = false;
            self.alarms += 1;
        }
        let is_below = self.latch.level.is_some_and(|latched| level < latched);
        self.is_over |= is_below && level != Level::Unknown;
        if self.latch.is_acknowledged && self.is_over {
            self.latch = Latch::default();
            self.is_over = false;
        }
    }
}

/// Records when a condition was last true; forgets it once it has been absent long enough and `may_end`.
fn hold(last_ns: &mut Option<i64>, is_now: bool, may_end: bool, time_ns: i64) {
    if is_now {
        *last_ns = Some(time_ns);
    } else if may_end && last_ns.is_some_and(|last| time_ns.saturating_sub(last) >= HOLD_NS) {
        *last_ns = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::InputFault;

    const PERIOD_NS: i64 = 10_000_000;

    struct Run {
        judge: Judge,
        time_ns: i64,
    }

    impl Run {
        fn new() -> Self {
            Self {
                judge: Judge::new(&LimitsSpec::default()),
                time_ns: 0,
            }
        }

        fn row(
            &mut self,
            utilisation: f64,
            reasons: &[Reason],
            fault: Option<InputFault>,
        ) -> Level {
            let mut set = Reasons::NONE;
            reasons.iter().for_each(|&reason| set.add(reason));
            self.time_ns += PERIOD_NS;
            let conditions = Conditions {
                faults: fault.map_or(InputFaults::NONE, InputFaults::from),
                ..Conditions::default()
            };
            let facts = RowFacts {
                time_ns: self.time_ns,
                reasons: set,
                utilisation,
                is_wheel_unloaded: false,
                rotates: false,
                takes_support: false,
                unproven: Proofs::NONE,
                conditions,
                is_acknowledged: false,
            };
            self.judge.row(&facts).level
        }

        fn good(&mut self, utilisation: f64, rows: usize) -> Level {
            (0..rows)
                .map(|_| self.row(utilisation, &[], None))
                .last()
                .unwrap()
        }

        fn acknowledge(&mut self, utilisation: f64) -> Verdict {
            self.time_ns += PERIOD_NS;
            self.judge.row(&RowFacts {
                time_ns: self.time_ns,
                reasons: Reasons::NONE,
                utilisation,
                is_wheel_unloaded: false,
                rotates: false,
                takes_support: false,
                unproven: Proofs::NONE,
                conditions: Conditions::default(),
                is_acknowledged: true,
            })
        }
    }

    // requirement: TW-VERDICT-01, TW-VERDICT-02, TW-VERDICT-06
    #[test]
    fn safe_needs_several_good_rows_an_alarm_only_one() {
        let mut run = Run::new();
        assert_eq!(run.judge.verdict().level, Level::Unknown);
        assert_eq!(run.good(0.1, 9), Level::Unknown);
        assert_eq!(run.good(0.1, 1), Level::Safe);
        assert_eq!(Run::new().good(0.95, 1), Level::Warning);
        assert_eq!(
            Run::new().row(f64::NAN, &[Reason::Tipping], None),
            Level::Danger
        );
    }

    // requirement: TW-VERDICT-05
    #[test]
    fn unloaded_wheel_is_danger_whatever_the_utilisation() {
        let mut run = Run::new();
        run.good(0.1, 20);
        run.time_ns += PERIOD_NS;
        let unloaded = RowFacts {
            time_ns: run.time_ns,
            reasons: Reasons::NONE,
            utilisation: 0.05,
            is_wheel_unloaded: true,
            rotates: false,
            takes_support: false,
            unproven: Proofs::NONE,
            conditions: Conditions::default(),
            is_acknowledged: false,
        };
        assert_eq!(run.judge.row(&unloaded).level, Level::Danger);
    }

    // requirement: TW-VERDICT-08, TW-VERDICT-17
    #[test]
    fn held_fault_states_its_cause_until_it_ends() {
        let mut run = Run::new();
        run.good(0.1, 20);
        run.row(0.1, &[], Some(InputFault::Lost));
        run.row(f64::NAN, &[Reason::ImuGap], None);
        assert_eq!(run.good(0.1, 50), Level::Fault);
        let held = run.judge.verdict().held;
        assert_eq!(held.faults, InputFault::Lost.into());
        assert!(held.reasons.has(Reason::ImuGap));
        assert_eq!(run.good(0.1, 100), Level::Safe);
        assert_eq!(run.judge.verdict().held, HeldProblems::default());
    }

    // requirement: TW-VERDICT-06, TW-VERDICT-15
    #[test]
    fn overturning_machine_stays_in_danger() {
        let mut run = Run::new();
        run.good(0.1, 20);
        run.good(1.2, 5);
        for reason in [Reason::Tipping, Reason::NoGroundContact, Reason::ImuFault] {
            for _ in 0..20 {
                let level = run.row(f64::NAN, &[reason], Some(InputFault::OutOfRange));
                assert_eq!(level, Level::Danger, "{reason:?}");
            }
        }
        assert!(
            run.judge
                .verdict()
                .held
                .reasons
                .has(Reason::NoGroundContact)
        );
        // what does not arrive is a fault all the same
        assert_eq!(run.row(1.2, &[], Some(InputFault::Stale)), Level::Fault);
        // and one bad row before a failure is not an overturning machine
        let mut glitch = Run::new();
        glitch.good(0.1, 20);
        glitch.good(1.2, 1);
        assert_eq!(
            glitch.row(f64::NAN, &[Reason::NotFinite], None),
            Level::Fault
        );
    }

    // requirement: TW-VERDICT-03, TW-VERDICT-04
    #[test]
    fn levels_rise_at_once_and_fall_after_a_second() {
        let mut run = Run::new();
        run.good(0.5, 10);
        assert_eq!(run.good(0.75, 1), Level::Notice);
        assert_eq!(run.good(1.0, 1), Level::Danger);
        assert_eq!(run.good(0.5, 100), Level::Danger);
        assert_eq!(run.good(0.5, 1), Level::Safe);
    }

    // requirement: TW-VERDICT-08
    #[test]
    fn fault_is_held_and_needs_good_rows_to_clear() {
        let mut run = Run::new();
        run.good(0.1, 20);
        assert_eq!(run.row(0.1, &[], Some(InputFault::Lost)), Level::Fault);
        assert_eq!(run.good(0.1, 99), Level::Fault);
        assert_eq!(run.good(0.1, 1), Level::Safe);
        // A gap is a fault once the machine has been running.
        assert_eq!(run.row(f64::NAN, &[Reason::ImuGap], None), Level::Fault);
    }

    // requirement: TW-VERDICT-10
    #[test]
    fn one_implausible_sample_is_tolerated_more_are_a_fault() {
        let mut run = Run::new();
        run.good(0.1, 20);
        for _ in 0..2 {
            let level = run.row(f64::NAN, &[Reason::ImuFault], None);
            assert_eq!(level, Level::Unknown);
        }
        assert_eq!(run.good(0.1, 9), Level::Unknown);
        assert_eq!(run.good(0.1, 1), Level::Safe);
        for level in [Level::Unknown, Level::Unknown, Level::Fault] {
            assert_eq!(run.row(f64::NAN, &[Reason::JointsFault], None), level);
        }
        // A signal fault is not a model failure, so it needs no acknowledgement.
        assert_eq!(run.good(0.1, 110), Level::Safe);
        assert_eq!(run.judge.verdict().latched_level, Level::Safe);
    }

    // requirement: TW-VERDICT-11
    #[test]
    fn missing_sensor_is_unknown_first_then_a_fault() {
        let mut run = Run::new();
        for _ in 0..=200 {
            assert_eq!(run.row(f64::NAN, &[Reason::ImuGap], None), Level::Unknown);
        }
        assert_eq!(run.row(f64::NAN, &[Reason::ImuGap], None), Level::Fault);
    }

    // requirement: TW-VERDICT-01, TW-VERDICT-07
    #[test]
    fn unknown_utilisation_is_never_safe() {
        let mut run = Run::new();
        run.good(0.1, 20);
        assert_eq!(run.row(f64::NAN, &[], None), Level::Unknown);
        assert_eq!(run.row(f64::INFINITY, &[], None), Level::Unknown);
        assert_eq!(run.good(0.1, 9), Level::Unknown);
        assert_eq!(run.good(0.1, 1), Level::Safe);
        let mut settling = Run::new();
        settling.good(0.1, 20);
        assert_eq!(settling.row(0.1, &[Reason::Settling], None), Level::Unknown);
    }

    // requirement: TW-VERDICT-18
    #[test]
    fn danger_persists_until_over_and_acknowledged() {
        let mut run = Run::new();
        run.good(0.1, 20);
        run.good(1.2, 1);
        assert_eq!(run.good(0.1, 200), Level::Safe);
        assert_eq!(run.judge.verdict().latched_level, Level::Danger);
        assert_eq!(run.acknowledge(0.1).latched_level, Level::Safe);
        // Acknowledged while it persists: cleared when it ends.
        assert_eq!(run.good(1.2, 1), Level::Danger);
        assert_eq!(run.acknowledge(1.2).latched_level, Level::Danger);
        run.good(0.1, 200);
        assert_eq!(run.judge.verdict().latched_level, Level::Safe);
    }

    // requirement: TW-VERDICT-19
    #[test]
    fn acknowledgement_of_one_alarm_does_not_clear_the_next() {
        let mut run = Run::new();
        run.good(0.1, 20);
        run.good(1.2, 1);
        run.good(0.1, 200);
        assert_eq!(run.judge.alarms(), 1);
        // The same level again, after the first was over: another alarm.
        run.good(1.2, 1);
        assert_eq!(run.judge.alarms(), 2);
        run.acknowledge(1.2);
        assert!(run.judge.latch().is_acknowledged);
        run.good(0.1, 200);
        assert_eq!(run.judge.latch(), Latch::default());
        // An alarm that goes on is one alarm.
        run.good(1.2, 50);
        assert_eq!(run.judge.alarms(), 3);
    }

    // requirement: TW-VERDICT-20
    #[test]
    fn inherited_alarm_ends_at_a_known_lower_level_once_acknowledged() {
        let mut run = Run::new();
        run.judge.resume(Latch::raised(Level::Danger));
        assert_eq!(run.judge.verdict().latched_level, Level::Danger);
        let verdict = run.acknowledge(0.1);
        assert_eq!(
            (verdict.level, verdict.latched_level),
            (Level::Unknown, Level::Danger)
        );
        assert!(run.judge.latch().is_acknowledged);
        run.good(0.1, 20);
        assert_eq!(run.judge.latch(), Latch::default());
        // The first danger after a restart is another alarm than the one acknowledged before.
        let mut run = Run::new();
        run.judge.resume(Latch {
            is_acknowledged: true,
            ..Latch::raised(Level::Danger)
        });
        run.good(1.2, 1);
        assert_eq!(run.judge.latch(), Latch::raised(Level::Danger));
        run.good(0.1, 200);
        assert_eq!(run.judge.verdict().latched_level, Level::Danger);
    }

    // requirement: TW-VERDICT-16
    #[test]
    fn verdict_between_rows_only_gets_worse() {
        let mut run = Run::new();
        run.good(0.1, 20);
        let stale = Conditions {
            faults: InputFault::Stale.into(),
            ..Conditions::default()
        };
        assert_eq!(run.judge.between_rows(stale, false).level, Level::Fault);
        let late = Conditions {
            cautions: InputFault::Stale.into(),
            ..Conditions::default()
        };
        assert_eq!(run.judge.between_rows(late, false).level, Level::Warning);
        assert_eq!(run.judge.verdict().level, Level::Safe);
    }
}
