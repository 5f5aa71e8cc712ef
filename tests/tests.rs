//! What crosses the crates.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod accuracy; // wheel loads against simulated truth
mod causal; // one by one equals four side by side, through the whole analysis
mod clocks; // offsets between topics, by the physics
mod coverage; // standard deviations against the spread of the truth
mod documents; // README, book and CONTRIBUTING are true
mod first_paper; // what the first paper shows
mod gaps; // what is missing is said, never filled in
mod number_signals; // any number of any message as a signal
mod payload; // masses that the log can tell
mod plausibility; // signals that cannot be true
mod real_logs; // logs of real robots, where they are there
mod second_paper; // what the second paper shows, and what pressures tell beyond it
mod whatif; // a log with its suspension moved otherwise
