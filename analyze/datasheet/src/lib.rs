//! A machine from its data sheet: some 15 to 30 numbers become bodies, joints and masses, a URDF (Unified Robot
//! Description Format), a machine file and a picture.
//!
//! - [`Sheet`] holds the numbers, with their units, and refuses those that contradict each other.
//! - [`Machine`] is the result: links, joints, shapes, wheels, and the list of everything that was assumed.
//!
//! What the sheet does not say comes from a prior of its [`Template`]; every prior that was used is an
//! [`Assumption`].

mod body;
mod dialogue;
mod error;
mod output;
mod prior;
mod quantity;
mod sheet;
mod weights;

pub use body::{Joint, JointKind, Link, Machine, Shape, Solid, Wheel};
pub use dialogue::{Question, ask, parts, prompt, questions, refusal};
pub use error::SheetError;
pub use output::{FromLog, comment, quoted};
pub use prior::{Assumption, Template};
pub use quantity::{Angle, Length, Mass, Quantity, Stiffness};
pub use sheet::{
    Arm, Articulation, Axle, Cylinder, Load, Outriggers, OutriggersSet, Segment, SegmentKind,
    Sheet, Slew, Superstructure, Switch, Tool, Tracks,
};

impl Sheet {
    /// The machine that this sheet describes.
    ///
    /// # Errors
    /// Numbers that are missing, impossible, or contradict each other.
    pub fn machine(&self) -> Result<Machine, SheetError> {
        self.check()?;
        let mut machine = body::build(self)?;
        weights::distribute(self, &mut machine)?;
        Ok(machine)
    }
}
