//! Writes the files of a machine from its sheet, and checks them.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_datasheet::Sheet;

use crate::setup::check_machine::{self, MachineCheck};
use crate::setup::first_machine;
use crate::setup::inspect::Described;

/// What was written.
#[derive(Debug)]
pub struct NewMachine {
    /// Masses, loads, and everything that was assumed, as text.
    pub summary: String,
    /// The machine by the equations, compared with the axle loads of the sheet.
    pub check: MachineCheck,
    /// The files, in the order of their use.
    pub files: Vec<PathBuf>,
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
/// a log, its signals are bound. `answers` is the text of a sheet that exists nowhere else; it is written, too.
///
/// # Errors
/// The sheet contradicts itself, a file exists or cannot be written, or the log cannot be read.
pub fn create(
    sheet: &Sheet,
    out: &Path,
    log: Option<LogOfMachine<'_>>,
    answers: Option<&str>,
) -> Result<NewMachine> {
    let machine = sheet.machine()?;
    let urdf = machine.urdf();
    let signals = log
        .map(|of| {
            let out = out.join("machine.toml");
            first_machine::signals(
                of.log,
                of.databases,
                &out,
                &urdf,
                &machine.constant_joints(),
            )
        })
        .transpose()?;
    let text = machine.machine_file("machine.urdf", signals.as_deref());
    let picture = machine.picture();
    let sheet_text = answers.map(|answers| ("sheet.toml", answers));
    let contents: Vec<(&str, &str)> = sheet_text
        .into_iter()
        .chain([
            ("machine.urdf", urdf.as_str()),
            ("machine.toml", text.as_str()),
            ("machine.svg", picture.as_str()),
        ])
        .collect();
    let unwritable = |path: &Path| format!("{}: cannot be written", path.display());
    fs::create_dir_all(out).with_context(|| unwritable(out))?;
    for (name, _) in &contents {
        let path = out.join(name);
        if path.exists() {
            bail!(
                "{}: expected a file that does not exist yet; give another folder with --out",
                path.display()
            );
        }
    }
    let mut files = Vec::new();
    for (name, content) in contents {
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
    })
}
