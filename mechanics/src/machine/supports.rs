//! All supports of a machine, on the ground or not.

use super::actuated_joint::{ActuatedJoint, TorqueJoint};
use super::support_id::SupportId;
use super::support_spec::{MeasuredLoad, PresenceSpec, SupportKind};
use super::support_switch::SupportSwitch;
use super::wheel::Wheel;

/// Time around a change of the support set in which the set is unknown (s), where the machine file states none.
pub(super) const TRANSITION_S: f64 = 1.0;

/// All supports of a machine, on the ground or not, sorted by name.
#[derive(Debug, Clone)]
pub struct Supports {
    /// The supports.
    pub all: Vec<Wheel>,
    /// Presence of each support on the ground.
    pub presence: Vec<Presence>,
    /// Signals that tell whether supports are set or raised.
    pub switches: Vec<SupportSwitch>,
    /// Time around a change of the set in which the set is unknown (s).
    pub transition_s: f64,
    /// Optimal load of each, where the machine file states it; else NaN (N).
    pub(super) optimal_load: Vec<f64>,
    /// The wheel that each measured joint spins.
    pub(super) spins: Vec<Option<SupportId>>,
    /// Joints that carry no torque.
    pub(super) free_joints: Vec<TorqueJoint>,
    /// Joints and supports whose force may be logged.
    pub(super) actuated_joints: Vec<ActuatedJoint>,
    /// The split rule of the machine file: D for four wheels at four corners, `None` for springs.
    pub(super) roll_moment_distribution: Option<f64>,
}

/// Presence of a support on the ground.
#[derive(Debug, Clone, Default)]
pub struct Presence {
    /// Condition under which a wheel is raised, or another support set. A wheel without one is on the ground.
    pub told: Option<PresenceSpec>,
    /// The supports that raise this one while all of them are set.
    pub raised_by: Vec<SupportId>,
    /// Measured load of the support.
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

    /// The split rule that the machine follows on four of its wheels, where it is on these at times.
    pub(super) fn rule_of_other_sets(&self) -> Option<f64> {
        let others = self.vary() || self.at_rest().len() < self.all.len();
        self.roll_moment_distribution.filter(|_| others)
    }

    /// The first support that comes and goes, or whose load is measured: its key in the machine file.
    #[must_use]
    pub fn not_constant(&self) -> Option<String> {
        let told_changes = |presence: &Presence| {
            presence.load.is_some() || presence.told.as_ref().is_some_and(PresenceSpec::varies)
        };
        self.first(|presence| {
            let mut raised_by = presence.raised_by.iter();
            told_changes(presence) || raised_by.any(|&by| told_changes(self.presence_of(by)))
        })
    }

    /// The first support of which spans of time tell whether it is set or raised: its key in the machine file. They are those
    /// of one log.
    #[must_use]
    pub fn told_by_spans(&self) -> Option<String> {
        self.first(|presence| matches!(presence.told, Some(PresenceSpec::Spans(_))))
    }

    /// The key in the machine file of the first support of which something is the case.
    fn first(&self, is: impl Fn(&Presence) -> bool) -> Option<String> {
        let mut named = self.all.iter().zip(&self.presence);
        let (wheel, _) = named.find(|(_, presence)| is(presence))?;
        Some(format!("{}.{}", wheel.kind.table(), wheel.name))
    }

    /// Returns the supports on the ground where no support that comes and goes is set, and no wheel is raised: the wheels and the
    /// supports that are always there.
    #[must_use]
    pub fn at_rest(&self) -> Vec<SupportId> {
        let is_always =
            |support: SupportId| self.presence_of(support).told == Some(PresenceSpec::Always(true));
        let stands = |&support: &SupportId| {
            let raised_by = &self.presence_of(support).raised_by;
            match self.support(support).kind {
                SupportKind::Wheel | SupportKind::TrackPoint => {
                    let is_jacked =
                        !raised_by.is_empty() && raised_by.iter().all(|&by| is_always(by));
                    !is_always(support) && !is_jacked
                }
                SupportKind::Foot => is_always(support),
            }
        };
        self.ids().filter(stands).collect()
    }

    /// Names of some supports, separated by commas.
    #[must_use]
    pub fn names(&self, on: &[SupportId]) -> String {
        let names = on.iter().map(|&support| self.support(support));
        let names: Vec<&str> = names.map(|wheel| wheel.name.as_str()).collect();
        names.join(", ")
    }

    /// Returns the ids of all supports, in the order of [`Supports::all`].
    pub fn ids(&self) -> impl Iterator<Item = SupportId> + Clone + use<> {
        (0..self.all.len()).map(SupportId::new)
    }

    /// The support of this name, or all points of the track of this name; none if there is neither.
    #[must_use]
    pub fn named(&self, name: &str) -> Vec<SupportId> {
        let is_named = |id: &SupportId| {
            let support = self.support(*id);
            support.name == name || support.track() == Some(name)
        };
        self.ids().filter(is_named).collect()
    }

    /// The supports of which [`Self::switches`] tell.
    pub fn told_by_signals(&self) -> impl Iterator<Item = SupportId> + '_ {
        self.switches
            .iter()
            .flat_map(|switch| switch.supports.iter().copied())
    }

    /// A support.
    #[must_use]
    pub fn support(&self, id: SupportId) -> &Wheel {
        &self.all[id.index()]
    }

    /// Returns the presence of a support on the ground.
    #[must_use]
    pub fn presence_of(&self, id: SupportId) -> &Presence {
        &self.presence[id.index()]
    }
}
