//! Vectors, wrenches, joint coordinates and the plane through the contact points.

pub mod contact_plane;
pub(crate) mod contact_plane_derivatives;
pub mod coordinate;
pub mod spatial;
