//! A machine from answers on the terminal, which are not lost if they contradict each other.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Error, Result, anyhow};
use tipwatch_datasheet::Sheet;

use super::files::{LogOfMachine, NewMachine, create};
use crate::setup::first_machine::Draft;

/// Creates a machine as [`create`] does, from the text of a sheet that exists nowhere else. If no machine can be made of it, the
/// text is kept as `sheet.toml` in the folder.
///
/// # Errors
/// As [`create`]; the message names the file with the answers, or has them if they cannot be written.
pub fn create_from_answers(
    answers: &str,
    out: &Path,
    log: Option<LogOfMachine<'_>>,
    ask: &mut dyn FnMut(&mut Draft) -> Result<()>,
) -> Result<NewMachine> {
    let made = Sheet::from_toml(answers, "the answers")
        .map_err(Error::from)
        .and_then(|sheet| create(&sheet, out, log, Some(answers), ask));
    made.map_err(|error| kept(&error, answers, out))
}

/// The error, with where the answers are now.
fn kept(error: &Error, answers: &str, out: &Path) -> Error {
    let path = out.join("sheet.toml");
    let write = || {
        if fs::read_to_string(&path).is_ok_and(|text| text == answers) {
            return Ok(());
        }
        fs::create_dir_all(out)?;
        let mut file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&path)?;
        file.write_all(answers.as_bytes())
    };
    match write() {
        Ok(()) => anyhow!(
            "{error:#}\nThe answers are kept: correct {path}, then run `tipwatch machine new {path} --out {out}`.",
            path = path.display(),
            out = out.display()
        ),
        Err(_) => anyhow!("{error:#}\nThe answers, to start from:\n{answers}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refused_answers_are_kept() {
        let folder = tempfile::TempDir::new().unwrap();
        let out = folder.path().join("machine");
        let answers = "template = \"forklift\"\nname = \"seven\"\n";
        let refused = |answers: &str| {
            let made = create_from_answers(answers, &out, None, &mut |_| Ok(()));
            made.err().unwrap().to_string()
        };
        let message = refused(answers);
        let path = out.join("sheet.toml");
        assert!(message.contains("the answers"), "{message}");
        assert!(message.contains(&path.display().to_string()), "{message}");
        assert_eq!(fs::read_to_string(&path).unwrap(), answers);
        // the next attempt overwrites nothing
        let again = refused("name = \"eight\"\n");
        assert!(again.contains("eight"), "{again}");
        assert_eq!(fs::read_to_string(&path).unwrap(), answers);
    }
}
