//! Triggers of the black box: conditions of the verdict that make it keep a clip.

use strum::IntoStaticStr;
use tipwatch_mechanics::verdict::Level;

use crate::wire::topics::{EVENT_ROW, WireVerdict};

/// A condition of the verdict that makes the black box keep a clip.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, clap::ValueEnum, IntoStaticStr,
)]
#[value(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Trigger {
    /// The level is notice, warning or danger; the clip lasts as long as it is.
    Notice,
    /// The level is warning or danger; the clip lasts as long as it is.
    Warning,
    /// The level is danger; the clip lasts as long as it is.
    Danger,
    /// A wheel carries no load in a row with loads, doubted or not: its overturning force is zero or less. The clip lasts as long
    /// as it does.
    LiftOff,
    /// The level becomes fault: the machine is not monitored any more. Only the change counts, because a fault may
    /// last for hours.
    Fault,
}

impl Trigger {
    /// Its name on the command line and in a clip.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether a verdict meets the condition. `before` is the level of the verdict before, if there was one.
    fn is_met(self, verdict: &WireVerdict, before: Option<Level>) -> bool {
        let level = Level::from_number(verdict.level);
        match self {
            Self::Notice => level.announces_lift_off(),
            Self::Warning => matches!(level, Level::Warning | Level::Danger),
            Self::Danger => level == Level::Danger,
            Self::LiftOff => {
                let wheels = verdict.otf.iter().take(verdict.wheel_count as usize);
                verdict.event == EVENT_ROW
                    && verdict.row_reasons().leave_loads()
                    && wheels.into_iter().any(|&otf| otf <= 0.0)
            }
            Self::Fault => level == Level::Fault && before != Some(Level::Fault),
        }
    }
}

/// The wanted conditions, and the level of the last verdict.
#[derive(Debug, Clone, Default)]
pub(super) struct TriggerWatch {
    wanted: Vec<Trigger>,
    level: Option<Level>,
}

impl TriggerWatch {
    pub(super) fn new(wanted: &[Trigger]) -> Self {
        Self {
            wanted: wanted.to_vec(),
            level: None,
        }
    }

    /// The gravest of the wanted conditions that a verdict meets.
    pub(super) fn take(&mut self, verdict: &WireVerdict) -> Option<Trigger> {
        let before = self.level.replace(Level::from_number(verdict.level));
        let met = (self.wanted.iter().copied()).filter(|trigger| trigger.is_met(verdict, before));
        met.max()
    }
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::state::{Reason, Reasons};

    use super::*;

    fn at(level: Level) -> WireVerdict {
        let mut verdict = WireVerdict::unknown();
        (verdict.level, verdict.event, verdict.wheel_count) = (level as u32, EVENT_ROW, 4);
        verdict
    }

    fn doubt() -> u32 {
        let mut reasons = Reasons::NONE;
        reasons.add(Reason::Contradiction);
        reasons.bits().into()
    }

    /// Each condition by itself is met at its levels, and at no others.
    #[test]
    fn conditions_are_met_at_their_levels() {
        use Level::*;
        let all = [Unknown, Safe, Notice, Warning, Danger];
        let met = |trigger| {
            let met = all.map(|level| TriggerWatch::new(&[trigger]).take(&at(level)).is_some());
            met.map(u8::from)
        };
        assert_eq!(met(Trigger::Notice), [0, 0, 1, 1, 1]);
        assert_eq!(met(Trigger::Warning), [0, 0, 0, 1, 1]);
        assert_eq!(met(Trigger::Danger), [0, 0, 0, 0, 1]);
        assert_eq!(met(Trigger::LiftOff), [0; 5], "loads are unknown");
        assert_eq!(met(Trigger::Fault), [0; 5]);
    }

    #[test]
    fn a_fault_that_lasts_triggers_once() {
        let mut watch = TriggerWatch::new(&[Trigger::Fault, Trigger::Notice]);
        let levels = [
            Level::Fault,
            Level::Fault,
            Level::Safe,
            Level::Fault,
            Level::Danger,
        ];
        let met = levels.map(|level| watch.take(&at(level)));
        let fault = Some(Trigger::Fault);
        assert_eq!(met, [fault, None, None, fault, Some(Trigger::Notice)]);
    }

    #[test]
    fn lift_off_needs_a_row_with_loads_and_a_wheel_of_the_machine() {
        let lifted = |wheel: usize, change: fn(&mut WireVerdict)| {
            let mut verdict = at(Level::Danger);
            verdict.otf[..4].fill(100.0);
            verdict.otf[wheel] = -1.0;
            change(&mut verdict);
            TriggerWatch::new(&[Trigger::LiftOff]).take(&verdict)
        };
        assert_eq!(lifted(3, |_| ()), Some(Trigger::LiftOff));
        assert_eq!(lifted(4, |_| ()), None);
        // a doubt of the sensors is no reason to throw away what they showed
        assert_eq!(
            lifted(3, |verdict| verdict.reasons = doubt()),
            Some(Trigger::LiftOff)
        );
        assert_eq!(lifted(3, |verdict| verdict.reasons = 1), None);
        assert_eq!(lifted(3, |verdict| verdict.event = 2), None);
    }
}
