//! `[supports.NAME]`, `[tracks.NAME]` and `raised` of wheels: supports that come and go, as written.
//!
//! Every support is a wheel of the machine: a contact point fixed to a body, with a stiffness, that stands on the
//! ground or not. [`MachineSpec::from_toml`](super::MachineSpec::from_toml) adds them to the wheels.

use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess};

use super::exactly::exactly;
use super::one_of::OneOf;
use super::signals::{FieldSpec, SWITCH_KEYS};

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
    #[serde(deserialize_with = "exactly")]
    pub xyz: [f64; 3],
    /// Distance of the ground from that point (m).
    #[serde(default)]
    pub radius: f64,
    /// Vertical stiffness (N/m), where that of the tyres is stated.
    pub stiffness: Option<f64>,
    /// When the support stands on the ground.
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
    #[serde(deserialize_with = "exactly")]
    pub from: [f64; 3],
    /// The front end.
    #[serde(deserialize_with = "exactly")]
    pub to: [f64; 3],
    /// Number of contact points, evenly spaced, the ends included.
    #[serde(default = "track_points")]
    pub points: usize,
    /// Vertical stiffness of each point (N/m), where that of the tyres is stated.
    pub stiffness: Option<f64>,
    /// When it is off the ground because the machine is jacked.
    pub raised: Option<PresenceSpec>,
    /// The supports that keep it off the ground while all of them are set.
    #[serde(default)]
    pub raised_by: Vec<String>,
}

fn track_points() -> usize {
    TRACK_POINTS
}

/// Condition or times of a support's presence.
#[derive(Debug, Clone, PartialEq)]
pub enum PresenceSpec {
    /// Always or never.
    Always(bool),
    /// Within these spans of time (s after the first sample).
    Spans(Vec<[f64; 2]>),
    /// While a number of the log is above a threshold.
    Signal(SwitchSpec),
}

impl<'de> OneOf<'de> for PresenceSpec {
    const EXPECTED: &'static str = "true, false, a list of spans in seconds [[from, to], ...], such as [[12.0, 80.5]], or a table { topic, \
         field }, such as { topic = \"/outriggers\", field = \"left.set\" }";

    fn of_bool(value: bool) -> Option<Self> {
        Some(Self::Always(value))
    }

    fn of_list<A: SeqAccess<'de>>(list: A) -> Option<Result<Self, A::Error>> {
        let spans = Vec::<Vec<f64>>::deserialize(SeqAccessDeserializer::new(list));
        // read as an array, a list of three numbers would lose one without a word
        let pair = |span: Vec<f64>| {
            <[f64; 2]>::try_from(span)
                .map_err(|span| A::Error::invalid_length(span.len(), &"a start and an end (s)"))
        };
        Some(spans.and_then(|spans| {
            let pairs: Result<Vec<[f64; 2]>, A::Error> = spans.into_iter().map(pair).collect();
            pairs.map(Self::Spans)
        }))
    }

    fn of_table<A: MapAccess<'de>>(table: A) -> Option<Result<Self, A::Error>> {
        let switch = SwitchSpec::deserialize(MapAccessDeserializer::new(table));
        Some(switch.map(Self::Signal))
    }
}

crate::read_one_of!(PresenceSpec);

/// A number of a log that switches.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "toml::Table")]
pub struct SwitchSpec {
    /// The number.
    pub number: FieldSpec,
    /// The value from which it is on.
    pub above: f64,
    /// Age of the last message from which the state is unknown (s).
    pub max_age: f64,
}

impl TryFrom<toml::Table> for SwitchSpec {
    type Error = toml::de::Error;

    fn try_from(mut table: toml::Table) -> Result<Self, Self::Error> {
        let [above, max_age] = SWITCH_KEYS.map(|key| table.remove(key));
        let number = |value: Option<toml::Value>, default: f64| match value {
            Some(value) => value.try_into(),
            None => Ok(default),
        };
        Ok(Self {
            above: number(above, 0.5)?,
            max_age: number(max_age, 2.0)?,
            number: table.try_into()?,
        })
    }
}

/// Kind of a support.
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

/// Origin of a wheel of [`MachineSpec::wheels`](super::MachineSpec::wheels), and when the wheel stands on the ground.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SupportOrigin {
    /// Kind of the support.
    pub kind: SupportKind,
    /// The contact point, or the wheel's centre, on its link (m).
    pub xyz: [f64; 3],
    /// Vertical stiffness (N/m), where its own table states it.
    pub stiffness: Option<f64>,
    /// When the support stands on the ground.
    pub set: Option<PresenceSpec>,
    /// Measured load of the support.
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

impl PresenceSpec {
    /// Whether the support's presence changes with time.
    #[must_use]
    pub fn varies(&self) -> bool {
        !matches!(self, Self::Always(_))
    }
}
