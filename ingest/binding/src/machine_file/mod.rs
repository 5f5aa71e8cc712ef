//! Reads a machine file and its URDF (Unified Robot Description Format).

mod descriptions;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use tipwatch_ingest::{Log, RobotDescription, robot_descriptions};
use tipwatch_mechanics::MachineError;
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec};

use crate::error::CanError;
use crate::files::read_text;
pub(crate) use descriptions::{mass_text, other_mass};

/// A machine file as read.
#[derive(Debug, Clone)]
pub struct MachineFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Its content.
    pub spec: MachineSpec,
    /// Its text, for hashing.
    pub text: String,
    /// Whether impossible inertias are accepted by option and not by a key.
    accepts_by_option: bool,
    /// Whether the machine has another name than in the text of the file.
    is_renamed: bool,
}

/// The text of a URDF and its origin, for error messages.
#[derive(Debug, Clone)]
pub struct Urdf {
    /// The file or topic.
    pub name: String,
    /// The text.
    pub text: String,
}

/// Error: a machine file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MachineFileError {
    /// The machine file cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// Its URDF cannot be read.
    #[error("{}: its URDF {} cannot be read", file.display(), path.display())]
    ReadUrdf {
        /// The machine file.
        file: PathBuf,
        /// The URDF.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The machine file names a URDF and another one was given.
    #[error("{}: expected no --urdf beside urdf = ... of the machine file ({}), found {}", file.display(), named.display(), given.display())]
    TwoUrdfs {
        /// The machine file.
        file: PathBuf,
        /// URDF that the machine file names.
        named: PathBuf,
        /// The URDF that was given.
        given: PathBuf,
    },
    /// Impossible inertias were accepted by option, and the machine file does not accept them.
    #[error("{}: expected no --accept-inertias beside accept_inertias = false, found both; remove one", file.display())]
    RefusesInertias {
        /// The machine file.
        file: PathBuf,
    },
    /// No URDF was given.
    #[error("{}: expected urdf = \"...\" in the machine file or {elsewhere}, found neither", file.display())]
    NoUrdf {
        /// The machine file.
        file: PathBuf,
        /// Other possible source of the URDF, as text.
        elsewhere: &'static str,
    },
    /// The log has several URDFs, and they describe different machines.
    #[error(
        "{}: expected one robot description on {topic}, found {count} different ones: link \"{link}\" has {earlier} in \
         the one at log time {earlier_ns} ns and {last} in the last one, at {last_ns} ns; write the one that is right to \
         a file and name it with urdf = \"FILE\" in the machine file or --urdf FILE",
        file.display()
    )]
    SeveralUrdfs {
        /// The machine file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Number of different robot descriptions.
        count: usize,
        /// The first link that differs.
        link: String,
        /// Mass of the link in an earlier description, as text.
        earlier: String,
        /// Log time of that description (ns).
        earlier_ns: i64,
        /// Mass of the link in the last description, as text.
        last: String,
        /// Log time of the last description (ns).
        last_ns: i64,
    },
    /// The log that may contain the URDF cannot be read.
    #[error(transparent)]
    Log(#[from] tipwatch_ingest::Error),
    /// A CAN signal is not described.
    #[error(transparent)]
    Can(#[from] CanError),
    /// The text is not a valid machine file, or describes an invalid machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
}

impl MachineFile {
    /// Reads a machine file.
    ///
    /// # Errors
    /// The file cannot be read, or is not a valid machine file.
    pub fn read(path: &Path) -> Result<Self, MachineFileError> {
        let text = read_text(path).map_err(|source| MachineFileError::Read {
            path: path.into(),
            source,
        })?;
        Self::from_text(path, &text)
    }

    /// Parses a machine file; its URDF is searched relative to `path`.
    ///
    /// # Errors
    /// The text is not a valid machine file.
    pub fn from_text(path: &Path, text: &str) -> Result<Self, MachineFileError> {
        Ok(Self {
            path: path.into(),
            spec: MachineSpec::from_toml(text, &path.display().to_string())?,
            text: text.into(),
            accepts_by_option: false,
            is_renamed: false,
        })
    }

    /// Adds a URDF to a machine file that names none.
    ///
    /// # Errors
    /// The machine file names another one, or the URDF cannot be found.
    pub fn with_urdf(mut self, urdf: &Path) -> Result<Self, MachineFileError> {
        let found = urdf
            .canonicalize()
            .map_err(|source| MachineFileError::ReadUrdf {
                file: self.path.clone(),
                path: urdf.into(),
                source,
            })?;
        if let Some(named) = self.urdf_path()
            && named.canonicalize().ok().as_ref() != Some(&found)
        {
            return Err(MachineFileError::TwoUrdfs {
                file: self.path,
                named,
                given: urdf.into(),
            });
        }
        self.spec.urdf = Some(found.display().to_string());
        Ok(self)
    }

    /// Accepts impossible inertias of the URDF, as `accept_inertias = true` in the machine file does.
    ///
    /// # Errors
    /// The machine file refuses them.
    pub fn accepting_inertias(mut self) -> Result<Self, MachineFileError> {
        match self.spec.accept_inertias {
            Some(true) => {}
            Some(false) => return Err(MachineFileError::RefusesInertias { file: self.path }),
            None => {
                self.spec.accept_inertias = Some(true);
                self.accepts_by_option = true;
            }
        }
        Ok(self)
    }

    /// Names the machine.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        self.is_renamed |= self.spec.name != name;
        self.spec.name = name.to_owned();
        self
    }

    /// Its name, if that is not the one in its text.
    #[must_use]
    pub fn other_name(&self) -> Option<&str> {
        self.is_renamed.then_some(self.spec.name.as_str())
    }

    /// Returns the text of a machine file that describes this machine: its own, with the key that an option added.
    #[must_use]
    pub fn effective_text(&self) -> Cow<'_, str> {
        match self.accepts_by_option {
            true => Cow::Owned(format!("accept_inertias = true # by option\n{}", self.text)),
            false => Cow::Borrowed(&self.text),
        }
    }

    /// Path of a file that the machine file names, relative to it.
    #[must_use]
    pub fn beside(&self, file: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// Path of the URDF that the machine file names.
    #[must_use]
    pub fn urdf_path(&self) -> Option<PathBuf> {
        self.spec.urdf.as_ref().map(|name| self.beside(name))
    }

    /// The URDF named by the machine file, relative to it; else the file `other`, else the one in
    /// the log.
    ///
    /// # Errors
    /// The URDF cannot be read, or there is none.
    pub fn urdf(&self, other: Option<&Path>, log: Option<&Log>) -> Result<Urdf, MachineFileError> {
        let beside = self.urdf_path();
        if let Some(path) = beside.or_else(|| other.map(Path::to_path_buf)) {
            let name = path.display().to_string();
            let text = read_text(&path);
            let text = text.map_err(|source| MachineFileError::ReadUrdf {
                file: self.path.clone(),
                path,
                source,
            })?;
            return Ok(Urdf { name, text });
        }
        let mut described = log.map(robot_descriptions).transpose()?.unwrap_or_default();
        let Some(last) = described.pop() else {
            return Err(MachineFileError::NoUrdf {
                file: self.path.clone(),
                elsewhere: match log {
                    Some(_) => "a topic /robot_description in the log",
                    None => "--urdf",
                },
            });
        };
        self.check_one_machine(&described, &last)?;
        Ok(Urdf {
            name: format!("topic {}", last.topic),
            text: last.text,
        })
    }

    /// Checks that earlier robot descriptions of a log are placeholders, or describe the machine of the last one.
    fn check_one_machine(
        &self,
        others: &[RobotDescription],
        last: &RobotDescription,
    ) -> Result<(), MachineFileError> {
        for earlier in others {
            if let Some(masses) = other_mass(earlier, last) {
                return Err(MachineFileError::SeveralUrdfs {
                    file: self.path.clone(),
                    topic: last.topic.clone(),
                    count: others.len() + 1,
                    link: masses.link,
                    earlier: mass_text(masses.earlier),
                    earlier_ns: earlier.log_time_ns,
                    last: mass_text(masses.last),
                    last_ns: last.log_time_ns,
                });
            }
        }
        Ok(())
    }

    /// The machine without a log: every joint not moved by a linkage counts as measured.
    ///
    /// # Errors
    /// The machine file or its URDF does not describe a valid machine.
    pub fn check_alone(&self) -> Result<Machine, MachineFileError> {
        let urdf = self.urdf(None, None)?;
        Ok(self
            .spec
            .check(&urdf.text, &urdf.name, LogFacts::default())?)
    }
}
