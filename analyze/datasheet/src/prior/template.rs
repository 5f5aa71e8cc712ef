//! The kinds of machines and the prior of each.

use serde::Deserialize;
use strum::{Display, EnumIter, EnumString, VariantNames};

/// A kind of machine.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Deserialize, Display, EnumIter, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Template {
    /// A wheeled robot with a robot arm.
    MobileManipulator,
    /// A forwarder: articulated frame, bogies, crane on the rear frame.
    Forwarder,
    /// A harvester: articulated frame, bogies in front, crane with a head.
    Harvester,
    /// A wheel loader: articulated frame, pendulum rear axle, lift arm and bucket.
    WheelLoader,
    /// A telehandler: rigid frame, telescopic boom.
    Telehandler,
    /// A counterbalance forklift: mast, pendulum or single rear wheel.
    Forklift,
    /// A truck crane: truck axles, superstructure, outriggers.
    TruckCrane,
    /// A mobile (all-terrain or rough-terrain) crane: equalised axles, superstructure, outriggers.
    MobileCrane,
    /// An excavator on wheels.
    WheeledExcavator,
    /// An excavator on tracks.
    CrawlerExcavator,
}

/// Body that takes the remainder of the axle loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Balance {
    /// The platform, or the carrier below a superstructure.
    Base,
    /// The superstructure: the carrier is symmetrical.
    Superstructure,
    /// Both frames of an articulated machine.
    Frames,
}

/// Prior assumptions about a kind of machine.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prior {
    /// Description of the kind, in one line.
    pub(crate) title: &'static str,
    /// Height of the centre of mass of the platform as a share of the overall height.
    pub(crate) com_height: f64,
    /// Mass of the arm with its tool as a share of the operating mass.
    pub(crate) arm: f64,
    /// Share of the first axle in the operating mass.
    pub(crate) first_axle: f64,
    /// Mass of the superstructure as a share of the mass without arm and wheels.
    pub(crate) superstructure: f64,
    pub(crate) balance: Balance,
    pub(crate) has_tracks: bool,
    pub(crate) is_articulated: bool,
    pub(crate) has_superstructure: bool,
    /// The frame with the cab is the rear one of an articulated machine.
    pub(crate) cab_is_rear: bool,
    /// The arm is on the front frame of an articulated machine.
    pub(crate) arm_is_front: bool,
    /// The tool hangs freely.
    pub(crate) hangs: bool,
    /// Smallest and largest operating mass (kg).
    pub(crate) mass: [f64; 2],
    /// Smallest and largest tyre radius (m).
    pub(crate) radius: [f64; 2],
    /// Largest mass of the tool as a share of the operating mass.
    pub(crate) tool: f64,
    /// Largest rated load as a multiple of the operating mass.
    pub(crate) rated: f64,
}

const BASIC: Prior = Prior {
    title: "",
    com_height: 0.4,
    arm: 0.15,
    first_axle: 0.5,
    superstructure: 0.0,
    balance: Balance::Base,
    has_tracks: false,
    is_articulated: false,
    has_superstructure: false,
    cab_is_rear: false,
    arm_is_front: false,
    hangs: false,
    mass: [1000.0, 100_000.0],
    radius: [0.2, 1.6],
    tool: 0.25,
    rated: 1.0,
};

impl Template {
    /// Returns the description of the kind, in one line.
    #[must_use]
    pub fn title(self) -> &'static str {
        self.prior().title
    }

    /// A filled-in and commented sheet: numbers of a public data sheet, with their sources.
    #[must_use]
    pub fn example(self) -> &'static str {
        match self {
            Self::MobileManipulator => include_str!("../../examples/mobile-manipulator.toml"),
            Self::Forwarder => include_str!("../../examples/forwarder.toml"),
            Self::Harvester => include_str!("../../examples/harvester.toml"),
            Self::WheelLoader => include_str!("../../examples/wheel-loader.toml"),
            Self::Telehandler => include_str!("../../examples/telehandler.toml"),
            Self::Forklift => include_str!("../../examples/forklift.toml"),
            Self::TruckCrane => include_str!("../../examples/truck-crane.toml"),
            Self::MobileCrane => include_str!("../../examples/mobile-crane.toml"),
            Self::WheeledExcavator => include_str!("../../examples/wheeled-excavator.toml"),
            Self::CrawlerExcavator => include_str!("../../examples/crawler-excavator.toml"),
        }
    }

    pub(crate) fn prior(self) -> Prior {
        match self {
            Self::MobileManipulator => Prior {
                title: "wheeled robot with a robot arm",
                arm: 0.3,
                mass: [5.0, 10_000.0],
                radius: [0.03, 1.0],
                tool: 1.0,
                rated: 20.0,
                ..BASIC
            },
            Self::Forwarder => Prior {
                title: "articulated frame, bogies, crane on the rear frame",
                com_height: 0.33,
                arm: 0.12,
                first_axle: 0.58,
                balance: Balance::Frames,
                is_articulated: true,
                hangs: true,
                mass: [2000.0, 40_000.0],
                radius: [0.3, 1.2],
                ..BASIC
            },
            Self::Harvester => Prior {
                title: "articulated frame, bogies in front, crane with a harvester head",
                com_height: 0.36,
                arm: 0.13,
                first_axle: 0.55,
                balance: Balance::Frames,
                is_articulated: true,
                arm_is_front: true,
                hangs: true,
                mass: [2000.0, 40_000.0],
                radius: [0.3, 1.2],
                ..BASIC
            },
            Self::WheelLoader => Prior {
                title: "articulated frame, pendulum rear axle, lift arm and bucket",
                com_height: 0.38,
                arm: 0.18,
                first_axle: 0.45,
                balance: Balance::Frames,
                is_articulated: true,
                cab_is_rear: true,
                arm_is_front: true,
                mass: [500.0, 250_000.0],
                radius: [0.2, 2.2],
                ..BASIC
            },
            Self::Telehandler => Prior {
                title: "rigid frame, telescopic boom",
                com_height: 0.4,
                arm: 0.17,
                first_axle: 0.45,
                mass: [1500.0, 60_000.0],
                rated: 0.8,
                ..BASIC
            },
            Self::Forklift => Prior {
                title: "counterbalance truck with a mast",
                com_height: 0.35,
                arm: 0.14,
                first_axle: 0.45,
                mass: [500.0, 100_000.0],
                radius: [0.1, 1.2],
                ..BASIC
            },
            Self::TruckCrane => Prior {
                title: "truck axles, superstructure with telescopic boom, outriggers",
                com_height: 0.4,
                arm: 0.2,
                superstructure: 0.4,
                has_superstructure: true,
                hangs: true,
                mass: [3000.0, 150_000.0],
                rated: 20.0,
                ..BASIC
            },
            Self::MobileCrane => Prior {
                title: "equalised axles, superstructure with telescopic boom, outriggers",
                com_height: 0.4,
                arm: 0.22,
                superstructure: 0.4,
                has_superstructure: true,
                hangs: true,
                mass: [3000.0, 250_000.0],
                rated: 20.0,
                ..BASIC
            },
            Self::WheeledExcavator => Prior {
                title: "excavator on wheels",
                com_height: 0.42,
                arm: 0.18,
                superstructure: 0.58,
                balance: Balance::Superstructure,
                has_superstructure: true,
                mass: [2000.0, 60_000.0],
                ..BASIC
            },
            Self::CrawlerExcavator => Prior {
                title: "excavator on tracks",
                com_height: 0.4,
                arm: 0.18,
                superstructure: 0.52,
                balance: Balance::Superstructure,
                has_tracks: true,
                has_superstructure: true,
                mass: [500.0, 1_000_000.0],
                ..BASIC
            },
        }
    }
}
