//! Statements about the health of a sensor.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The health of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorHealth {
    /// "joint_states", "imu", "odometry", "tool_wrench" or "actuator".
    pub signal: String,
    /// Name of its topic.
    pub topic: String,
    /// Samples with a usable stamp.
    pub samples: u64,
    /// Samples that were left out or given less weight, in part or wholly, because they are implausible.
    pub implausible: u64,
    /// Samples per second: the inverse of the median time between them (Hz); null for fewer than two.
    pub rate_hz: Option<f64>,
    /// Where the rate changes and stays so, the first twenty; null if the samples come irregularly.
    pub rate_changes: Option<Vec<RateChange>>,
    /// Longest time between two samples (s); null for fewer than two.
    pub longest_gap_s: Option<f64>,
    /// The sample before it (ns).
    pub longest_gap_ns: Option<i64>,
    /// Steps of its clock and of that of the recorder: restarts, corrections, jumps.
    pub clock_steps: u64,
    /// Its numbers.
    pub numbers: Vec<NumberHealth>,
}

/// A change of the rate of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RateChange {
    /// The first sample of those that come at the new rate (ns).
    pub at_ns: i64,
    /// The rate before (Hz).
    pub from_hz: f64,
    /// The rate from there on (Hz).
    pub to_hz: f64,
}

/// The health of one number of a sensor, in its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NumberHealth {
    /// Its name, such as `specific_force_x` or `lift_position`.
    pub name: String,
    /// Its unit, also that of the numbers below.
    pub unit: String,
    /// Samples that have it.
    pub samples: u64,
    /// The least value; null if no sample has it.
    pub least: Option<f64>,
    /// The greatest value.
    pub greatest: Option<f64>,
    /// The step of which all changes are multiples; null if there is none.
    pub resolution: Option<f64>,
    /// Root mean square of what is faster than some 3 Hz, noise and vibration: the median over spans of half a second.
    /// Null below 20 samples per second.
    pub vibration_rms: Option<f64>,
    /// The same in the span where it is greatest.
    pub greatest_vibration_rms: Option<f64>,
    /// The first sample of that span (ns).
    pub greatest_vibration_ns: Option<i64>,
    /// Share of the samples that repeat the least or the greatest value three times or more, far from the usual ones: the
    /// sensor is at its limit. Null for numbers that may rest at an end, such as positions.
    pub clipped_share: Option<f64>,
    /// Longest time for which it has one value, to the bit (s).
    pub longest_constant_s: f64,
    /// Single samples far from those around them, which agree; null below 20 samples per second.
    pub outliers: Option<u64>,
}
