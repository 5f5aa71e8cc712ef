//! Writes the files of a machine from its sheet, and checks them.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_datasheet::Sheet;

use crate::setup::check_machine::{self, MachineCheck};
use crate::setup::first_machine::{self, Draft, URDF};
use crate::setup::inspect::Described;

/// Result of writing a new machine.
pub struct NewMachine {
    /// Masses, loads, and everything that was assumed, as text.
    pub summary: String,
    /// The machine by the equations, compared with the axle loads of the sheet.
    pub check: MachineCheck,
    /// The files, in the order of their use.
    pub files: Vec<PathBuf>,
    /// The machine file as it was completed for a log, if one was given.
    pub of_log: Option<OfLog>,
}

/// A machine file that was completed for a log.
pub struct OfLog {
    /// Draft with the values that are still open or assumed.
    pub draft: Draft,
    /// Inputs that the log lacks for an analysis, if any.
    pub missing: Option<String>,
    /// Result of asking the questions: an error if not all could be asked. Given answers are in the machine file in any case.
    pub asked: Result<()>,
}

/// A log of the machine, and the DBC files of its buses.
#[derive(Debug, Clone, Copy)]
pub struct LogOfMachine<'a> {
    /// The log.
    pub log: &'a Path,
    /// The files.
    pub databases: &'a [Described],
}

/// Writes `machine.toml`, `machine.urdf` and `machine.svg` into a folder; existing files are never overwritten. With
/// a log, its signals are bound, and `ask` may put answers into the draft. `answers` is the text of a sheet that exists
/// nowhere else; it is written, too.
///
/// # Errors
/// The sheet contradicts itself, a file exists or cannot be written, or the log cannot be read.
pub fn create(
    sheet: &Sheet,
    out: &Path,
    log: Option<LogOfMachine<'_>>,
    answers: Option<&str>,
    ask: &mut dyn FnMut(&mut Draft) -> Result<()>,
) -> Result<NewMachine> {
    let machine = sheet.machine()?;
    let names = ["sheet.toml", URDF, "machine.toml", "machine.svg"];
    let names = &names[usize::from(answers.is_none())..];
    // answers to many questions must not be lost to a file that is there already
    for name in names {
        let path = out.join(name);
        if path.exists() {
            bail!(
                "{}: expected a file that does not exist yet; give another folder with --out",
                path.display()
            );
        }
    }
    let (text, of_log) = match log {
        None => (machine.machine_file(URDF, None), None),
        Some(of) => {
            let path = out.join("machine.toml");
            let mut draft =
                first_machine::draft_of_sheet(machine.clone(), of.log, &path, of.databases)?;
            let asked = ask(&mut draft);
            let (text, missing) = first_machine::finished(&draft)?;
            let of_log = OfLog {
                draft,
                missing,
                asked,
            };
            (text, Some(of_log))
        }
    };
    let (urdf, picture) = (machine.urdf(), machine.picture());
    let contents = [answers.unwrap_or_default(), &urdf, &text, &picture];
    let contents = &contents[usize::from(answers.is_none())..];
    let unwritable = |path: &Path| format!("{}: cannot be written", path.display());
    fs::create_dir_all(out).with_context(|| unwritable(out))?;
    let mut files = Vec::new();
    for (name, content) in names.iter().zip(contents) {
        let path = out.join(name);
        let file = OpenOptions::new().write(true).create_new(true).open(&path);
        let written = file.and_then(|mut file| file.write_all(content.as_bytes()));
        written.with_context(|| unwritable(&path))?;
        files.push(path);
    }
    let machine_file = MachineFile::read(&out.join("machine.toml"))?;
    Ok(NewMachine {
        summary: machine.summary(),
        check: check_machine::check(&machine_file, None)?,
        files,
        of_log,
    })
}
