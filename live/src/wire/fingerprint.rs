//! Fingerprint of a running program: SHA-256 of the executable, its options and the files that it reads. A recorded number can be
//! traced to them.

use std::path::Path;

use anyhow::{Context, Result};
use tipwatch_binding::{Hash, MachineFile, Urdf, hash, hash_file, hex, running_file};

use crate::wire::session::name_to_wire;
use crate::wire::topics::{TEXT_BYTES, WireMachine};

/// Identity of a program and of its input: version, executable, arguments and files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fingerprint {
    /// Version of the program.
    pub version: String,
    /// Hash of its executable.
    pub program: Hash,
    /// Its arguments as a JSON array, the command among them.
    pub options: String,
    /// Hash of the machine file.
    pub machine: Hash,
    /// Hash of the URDF.
    pub urdf: Hash,
    /// Hash of the result of the machine's commissioning, if one is bound.
    pub commissioning: Option<Hash>,
}

impl Fingerprint {
    /// The fingerprint of this process, with its own arguments.
    ///
    /// # Errors
    /// The executable or the commissioning cannot be read.
    pub fn of_this_program(
        file: &MachineFile,
        urdf: &Urdf,
        commissioning: Option<&Path>,
    ) -> Result<Self> {
        let mut arguments = tipwatch_storage::recorded_arguments();
        arguments.drain(..arguments.len().min(1));
        let (program, _) = hash_file(&running_file()?).context("cannot hash the program itself")?;
        let bound = commissioning.map(|path| {
            let found =
                hash_file(path).with_context(|| format!("{}: cannot read it", path.display()));
            found.map(|(hash, _)| hash)
        });
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").into(),
            program,
            options: serde_json::to_string(&arguments)?,
            machine: hash(file.text.as_bytes()),
            urdf: hash(urdf.text.as_bytes()),
            commissioning: bound.transpose()?,
        })
    }

    /// Hash of the options.
    #[must_use]
    pub fn options_hash(&self) -> Hash {
        hash(self.options.as_bytes())
    }

    /// Names and values for people and files: hashes in hexadecimal.
    #[must_use]
    pub fn entries(&self) -> Vec<(&'static str, String)> {
        let mut entries = vec![
            ("version", self.version.clone()),
            ("program_sha256", hex(&self.program)),
            ("options", self.options.clone()),
            ("options_sha256", hex(&self.options_hash())),
            ("machine_sha256", hex(&self.machine)),
            ("urdf_sha256", hex(&self.urdf)),
        ];
        if let Some(commissioning) = &self.commissioning {
            entries.push(("commissioning_sha256", hex(commissioning)));
        }
        entries
    }

    /// The entries as one line.
    #[must_use]
    pub fn statement(&self) -> String {
        let entries = self.entries();
        let texts: Vec<String> = (entries.iter())
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        texts.join("; ")
    }

    /// Writes it into the message on the machine. Options that are too long are cut there; their hash is of all.
    ///
    /// # Errors
    /// The version is too long for the wire.
    pub fn write_to(&self, wire: &mut WireMachine) -> Result<()> {
        wire.version = name_to_wire(&self.version)?;
        wire.program_sha256 = self.program;
        wire.options_sha256 = self.options_hash();
        wire.machine_sha256 = self.machine;
        wire.urdf_sha256 = self.urdf;
        wire.commissioning_sha256 = self.commissioning.unwrap_or_default();
        let mut end = self.options.len().min(TEXT_BYTES - 1);
        while !self.options.is_char_boundary(end) {
            end -= 1;
        }
        wire.options = [0; TEXT_BYTES];
        wire.options[..end].copy_from_slice(&self.options.as_bytes()[..end]);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::topics::Wire;

    fn fingerprint(options: &str) -> Fingerprint {
        Fingerprint {
            version: "1.2.3".into(),
            program: [1; 32],
            options: options.into(),
            machine: [2; 32],
            urdf: [3; 32],
            commissioning: None,
        }
    }

    #[test]
    fn options_that_are_too_long_are_cut_between_characters_and_hashed_as_a_whole() {
        let mut wire = WireMachine::blank();
        let long = fingerprint(&"é".repeat(400));
        long.write_to(&mut wire).unwrap();
        let text = std::str::from_utf8(&wire.options[..510]).unwrap();
        assert_eq!(text, "é".repeat(255));
        assert_eq!(wire.options[510..], [0, 0]);
        assert_eq!(wire.options_sha256, hash("é".repeat(400).as_bytes()));
        assert_eq!(wire.commissioning_sha256, [0; 32]);
        let other = fingerprint("[\"monitor\"]");
        assert_ne!(other.options_hash(), long.options_hash());
        assert!(
            other
                .statement()
                .contains("options [\"monitor\"]; options_sha256 ")
        );
    }
}
