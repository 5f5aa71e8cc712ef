//! The one entry: a state in, an outcome out, for one instant or for many rows.

pub(crate) mod batch;
pub(crate) mod evaluation;
pub(crate) mod explain;
pub(crate) mod model;
pub(crate) mod outcome;
pub(crate) mod quantities;
pub(crate) mod quantity;
pub(crate) mod scope;
pub(crate) mod workspace;
