//! The text of the machine file with the identified parameters: everything else stays, comments too.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use tipwatch_binding::MachineFile;
use tipwatch_datasheet::quoted;

use super::run::Identified;

/// Writes the machine file with the identified parameters, once it is known to be valid.
///
/// # Errors
/// The result is not a valid machine, or the file cannot be written.
pub fn write_machine_file(path: &Path, before: &MachineFile, found: &Identified) -> Result<()> {
    let beside = (path.parent()).filter(|folder| !folder.as_os_str().is_empty());
    let text = machine_file_text(before, found, beside.unwrap_or(Path::new(".")));
    let file = MachineFile::from_text(path, &text)
        .with_context(|| format!("{}: the result is not a valid machine file", path.display()))?;
    if before.spec.urdf.is_some() {
        // without a log, joints may differ; with a URDF everything else is checked
        let checked = file.check_alone();
        ensure!(
            checked.is_ok(),
            "{}: the result does not describe a valid machine: {:?}",
            path.display(),
            checked.err()
        );
    }
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}

/// The text of a machine file with the table `[identified]`, for a file in `folder`.
#[must_use]
pub fn machine_file_text(file: &MachineFile, found: &Identified, folder: &Path) -> String {
    let kept = without_identified(&file.effective_text());
    let beside = file
        .path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let places =
        [beside.unwrap_or(Path::new(".")), folder].map(|folder| folder.canonicalize().ok());
    let is_elsewhere = places[0].is_none() || places[0] != places[1];
    let mut text = String::with_capacity(kept.len() + 4096);
    for line in kept.lines() {
        let key = line.split('=').next().unwrap_or_default().trim();
        let urdf = file.urdf(None, None).ok();
        match (key, urdf) {
            ("urdf", Some(urdf)) if is_elsewhere && line.contains('=') => {
                let path = Path::new(&urdf.name).canonicalize();
                let path = path.map_or(urdf.name, |path| path.display().to_string());
                let _ = writeln!(text, "urdf = {}", quoted(&path));
            }
            ("commissioning", _) if line.contains('=') => {
                let _ = writeln!(
                    text,
                    "# of the machine file before its identification:\n# {line}"
                );
            }
            _ => {
                let _ = writeln!(text, "{line}");
            }
        }
    }
    let _ = write!(text, "\n{}", table(found));
    text
}

/// The text without an earlier result. The tables are those that [`table`] writes, or a person has reformatted.
fn without_identified(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut is_identified = false;
    for line in text.lines() {
        let trimmed = line.trim();
        let head = trimmed.split('#').next().unwrap_or_default().trim();
        let name = head.trim_start_matches('[').trim_end_matches(']').trim();
        let is_name = |c: char| c.is_alphanumeric() || "._-\"' ".contains(c);
        let is_header = head.starts_with('[')
            && head.ends_with(']')
            && name.starts_with(|c: char| c.is_alphabetic() || "_\"'".contains(c))
            && name.chars().all(is_name);
        if is_header {
            is_identified = name == "identified" || name.starts_with("identified.");
        }
        if !is_identified {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept.trim_end().to_string() + "\n"
}

/// The table. Numbers are written so that they are read back to the bit.
fn table(found: &Identified) -> String {
    let (machine, known) = (&found.machine, &found.result.identified);
    let names = known
        .unknowns
        .iter()
        .map(|unknown| quoted(&unknown.name(machine)));
    let nominal = known.unknowns.iter();
    let nominal = nominal.map(|unknown| unknown.nominal(machine).unwrap_or(f64::NAN));
    let sigma = known
        .unknowns
        .iter()
        .map(|&unknown| known.sigma(unknown).unwrap_or(0.0));
    let mut text = String::from(
        "# Written by tipwatch identify. URDF and the tables above keep their values; the changes are added to them.\n\
         # Standard deviations and correlations replace [uncertainty] for these parameters. They hold for these nominal\n\
         # values only: run tipwatch identify again after a change.\n[identified]\n",
    );
    let from = found.from.iter().map(|from| quoted(from));
    let _ = writeln!(text, "from = [{}]", joined(from));
    let _ = writeln!(text, "parameters = [{}]", joined(names));
    for (key, numbers) in [
        ("nominal", nominal.collect::<Vec<f64>>()),
        ("change", known.change.clone()),
        ("prior_sigma", known.prior_sigma.clone()),
        ("sigma", sigma.collect()),
    ] {
        let _ = writeln!(
            text,
            "{key} = [{}]",
            joined(numbers.into_iter().map(number))
        );
    }
    if let Some(share) = known.model_share {
        let _ = writeln!(
            text,
            "# residuals are larger than the model_share of [uncertainty] says: this one replaces it\nmodel_share = {}",
            number(share)
        );
    }
    if let Some(factor) = known.sigma_factor {
        let _ = writeln!(
            text,
            "# the stated standard deviations of scales and sensors were widened by this factor (--widen-sigmas)\n\
             sigma_factor = {}",
            number(factor)
        );
    }
    for direction in &known.directions {
        let weights = direction.weights.iter().map(|&weight| number(weight));
        let _ = writeln!(text, "\n[[identified.direction]]");
        let _ = writeln!(text, "share = {}", number(direction.share));
        let _ = writeln!(text, "weights = [{}]", joined(weights));
    }
    text
}

fn joined(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

/// A number as TOML reads it.
fn number(value: f64) -> String {
    match value.is_nan() {
        true => "nan".into(),
        false => format!("{value:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_earlier_result_is_cut_out_and_comments_stay() {
        let text = "name = \"m\" # a machine\n[identified] # old\nchange = [\n  1.0,\n]\n[[identified.direction]]\n\
                    share = 0.5\n# kept with it\n[limits]\nnotice = 0.7 # mine\nlist = [\n[1],\n]\n";
        let kept = without_identified(text);
        assert_eq!(
            kept,
            "name = \"m\" # a machine\n[limits]\nnotice = 0.7 # mine\nlist = [\n[1],\n]\n"
        );
    }

    #[test]
    fn numbers_are_read_back_to_the_bit() {
        for value in [0.1 + 0.2, -1e-300, 5.0, 1e22] {
            let read: toml::Table = toml::from_str(&format!("x = {}", number(value))).unwrap();
            assert_eq!(read["x"].as_float(), Some(value));
        }
    }
}
