//! The latched alarm: it stays until it is over and was acknowledged.

use super::level::Level;

/// A latched alarm, if any. Only an acknowledgement ends it: not the end of a session, and not a restart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Latch {
    /// Level of the alarm: [`Level::Danger`] or [`Level::Fault`]; `None` without an alarm.
    pub level: Option<Level>,
    /// Whether the alarm was acknowledged. An acknowledged alarm is released as soon as it is known to be over.
    pub is_acknowledged: bool,
}

impl Latch {
    /// An alarm of this level that nobody has acknowledged.
    #[must_use]
    pub fn raised(level: Level) -> Self {
        Self {
            level: Some(level),
            is_acknowledged: false,
        }
    }

    /// The level to act on while the current one is `level`.
    #[must_use]
    pub fn over(self, level: Level) -> Level {
        self.level.map_or(level, |latched| latched.max(level))
    }

    /// Somebody has acknowledged the alarm. Without one this does nothing.
    pub fn acknowledge(&mut self) {
        self.is_acknowledged |= self.level.is_some();
    }
}
