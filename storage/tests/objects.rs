//! Objects read by position.
