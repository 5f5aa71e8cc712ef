//! What crosses the crates.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod accuracy; // wheel loads against simulated truth
mod causal; // one by one equals four side by side, through the whole analysis
mod gaps; // what is missing is said, never filled in
mod real_logs; // logs of real robots, where they are there
