//! Which supports are on the ground by the samples so far.

use super::status::{
    GroundGap, GroundSet, LOAD_MAX_AGE_S, SupportStatus, carries_from, is_set_from, on_ground,
};
use crate::machine::{ForceSource, Machine, PresenceSpec, SupportId, SupportKind};
use crate::state::{NumberKind, Sample, SampleError, Sensor, Sensors};

/// Follows the supports of one machine by past samples only.
///
/// A set is unknown for the time of transition after each change. That the weight passed already before the switch told so
/// is known afterwards only: an analysis of the whole log leaves that time unknown, too.
#[derive(Debug, Clone)]
pub struct SupportWatch {
    /// Last sample of each switch.
    switches: Vec<LastNumber>,
    /// Sources of each support's status.
    watched: Vec<Watched>,
    /// The support whose load each actuator signal measures.
    loads_of: Vec<Option<usize>>,
    /// Stamp from which spans of time count (ns); without it they tell nothing.
    spans_from_ns: Option<i64>,
    transition_ns: i64,
    /// The last set that was known.
    known: Option<GroundSet>,
    /// Stamp at which that set followed another one (ns).
    changed_ns: Option<i64>,
    /// The last set on which the machine stood for certain: that before a transition.
    stood_on: Option<GroundSet>,
}

/// The sources of a support's status.
#[derive(Debug, Clone)]
struct Watched {
    is_foot: bool,
    told: StatusSource,
    /// Measured load of the support; the support is set, or carries although it is told not to be set, from a threshold on.
    load: Option<LastNumber>,
    /// Whether the support was set by its load alone, and was not taken back since.
    is_kept: bool,
}

#[derive(Debug, Clone)]
enum StatusSource {
    Always(bool),
    /// Spans of time (ns) after the first sample.
    Spans(Vec<[i64; 2]>),
    /// The switch with this index.
    Switch(usize),
    /// Its measured load alone.
    Load,
}

/// The last sample of a number that switches.
#[derive(Debug, Clone)]
struct LastNumber {
    above: f64,
    max_age_ns: i64,
    /// Its stamp (ns) and value.
    last: Option<(i64, f64)>,
}

impl LastNumber {
    fn new(above: f64, max_age_s: f64) -> Self {
        Self {
            above,
            max_age_ns: nanoseconds(max_age_s),
            last: None,
        }
    }

    fn take(&mut self, stamp_ns: i64, value: f64) -> Result<(), SampleError> {
        if self.last.is_some_and(|(last_ns, _)| stamp_ns <= last_ns) {
            return Err(SampleError::NotLater);
        }
        self.last = Some((stamp_ns, value));
        match value.is_nan() {
            true => Err(SampleError::NotFinite),
            false => Ok(()),
        }
    }

    fn at(&self, time_ns: i64) -> SupportStatus {
        match self.last {
            Some((stamp_ns, value)) if time_ns.saturating_sub(stamp_ns) < self.max_age_ns => {
                SupportStatus::of_number(value, self.above)
            }
            _ => SupportStatus::Missing,
        }
    }
}

fn nanoseconds(seconds: f64) -> i64 {
    // a number beyond the range saturates
    (seconds * 1e9).round() as i64
}

impl SupportWatch {
    /// A watch that has seen nothing; `None` for a machine that is always on the same supports.
    #[must_use]
    pub fn new(machine: &Machine, sensors: &Sensors) -> Option<Self> {
        let supports = machine.supports();
        if !supports.vary() {
            return None;
        }
        let switches = supports.switches.iter();
        let switches = switches.map(|it| LastNumber::new(it.spec.above, it.spec.max_age));
        let switch_of = |support: SupportId| {
            let mut switches = supports.switches.iter();
            switches.position(|switch| switch.supports.contains(&support))
        };
        let watched = supports.ids().map(|support| {
            let presence = supports.presence_of(support);
            let is_foot = supports.support(support).kind == SupportKind::Foot;
            let told = match (&presence.told, switch_of(support)) {
                (Some(PresenceSpec::Always(on)), _) => StatusSource::Always(*on),
                (Some(PresenceSpec::Spans(spans)), _) => {
                    StatusSource::Spans(spans.iter().map(|span| span.map(nanoseconds)).collect())
                }
                (Some(PresenceSpec::Signal(_)), Some(switch)) => StatusSource::Switch(switch),
                _ if presence.load.is_some() => StatusSource::Load,
                // a wheel or track that is never raised
                _ => StatusSource::Always(is_foot),
            };
            let load = presence.load.as_ref().map(|load| {
                let above = match &told {
                    StatusSource::Load => is_set_from(load),
                    _ => carries_from(machine, load),
                };
                LastNumber::new(above, LOAD_MAX_AGE_S)
            });
            Watched {
                is_foot,
                told,
                load,
                is_kept: false,
            }
        });
        let joints = &machine.contact().actuated_joints;
        let support_of = |source: &ForceSource| match source {
            ForceSource::Support { support, .. } => Some(support.index()),
            ForceSource::Linkage(_) => None,
        };
        let loads_of = sensors.actuators.iter();
        let loads_of = loads_of.map(|signal| support_of(&joints[signal.joint].source));
        Some(Self {
            switches: switches.collect(),
            watched: watched.collect(),
            loads_of: loads_of.collect(),
            spans_from_ns: None,
            transition_ns: nanoseconds(supports.transition_s),
            known: None,
            changed_ns: None,
            stood_on: None,
        })
    }

    /// The stamp from which the spans of time of the machine file count (ns): the first of the log.
    pub fn count_spans_from(&mut self, start_ns: i64) {
        self.spans_from_ns = Some(start_ns);
    }

    /// Whether an actuator's signal measures the load of a support that is in the air while this set is on the ground, as a
    /// source other than that load tells.
    #[must_use]
    pub(crate) fn is_idle(&self, machine: &Machine, signal: usize, set: GroundSet) -> bool {
        let support = self.loads_of.get(signal).copied().flatten();
        let mut ids = machine.supports().ids();
        let id = support.and_then(|support| ids.find(|id| id.index() == support));
        id.is_some_and(|id| {
            !set.has(id) && !matches!(self.watched[id.index()].told, StatusSource::Load)
        })
    }

    /// Takes a sample; all but switches and measured loads of supports say nothing here.
    ///
    /// # Errors
    /// [`SampleError`] where a switch does not tell anything by it.
    pub fn take(&mut self, machine: &Machine, sample: &Sample<'_>) -> Result<(), SampleError> {
        let number = match sample.sensor {
            Sensor::Number(NumberKind::Switch, switch) => self.switches.get_mut(switch),
            Sensor::Number(NumberKind::Actuator, signal) => {
                let support = self.loads_of.get(signal).copied().flatten();
                let Some(support) = support else {
                    return Ok(());
                };
                self.watched[support].load.as_mut()
            }
            _ => return Ok(()),
        };
        let (Some(number), &[value]) = (number, sample.values) else {
            return Err(SampleError::UnknownSensor);
        };
        let taken = number.take(sample.stamp_ns, value);
        // a set that is over before the next row is a change, too
        let _ = self.follow(machine, sample.stamp_ns);
        taken
    }

    /// The supports on the ground at a time that is not before the last one (ns).
    ///
    /// # Errors
    /// They are unknown.
    pub fn at(&mut self, machine: &Machine, time_ns: i64) -> Result<GroundSet, GroundGap> {
        let set = self.follow(machine, time_ns)?;
        let in_transition =
            |changed_ns: i64| (time_ns.saturating_sub(changed_ns)) < self.transition_ns;
        if self.changed_ns.is_some_and(in_transition) {
            let takes = self.stood_on.is_some_and(|before| set.takes_from(before));
            return Err(match takes {
                true => GroundGap::Taken,
                false => GroundGap::Transition,
            });
        }
        self.stood_on = Some(set);
        Ok(set)
    }

    /// Returns the set at a time, new or not, and follows it.
    fn follow(&mut self, machine: &Machine, time_ns: i64) -> Result<GroundSet, GroundGap> {
        self.keep_set(time_ns);
        let told = |support: SupportId| self.status(support.index(), time_ns);
        let set = on_ground(machine.supports(), &told)?;
        if self.known.replace(set).is_some_and(|known| known != set) {
            self.changed_ns = Some(time_ns);
        }
        Ok(set)
    }

    /// A foot whose load alone tells whether it is set stays set where it carries nothing while another one stays set: it was
    /// lifted, or its load passed to others. Whoever takes it back takes all of them back. If it was taken back alone,
    /// its load contradicts equilibrium.
    fn keep_set(&mut self, time_ns: i64) {
        for support in 0..self.watched.len() {
            if !matches!(self.watched[support].told, StatusSource::Load) {
                continue;
            }
            match self.by_signal(support, time_ns) {
                SupportStatus::On => self.watched[support].is_kept = true,
                SupportStatus::Off => {
                    let others = (0..self.watched.len()).filter(|&other| other != support);
                    let mut feet = others.filter(|&other| self.watched[other].is_foot);
                    let stays = feet.any(|it| self.by_signal(it, time_ns) == SupportStatus::On);
                    self.watched[support].is_kept &= stays;
                }
                _ => {}
            }
        }
    }

    fn status(&self, support: usize, time_ns: i64) -> SupportStatus {
        match self.by_signal(support, time_ns) {
            SupportStatus::Off if self.watched[support].is_kept => SupportStatus::On,
            status => status,
        }
    }

    /// Returns the status of a support by its switch, time spans and measured load at a time, regardless of its earlier status.
    fn by_signal(&self, support: usize, time_ns: i64) -> SupportStatus {
        let watched = &self.watched[support];
        let load = watched.load.as_ref().map(|load| load.at(time_ns));
        let told = match &watched.told {
            StatusSource::Always(on) => SupportStatus::of(*on),
            StatusSource::Switch(switch) => self.switches[*switch].at(time_ns),
            StatusSource::Spans(spans) => match self.spans_from_ns {
                None => SupportStatus::Missing,
                Some(start_ns) => {
                    let since_ns = time_ns.saturating_sub(start_ns);
                    let is_within = |[from, to]: &[i64; 2]| (*from..*to).contains(&since_ns);
                    SupportStatus::of(spans.iter().any(is_within))
                }
            },
            StatusSource::Load => return load.unwrap_or(SupportStatus::Missing),
        };
        match load {
            Some(load) if watched.is_foot => told.beside_load(load),
            _ => told,
        }
    }
}
