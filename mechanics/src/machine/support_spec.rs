//! `[supports.NAME]`, `[tracks.NAME]` and `raised` of wheels: supports that come and go, as written.
//!
//! Every support is a wheel of the machine: a contact point fixed to a body, with a stiffness, that stands on the
//! ground or not. [`MachineSpec::from_toml`](super::MachineSpec::from_toml) adds them to the wheels.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::signals::FieldSpec;
use super::spec::{MachineSpec, WheelSpec};
use super::{MAX_WHEELS, MachineError};

/// Contact points of a track that states no number of them.
const TRACK_POINTS: usize = 3;

/// `[supports.NAME]`: an outrigger, a stabiliser, a blade, a fork or a tool that can stand on the ground.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportSpec {
    /// The link that carries the contact point.
    pub link: String,
    /// The contact point on that link (m).
    #[serde(default)]
    pub xyz: [f64; 3],
    /// Distance of the ground from that point (m).
    #[serde(default)]
    pub radius: f64,
    /// Vertical stiffness (N/m), where that of the tyres is stated.
    pub stiffness: Option<f64>,
    /// When it stands on the ground.
    pub set: Option<PresenceSpec>,
    /// Field of its measured load (N).
    pub force: Option<FieldSpec>,
    /// Standard deviation of one sample of that load (N).
    #[serde(default = "force_sigma")]
    pub force_sigma: f64,
    /// Standard deviation of its friction, as a fraction of the load.
    #[serde(default = "friction_share")]
    pub friction_share: f64,
}

fn force_sigma() -> f64 {
    500.0
}

fn friction_share() -> f64 {
    0.03
}

/// `[tracks.NAME]`: a track, which stands on the ground along its length.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackSpec {
    /// The link that carries it.
    pub link: String,
    /// The rear end of its contact line on that link (m).
    pub from: [f64; 3],
    /// The front end.
    pub to: [f64; 3],
    /// Number of contact points, evenly spaced, the ends included.
    #[serde(default = "track_points")]
    pub points: usize,
    /// Vertical stiffness of each point (N/m), where that of the tyres is stated.
    pub stiffness: Option<f64>,
}

fn track_points() -> usize {
    TRACK_POINTS
}

/// When something is the case.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "true, false, a list of spans [[from, to], ...] in seconds, or a table { topic, field }"
)]
pub enum PresenceSpec {
    /// Always or never.
    Always(bool),
    /// Within these spans of time (s after the first sample).
    Spans(Vec<[f64; 2]>),
    /// While a number of the log is above a threshold.
    Signal(SwitchSpec),
}

/// A number of a log that switches.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SwitchSpec {
    /// Topic, of any type.
    pub topic: String,
    /// Path of the number in its messages.
    pub field: Option<String>,
    /// The name whose index in a list of names selects the number.
    pub joint: Option<String>,
    /// Factor applied to the number.
    #[serde(default = "one")]
    pub scale: f64,
    /// Offset added after scaling.
    #[serde(default)]
    pub offset: f64,
    /// The value from which it is on.
    #[serde(default = "half")]
    pub above: f64,
    /// Age of the last message from which the state is unknown (s).
    #[serde(default = "max_age")]
    pub max_age: f64,
}

fn one() -> f64 {
    1.0
}

fn half() -> f64 {
    0.5
}

fn max_age() -> f64 {
    2.0
}

impl SwitchSpec {
    /// The number.
    #[must_use]
    pub fn number(&self) -> FieldSpec {
        FieldSpec {
            topic: self.topic.clone(),
            field: self.field.clone(),
            joint: self.joint.clone(),
            scale: self.scale,
            offset: self.offset,
        }
    }
}

/// What a support is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SupportKind {
    /// A wheel, caster or skid of `[wheels]`.
    #[default]
    Wheel,
    /// A support of `[supports]`.
    Foot,
    /// A point of a track.
    TrackPoint,
}

impl SupportKind {
    /// The table of the machine file that it is from.
    #[must_use]
    pub fn table(self) -> &'static str {
        match self {
            Self::Wheel => "wheels",
            Self::Foot => "supports",
            Self::TrackPoint => "tracks",
        }
    }
}

/// How a wheel of [`MachineSpec::wheels`] came about, and when it stands on the ground.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SupportOrigin {
    /// What it is.
    pub kind: SupportKind,
    /// The contact point, or the wheel's centre, on its link (m).
    pub xyz: [f64; 3],
    /// Vertical stiffness (N/m), where its own table states it.
    pub stiffness: Option<f64>,
    /// When it stands on the ground.
    pub set: Option<PresenceSpec>,
    /// Its measured load.
    pub force: Option<MeasuredLoad>,
}

/// The measured load of a support.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredLoad {
    /// The number of the log (N).
    pub field: FieldSpec,
    /// Standard deviation of one sample (N).
    pub sigma: f64,
    /// Standard deviation of the friction, as a fraction of the load.
    pub friction_share: f64,
}

impl MachineSpec {
    /// Makes wheels of the supports and tracks.
    pub(super) fn add_supports(&mut self) -> Result<(), MachineError> {
        for (name, support) in std::mem::take(&mut self.supports) {
            let place = format!("supports.{name}");
            if support.set.is_none() && support.force.is_none() {
                let expected = "set = true, spans of time or a signal, or force = { topic, field }";
                return Err(MachineError::value(&self.file, place, expected, "neither"));
            }
            let wheel = WheelSpec {
                link: support.link,
                radius: support.radius,
                raised: None,
                raised_by: Vec::new(),
                origin: SupportOrigin {
                    kind: SupportKind::Foot,
                    xyz: support.xyz,
                    stiffness: support.stiffness,
                    set: support.set,
                    force: support.force.map(|field| MeasuredLoad {
                        field,
                        sigma: support.force_sigma,
                        friction_share: support.friction_share,
                    }),
                },
            };
            self.add_support(&place, name, wheel)?;
        }
        for (name, track) in std::mem::take(&mut self.tracks) {
            let place = format!("tracks.{name}");
            if !(2..=MAX_WHEELS / 2).contains(&track.points) {
                let expected = format!("2 to {} points", MAX_WHEELS / 2);
                let place = format!("{place}.points");
                return Err(MachineError::value(
                    &self.file,
                    place,
                    expected,
                    track.points,
                ));
            }
            for point in 0..track.points {
                let share = point as f64 / (track.points - 1) as f64;
                let along = |k: usize| track.from[k] + share * (track.to[k] - track.from[k]);
                let wheel = WheelSpec {
                    link: track.link.clone(),
                    radius: 0.0,
                    raised: None,
                    raised_by: Vec::new(),
                    origin: SupportOrigin {
                        kind: SupportKind::TrackPoint,
                        xyz: std::array::from_fn(along),
                        stiffness: track.stiffness,
                        ..SupportOrigin::default()
                    },
                };
                self.add_support(&place, format!("{name}_{}", point + 1), wheel)?;
            }
        }
        Ok(())
    }

    fn add_support(
        &mut self,
        place: &str,
        name: String,
        wheel: WheelSpec,
    ) -> Result<(), MachineError> {
        if self.wheels.contains_key(&name) {
            let expected = "names that no other wheel, support or track has";
            return Err(MachineError::value(
                &self.file,
                place,
                expected,
                format!("\"{name}\" twice"),
            ));
        }
        self.wheels.insert(name, wheel);
        Ok(())
    }
}

/// The supports and tracks of a machine file by name.
pub(super) type ByName<T> = BTreeMap<String, T>;

impl PresenceSpec {
    /// Whether it changes with time.
    #[must_use]
    pub fn varies(&self) -> bool {
        !matches!(self, Self::Always(_))
    }
}
