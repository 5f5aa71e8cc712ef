//! Check that a rod obeys its valve: it must not stand still, and above all not run the other way.

/// Largest opening of the valve (share of full opening) until the rod has proven its direction.
pub const TRIAL_OPENING: f64 = 0.12;
/// A valve opened this far (share of full opening) moves its rod.
pub const MOVING_OPENING: f64 = 0.1;
/// Opening (share of full opening) from which a valve moves its rod in proportion: below it, real valves may not open at all.
const PARTLY_OPENING: f64 = 0.05;
/// Opening (share of full opening) from which a valve may move its rod: during a trial, and after it.
const TRIAL_DIRECTION_OPENING: f64 = 0.01;
const DIRECTION_OPENING: f64 = 0.03;
/// Time after a reversal of the valve in which the rod may still run the old way (s).
const SETTLE_S: f64 = 0.3;
/// Motion that shows a direction (m): above the noise of a stroke sensor, and the travel until a trial ends.
const DIRECTION_M: f64 = 3e-3;
/// A rod that moved less than this (m) stands still: above the noise of a stroke sensor.
pub const STILL_ROD_M: f64 = 1e-3;
/// Longest time in total for which a valve may be open while its rod stands still (s).
pub const STILL_ROD_S: f64 = 1.0;

/// A rod that does not obey its valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RodFault {
    /// The valve was open, and the rod stood still.
    Still,
    /// The rod moved against its valve: valves or sensors are exchanged or reversed.
    WrongWay,
}

/// Watches one rod.
#[derive(Debug, Clone, Copy)]
pub struct RodWatch {
    /// Stroke to which the rod last moved (m), and the total time for which its valve has been open since (s).
    still_from: f64,
    open_s: f64,
    /// Direction in which the valve is open, and the time for which it has been (s).
    direction: f64,
    since_s: f64,
    /// Stroke at which the rod had settled into that direction (m).
    from: f64,
    is_proven: bool,
    fault: Option<RodFault>,
}

impl RodWatch {
    /// Nothing is known of the rod.
    pub const NEW: Self = Self {
        still_from: f64::NAN,
        open_s: 0.0,
        direction: 0.0,
        since_s: 0.0,
        from: f64::NAN,
        is_proven: false,
        fault: None,
    };

    /// The largest opening that is allowed now.
    #[must_use]
    pub fn max_opening(&self) -> f64 {
        match self.is_proven {
            true => 1.0,
            false => TRIAL_OPENING,
        }
    }

    /// Whether the rod has moved with its valve.
    #[must_use]
    pub fn is_proven(&self) -> bool {
        self.is_proven
    }

    /// The fault found, if any; it stays.
    #[must_use]
    pub fn fault(&self) -> Option<RodFault> {
        self.fault
    }

    /// Takes the measured stroke of a rod (m) whose valve had this opening for the last `seconds`.
    pub fn see(&mut self, seconds: f64, opening: f64, rod: f64) {
        let fault = [
            self.still(seconds, opening, rod),
            self.wrong_way(seconds, opening, rod),
        ];
        self.fault = self.fault.or(fault[1]).or(fault[0]);
    }

    fn still(&mut self, seconds: f64, opening: f64, rod: f64) -> Option<RodFault> {
        if !((rod - self.still_from).abs() < STILL_ROD_M) {
            (self.still_from, self.open_s) = (rod, 0.0);
        }
        if opening.abs() >= PARTLY_OPENING {
            self.open_s += seconds * (opening.abs() / MOVING_OPENING).min(1.0);
        }
        (self.open_s > STILL_ROD_S).then_some(RodFault::Still)
    }

    fn wrong_way(&mut self, seconds: f64, opening: f64, rod: f64) -> Option<RodFault> {
        let least = match self.is_proven {
            true => DIRECTION_OPENING,
            false => TRIAL_DIRECTION_OPENING,
        };
        let direction = match opening.abs() >= least {
            true => opening.signum(),
            false => 0.0,
        };
        if direction != self.direction {
            (self.direction, self.since_s, self.from) = (direction, 0.0, f64::NAN);
        }
        self.since_s += seconds;
        // a trial starts from rest
        let settle_s = if self.is_proven { SETTLE_S } else { 0.0 };
        if direction == 0.0 || self.since_s < settle_s {
            return None;
        }
        if self.from.is_nan() {
            self.from = rod;
        }
        let moved = direction * (rod - self.from);
        if moved >= DIRECTION_M {
            self.is_proven = true;
            self.from = rod;
        }
        (moved <= -DIRECTION_M).then_some(RodFault::WrongWay)
    }
}
