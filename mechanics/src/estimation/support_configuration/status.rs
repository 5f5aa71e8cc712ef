//! Status of each support at one time, and the set of supports on the ground that follows from it.

use crate::machine::{MAX_WHEELS, Machine, MeasuredLoad, SupportId, SupportKind, Supports};
use crate::number::SURE_SIGMAS;

/// Largest age of a sample of a measured load that tells whether its support is set (s).
pub const LOAD_MAX_AGE_S: f64 = 2.0;
/// A support that is told not to be set, and carries this share of the mean load of all feet, is set all the same: a retracted
/// cylinder that presses against its stop measures less.
const CARRIES_SHARE: f64 = 0.25;

/// Status of a support: of a foot whether it is set, of a wheel or a point of a track whether it is raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SupportStatus {
    /// Set, or raised.
    On,
    /// Not set, or not raised.
    Off,
    /// Between two samples that differ.
    Changing,
    /// No sample that is young enough.
    Missing,
    /// Told not to be set, while it carries a load by its own sensor.
    Carries,
}

impl SupportStatus {
    /// Returns the status of a support that is told to be on or off.
    #[must_use]
    pub fn of(on: bool) -> Self {
        if on { Self::On } else { Self::Off }
    }

    /// Returns the status by a number that counts as on from `above` on.
    #[must_use]
    pub fn of_number(number: f64, above: f64) -> Self {
        match number.is_nan() {
            true => Self::Missing,
            false => Self::of(number >= above),
        }
    }

    /// Returns this status combined with the one by the support's measured load.
    #[must_use]
    pub fn beside_load(self, load: Self) -> Self {
        match (self, load) {
            (Self::Off, Self::On) => Self::Carries,
            (told, _) => told,
        }
    }
}

/// The load from which on a support without a switch is set (N).
#[must_use]
pub fn is_set_from(load: &MeasuredLoad) -> f64 {
    SURE_SIGMAS * load.sigma
}

/// The load from which on a support that is told not to be set is set all the same (N).
#[must_use]
pub fn carries_from(machine: &Machine, load: &MeasuredLoad) -> f64 {
    let supports = machine.supports();
    let is_foot = |id: &SupportId| supports.support(*id).kind == SupportKind::Foot;
    let feet = supports.ids().filter(is_foot).count();
    let weight = machine.mass() * machine.gravity();
    (CARRIES_SHARE * weight / feet as f64).max(is_set_from(load))
}

/// Reason for which the supports on the ground are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroundGap {
    /// The weight passes from some supports to others, or one has left the ground.
    Transition,
    /// Supports that were in the air take the weight of the last set that was known: see [`GroundSet::takes_from`].
    Taken,
    /// The signal of this support is missing or too old.
    Missing(SupportId),
    /// This support is told not to be set, while its own sensor measures a load.
    Carries(SupportId),
}

/// Some of a machine's supports: those on the ground.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GroundSet(u16);

const _: () = assert!(MAX_WHEELS <= u16::BITS as usize);

impl GroundSet {
    /// Returns the set as one bit for each support, in the order of [`Supports::all`].
    #[must_use]
    pub fn bits(self) -> u16 {
        self.0
    }

    /// Whether the set contains a support.
    #[must_use]
    pub fn has(self, support: SupportId) -> bool {
        self.0 >> support.index() & 1 == 1
    }

    /// Whether supports of this set that were in the air take the weight of the set before, and none of that one alone has left the
    /// ground: all of them stay, or none does, as where jacks are retracted. In a fall some leave it, and others stay.
    #[must_use]
    pub fn takes_from(self, before: Self) -> bool {
        let [come, gone] = [self.0 & !before.0, before.0 & !self.0];
        come != 0 && (gone == 0 || gone == before.0)
    }

    /// Returns the supports of the set as a list, in their order.
    #[must_use]
    pub fn list(self, supports: &Supports) -> Vec<SupportId> {
        supports.ids().filter(|&id| self.has(id)).collect()
    }
}

impl FromIterator<SupportId> for GroundSet {
    fn from_iter<I: IntoIterator<Item = SupportId>>(supports: I) -> Self {
        let bits = supports.into_iter().map(|support| 1 << support.index());
        Self(bits.fold(0, |bits, bit: u16| bits | bit))
    }
}

/// The supports on the ground.
///
/// # Errors
/// [`GroundGap`] where the status of one support is unknown.
pub fn on_ground(
    supports: &Supports,
    told: &impl Fn(SupportId) -> SupportStatus,
) -> Result<GroundSet, GroundGap> {
    let mut on = GroundSet::default();
    let mut is_changing = false;
    for support in supports.ids() {
        let presence = supports.presence_of(support);
        let is_foot = supports.support(support).kind == SupportKind::Foot;
        let (status, by) = match (is_foot, presence.raised_by.is_empty()) {
            (false, false) => raised_by(&presence.raised_by, told),
            _ => (told(support), support),
        };
        match (status, is_foot) {
            (SupportStatus::On, true) | (SupportStatus::Off, false) => {
                on.0 |= 1 << support.index();
            }
            (SupportStatus::On, false) | (SupportStatus::Off, true) => {}
            (SupportStatus::Changing, _) => is_changing = true,
            (SupportStatus::Missing, _) => return Err(GroundGap::Missing(by)),
            (SupportStatus::Carries, _) => return Err(GroundGap::Carries(by)),
        }
    }
    match is_changing {
        true => Err(GroundGap::Transition),
        false => Ok(on),
    }
}

/// A wheel or track is raised while all of some supports are set: its status, and the first of them that it hangs on.
fn raised_by(
    by: &[SupportId],
    told: &impl Fn(SupportId) -> SupportStatus,
) -> (SupportStatus, SupportId) {
    let all = || by.iter().map(|&support| (told(support), support));
    let is_off = all().find(|(status, _)| *status == SupportStatus::Off);
    let is_open = || all().find(|(status, _)| *status != SupportStatus::On);
    is_off
        .or_else(is_open)
        .unwrap_or((SupportStatus::On, by[0]))
}
