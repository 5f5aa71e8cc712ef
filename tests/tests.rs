//! Tests that span several crates.

#![allow(clippy::unwrap_used, reason = "a test that cannot continue fails")]

mod accuracy; // wheel loads compared with simulated ground truth
mod advice; // every advised change holds in an independent evaluation
mod architecture; // dependencies between files, folders and crates
mod basis; // only what is proven is safe
mod can; // frames of a CAN bus give the loads of the original log
mod causal; // batch evaluation equals sample-by-sample evaluation
mod clocks; // time offsets between topics, estimated from the physics
mod coverage; // standard deviations compared with actual errors
mod documents; // commands, snippets and names in README, book and CONTRIBUTING
mod first_paper; // results of the first paper
mod fuzz; // no input makes the program panic
mod gaps; // missing data is reported, never filled in
mod golden; // results equal the recorded ones bit for bit
mod gross_inputs; // signals in other units, impossible machines
mod identification; // parameters from measured loads
mod language; // the report in German: every sentence, no page half translated
mod measured_forces; // measured forces of cylinders beside the computed ones
mod measured_lengths; // measured strokes of cylinders against angles
mod measured_loads; // measured loads beside the computed ones
mod measured_supports; // measured loads of outriggers and raised wheels
mod number_signals; // any field of any message as a signal
mod object_storage; // logs in a bucket, with faults
mod payload; // payload mass from cylinder forces
mod plausibility; // implausible signals
mod prediction; // lead time and false alarms of the prediction, compared with simulated ground truth
mod python; // the Python package
mod real_logs; // logs of real robots
mod redaction; // secrets of URLs leave the programs by no door
mod redundancy; // wrong sensors found by comparison with each other
mod reference_posture; // utilisation does not depend on when a recording begins
mod release_profile; // what the programs are built with
mod rotation; // tip-overs that gyro and attitude show, whatever the loads say
mod second_paper; // results of the second paper, and the gain from cylinder pressures
mod sparse; // static rows, and lifts that no row shows
mod sparse_supports; // static rows of a machine whose supports come and go
mod split; // what is said about wheels whose load equilibrium leaves open
mod supports; // outriggers, raised wheels and three-point axles, compared with simulated ground truth
mod tipping; // onset, certainty and causes of lifts and tip-overs
mod traceability; // requirements and the tests that hold them
mod whatif; // replays with a different suspension motion
mod wrong_samples; // samples that are wrong by themselves: jumps, saturation, frozen axes, outliers, wraps
