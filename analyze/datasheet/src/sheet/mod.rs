//! The sheet: the numbers as written, their checks, and the size of a tyre by its designation.

mod check;
mod derived;
mod spec;
mod tyre;

pub use spec::{
    Arm, Articulation, Axle, Cylinder, Load, Outriggers, OutriggersSet, Segment, SegmentKind,
    Sheet, Slew, Superstructure, Switch, Tool, Tracks,
};
pub(crate) use tyre::Tyre;
