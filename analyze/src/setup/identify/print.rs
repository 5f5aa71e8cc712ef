//! The result of an identification as text.

use std::fmt::Write as _;

use tipwatch_calibration::identification::{ChannelError, Combination, Knowledge};

use super::document::correlations;
use super::run::Identified;

/// Rows of lists; JSON has all.
const MOST: usize = 12;

/// The text of a result.
#[must_use]
pub fn text(found: &Identified) -> String {
    let mut out = String::new();
    // writing to a string cannot fail
    let _ = write(&mut out, found);
    out
}

fn write(out: &mut String, found: &Identified) -> std::fmt::Result {
    let result = &found.result;
    writeln!(out, "data:")?;
    for source in &result.sources {
        write!(
            out,
            "  {}: {} instants, worth {:.0} independent ones",
            source.name,
            source.instants,
            source.effective.max(1.0).min(source.instants as f64)
        )?;
        if source.left_out + source.outliers > 0 {
            write!(
                out,
                "; {} left out (a wheel off the ground, or unknown numbers), {} outliers",
                source.left_out, source.outliers
            )?;
        }
        if source.scale > 1.05 {
            write!(
                out,
                "; residuals {:.1} times as large as stated",
                source.scale
            )?;
        }
        writeln!(out)?;
    }
    estimates(out, found)?;
    not_told(out, found)?;
    writeln!(out, "\nlargest correlations of the estimates:")?;
    for row in correlations(found).iter().take(MOST) {
        let [a, b] = &row.parameters;
        writeln!(out, "  {:+.2}  {a}, {b}", row.correlation)?;
    }
    writeln!(
        out,
        "\nresiduals of the fitted data (measured minus computed):"
    )?;
    errors(out, &result.fitted)?;
    match &result.held_back {
        None => writeln!(
            out,
            "\nNo data were held back: there are too few. The error on data that the fit has not seen is unknown."
        )?,
        Some(held) => {
            writeln!(
                out,
                "\nresiduals of {} instants that were held back (whole stretches or weighings):",
                held.instants
            )?;
            errors(out, &held.channels)?;
            if held.loads_before.is_finite() {
                writeln!(
                    out,
                    "  all loads: root mean square {:.1} N before, {:.1} N after",
                    held.loads_before, held.loads_after
                )?;
            }
            if !held.is_no_worse() {
                writeln!(
                    out,
                    "The identified machine predicts the data that were held back worse than the machine before. Nothing \
                     is claimed, and no machine file is written."
                )?;
            }
        }
    }
    bands(out, found)?;
    for note in &found.notes {
        writeln!(out, "note: {note}")?;
    }
    Ok(())
}

/// Writes the evidence of the readings on the stated standard deviations.
fn bands(out: &mut String, found: &Identified) -> std::fmt::Result {
    if let Some(agreement) = &found.agreement {
        writeln!(
            out,
            "\nweighings against each other: chi-square {:.1} of {} redundant readings{}",
            agreement.chi_square,
            agreement.redundant,
            match agreement.is_contradicted() {
                true => ": THEY CONTRADICT EACH OTHER",
                false => "",
            }
        )?;
    }
    let Some(bands) = &found.result.bands else {
        return Ok(());
    };
    writeln!(
        out,
        "\nbands: {:.0} % of {} readings of loads inside two standard deviations (95 % expected); {}",
        100.0 * bands.inside_two_sigma,
        bands.readings,
        match bands.excess {
            Some(excess) => format!("residuals {excess:.1} times as large as stated at most"),
            None =>
                "they show only how the supports share the load, which is open: nothing tests the stated standard deviations"
                    .into(),
        }
    )?;
    if bands.model_share > bands.stated_share {
        writeln!(
            out,
            "  model_share {:.4} in the new machine file instead of {:.4}: so two standard deviations hold 95 %",
            bands.model_share, bands.stated_share
        )?;
    }
    Ok(())
}

fn estimates(out: &mut String, found: &Identified) -> std::fmt::Result {
    let result = &found.result;
    let told = |knowledge| {
        move |e: &&tipwatch_calibration::identification::Estimate| e.knowledge == knowledge
    };
    let clear = result.estimates.iter().filter(told(Knowledge::Determined));
    let partly = result.estimates.iter().filter(told(Knowledge::Partly));
    writeln!(
        out,
        "\n{:<34} {:>6} {:>12} {:>12} {:>12} {:>12}",
        "parameter", "unit", "before", "change", "sigma before", "sigma after"
    )?;
    for e in clear.chain(partly) {
        let before = e.nominal.map_or("-".into(), |value| format!("{value:.4}"));
        writeln!(
            out,
            "{:<34} {:>6} {:>12} {:>+12.4} {:>12.4} {:>12.4}{}",
            e.name,
            e.unit,
            before,
            e.change,
            e.prior_sigma,
            e.sigma,
            if e.knowledge == Knowledge::Partly {
                "  partly"
            } else {
                ""
            }
        )?;
    }
    let rest = result
        .estimates
        .iter()
        .filter(told(Knowledge::Undetermined))
        .count();
    writeln!(
        out,
        "The data do not tell the other {rest} of {} parameters by themselves: each keeps its standard deviation from \
         before.",
        result.estimates.len()
    )
}

/// Writes the parameters that the data do not determine, by name.
fn not_told(out: &mut String, found: &Identified) -> std::fmt::Result {
    let result = &found.result;
    let names: Vec<&str> = (result.undetermined.iter())
        .map(|&index| result.estimates[index].name.as_str())
        .collect();
    writeln!(
        out,
        "\ncombinations that the data tell (singular value; 1 is as much as was known before):"
    )?;
    for combination in result.determined.iter().take(MOST) {
        writeln!(
            out,
            "  {:>8.1}  {}",
            combination.singular_value,
            parts(found, combination)
        )?;
    }
    if !names.is_empty() {
        let more = names.len().saturating_sub(MOST);
        write!(
            out,
            "\nnot told at all: {}",
            names[..names.len() - more].join(", ")
        )?;
        match more {
            0 => writeln!(out)?,
            more => writeln!(out, " and {more} more")?,
        }
    }
    if !result.indistinguishable.is_empty() {
        writeln!(
            out,
            "\nnot told apart (changes in standard deviations that together leave every measured number as it is):"
        )?;
        for combination in result.indistinguishable.iter().take(MOST) {
            writeln!(out, "  {}", parts(found, combination))?;
        }
        let more = result.indistinguishable.len().saturating_sub(MOST);
        if more > 0 {
            writeln!(out, "  and {more} more")?;
        }
    }
    Ok(())
}

fn parts(found: &Identified, combination: &Combination) -> String {
    let terms = combination.terms.iter().map(|term| {
        let name = &found.result.estimates[term.unknown].name;
        format!("{:+.2} {name}", term.weight)
    });
    terms.collect::<Vec<_>>().join(", ")
}

fn errors(out: &mut String, channels: &[ChannelError]) -> std::fmt::Result {
    for of in channels {
        writeln!(
            out,
            "  {:<26} {:>6} readings: mean {:>+9.3} -> {:>+9.3} {unit}, root mean square {:>9.3} -> {:>9.3} {unit}",
            of.name,
            of.readings,
            of.bias_before,
            of.bias_after,
            of.rms_before,
            of.rms_after,
            unit = of.unit
        )?;
    }
    Ok(())
}
