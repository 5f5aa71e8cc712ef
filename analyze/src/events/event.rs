//! Events: kind, time, severity, evidence.

use polars::prelude::{Column, IntoColumn, NewChunkedArray, StringChunked};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tipwatch_language::word;
use tipwatch_mechanics::estimation::rotation::RotationWitness;
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::machine::Policy;

use super::counterfactual::{Answer, Counterfactual};
use crate::base::frame::Field;

/// Rotation about an edge (rad) that turns edge tipping into a tip-over.
pub(crate) const TIP_OVER_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// A finding with a duration. Its fields are the keys of an event in `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Event {
    /// Its kind.
    #[schemars(with = "&'static str")]
    pub kind: EventKind,
    /// Start (ns): the onset found from loads and motion where there is one, else the first row.
    pub start_ns: i64,
    /// Standard deviation of the start (s); null where no onset was found or without uncertainties.
    pub start_sigma_s: Option<f64>,
    /// Whether it began then, or may have begun earlier: rows before it are missing, or the log begins with it.
    #[schemars(with = "&'static str")]
    pub start_bound: Bound,
    /// Whether the machine fell already in the first rows that show the event: the log does not show how that began, and so neither
    /// what took the load nor what would have prevented it.
    #[serde(skip)]
    #[schemars(skip)]
    pub is_under_way: bool,
    /// Last row, or, where the load of a wheel rises through the limit before the next row, or that off an edge through zero, that time
    /// (ns); null if the event is still active when the log ends.
    pub end_ns: Option<i64>,
    /// Standard deviation of that time (s); null where the load is not seen to rise through the limit, or without uncertainties.
    pub end_sigma_s: Option<f64>,
    /// Whether it ended then, or may have gone on: rows after it are missing.
    #[schemars(with = "&'static str")]
    pub end_bound: Bound,
    /// The wheel, edge or signal, in lower case.
    pub subject: String,
    /// The worst value; its kind defines the quantity.
    pub worst: f64,
    /// Time of the worst value (ns).
    pub worst_ns: i64,
    /// Unit of `worst`.
    pub unit: &'static str,
    /// Time (s) from the onset of the `wheel_light` that preceded this event; null without one.
    pub lead_s: Option<f64>,
    /// The wheel of that `wheel_light`.
    #[serde(skip)]
    #[schemars(skip)]
    pub lead_from: Option<String>,
    /// Confidence, 0 to 1: probability that the finding is true if the stated split rule is; null without
    /// uncertainties.
    pub certainty: Option<f64>,
    /// Probability that the finding is true whatever the split: at most `certainty`, equal to it for edges.
    pub certainty_any_split: Option<f64>,
    /// Whether the finding would disappear under another statically admissible load split.
    pub split_dependent: Option<bool>,
    /// For a wheel that lifted, the front axle's share of the roll moment, 0 to 1, at which it would just have stayed on the
    /// ground: the nearest to the stated one; null where no share would have kept it there, and where no share
    /// determines the split.
    pub split_flips_at: Option<f64>,
    /// For a wheel, the smallest and the largest load (N) that equilibrium allows at `judged_ns`.
    pub load_range_n: Option<[f64; 2]>,
    /// For a support whose own sensor shows no load, the mean of what it shows (N).
    pub measured_load_n: Option<f64>,
    /// Time of the row on which the confidence rests (ns).
    pub judged_ns: Option<i64>,
    /// For an edge, the rotation about it since the start, outwards positive: the largest (rad).
    pub rotation_rad: Option<f64>,
    /// For an edge, what shows it.
    #[schemars(with = "Option<&'static str>")]
    pub shown_by: Option<ShownBy>,
    /// For an edge, the rotation about it as gyro and attitude measure it; null where they show none beyond what tyres
    /// and ground explain.
    pub measured_rotation: Option<MeasuredRotation>,
    /// For a wheel, when it was off the ground under any split: the onset of a rotation about an edge (ns).
    pub any_split_ns: Option<i64>,
    /// Causes of the load loss; null for events without a load and models without causes.
    pub causes: Option<EventCauses>,
    /// What would have prevented it, one answer for each supposition that differs from what was recorded.
    pub counterfactuals: Vec<Counterfactual>,
    /// The input fault; null for other kinds of events.
    pub fault: Option<InputFault>,
    /// Signals that contradict each other during the event, so that its sensors may be wrong; null if none do.
    pub doubt: Option<Doubt>,
    /// Encoders on whose sign it rests and whose other sign the motion of the log leaves open: it is in the certainty.
    pub untested: Vec<UntestedSign>,
}

tipwatch_mechanics::named! {
    /// How the time of a start or of an end is meant.
    #[derive(Default)]
    pub enum Bound {
        /// At this time.
        #[default]
        At,
        /// At this time or before it.
        AtOrBefore,
        /// At this time or after it.
        AtOrAfter,
    }
}

/// What casts doubt on an event: signals that contradict each other while it lasts.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Doubt {
    /// The signals.
    pub subjects: Vec<String>,
    /// Probability that the loads are right all the same; it is in the event's certainty.
    pub loads_are_right: f64,
}

/// An encoder of which the motion of the log does not refute that it has the other sign.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UntestedSign {
    /// The joint.
    pub joint: String,
    /// Probability that it has the other sign.
    pub reversed: f64,
    /// Probability of the event if it has, in the row on which the certainty rests.
    pub certainty_if_reversed: f64,
}

tipwatch_mechanics::named! {
    /// What shows a rotation about an edge.
    pub enum ShownBy {
        /// Gyro and attitude: the computed loads do not show it.
        Rotation,
        /// The computed loads: gyro and attitude show no rotation beyond what tyres and ground explain.
        Loads,
        /// Both.
        Both,
    }
}

/// Least probability of an event that is stated as a fact.
pub(crate) const LEAST_OF_A_FACT: f64 = 0.5;

/// A rotation about an edge by gyro and attitude alone.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeasuredRotation {
    /// Which of them shows it.
    #[serde(rename = "shown_by")]
    #[schemars(with = "&'static str")]
    pub witness: RotationWitness,
    /// The edge that the gyro shows, where the attitude shows that of the event: it is about one of both.
    pub other_edge: Option<String>,
    /// Standard deviation of what tyres, ground and sensor explain of it (rad).
    pub sigma_rad: f64,
    /// Whether it began in the log; otherwise the start is the first sample that shows it, or a time before the first row.
    pub onset_in_log: bool,
    /// When it reached 10 degrees (ns).
    pub ten_degrees_ns: Option<i64>,
    /// Rotation since the start at which gravity through the centre of mass passes over the edge: the point of no return
    /// (rad), of the stated machine with `no_return_load_kg` more on its tool; null where the posture at the start is unknown,
    /// and where neither the stated machine nor a load explains the rotation. Of all that is said of a rotation, only this
    /// rests on masses.
    pub no_return_rad: Option<f64>,
    /// Its standard deviation, by those of the masses (rad); null without uncertainties.
    pub no_return_sigma_rad: Option<f64>,
    /// The unstated load on the tool that explains the rotation and that the point of no return contains (kg); null where the
    /// stated machine explains it.
    pub no_return_load_kg: Option<f64>,
    /// When the platform passed it, at the start or later (ns); null if it did not.
    pub no_return_ns: Option<i64>,
    /// Standard deviation of that time (s); null where the platform did not pass it for certain.
    pub no_return_time_sigma_s: Option<f64>,
    /// Since when the machine rested on its side, or earlier (ns).
    pub at_rest_ns: Option<i64>,
    /// Since when it rested between its wheels and its side, while the loads show it on its wheels (ns): the ground gave way
    /// under it, or something that is not measured props it.
    pub rested_ns: Option<i64>,
}

/// An input fault.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct InputFault {
    /// Kind of fault.
    #[schemars(with = "&'static str")]
    pub kind: FaultKind,
    /// What happens to rows that depend on it.
    #[schemars(with = "&'static str")]
    pub policy: Policy,
    /// The limit that the worst value exceeded, in its unit; null for faults without a limit.
    pub limit: Option<f64>,
    /// Number of samples.
    pub samples: u64,
    /// Of signals that contradict each other, what it looks like: "as if ...".
    pub explanation: Option<String>,
    /// Of signals that contradict each other and that the loads rest on, the probability that the loads are right all the
    /// same.
    pub loads_are_right: Option<f64>,
    /// Of signals that contradict each other, since when they may have (ns): the start, or when windows last supported the sensor.
    #[serde(skip)]
    #[schemars(skip)]
    pub possible_since_ns: Option<i64>,
}

impl Event {
    /// Whether gyro and attitude both show the event, whichever edge it is about: then neither loads nor joints are needed to
    /// know of the event.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        let rotation = self.measured_rotation.as_ref();
        rotation.is_some_and(|rotation| rotation.witness.is_both())
    }

    /// The other edge that it may be about.
    pub(crate) fn other_edge(&self) -> Option<&str> {
        self.measured_rotation.as_ref()?.other_edge.as_deref()
    }

    /// Whether the event is more probable than not; an event without a probability rests on measurements.
    pub(crate) fn is_fact(&self) -> bool {
        self.certainty.is_none_or(|p| p >= LEAST_OF_A_FACT)
    }

    /// Whether a measured rotation may as well be that of ground which gave way under the machine: then the event is neither certain
    /// nor excluded.
    pub(crate) fn is_open(&self) -> bool {
        let is_as_likely = !self.is_fact() && Answer::of(self.certainty) == Answer::Open;
        let rotation = self.measured_rotation.as_ref();
        rotation.is_some_and(|rotation| rotation.rested_ns.is_some() || is_as_likely)
    }

    /// Whether the log ends while the machine tips about an edge, before it has tipped over.
    pub(crate) fn is_undecided(&self) -> bool {
        let rotation = self.rotation_rad.unwrap_or(0.0);
        self.kind == EventKind::EdgeTipping && self.end_ns.is_none() && rotation < TIP_OVER_RAD
    }

    /// Its time, first and last (ns); without an end, all that follows.
    pub(crate) fn span_ns(&self) -> [i64; 2] {
        [self.start_ns, self.end_ns.unwrap_or(i64::MAX)]
    }

    /// Whether a part of the event is in this time, first and last (ns).
    pub(crate) fn overlaps(&self, [from_ns, to_ns]: [i64; 2]) -> bool {
        let [start_ns, end_ns] = self.span_ns();
        from_ns <= end_ns && start_ns <= to_ns
    }

    /// Whether the log does not show how the event began: it was under way when the rows begin, or the machine tipped over behind rows
    /// that are missing.
    pub(crate) fn hides_onset(&self) -> bool {
        let is_behind_hole = self.start_bound == Bound::AtOrBefore;
        self.is_under_way || (self.kind == EventKind::TipOver && is_behind_hole)
    }

    /// Whether the event is a part of a fall whose onset the log does not show: that fall itself, or what happened in it.
    pub(crate) fn is_of_fall_under_way(&self, events: &[Self]) -> bool {
        self.hides_onset() || Self::is_in_fall_under_way(events, self.start_ns)
    }

    /// Returns the sentence that replaces causes and advice for a fall whose onset the log does not show.
    pub(crate) fn onset_not_shown() -> &'static str {
        word!(
            "The log does not show the onset: what took the load, and what would have prevented it, cannot be told."
        )
    }

    /// Whether a time (ns) lies in a fall whose onset the log does not show, or may, by two standard deviations.
    pub(crate) fn is_in_fall_under_way(events: &[Self], time_ns: i64) -> bool {
        events.iter().any(|fall| {
            let is_fall = matches!(fall.kind, EventKind::EdgeTipping | EventKind::TipOver);
            let is_unseen = is_fall && fall.hides_onset() && fall.is_fact();
            let band_ns = (2e9 * fall.start_sigma_s.unwrap_or(0.0)) as i64;
            is_unseen && fall.overlaps([time_ns, time_ns.saturating_add(band_ns)])
        })
    }

    /// Whether the event states something of the machine that would be wrong with its loads.
    pub(crate) fn rests_on_loads(&self) -> bool {
        self.kind.is_observed() && !self.is_measured()
    }

    /// Multiplies its certainty by the probability that its loads are right although these subjects contradict each other.
    pub(crate) fn doubt_by(&mut self, subjects: Vec<String>, loads_are_right: f64) {
        for certainty in [&mut self.certainty, &mut self.certainty_any_split] {
            *certainty = certainty.map(|certainty| certainty * loads_are_right);
        }
        let doubt = self.doubt.get_or_insert(Doubt {
            subjects: Vec::new(),
            loads_are_right: 1.0,
        });
        doubt.subjects.extend(subjects);
        doubt.loads_are_right *= loads_are_right;
    }
}

/// Causes of the load loss (OTF) of an event's wheels up to its onset. What follows the onset, such as the
/// rotation of a machine that tips over, is a consequence and is left out.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EventCauses {
    /// Start of the comparison (ns): the end of the last half second without acceleration and joint motion, or two
    /// seconds before the end of the comparison if there is none.
    pub since_ns: i64,
    /// Whether the machine was steady then.
    pub since_is_steady: bool,
    /// End of the comparison: the last row up to the onset (ns).
    pub at_ns: i64,
    /// OTF of the wheels at the start (N).
    pub otf_before_n: f64,
    /// OTF of the wheels at the end (N).
    pub otf_n: f64,
    /// Shares of the causes, the largest first; negative where a cause added load. They add up to 100 %.
    pub shares: Vec<CauseShare>,
}

impl MeasuredRotation {
    /// A rotation that began in the log, of which only the witness and its standard deviation are known.
    pub(super) fn blank(witness: RotationWitness, sigma_rad: f64) -> Self {
        Self {
            witness,
            other_edge: None,
            sigma_rad,
            onset_in_log: true,
            ten_degrees_ns: None,
            no_return_rad: None,
            no_return_sigma_rad: None,
            no_return_load_kg: None,
            no_return_ns: None,
            no_return_time_sigma_s: None,
            at_rest_ns: None,
            rested_ns: None,
        }
    }
}

impl EventCauses {
    /// Whether load was lost since the start of the comparison.
    pub(crate) fn is_loss(&self) -> bool {
        self.otf_before_n > self.otf_n
    }
}

/// Share of one cause.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CauseShare {
    /// Name of the cause, as in the column names.
    pub cause: &'static str,
    /// OTF that it removed (N); negative if it added load.
    pub taken_n: f64,
    /// The same as a percentage of the total loss.
    pub percent: f64,
}

tipwatch_mechanics::named! {
    /// Kinds of events.
    #[derive(PartialOrd, Ord, clap::ValueEnum, Deserialize)]
    #[value(rename_all = "snake_case")]
    #[serde(rename_all = "snake_case")]
    pub enum EventKind {
        /// A wheel's load is below the limit; `worst` is the lowest load (N).
        WheelLight,
        /// A wheel carries no load; `worst` is the lowest OTF (N).
        WheelLift,
        /// All wheels off an edge carry no load, shown by the loads alone or by a rotation about the edge while
        /// they are within their error of zero; `worst` is the largest overturning moment (N m).
        EdgeTipping,
        /// Edge tipping in which the platform rotates outwards about the edge by 10 degrees or more, or for certain beyond the
        /// point of no return and never back; `worst` is the rotation (rad).
        TipOver,
        /// A signal is missing for longer than the estimator bridges; `worst` is the duration (s).
        InputGap,
        /// A signal is implausible; the kind of fault defines `worst`. Unlike the others it is listed
        /// however short it is.
        InputFault,
        /// Between the rows of a sparse log, motion within the greatest rates and accelerations can have lifted the
        /// wheel; `worst` is the smallest OTF that they allow (N). Not a finding that it lifted.
        LiftNotExcluded,
    }
}

impl Event {
    /// An event of which only kind, start and subject are known.
    #[must_use]
    pub fn blank(kind: EventKind, start_ns: i64, subject: String) -> Self {
        Self {
            kind,
            start_ns,
            start_sigma_s: None,
            start_bound: Bound::At,
            is_under_way: false,
            end_ns: None,
            end_sigma_s: None,
            end_bound: Bound::At,
            subject,
            worst: f64::NAN,
            worst_ns: start_ns,
            unit: "-",
            lead_s: None,
            lead_from: None,
            certainty: None,
            certainty_any_split: None,
            split_dependent: None,
            split_flips_at: None,
            load_range_n: None,
            measured_load_n: None,
            judged_ns: None,
            rotation_rad: None,
            shown_by: None,
            measured_rotation: None,
            any_split_ns: None,
            causes: None,
            counterfactuals: Vec::new(),
            fault: None,
            doubt: None,
            untested: Vec::new(),
        }
    }
}

impl Event {
    /// The order of events where only the first are shown: facts first, the gravest, the earliest.
    pub(crate) fn importance(&self) -> (bool, usize, i64) {
        (!self.is_fact(), self.kind.rank(), self.start_ns)
    }

    /// Returns the severity among events of the same kind: the larger, the worse. Not comparable between kinds.
    pub(crate) fn severity(&self) -> f64 {
        let severity = match self.kind {
            EventKind::WheelLight | EventKind::WheelLift | EventKind::LiftNotExcluded => {
                -self.worst
            }
            EventKind::EdgeTipping | EventKind::TipOver | EventKind::InputGap => self.worst,
            // `worst` has another meaning for each kind of fault
            EventKind::InputFault => {
                (self.fault.as_ref()).map_or(0.0, |fault| fault.samples as f64)
            }
        };
        match severity.is_nan() {
            true => f64::NEG_INFINITY,
            false => severity,
        }
    }
}

impl Field for EventKind {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        let names = values.map(|kind| kind.name());
        StringChunked::from_iter_values(name.into(), names).into_column()
    }
}

impl EventKind {
    /// Whether the event concerns the machine's stability, not the log.
    #[must_use]
    pub fn is_stability(self) -> bool {
        match self {
            Self::WheelLight
            | Self::WheelLift
            | Self::EdgeTipping
            | Self::TipOver
            | Self::LiftNotExcluded => true,
            Self::InputGap | Self::InputFault => false,
        }
    }

    /// The smaller, the more important.
    pub(crate) fn rank(self) -> usize {
        match self {
            Self::TipOver => 0,
            Self::EdgeTipping => 1,
            Self::WheelLift => 2,
            Self::WheelLight => 3,
            Self::LiftNotExcluded => 4,
            Self::InputGap => 5,
            Self::InputFault => 6,
        }
    }

    /// Whether the event means that a wheel is off the ground.
    pub(crate) fn is_lift(self) -> bool {
        matches!(self, Self::WheelLift | Self::EdgeTipping | Self::TipOver)
    }

    /// Whether rows show that the event happened: neither a mere possibility between rows, nor a matter of the log.
    #[must_use]
    pub fn is_observed(self) -> bool {
        self.is_stability() && self != Self::LiftNotExcluded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(kind: EventKind, span_s: [i64; 2]) -> Event {
        let [start_ns, end_ns] = span_s.map(|s| s * 1_000_000_000);
        Event {
            end_ns: Some(end_ns),
            ..Event::blank(kind, start_ns, "left".into())
        }
    }

    #[test]
    fn a_fact_comes_before_a_graver_event_that_is_none() {
        let event = |kind, start_ns, certainty| Event {
            certainty,
            ..Event::blank(kind, start_ns, "fl".into())
        };
        let mut events = [
            event(EventKind::TipOver, 1, Some(0.3)),
            event(EventKind::WheelLight, 2, None),
            event(EventKind::WheelLift, 4, Some(0.9)),
            event(EventKind::WheelLift, 3, Some(0.6)),
        ];
        events.sort_by_key(Event::importance);
        assert_eq!(events.map(|event| event.start_ns), [3, 4, 2, 1]);
    }

    #[test]
    fn the_worst_kind_comes_first() {
        use EventKind::{EdgeTipping, InputGap, TipOver, WheelLift, WheelLight};
        let mut kinds = [InputGap, WheelLight, TipOver, WheelLift, EdgeTipping];
        kinds.sort_by_key(|kind| kind.rank());
        assert_eq!(
            kinds,
            [TipOver, EdgeTipping, WheelLift, WheelLight, InputGap]
        );
    }

    #[test]
    fn a_measured_rotation_as_likely_of_the_ground_as_of_a_fall_is_open() {
        let rotated = |certainty: f64, rested_ns| Event {
            certainty: Some(certainty),
            measured_rotation: Some(MeasuredRotation {
                ten_degrees_ns: Some(4),
                rested_ns,
                ..MeasuredRotation::blank(RotationWitness::GyroAlone, 0.01)
            }),
            ..event(EventKind::TipOver, [3, 9])
        };
        assert!(rotated(0.499_95, None).is_open() && rotated(0.9, Some(5)).is_open());
        assert!(!rotated(0.9, None).is_open() && !rotated(1e-6, None).is_open());
        let by_loads = Event {
            measured_rotation: None,
            ..rotated(0.499_95, None)
        };
        assert!(!by_loads.is_open());
    }

    #[test]
    fn what_happens_in_a_fall_that_was_under_way_is_a_part_of_it() {
        let seen = event(EventKind::EdgeTipping, [0, 9]);
        let unseen = Event {
            is_under_way: true,
            ..seen.clone()
        };
        let unlikely = Event {
            certainty: Some(0.3),
            ..unseen.clone()
        };
        let [within, later] = [[4, 5], [10, 11]].map(|span_s| event(EventKind::WheelLift, span_s));
        assert!(within.is_of_fall_under_way(std::slice::from_ref(&unseen)));
        assert!(!later.is_of_fall_under_way(std::slice::from_ref(&unseen)));
        for fall in [seen, unlikely] {
            assert!(!within.is_of_fall_under_way(&[fall]));
        }
        assert!(unseen.is_of_fall_under_way(&[]));
    }

    #[test]
    fn a_fall_behind_missing_rows_hides_its_onset_and_what_is_in_its_band() {
        let over = Event {
            start_bound: Bound::AtOrBefore,
            start_sigma_s: Some(1.0),
            ..event(EventKind::TipOver, [5, 9])
        };
        let falls = std::slice::from_ref(&over);
        assert!(over.hides_onset());
        let lift = |span_s| event(EventKind::WheelLift, span_s).is_of_fall_under_way(falls);
        assert!(lift([5, 9]) && lift([4, 9]) && !lift([2, 9]));
        let shown = Event {
            start_bound: Bound::At,
            ..over.clone()
        };
        assert!(!shown.hides_onset());
        // a tipping that stays one is judged by its rows
        let tipping = Event {
            start_bound: Bound::AtOrBefore,
            ..event(EventKind::EdgeTipping, [5, 9])
        };
        assert!(!tipping.hides_onset());
    }
}
