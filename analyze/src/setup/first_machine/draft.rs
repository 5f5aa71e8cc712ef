//! A first machine file in the making.

use std::path::PathBuf;

use tipwatch_datasheet::Machine;
use tipwatch_ingest::Log;

use super::guesses::Guesses;
use super::imu::ImuSection;
use super::signals::Topics;
use super::urdf::Urdf;
use super::write_options::WriteOptions;

/// A first machine file that is not written yet: the guesses, and the statements of a person.
pub struct Draft {
    pub(super) log: Log,
    pub(super) urdf: Option<Urdf>,
    pub(super) topics: Topics,
    pub(super) guesses: Option<Guesses>,
    pub(super) imu: ImuSection,
    pub(super) options: WriteOptions,
    pub(super) stated: Stated,
    /// The machine of a data sheet, which states all but the signals, the mounting of the IMU and the load.
    pub(super) of_sheet: Option<Machine>,
    /// The path of the machine file.
    pub(super) out: PathBuf,
}

/// Statements of a person that replace no guess.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stated {
    /// Joints that carry no torque.
    pub(super) free_joints: Vec<String>,
    /// Links other than wheels on which the machine stood.
    pub(super) supports: Vec<String>,
    /// Wheels that were off the ground on these supports.
    pub(super) raised: Vec<String>,
    /// Vertical stiffness of each tyre on flat ground (N/m).
    pub(super) tyre_stiffness: Option<f64>,
    pub(super) roll_moment_distribution: Option<f64>,
    /// Mass of the load on the tool (kg).
    pub(super) payload: Option<f64>,
    /// Standard deviation of the mass of the tool (kg).
    pub(super) tool_mass_sigma: Option<f64>,
    /// Keys of `[uncertainty]` and their values.
    pub(super) uncertainty: Vec<(&'static str, f64)>,
    /// Position of the IMU in its link (m).
    pub(super) imu_xyz: Option<[f64; 3]>,
    /// Roll, pitch and yaw of the IMU in its link (rad).
    pub(super) imu_rpy: Option<[f64; 3]>,
}
