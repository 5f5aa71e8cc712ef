//! The terms and acronyms of the pages, each explained once.

use maud::Markup;

use super::elements::{facts, section};

/// A term of the glossary.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Term {
    Com,
    Envelope,
    Fault,
    ForceAngle,
    Imu,
    Itom,
    Margin,
    Mhs,
    Otf,
    Row,
    Sigma,
    StabilityAngle,
    StaticLoad,
    Tom,
    Urdf,
    Zmp,
}

impl Term {
    /// The term, and what it means.
    fn entry(self) -> (&'static str, &'static str) {
        match self {
            Self::Com => ("Centre of mass", "of the whole machine, load included"),
            Self::Envelope => (
                "Envelope",
                "the range of loads on a wheel that equilibrium allows, for any split of the load between the wheels",
            ),
            Self::Fault => (
                "Implausible input",
                "a signal whose values are out of range, frozen, change too fast or contradict another signal",
            ),
            Self::ForceAngle => (
                "Force-Angle",
                "stability measure of Papadopoulos and Rey: the angle about an edge from the edge to the resulting force \
                 at the centre of mass, inertia included; positive is stable",
            ),
            Self::Imu => (
                "IMU",
                "inertial measurement unit: measures angular velocity and specific force",
            ),
            Self::Itom => (
                "ITOM",
                "improved tip-over moment: TOM plus the inertia forces of the chassis; positive means tipping. \
                 ITOM with wheels also includes the mass of the wheels",
            ),
            Self::Margin => (
                "Margin",
                "overturning force of a wheel divided by its static load: 0 when the wheel is about to lift, 100 % at rest on \
                 level ground. The margin of the machine is that of its worst wheel",
            ),
            Self::Mhs => (
                "MHS",
                "moment-height stability: overturning moment about an edge due to the arm and the force on the tool alone",
            ),
            Self::Otf => (
                "OTF",
                "overturning force: the load a wheel would carry if every wheel were held to the ground. It is negative when \
                 the ground would have to pull the wheel down, so the wheel lifts",
            ),
            Self::Row => (
                "Row",
                "one instant at which loads are computed; a row is valid if all inputs it needs are there and plausible",
            ),
            Self::Sigma => ("σ", "standard deviation"),
            Self::StabilityAngle => (
                "Stability angle",
                "the same angle as Force-Angle for the weight alone; positive is stable",
            ),
            Self::StaticLoad => (
                "Static load",
                "load of a wheel at rest on level ground, in the posture of the first valid row",
            ),
            Self::Tom => ("TOM", "tip-over moment: MHS plus the weight of the chassis"),
            Self::Urdf => (
                "URDF",
                "Unified Robot Description Format: the file that describes links, joints and masses of the machine",
            ),
            Self::Zmp => (
                "ZMP",
                "zero moment point, also centre of pressure: the point where the resulting force of the ground acts. The machine \
                 tips when it reaches an edge of the support polygon",
            ),
        }
    }
}

/// The section at the end of a page that explains its terms.
pub(crate) fn glossary(terms: &[Term]) -> Markup {
    let entries: Vec<_> = terms.iter().map(|term| term.entry()).collect();
    section("Glossary", facts(&entries))
}
