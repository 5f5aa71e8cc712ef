//! The keys of a sheet.

use serde::Deserialize;
use serde::de::MapAccess;
use serde::de::value::MapAccessDeserializer;
use tipwatch_mechanics::machine::{OneOf, exactly, exactly_if_any, explained};

use crate::error::SheetError;
use crate::prior::Template;
use crate::quantity::{Angle, Length, Mass, Stiffness};

/// A data sheet. Plain numbers are in kg, m and degrees; text may state another unit.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// The kind of machine.
    pub template: Template,
    /// Name of the machine.
    pub name: String,
    /// Sources of the numbers, a line each.
    #[serde(default)]
    pub sources: Vec<String>,
    /// Operating mass: of everything that stands on the ground, with the arm in the posture of the sheet.
    pub mass: Mass,
    /// Overall length, without the arm.
    pub length: Option<Length>,
    /// Overall width.
    pub width: Option<Length>,
    /// Overall height.
    pub height: Option<Length>,
    /// Clearance below the frame.
    pub ground_clearance: Option<Length>,
    /// Height of the centre of mass of the whole machine over the ground.
    pub centre_of_mass_height: Option<Length>,
    /// Sideways inclination at which the machine tips, in the posture of the sheet.
    pub tilt_angle: Option<Angle>,
    /// Vertical stiffness of one tyre.
    pub tyre_stiffness: Option<Stiffness>,
    /// The axles, front to rear.
    #[serde(default)]
    pub axles: Vec<Axle>,
    /// Tracks instead of axles.
    pub tracks: Option<Tracks>,
    /// The joint between front and rear frame.
    pub articulation: Option<Articulation>,
    /// Slewing joint of the arm, or of the whole superstructure.
    pub slew: Option<Slew>,
    /// The upper carriage that turns with the arm.
    pub superstructure: Option<Superstructure>,
    /// Boom, crane, mast or manipulator.
    pub arm: Arm,
    /// Outriggers or stabilisers, a pair each, front to rear.
    #[serde(default)]
    pub outriggers: Vec<Outriggers>,
    /// The load that the machine may carry.
    pub rated_load: Option<Load>,
    /// Name of the sheet, for messages.
    #[serde(skip)]
    pub file: String,
}

/// An axle, or a pair of bogies.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axle {
    /// Distance behind the axle before it; not for the first.
    pub behind: Option<Length>,
    /// Distance between the middles of the left and the right wheel; none for a single wheel in the middle.
    pub track: Option<Length>,
    /// Load of this axle, as the scale under it reads.
    pub load: Option<Mass>,
    /// Load of this axle with the rated load on the tool.
    pub laden: Option<Mass>,
    /// Designation of the tyre, such as `20.5R25`.
    pub tyre: Option<String>,
    /// Radius of the unloaded tyre; default: from the designation.
    pub tyre_radius: Option<Length>,
    /// Width of the tyre (of both, for twin tyres); default: from the designation.
    pub tyre_width: Option<Length>,
    /// Mass of one wheel with its tyre.
    pub wheel_mass: Option<Mass>,
    /// Largest steering angle, if its wheels are steered.
    pub steering: Option<Angle>,
    /// Distance between the two wheels of a bogie, if it has bogies.
    pub bogie: Option<Length>,
    /// Largest angle about the longitudinal axis, if the axle hangs on a pivot in the middle.
    pub pendulum: Option<Angle>,
}

/// Tracks of a crawler.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tracks {
    /// Distance between the middles of the tracks.
    pub gauge: Length,
    /// Length on the ground: between the middles of sprocket and idler.
    pub length: Length,
    /// Width of a shoe.
    pub shoe: Length,
    /// Height of a track.
    pub height: Length,
}

/// The joint between front and rear frame.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Articulation {
    /// Distance of the joint behind the front axle.
    pub behind: Length,
    /// Largest angle to each side.
    pub angle: Angle,
    /// Largest angle of the frames against each other about the longitudinal axis, if they can turn freely.
    pub roll: Option<Angle>,
    /// Mass of the front frame with all that it carries, without wheels and arm.
    pub front_mass: Option<Mass>,
}

/// A slewing joint.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slew {
    /// Distance of its axis behind the front axle; with tracks behind their middle.
    pub behind: Length,
    /// Height over the ground.
    pub height: Length,
    /// Smallest and largest angle; none: endless.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub range: Option<[Angle; 2]>,
    /// Its angle in the posture of the sheet: 0 forward, positive to the left.
    pub at: Option<Angle>,
}

/// The upper carriage of an excavator or a crane.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Superstructure {
    /// Mass with counterweight, without the arm.
    pub mass: Option<Mass>,
    /// Distance of its centre of mass behind the axis of the slew.
    pub centre_of_mass_behind: Option<Length>,
    /// Tail swing radius.
    pub tail: Length,
    /// Width.
    pub width: Option<Length>,
}

/// An arm in a vertical plane.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    /// Distance of its first pin ahead of the slew's axis; without a slew ahead of the front axle.
    pub ahead: Length,
    /// Height of its first pin over the ground.
    pub height: Length,
    /// Mass of all segments and the tool together.
    pub mass: Option<Mass>,
    /// Largest horizontal distance of the tip from the slew's axis; without a slew from the front axle.
    pub reach: Option<Length>,
    /// Its segments, from the machine to the tip.
    pub segments: Vec<Segment>,
    /// Tool at the tip.
    pub tool: Option<Tool>,
}

/// Motion of a segment relative to the one before it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, strum::Display)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum SegmentKind {
    /// Lifting joint: positive is upwards.
    #[default]
    Lift,
    /// Joint about the upright axis of the segment before: positive is to the left.
    Yaw,
    /// Joint about the segment's own length.
    Roll,
    /// An upright mast: positive is backwards; its extension lifts the tool.
    Mast,
}

/// A segment of an arm.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Its name, which its joint has too.
    pub name: String,
    /// Motion of the segment.
    #[serde(default)]
    pub kind: SegmentKind,
    /// Length from its pin to the next one; at most one may be left out if the reach is known.
    pub length: Option<Length>,
    /// Mass.
    pub mass: Option<Mass>,
    /// Smallest and largest angle against the segment before it.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub range: Option<[Angle; 2]>,
    /// Its angle in the posture of the sheet.
    pub at: Option<Angle>,
    /// Largest telescopic extension.
    pub extension: Option<Length>,
    /// Its extension in the posture of the sheet.
    pub extended: Option<Length>,
    /// Number of its telescopic sections.
    pub sections: Option<u8>,
    /// Cylinder that turns the segment.
    pub cylinder: Option<Cylinder>,
}

/// A cylinder and its pins.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Its pin on the segment before: ahead of and above the segment's pin, along and across that segment.
    #[serde(deserialize_with = "exactly")]
    pub base: [Length; 2],
    /// Its pin on the segment: along and across it, from the segment's pin.
    #[serde(deserialize_with = "exactly")]
    pub eye: [Length; 2],
    /// Length of the retracted cylinder between the pins.
    pub closed: Length,
    /// Stroke.
    pub stroke: Length,
    /// Diameter of the piston.
    pub bore: Length,
    /// Diameter of the rod.
    pub rod: Length,
}

/// Tool at the tip of an arm.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Its name: bucket, forks, grapple, hook, head, gripper.
    pub name: String,
    /// Mass.
    pub mass: Option<Mass>,
    /// Its length beyond the last pin.
    pub length: Option<Length>,
    /// Smallest and largest angle, if it turns.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub range: Option<[Angle; 2]>,
    /// Its angle in the posture of the sheet.
    pub at: Option<Angle>,
}

/// A pair of outriggers.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outriggers {
    /// Distance behind the front axle; negative: ahead of it.
    pub behind: Length,
    /// Distance between the middles of the left and the right pad when they are fully extended.
    pub base: Length,
    /// Side or diameter of a pad.
    pub pad: Option<Length>,
    /// Time in which the pads stand on the ground in the logs of this machine.
    pub set: Option<OutriggersSet>,
}

/// Time in which a pair of outriggers stands on the ground.
#[derive(Debug, Clone, PartialEq)]
pub enum OutriggersSet {
    /// In every row, or in none.
    Always(bool),
    /// While a signal of each side says so.
    Signals {
        /// Signal of the left pad.
        left: Switch,
        /// Signal of the right pad.
        right: Switch,
    },
}

/// The keys of [`OutriggersSet::Signals`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sides {
    left: Switch,
    right: Switch,
}

impl<'de> OneOf<'de> for OutriggersSet {
    const EXPECTED: &'static str = "true, false, or a table { left, right } of signals, such as { left = { topic = \"/outriggers\", field = \
         \"left\" }, right = { topic = \"/outriggers\", field = \"right\" } }";

    fn of_bool(value: bool) -> Option<Self> {
        Some(Self::Always(value))
    }

    fn of_table<A: MapAccess<'de>>(table: A) -> Option<Result<Self, A::Error>> {
        let sides = Sides::deserialize(MapAccessDeserializer::new(table));
        Some(sides.map(|Sides { left, right }| Self::Signals { left, right }))
    }
}

tipwatch_mechanics::read_one_of!(OutriggersSet);

/// A number in a log that shows whether something is on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// Topic of the messages.
    pub topic: String,
    /// Path of the number in a message.
    pub field: String,
    /// Value from which the switch is on; 0.5 where it is not stated.
    pub above: Option<f64>,
}

/// A load at the tool.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Mass.
    pub mass: Mass,
    /// Distance of its centre of mass ahead of the tool's frame, such as the load centre of a forklift.
    pub centre: Length,
}

impl Sheet {
    /// Reads a sheet; `file` is its name for messages.
    ///
    /// # Errors
    /// The text is not a sheet, or a number is impossible.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, SheetError> {
        let sheet: Self = toml::from_str(text).map_err(|error| SheetError::Text {
            file: file.into(),
            message: explained(text, &error),
        })?;
        let sheet = Self {
            file: file.into(),
            ..sheet
        };
        sheet.check()?;
        Ok(sheet)
    }

    pub(crate) fn wrong(
        &self,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
        likely: impl Into<String>,
    ) -> SheetError {
        SheetError::Value {
            file: self.file.clone(),
            place: place.into(),
            expected: expected.into(),
            found: found.into(),
            likely: likely.into(),
        }
    }
}
