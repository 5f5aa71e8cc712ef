//! Record of one sensor's samples: its clock, its period and its consecutive failures.

use tipwatch_mechanics::state::{NumberKind, Sensor, Sensors};

use super::delay::DriftWatch;
use crate::safety_limits::{
    LATE_PERIODS, MAX_AUXILIARY_AGE_NS, MIN_LATE_NS, MIN_STALE_NS, STALE_PERIODS,
};

/// Weight of a new interval in a sensor's mean period.
const PERIOD_SHARE: f64 = 0.05;

/// Age of a sensor's last good sample, relative to the sensor's own period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Age {
    Fresh,
    Late,
    Stale,
}

#[derive(Debug, Clone)]
pub(super) struct SensorWatch {
    pub(super) sensor: Sensor,
    pub(super) value_count: usize,
    /// The longest age (ns) that is not stale, whatever the sensor's period.
    max_age_ns: i64,
    /// Delays of its samples.
    pub(super) drift: DriftWatch,
    /// Stamp and publication time of the last admitted sample (ns): the reference for clock jumps.
    clock_ns: Option<(i64, i64)>,
    /// Publication time of the last good sample (ns).
    pub(super) fresh_ns: Option<i64>,
    period_ns: Option<f64>,
    /// Consecutive samples whose stamp jumped.
    pub(super) jumped: u32,
    /// Consecutive samples that were not later than the one before.
    pub(super) disordered: u32,
    /// Consecutive samples with an implausible value.
    pub(super) implausible: u32,
}

impl SensorWatch {
    /// `max_gap_ns` is the longest gap that the estimator bridges.
    pub(super) fn new(sensor: Sensor, sensors: &Sensors, max_gap_ns: i64) -> Self {
        // without these the estimate goes on
        let is_auxiliary = sensor == Sensor::Odometry && sensors.imu
            || matches!(
                sensor,
                Sensor::Number(NumberKind::Load | NumberKind::Force, _)
            );
        Self {
            sensor,
            value_count: sensors.value_count(sensor).unwrap_or(0),
            max_age_ns: if is_auxiliary {
                MAX_AUXILIARY_AGE_NS
            } else {
                max_gap_ns
            },
            drift: DriftWatch::default(),
            clock_ns: None,
            fresh_ns: None,
            period_ns: None,
            jumped: 0,
            disordered: 0,
            implausible: 0,
        }
    }

    /// The sensor's and this computer's clock agree: both are the reference for the next sample.
    pub(super) fn accept_clock(&mut self, stamp_ns: i64, published_ns: i64) {
        self.jumped = 0;
        self.clock_ns = Some((stamp_ns, published_ns));
    }

    /// A good sample came: only that makes the sensor fresh.
    pub(super) fn refresh(&mut self, published_ns: i64) {
        self.disordered = 0;
        if let Some(before_ns) = self.fresh_ns {
            let interval_ns = published_ns.saturating_sub(before_ns) as f64;
            let period_ns = self.period_ns.get_or_insert(interval_ns);
            *period_ns += PERIOD_SHARE * (interval_ns - *period_ns);
        }
        self.fresh_ns = Some(published_ns);
    }

    /// Whether the verdict needs the sensor. It does not need the command of a joint: without one, the joint is predicted to go
    /// on.
    pub(super) fn is_required(&self) -> bool {
        !matches!(self.sensor, Sensor::Number(NumberKind::Command, _))
    }

    /// Judges the age (ns) of the last good sample by the sensor's period. Switches, payload masses and commands always count as
    /// fresh here. A switch or a mass may be sent only when it changes, and is too old by its own limit in the machine file: then
    /// the supports or the loads are unknown. A command that is not sent is unknown.
    pub(super) fn age(&self, age_ns: i64) -> Age {
        if matches!(
            self.sensor,
            Sensor::Number(NumberKind::Switch, _)
                | Sensor::Number(NumberKind::Command, _)
                | Sensor::Number(NumberKind::Payload, _)
        ) {
            return Age::Fresh;
        }
        let max_ns = self.max_age_ns as f64;
        let after = |periods: f64, min_ns: f64| {
            let known = self.period_ns.map_or(max_ns, |period| periods * period);
            known.clamp(min_ns.min(max_ns), max_ns)
        };
        match age_ns as f64 {
            age if age > after(STALE_PERIODS, MIN_STALE_NS) => Age::Stale,
            age if age > after(LATE_PERIODS, MIN_LATE_NS) => Age::Late,
            _ => Age::Fresh,
        }
    }

    /// Whether the sensor's clock and this computer's disagree on the time since the last admitted sample.
    pub(super) fn clock_jumps(
        &self,
        stamp_ns: i64,
        published_ns: i64,
        pace: f64,
        max_gap_ns: i64,
    ) -> bool {
        self.clock_ns
            .is_some_and(|(last_stamp_ns, last_published_ns)| {
                let by_sensor = stamp_ns.saturating_sub(last_stamp_ns) as f64 / pace;
                let by_host = published_ns.saturating_sub(last_published_ns) as f64;
                (by_sensor - by_host).abs() > max_gap_ns as f64
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_its_own_limit_makes_a_switch_too_old() {
        let sensors = Sensors {
            imu: true,
            switches: 1,
            loads: 1,
            commands: 1,
            payload_signals: vec![0],
            ..Sensors::default()
        };
        let age_of = |sensor: Sensor| {
            let mut watch = SensorWatch::new(sensor, &sensors, 100_000_000);
            for time_ns in [0, 10_000_000, 20_000_000] {
                watch.refresh(time_ns);
            }
            watch.age(1_500_000_000)
        };
        assert_eq!(age_of(Sensor::Imu), Age::Stale);
        assert_eq!(age_of(Sensor::Number(NumberKind::Switch, 0)), Age::Fresh);
        assert_eq!(age_of(Sensor::Number(NumberKind::Payload, 0)), Age::Fresh);
        // nor does the verdict rest on what is asked of a joint
        assert_eq!(age_of(Sensor::Number(NumberKind::Command, 0)), Age::Fresh);
        let is_required =
            |sensor: Sensor| SensorWatch::new(sensor, &sensors, 100_000_000).is_required();
        assert!(
            is_required(Sensor::Number(NumberKind::Load, 0))
                && !is_required(Sensor::Number(NumberKind::Command, 0))
        );
    }
}
