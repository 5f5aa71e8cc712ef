//! All supports of a machine, on the ground or not.

use super::actuated_joint::{ActuatedJoint, TorqueJoint};
use super::support_spec::{MeasuredLoad, PresenceSpec, SupportKind};
use super::wheel::Wheel;

/// Time around a change of the support set in which the set is unknown (s), where the machine file states none.
pub(super) const TRANSITION_S: f64 = 1.0;

/// All supports of a machine, on the ground or not, sorted by name.
#[derive(Debug, Clone)]
pub struct Supports {
    /// The supports.
    pub all: Vec<Wheel>,
    /// When each of them stands on the ground.
    pub presence: Vec<Presence>,
    /// Time around a change of the set in which the set is unknown (s).
    pub transition_s: f64,
    /// Optimal load of each, where the machine file states it; else NaN (N).
    pub(super) optimal_load: Vec<f64>,
    /// The wheel that each measured joint spins.
    pub(super) spins: Vec<Option<usize>>,
    /// Joints that carry no torque.
    pub(super) free_joints: Vec<TorqueJoint>,
    /// Joints and supports whose force may be logged.
    pub(super) actuated_joints: Vec<ActuatedJoint>,
    /// The split rule of the machine file: D for four wheels at four corners, `None` for springs.
    pub(super) roll_moment_distribution: Option<f64>,
}

/// When a support stands on the ground.
#[derive(Debug, Clone, Default)]
pub struct Presence {
    /// For wheels, when it is raised; for others, when it is set. A wheel without is on the ground.
    pub told: Option<PresenceSpec>,
    /// The supports that raise it while all of them are set.
    pub raised_by: Vec<usize>,
    /// Its measured load.
    pub load: Option<MeasuredLoad>,
}

impl Supports {
    /// Whether the set can change during a log.
    #[must_use]
    pub fn vary(&self) -> bool {
        let varies = |presence: &Presence| {
            presence.told.as_ref().is_some_and(PresenceSpec::varies)
                || (presence.told.is_none() && presence.load.is_some())
        };
        self.presence.iter().any(varies)
    }

    /// The first support that comes and goes, or whose load is measured: its key in the machine file.
    #[must_use]
    pub fn not_constant(&self) -> Option<String> {
        let told_changes = |presence: &Presence| {
            presence.load.is_some() || presence.told.as_ref().is_some_and(PresenceSpec::varies)
        };
        let changes = |presence: &Presence| {
            let mut raised_by = presence.raised_by.iter();
            told_changes(presence) || raised_by.any(|&by| told_changes(&self.presence[by]))
        };
        let mut named = self.all.iter().zip(&self.presence);
        let (wheel, _) = named.find(|(_, presence)| changes(presence))?;
        Some(format!("{}.{}", wheel.kind.table(), wheel.name))
    }

    /// The supports that are on the ground where nothing is set or raised that comes and goes: the wheels and what
    /// is always there.
    #[must_use]
    pub fn at_rest(&self) -> Vec<usize> {
        let is_always =
            |support: usize| self.presence[support].told == Some(PresenceSpec::Always(true));
        let stands = |&support: &usize| {
            let raised_by = &self.presence[support].raised_by;
            match self.all[support].kind {
                SupportKind::Wheel | SupportKind::TrackPoint => {
                    let is_jacked =
                        !raised_by.is_empty() && raised_by.iter().all(|&by| is_always(by));
                    !is_always(support) && !is_jacked
                }
                SupportKind::Foot => is_always(support),
            }
        };
        (0..self.all.len()).filter(stands).collect()
    }

    /// Names of some supports, separated by commas.
    #[must_use]
    pub fn names(&self, on: &[usize]) -> String {
        let names = on.iter().filter_map(|&support| self.all.get(support));
        let names: Vec<&str> = names.map(|wheel| wheel.name.as_str()).collect();
        names.join(", ")
    }
}
