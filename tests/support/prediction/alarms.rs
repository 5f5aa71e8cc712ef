//! Alarms that several rows raise, and what they are worth.

use tipwatch_mechanics::prediction::Law;
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::verdict::limits::{HOLD_NS, PERSISTENT};

use super::followed::{Followed, Lift, Row};

/// Time after its end within which no lift follows a false alarm (s): the horizon of the prediction.
const AFTER_S: f64 = 2.0;

/// A kind of alarm.
#[derive(Debug)]
pub struct Kind {
    /// Name.
    pub name: &'static str,
    is_on: fn(&Row) -> bool,
}

/// Lift-off within two seconds if the motion goes on.
pub const GO_ON: Kind = Kind {
    name: "prediction, go on",
    is_on: |row| row.ahead[Law::GoOn as usize].lift_off_s.is_finite(),
};

/// The alarms that are compared.
pub const KINDS: [Kind; 9] = [
    Kind {
        name: "plain rate, 5 s (as announced)",
        is_on: |row| row.by_rate_s.is_finite(),
    },
    Kind {
        name: "plain rate, 2 s",
        is_on: |row| row.by_rate_s <= 2.0,
    },
    Kind {
        name: "plain rate, 1 s",
        is_on: |row| row.by_rate_s <= 1.0,
    },
    GO_ON,
    Kind {
        name: "prediction, go on, 1 s",
        is_on: |row| row.ahead[Law::GoOn as usize].lift_off_s <= 1.0,
    },
    Kind {
        name: "prediction, go on, sure within 2 s",
        is_on: |row| row.ahead[Law::GoOn as usize].latest_s.is_finite(),
    },
    Kind {
        name: "prediction, go on, possible",
        is_on: |row| row.ahead[Law::GoOn as usize].earliest_s.is_finite(),
    },
    Kind {
        name: "level warning",
        is_on: |row| matches!(row.level, Level::Warning | Level::Danger),
    },
    Kind {
        name: "level danger",
        is_on: |row| row.level == Level::Danger,
    },
];

/// Returns start and end of each alarm (s): raised by three rows in succession, released after one second without.
#[must_use]
pub fn episodes(log: &Followed, kind: &Kind) -> Vec<[f64; 2]> {
    let hold_s = HOLD_NS as f64 * 1e-9;
    let mut found: Vec<[f64; 2]> = Vec::new();
    let mut in_succession = 0;
    for row in &log.rows {
        in_succession = if (kind.is_on)(row) {
            in_succession + 1
        } else {
            0
        };
        if in_succession == 0 {
            continue;
        }
        match found.last_mut() {
            Some(last) if row.time_s - last[1] < hold_s => last[1] = row.time_s,
            _ if in_succession >= PERSISTENT => found.push([row.time_s; 2]),
            _ => {}
        }
    }
    found
}

/// Returns the lead time of the alarm that was on when a lift began (s); zero if the alarm came too late, NaN without an alarm.
#[must_use]
pub fn lead_s(log: &Followed, lift: &Lift, kind: &Kind) -> f64 {
    let hold_s = HOLD_NS as f64 * 1e-9;
    let all = episodes(log, kind);
    let mut before = all.iter().filter(|alarm| alarm[0] <= lift.time_s);
    match before.rfind(|alarm| alarm[1] + hold_s >= lift.time_s) {
        Some(alarm) => lift.time_s - alarm[0],
        None if all
            .iter()
            .any(|alarm| (0.0..0.5).contains(&(alarm[0] - lift.time_s))) =>
        {
            0.0
        }
        None => f64::NAN,
    }
}

/// Number of alarms that no lift followed, neither while they were on nor soon after, and that none preceded.
#[must_use]
pub fn false_alarms(log: &Followed, kind: &Kind) -> usize {
    let is_false = |alarm: &&[f64; 2]| {
        let about = |lift: &Lift| (alarm[0] - AFTER_S..alarm[1] + AFTER_S).contains(&lift.time_s);
        !log.lifts().iter().any(about)
    };
    episodes(log, kind).iter().filter(is_false).count()
}
