//! A joint that is measured at other instants than the rest of its message: a driver that polls its encoders one after the other, or
//! a slow one, repeats its value meanwhile. It has a filter of its own, which takes its measurements only.
//!
//! The filter of the message follows it further, and neither its estimate nor the noise that it shows there is used. Bands are those
//! of the joint that is known worst, for the noise of all joints of the arm is one number.

use super::judged;
use super::kalman_filter::KalmanFilter;
use super::reading::{FilterStatus, Reading};
use super::white_jerk::Channel;
use crate::estimation::plausibility::Treatment;
use crate::state::SampleError;

/// One joint of a stream of joint states.
#[derive(Debug, Clone)]
pub(super) struct Alone {
    stream: usize,
    /// Channel of the joint in the filter of the stream.
    channel: usize,
    /// Whether the joint moves the arm: only then does its covariance enter the bands, other than that of a spinning wheel.
    is_of_arm: bool,
    filter: KalmanFilter,
    /// Stamp at which the joint was measured last (ns): repeats of its values belong to that time.
    measured_ns: Option<i64>,
}

impl Alone {
    pub(super) fn new(
        stream: usize,
        channel: usize,
        is_of_arm: bool,
        filter: KalmanFilter,
    ) -> Self {
        Self {
            stream,
            channel,
            is_of_arm,
            filter,
            measured_ns: None,
        }
    }

    pub(super) fn stream(&self) -> usize {
        self.stream
    }

    pub(super) fn channel(&self) -> usize {
        self.channel
    }

    /// Whether the joint is measured at instants of its own, with a filter of its own.
    pub(super) fn is_used(&self) -> bool {
        self.filter.last_ns().is_some()
    }

    /// Takes position and rate in a message; `with` is the filter of the whole.
    pub(super) fn push(
        &mut self,
        stamp_ns: i64,
        [position, rate]: [f64; 2],
        treatment: &Treatment,
        repeats: bool,
        with: &mut KalmanFilter,
    ) -> Result<(), SampleError> {
        let is_used = self.is_used();
        let filter = &mut self.filter;
        let mut measured =
            |at_ns: i64| judged::push(filter, at_ns, &[position], Some(&[rate]), treatment);
        match (repeats, self.measured_ns) {
            (true, Some(at_ns)) if !is_used => {
                measured(at_ns)?;
                // a value that was left out begins nothing
                if self.is_used() {
                    self.filter.take_over(with);
                    with.disregard(self.channel);
                }
            }
            (true, _) => {}
            (false, _) => {
                self.measured_ns = Some(stamp_ns);
                if is_used {
                    measured(stamp_ns)?;
                }
            }
        }
        Ok(())
    }

    /// Whether the joint's last measurement is within `max_gap_ns` of a stamp.
    pub(super) fn is_near(&self, stamp_ns: i64, max_gap_ns: i64) -> bool {
        self.filter.is_near(stamp_ns, max_gap_ns)
    }

    /// Writes its channel at a stamp in place of that of the whole, and allows for it in the covariance.
    pub(super) fn read_into(
        &self,
        stamp_ns: i64,
        settle_ns: i64,
        channels: &mut [Channel],
        reading: &mut Reading,
    ) {
        let own = &mut channels[self.channel..=self.channel];
        let covariance = self.filter.read(stamp_ns, 0.0, own);
        if self.is_of_arm && covariance[2][2] > reading.covariance[2][2] {
            reading.covariance = covariance;
        }
        if self.filter.status(stamp_ns, settle_ns) == FilterStatus::Settling {
            reading.standing = FilterStatus::Settling;
        }
    }
}
