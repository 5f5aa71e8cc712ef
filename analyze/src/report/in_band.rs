//! The wheels that may have carried less than was computed, as the bands of their overturning forces (OTF) allow.

use tipwatch_language::say;

use crate::analysis::Analysis;
use crate::analysis::digest::OtfBand;
use crate::events::EventKind;
use crate::events::support_words::SupportWord;
use crate::page::with_sure_band;

/// The wheels whose band reaches below a bound (N) by wheel in a valid row, or while the machine tips and does not tip over, the
/// lowest first.
pub(super) fn wheels(analysis: &Analysis, bound_n: impl Fn(usize) -> f64) -> Vec<(usize, OtfBand)> {
    // the loads of a machine that falls over tell nothing of the wheels that it falls over
    let is_in_fall = |band: &OtfBand| {
        let time_ns = analysis.rows.times_ns[band.row];
        let mut falls = analysis.events.iter();
        falls.any(|it| it.kind == EventKind::TipOver && it.is_fact() && it.overlaps([time_ns; 2]))
    };
    let wheels = analysis.digest.wheels.iter().enumerate();
    let bands = wheels.filter_map(|(wheel, found)| {
        let tipping = found.least_while_tipping.iter().copied();
        let tipping = tipping.filter(|band| !is_in_fall(band));
        let bands = found.least_in_band.into_iter().chain(tipping);
        let lowest = bands.min_by(|a, b| a.least_n().total_cmp(&b.least_n()))?;
        Some((wheel, lowest))
    });
    let mut found: Vec<(usize, OtfBand)> = bands
        .filter(|(wheel, band)| band.least_n() < bound_n(*wheel))
        .collect();
    found.sort_by(|(_, a), (_, b)| a.least_n().total_cmp(&b.least_n()));
    found
}

/// The wheels that may have lifted, the one most likely to have first.
pub(super) fn lifts(analysis: &Analysis) -> Vec<(usize, OtfBand)> {
    wheels(analysis, |_| 0.0)
}

/// Whether a band of the load of every wheel is known in every row: without bands no lift is excluded.
pub(super) fn are_known(analysis: &Analysis) -> bool {
    analysis
        .digest
        .wheels
        .iter()
        .all(|wheel| wheel.is_band_known)
}

/// A wheel, and what it carried.
fn in_words(analysis: &Analysis, (wheel, band): (usize, OtfBand)) -> String {
    say!(
        "{}: {} N at t = {:.2} s",
        SupportWord::named(&analysis.machine.wheels()[wheel]),
        with_sure_band(band.otf_n, band.sigma_n),
        analysis.rows.seconds(band.row)
    )
}

/// All of these wheels.
pub(super) fn all_in_words(analysis: &Analysis, found: &[(usize, OtfBand)]) -> String {
    let words: Vec<String> = found.iter().map(|&it| in_words(analysis, it)).collect();
    words.join("; ")
}
