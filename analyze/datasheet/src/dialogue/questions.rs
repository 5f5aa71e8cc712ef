//! The questions of each kind of machine, in the order in which they are asked.

use super::parts::equipment;
use super::question::{Kind, Question};
use crate::prior::Template;
use crate::sheet::SegmentKind;

/// The part of a machine that a question is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    /// The machine as a whole.
    Machine,
    /// Each axle of a machine on wheels.
    Axle,
    /// Each segment of the arm.
    Segment,
    /// Each pair of outriggers.
    Outriggers,
}

impl Part {
    /// Returns the number of such parts of a kind of machine with `axles` axles.
    fn count(self, template: Template, axles: usize) -> usize {
        match self {
            Self::Machine => 1,
            Self::Axle if template.prior().has_tracks => 0,
            Self::Axle => axles,
            Self::Segment => equipment(template).segments.len(),
            Self::Outriggers => equipment(template).outriggers,
        }
    }
}

/// One part of one machine.
#[derive(Debug, Clone, Copy)]
struct Place {
    template: Template,
    axles: usize,
    /// Number of the axle, of the segment or of the pair of outriggers, from 0.
    index: usize,
}

impl Place {
    /// Returns the name of a part in the questions; empty for the machine as a whole.
    fn name(&self, part: Part) -> String {
        match (part, self.index) {
            (Part::Machine, _) => String::new(),
            (Part::Axle, 0) => "Front axle".into(),
            (Part::Axle, index) if index + 1 == self.axles => "Rear axle".into(),
            (Part::Axle, index) => format!("Axle {}", index + 1),
            (Part::Segment, index) => equipment(self.template).segments[index].0.into(),
            (Part::Outriggers, 0) => "Outriggers, first pair".into(),
            (Part::Outriggers, _) => "Outriggers, second pair".into(),
        }
    }

    fn has_tracks(&self) -> bool {
        self.template.prior().has_tracks
    }

    fn has_forks(&self) -> bool {
        self.template == Template::Forklift
    }

    fn is_forest_machine(&self) -> bool {
        matches!(self.template, Template::Forwarder | Template::Harvester)
    }

    fn has_slew(&self) -> bool {
        self.template.prior().has_superstructure
            || self.is_forest_machine()
            || self.template == Template::MobileManipulator
    }

    /// The axle may hang on a pivot.
    fn may_oscillate(&self) -> bool {
        match self.template {
            Template::WheelLoader | Template::Forklift | Template::Harvester => self.index == 1,
            Template::WheeledExcavator => self.index == 0,
            Template::Telehandler => true,
            _ => false,
        }
    }

    /// The segment has an extension, and is a mast or not.
    fn extends(&self, as_mast: bool) -> bool {
        let (_, kind, telescopes) = equipment(self.template).segments[self.index];
        telescopes && (kind == SegmentKind::Mast) == as_mast
    }
}

/// A question about every place that `is_asked` takes.
struct Row {
    part: Part,
    is_asked: fn(&Place) -> bool,
    is_required: bool,
    kind: Kind,
    key: &'static str,
    text: &'static str,
    after: Option<&'static str>,
}

impl Row {
    /// The question about a place.
    fn at(&self, place: &Place) -> Question {
        let key = |pattern: &str| pattern.replace('*', &place.index.to_string());
        Question {
            key: key(self.key),
            text: self.text.replace("{name}", &place.name(self.part)),
            is_required: self.is_required,
            after: self.after.map(key),
            kind: self.kind,
        }
    }
}

const NEEDED: bool = true;
const OPEN: bool = false;

macro_rules! questions {
    ($($part:ident $required:ident $kind:ident $key:literal $text:literal
        $(after $after:literal)? $(if |$place:ident| $is_asked:expr)?;)*) => {
        &[$(Row {
            part: Part::$part,
            is_asked: questions!(@if $(|$place| $is_asked)?),
            is_required: $required,
            kind: Kind::$kind,
            key: $key,
            text: $text,
            after: questions!(@after $($after)?),
        }),*]
    };
    (@if) => { |_| true };
    (@if |$place:ident| $is_asked:expr) => { |$place| $is_asked };
    (@after) => { None };
    (@after $after:literal) => { Some($after) };
}

/// Questions, one a row: the part, whether an answer is needed, the type of the answer, the key (`*` is the number of the part),
/// the text, the key without whose answer the question is not asked, and the machines and parts of which it is asked. Rows of one
/// part that follow each other are asked together, part by part.
const QUESTIONS: &[Row] = questions! {
    Machine NEEDED Text   "name" "Name of the machine";
    Machine OPEN   Text   "sources.0" "Source of the numbers (maker, document, year)";
    Machine NEEDED Number "mass" "Operating mass [kg]";
    Machine OPEN   Number "length" "Overall length without the arm [m]";
    Machine OPEN   Number "width" "Overall width [m]";
    Machine OPEN   Number "height" "Overall height [m]";
    Machine OPEN   Number "centre_of_mass_height" "Height of its centre of mass over the ground, if known [m]";
    Machine NEEDED Number "tracks.gauge" "Track gauge, middle to middle [m]" if |of| of.has_tracks();
    Machine NEEDED Number "tracks.length" "Length of the tracks on the ground, sprocket to idler [m]" if |of| of.has_tracks();
    Machine NEEDED Number "tracks.shoe" "Width of the shoes [m]" if |of| of.has_tracks();
    Machine NEEDED Number "tracks.height" "Height of the tracks [m]" if |of| of.has_tracks();

    Axle NEEDED Number "axles.*.behind" "{name}: distance behind the axle before it [m]" if |of| of.index > 0;
    Axle NEEDED Number "axles.*.track" "{name}: track [m]" if |of| !of.has_forks() || of.index != 1;
    Axle OPEN   Number "axles.*.track" "{name}: track [m]; none for a single wheel in the middle" if |of| of.has_forks() && of.index == 1;
    Axle OPEN   Number "axles.*.load" "{name}: load, without payload [kg]";
    Axle OPEN   Text   "axles.*.tyre" "{name}: tyre, such as 20.5R25; none to state the radius";
    Axle OPEN   Number "axles.*.tyre_radius" "{name}: radius of the unloaded tyre; none to take it from the tyre [m]";
    Axle OPEN   Number "axles.*.bogie" "{name}: distance between the wheels of a bogie, if it has bogies [m]" if |of| of.is_forest_machine();
    Axle OPEN   Number "axles.*.pendulum" "{name}: largest angle of its oscillation, if it hangs on a pivot [degrees]" if |of| of.may_oscillate();

    Machine NEEDED Number "articulation.behind" "Distance of the frame joint behind the front axle [m]" if |of| of.template.prior().is_articulated;
    Machine NEEDED Number "articulation.angle" "Largest articulation angle [degrees]" if |of| of.template.prior().is_articulated;
    Machine OPEN   Number "articulation.roll" "Largest angle of the frame roll joint, if it has one [degrees]" if |of| of.template.prior().is_articulated;
    Machine NEEDED Number "slew.behind" "Distance of the slew's axis behind the middle of the tracks [m]" if |of| of.has_slew() && of.has_tracks();
    Machine NEEDED Number "slew.behind" "Distance of the slew's axis behind the front axle [m]" if |of| of.has_slew() && !of.has_tracks();
    Machine NEEDED Number "slew.height" "Height of the slew over the ground [m]" if |of| of.has_slew();
    Machine NEEDED Number "superstructure.tail" "Tail swing radius [m]" if |of| of.template.prior().has_superstructure;
    Machine OPEN   Number "superstructure.mass" "Mass of the superstructure with counterweight, without arm, if known [kg]"
        if |of| of.template.prior().has_superstructure;
    Machine NEEDED Number "arm.ahead" "Arm: distance of the fork's face ahead of the front axle [m]" if |of| of.has_forks();
    Machine NEEDED Number "arm.ahead" "Arm: distance of its first pin ahead of the slew's axis [m]" if |of| of.has_slew();
    Machine NEEDED Number "arm.ahead" "Arm: distance of its first pin ahead of the front axle [m]" if |of| !of.has_forks() && !of.has_slew();
    Machine NEEDED Number "arm.height" "Arm: height of its first pin over the ground [m]";
    Machine OPEN   Number "arm.mass" "Arm: mass with its tool, if known [kg]";
    Machine OPEN   Number "arm.reach" "Arm: largest horizontal reach [m]";

    Segment NEEDED Number "arm.segments.*.length" "Arm, {name}: length [m]";
    Segment OPEN   Range  "arm.segments.*.range" "Arm, {name}: smallest and largest angle, such as -30, 60 [degrees]";
    Segment OPEN   Number "arm.segments.*.at" "Arm, {name}: angle when the machine was weighed [degrees]";
    Segment NEEDED Number "arm.segments.*.extension" "Arm, {name}: lift height [m]" if |of| of.extends(true);
    Segment OPEN   Number "arm.segments.*.extension" "Arm, {name}: telescopic extension [m]" if |of| of.extends(false);

    Machine OPEN   Number "arm.tool.mass" "Tool: mass, if known [kg]";
    Machine OPEN   Number "arm.tool.length" "Tool: length [m]";
    Machine OPEN   Number "rated_load.mass" "Rated load [kg]";
    Machine NEEDED Number "rated_load.centre" "Rated load: its centre ahead of the tool's frame [m]" after "rated_load.mass";

    Outriggers OPEN   Number "outriggers.*.behind" "{name}: distance behind the front axle, negative ahead of it; none if it has none [m]"
        if |of| of.index == 0;
    Outriggers OPEN   Number "outriggers.*.behind" "{name}: distance behind the front axle, negative ahead of it; none if it has none [m]"
        after "outriggers.0.behind" if |of| of.index > 0;
    Outriggers NEEDED Number "outriggers.*.base" "{name}: from the middle of the left pad to that of the right [m]" after "outriggers.*.behind";
};

/// The questions of a kind of machine with this many axles.
#[must_use]
pub fn questions(template: Template, axles: usize) -> Vec<Question> {
    let mut list = Vec::new();
    for rows in QUESTIONS.chunk_by(|one, next| one.part == next.part) {
        for index in 0..rows[0].part.count(template, axles) {
            let place = Place {
                template,
                axles,
                index,
            };
            let asked = rows.iter().filter(|row| (row.is_asked)(&place));
            list.extend(asked.map(|row| row.at(&place)));
        }
    }
    list
}
