//! The facts of an analysis that findings use besides the event.

use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{JointCoupling, Machine, SupportKind};
use tipwatch_mechanics::number::SURE_SIGMAS;

use crate::analysis::{Analysis, Input};
use crate::events::split_rule::{is_stated, sharing, split_rule};
use crate::events::support_words::{SupportWord, edge_word};
use crate::events::{Event, EventCauses, EventKind, MERGED_NS};
use crate::page::{input_in_words, percent};
use crate::report::deciding::Deciding;

/// The facts of the analysis that findings use besides the event.
pub(in crate::report) struct Scene {
    pub(super) start_ns: i64,
    pub(super) wheels: Vec<WheelFacts>,
    /// To follow "if".
    pub(super) split_rule: String,
    /// To follow "how the".
    pub(super) sharing: String,
    /// Word for a support of the machine.
    pub(in crate::report) word: SupportWord,
    /// Whether the machine file states the quantities that determine the split: flat ground and the tyres' stiffness.
    pub(super) is_split_stated: bool,
    /// Onsets of rotations that the machine as stated does not explain (ns).
    pub(super) unexplained_ns: Vec<i64>,
    pub(in crate::report) is_sparse: bool,
    /// Whether the log goes on after the last row.
    pub(in crate::report) goes_on: bool,
    pub(super) inputs: Vec<InputFacts>,
    /// Axles that swing, by the edge that they are astride.
    pub(super) stops: Vec<AxleStop>,
}

/// Swing of an axle until its wheel off an edge leaves the ground with the machine that tips about the edge.
pub(super) struct AxleStop {
    /// Name of the edge.
    edge: String,
    /// The wheels, in words.
    wheels: Vec<String>,
    /// Stops of the axle's joint, least and most (rad).
    limits_rad: [f64; 2],
}

impl AxleStop {
    /// Whether a rotation of the platform, with its standard deviation (rad), is for certain more than the axle can swing,
    /// wherever it stood and to whichever side it swings: the whole way between its stops.
    fn is_passed(&self, rotation_rad: f64, sigma_rad: f64) -> bool {
        let [least, most] = self.limits_rad;
        rotation_rad - SURE_SIGMAS * sigma_rad > most - least
    }

    fn all(machine: &Machine) -> Vec<Self> {
        let edges = machine.polygon().edges().iter();
        let stops = edges.flat_map(|edge| {
            let axles = machine.axles_astride(edge);
            axles.filter_map(move |axle| {
                let JointCoupling::Measured(joint) = machine.bodies()[axle.body].coupling else {
                    return None;
                };
                let limits_rad = machine.joints()[joint].limits?;
                let wheels = machine.wheels().iter().enumerate();
                let off = wheels
                    .filter(|(wheel, _)| axle.supports_wheel[*wheel] && !edge.carries[*wheel]);
                Some(Self {
                    edge: edge.name.clone(),
                    wheels: off.map(|(_, wheel)| SupportWord::named(wheel)).collect(),
                    limits_rad,
                })
            })
        });
        stops.collect()
    }
}

/// Source of the numbers of a signal.
pub(super) struct InputFacts {
    /// Its name, as events have it.
    pub(super) subject: String,
    pub(super) topic: String,
    pub(super) type_name: String,
    pub(super) rate_hz: Option<f64>,
}

pub(super) struct WheelFacts {
    pub(super) name: String,
    pub(super) kind: SupportKind,
    pub(super) static_n: f64,
    pub(super) limit_n: Option<f64>,
    /// Measurements that would decide the wheel's load where equilibrium leaves it open.
    pub(super) deciding: Vec<Deciding>,
}

impl InputFacts {
    fn of(input: &Input) -> Self {
        Self {
            subject: input.subject.clone(),
            topic: input.topic.clone(),
            type_name: input.type_name.clone(),
            rate_hz: input.timing.rate_hz,
        }
    }
}

impl Scene {
    /// The wheels of axles astride the edge of a measured rotation that leave the ground because it goes beyond their stops, in
    /// words.
    pub(in crate::report) fn off_by_stops(&self, event: &Event) -> Vec<String> {
        let sigma_rad = event.measured_rotation.as_ref().map(|it| it.sigma_rad);
        let Some((rotation_rad, sigma_rad)) = event.rotation_rad.zip(sigma_rad) else {
            return Vec::new();
        };
        let beyond = self.stops.iter().filter(|stop| {
            stop.edge.eq_ignore_ascii_case(&event.subject)
                && stop.is_passed(rotation_rad, sigma_rad)
        });
        beyond.flat_map(|stop| stop.wheels.clone()).collect()
    }

    pub(in crate::report) fn of(analysis: &Analysis) -> Self {
        let machine = &analysis.machine;
        let limits = analysis.min_loads_n.as_deref().unwrap_or_default();
        let wheels = machine.wheels().iter().enumerate();
        let wheels = wheels.map(|(wheel, facts)| WheelFacts {
            name: facts.name.clone(),
            kind: facts.kind,
            static_n: machine.reference().static_load[wheel],
            limit_n: limits.get(wheel).copied(),
            deciding: Deciding::of(analysis, &[wheel]),
        });
        let unexplained = analysis.explained_falls.iter();
        let unexplained = unexplained.filter(|fall| !fall.is_as_stated());
        Self {
            start_ns: analysis.rows.times_ns.first().copied().unwrap_or(0),
            wheels: wheels.collect(),
            split_rule: split_rule(machine),
            sharing: sharing(machine),
            word: SupportWord::of(machine),
            is_split_stated: is_stated(machine),
            unexplained_ns: unexplained.map(|fall| fall.onset_ns).collect(),
            is_sparse: analysis.coverage.between_rows.is_some(),
            goes_on: analysis.coverage.after_rows_s > 0.0,
            stops: AxleStop::all(machine),
            inputs: analysis.inputs.iter().map(InputFacts::of).collect(),
        }
    }

    /// Seconds from the first row.
    pub(in crate::report) fn seconds(&self, time_ns: i64) -> f64 {
        time_ns.saturating_sub(self.start_ns) as f64 * 1e-9
    }

    /// Display name of the wheel, edge or signal.
    pub(in crate::report) fn subject(&self, event: &Event) -> String {
        match event.kind {
            EventKind::WheelLight | EventKind::WheelLift | EventKind::LiftNotExcluded => self
                .wheel(&event.subject)
                .map_or_else(|| event.subject.clone(), |wheel| wheel.name.clone()),
            EventKind::InputGap | EventKind::InputFault => input_in_words(&event.subject),
            EventKind::EdgeTipping | EventKind::TipOver => match event.other_edge() {
                Some(other) => say!("{} or {}", edge_word(&event.subject), edge_word(other)),
                None => edge_word(&event.subject).into_owned(),
            },
        }
    }

    /// The wheel or other support of an event with the word for it: "wheel FL", "support ORR".
    pub(in crate::report) fn support(&self, event: &Event) -> String {
        format!("{} {}", self.word_of(&[event]).one, self.subject(event))
    }

    /// The lead time of an event (s), and the wheel or other support that it counts from: "wheel FL".
    pub(in crate::report) fn lead(&self, event: &Event) -> Option<(f64, String)> {
        let from = self.wheel(event.lead_from.as_ref()?)?;
        Some((event.lead_s?, from.named()))
    }

    /// Names the load that falls to zero at an event: the OTF of a wheel, or that off an edge, which the wheels on its other side
    /// carry.
    pub(in crate::report) fn otf_of(&self, event: &Event) -> String {
        match event.kind {
            EventKind::EdgeTipping | EventKind::TipOver => say!(
                "the overturning force (OTF) off the {} edge",
                edge_word(&event.subject)
            ),
            _ => say!("the overturning force (OTF) of {}", self.support(event)),
        }
    }

    /// Returns the note that the causes of an event end before it begins, if rows are missing between.
    pub(in crate::report) fn not_shown(
        &self,
        event: &Event,
        causes: &EventCauses,
    ) -> Option<String> {
        (causes.at_ns < event.start_ns.saturating_sub(MERGED_NS)).then(|| {
            say!(
                "What took the rest until t = {:.2} s is not known: there are no loads between",
                self.seconds(event.start_ns)
            )
        })
    }

    /// The kind of an event in words, and what it happened to: "wheel light FL", "support lift ORR", "edge tipping left".
    pub(in crate::report) fn kind_and_subject(&self, event: &Event) -> String {
        format!("{} {}", self.kind(event), self.subject(event))
    }

    /// The kind of an event in words.
    pub(in crate::report) fn kind(&self, event: &Event) -> String {
        self.word_of(&[event]).event(event.kind)
    }

    /// The word for the wheels or other supports of some events.
    pub(super) fn word_of(&self, events: &[&Event]) -> SupportWord {
        let known = events.iter().filter_map(|event| self.wheel(&event.subject));
        SupportWord::of_all(known.map(|wheel| wheel.kind))
    }

    /// Describes the measurements that would decide the loads of some wheels or other supports, as one sentence without a period.
    pub(super) fn deciding<'w>(
        &self,
        wheels: impl Iterator<Item = &'w WheelFacts> + Clone,
    ) -> String {
        let mut ways: Vec<Deciding> = Vec::new();
        for way in wheels.clone().flat_map(|wheel| &wheel.deciding) {
            if !ways.contains(way) {
                ways.push(*way);
            }
        }
        Deciding::sentence(&ways, SupportWord::of_all(wheels.map(|wheel| wheel.kind)))
    }

    pub(super) fn wheel(&self, subject: &str) -> Option<&WheelFacts> {
        self.wheels
            .iter()
            .find(|wheel| wheel.name.to_lowercase() == subject)
    }
}

impl WheelFacts {
    /// "wheel FL", "support ORR".
    pub(super) fn named(&self) -> String {
        format!("{} {}", SupportWord::of_kind(self.kind).one, self.name)
    }

    /// A load of the wheel (N) as a share of its static load, in words.
    pub(super) fn share(&self, load_n: f64) -> String {
        if load_n.is_finite() && self.static_n > 0.0 {
            say!("{} of its static load", percent(load_n / self.static_n))
        } else {
            word!("its static load is not computable").to_string()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axle_may_have_stood_at_its_other_stop() {
        let stop = |limits_rad| AxleStop {
            edge: "left".into(),
            wheels: Vec::new(),
            limits_rad,
        };
        let both_ways = stop([-0.2, 0.2]);
        assert!(!both_ways.is_passed(0.3, 0.01));
        assert!(both_ways.is_passed(0.45, 0.01));
        assert!(!both_ways.is_passed(0.45, 0.03));
        // a zero that is not the middle changes nothing
        assert!(stop([0.6, 1.0]).is_passed(0.45, 0.01));
    }
}
