//! The fleet file: assigns machine files to logs.
//!
//! ```toml
//! default = "forwarder.toml"           # for logs without a matching rule; without it they fail
//!
//! [[machine]]
//! file = "fw-01.toml"                  # relative to the fleet file
//! path = "**/fw-01/**"                 # absolute path of the log: * within a name, ** across folders
//!
//! [[machine]]
//! file = "harvester.toml"
//! topic = "/harvester/joint_states"    # the log has this topic; * as in paths
//!
//! [[machine]]
//! file = "fw-09.toml"
//! metadata = { record = "session", key = "vehicle", value = "FW-009*" }
//! ```
//!
//! `name = "fw-07"` in a rule names the machine, for one machine file of several machines that are alike; without it the machine
//! file names it.
//!
//! `type = "forwarder 8 t"` in a rule names the type of its machine, whose machines are compared with each
//! other; without it machines with the same URDF are of one type.
//!
//! All conditions of a rule must hold. If rules of different machines match one log, the log fails,
//! because a wrong machine gives plausible but wrong loads.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use glob::{MatchOptions, Pattern};
use serde::Deserialize;
use tipwatch_binding::{MachineFile, read_text};
use tipwatch_ingest::{Log, MetadataRecord, metadata_records};

use super::failure::FailureKind;
use super::version::{machine_sha256, named_files, urdf_hash};
use crate::base::file_hash::FileHash;

/// A fleet file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FleetSpec {
    default: Option<PathBuf>,
    #[serde(default, rename = "machine")]
    machines: Vec<RuleSpec>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RuleSpec {
    file: PathBuf,
    name: Option<String>,
    path: Option<String>,
    topic: Option<String>,
    metadata: Option<MetadataSpec>,
    #[serde(rename = "type")]
    kind: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MetadataSpec {
    record: Option<String>,
    key: String,
    value: String,
}

/// The machine files of a fleet and the rules that choose among them.
#[derive(Debug)]
pub struct Fleet {
    machines: Vec<MachineFile>,
    rules: Vec<Rule>,
    /// Index of the default machine.
    default: Option<usize>,
}

#[derive(Debug)]
struct Rule {
    /// Index of the machine.
    machine: usize,
    path: Option<Pattern>,
    topic: Option<Pattern>,
    metadata: Option<MetadataRule>,
    kind: Option<String>,
}

/// The machine of a log.
pub(super) struct Assigned<'a> {
    pub(super) machine: &'a MachineFile,
    kind: Option<&'a str>,
}

impl Assigned<'_> {
    /// Type of the machine: that of the fleet file, else its `urdf`; `None` without both.
    pub(super) fn kind(&self, urdf: Option<&FileHash>) -> Option<String> {
        if let Some(kind) = self.kind {
            return Some(kind.into());
        }
        // by content: copies of a file may have any name
        Some(format!("URDF {}", urdf?.sha256.as_ref()?.get(..8)?))
    }
}

#[derive(Debug)]
struct MetadataRule {
    record: Option<String>,
    key: String,
    value: Pattern,
}

impl Fleet {
    /// A reason with the machine files named without their folders.
    pub(super) fn without_folders(&self, reason: &str) -> String {
        let folders = self
            .machines
            .iter()
            .filter_map(|machine| machine.path.parent());
        let names = folders.map(|folder| folder.join("").display().to_string());
        let names = names.filter(|name| name.len() > 1);
        names.fold(reason.to_owned(), |text, name| text.replace(&name, ""))
    }

    /// One machine for all logs.
    #[must_use]
    pub fn of_one(machine: MachineFile) -> Self {
        Self {
            machines: vec![machine],
            rules: Vec::new(),
            default: Some(0),
        }
    }

    /// Reads a fleet file and the machine files that it names.
    ///
    /// # Errors
    /// A file cannot be read, or is not valid.
    pub fn read(path: &Path) -> Result<Self> {
        let place = path.display();
        let text = read_text(path).with_context(|| format!("{place}: cannot be read"))?;
        let spec: FleetSpec =
            toml::from_str(&text).with_context(|| format!("{place}: not a valid fleet file"))?;
        if spec.machines.is_empty() && spec.default.is_none() {
            bail!("{place}: expected at least one [[machine]] or default, found neither");
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut fleet = Self {
            machines: Vec::new(),
            rules: Vec::new(),
            default: None,
        };
        for (i, rule) in spec.machines.into_iter().enumerate() {
            let machine = fleet.machine(&folder.join(&rule.file), rule.name.as_deref());
            let checked = machine.and_then(|machine| rule.check(machine));
            fleet
                .rules
                .push(checked.with_context(|| format!("{place}: machine {}", i + 1))?);
        }
        if let Some(file) = spec.default {
            fleet.default = Some(fleet.machine(&folder.join(file), None)?);
        }
        Ok(fleet)
    }

    /// Index of the machine of a machine file with this name, else with that in the file.
    fn machine(&mut self, path: &Path, name: Option<&str>) -> Result<usize> {
        let mut machine = MachineFile::read(path)?;
        if let Some(name) = name {
            if name.trim().is_empty() {
                bail!("name: expected a name, found \"{name}\"");
            }
            machine = machine.named(name);
        }
        let known = self.machines.iter();
        let known = known.map(|known| (&known.path, &known.spec.name));
        if let Some(known) = known
            .enumerate()
            .find(|(_, known)| *known == (&machine.path, &machine.spec.name))
        {
            return Ok(known.0);
        }
        self.machines.push(machine);
        Ok(self.machines.len() - 1)
    }

    /// Changes every machine file.
    ///
    /// # Errors
    /// A machine file cannot be changed like that.
    pub fn with_machines(
        mut self,
        change: impl Fn(MachineFile) -> Result<MachineFile>,
    ) -> Result<Self> {
        self.machines = self
            .machines
            .into_iter()
            .map(change)
            .collect::<Result<_>>()?;
        Ok(self)
    }

    /// Says which machine files have the same name and differ, by themselves or by the files that they name: tables and pages know a machine by its name.
    #[must_use]
    pub(super) fn note(&self) -> Option<String> {
        let mut of_name = BTreeMap::<&str, BTreeMap<(String, String), &Path>>::new();
        for machine in &self.machines {
            // what cannot be read is a reason why each of its logs fails
            let urdf = urdf_hash(machine).ok().flatten();
            let named = named_files(machine, urdf.as_ref()).unwrap_or_default();
            let files = of_name.entry(&machine.spec.name).or_default();
            files
                .entry((machine_sha256(machine), named))
                .or_insert(&machine.path);
        }
        let shared = of_name.iter().filter(|(_, files)| files.len() > 1);
        let is_of_one_text = |files: &BTreeMap<(String, String), &Path>| {
            let texts: BTreeSet<&String> = files.keys().map(|(text, _)| text).collect();
            texts.len() < files.len()
        };
        let by_urdf = match shared.clone().any(|(_, files)| is_of_one_text(files)) {
            true => "; where their texts are equal, their URDF or DBC files differ",
            false => "",
        };
        let shared: Vec<String> = shared
            .map(|(name, files)| {
                let mut files: Vec<String> = files
                    .values()
                    .map(|file| file.display().to_string())
                    .collect();
                files.sort();
                format!("{name} ({})", files.join(", "))
            })
            .collect();
        (!shared.is_empty()).then(|| {
            format!(
                "machine files that differ have the same name: {}{by_urdf}; their logs count as those of one machine: give each machine \
                 a name of its own",
                shared.join("; ")
            )
        })
    }

    /// All files that the analyses need: machine files, their URDF and DBC files.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let of_machine = |machine: &MachineFile| {
            let mut files = vec![machine.path.clone()];
            files.extend(machine.urdf_path());
            files.extend(machine.dbc_files());
            files
        };
        let mut files: Vec<PathBuf> = self.machines.iter().flat_map(of_machine).collect();
        let mut known = BTreeSet::new();
        files.retain(|file| known.insert(file.clone()));
        files
    }

    /// The machine file of a log, which is opened if a rule needs its contents and it was not opened before.
    ///
    /// # Errors
    /// A rule needs the contents of the log and it cannot be opened, no rule matches, or rules of
    /// several machines match.
    pub(super) fn machine_of(&self, log: &Path, opened: &mut Option<Log>) -> Result<Assigned<'_>> {
        let mut content = None;
        if self.rules.iter().any(Rule::needs_content) {
            let opened = match opened {
                Some(opened) => opened,
                None => opened.insert(Log::open(log)?),
            };
            content = Some(Content::of(opened)?);
        }
        let matching = self
            .rules
            .iter()
            .filter(|rule| rule.holds(log, content.as_ref()));
        let matching: Vec<&Rule> = matching.collect();
        let mut chosen: Vec<usize> = matching.iter().map(|rule| rule.machine).collect();
        chosen.sort_unstable();
        chosen.dedup();
        match (chosen.as_slice(), self.default) {
            (&[machine], _) | (&[], Some(machine)) => Ok(Assigned {
                machine: &self.machines[machine],
                kind: matching.iter().find_map(|rule| rule.kind.as_deref()),
            }),
            (&[], None) => Err(FailureKind::Machine.error(format!(
                "{}: expected a matching rule or a default in the fleet file, found neither",
                log.display()
            ))),
            (several, _) => {
                let file = |&m: &usize| self.machines[m].path.display().to_string();
                let name = |m: &usize| format!("{} ({})", file(m), self.machines[*m].spec.name);
                let files: BTreeSet<String> = several.iter().map(file).collect();
                let names: Vec<String> = match files.len() < several.len() {
                    true => several.iter().map(name).collect(),
                    false => several.iter().map(file).collect(),
                };
                Err(FailureKind::Machine.error(format!(
                    "{}: expected one machine, found matching rules for {}",
                    log.display(),
                    names.join(" and ")
                )))
            }
        }
    }
}

/// The properties of a log that rules match.
struct Content {
    topics: Vec<String>,
    metadata: Vec<MetadataRecord>,
}

impl Content {
    fn of(log: &Log) -> Result<Self> {
        Ok(Self {
            topics: log
                .topics()
                .iter()
                .map(|topic| topic.name.clone())
                .collect(),
            metadata: metadata_records(log)?,
        })
    }
}

impl RuleSpec {
    fn check(self, machine: usize) -> Result<Rule> {
        if self.path.is_none() && self.topic.is_none() && self.metadata.is_none() {
            bail!("expected path, topic or metadata, found none");
        }
        let pattern = |key: &str, text: Option<&String>| {
            let pattern = text.map(|text| Pattern::new(text));
            pattern
                .transpose()
                .with_context(|| format!("{key}: not a valid pattern"))
        };
        let metadata = self.metadata.as_ref();
        let value = pattern("metadata.value", metadata.map(|wanted| &wanted.value))?;
        Ok(Rule {
            machine,
            kind: self.kind,
            path: pattern("path", self.path.as_ref())?,
            topic: pattern("topic", self.topic.as_ref())?,
            metadata: self.metadata.zip(value).map(|(spec, value)| MetadataRule {
                record: spec.record,
                key: spec.key,
                value,
            }),
        })
    }
}

impl Rule {
    fn needs_content(&self) -> bool {
        self.topic.is_some() || self.metadata.is_some()
    }

    fn holds(&self, log: &Path, content: Option<&Content>) -> bool {
        let path = |pattern: &Pattern| pattern.matches_path_with(log, EXACT);
        let topics = content.map_or(&[][..], |content| &content.topics);
        let topic = |pattern: &Pattern| topics.iter().any(|name| pattern.matches_with(name, EXACT));
        let records = content.map_or(&[][..], |content| &content.metadata);
        let metadata = |wanted: &MetadataRule| records.iter().any(|record| wanted.holds(record));
        self.path.as_ref().is_none_or(path)
            && self.topic.as_ref().is_none_or(topic)
            && self.metadata.as_ref().is_none_or(metadata)
    }
}

impl MetadataRule {
    fn holds(&self, record: &MetadataRecord) -> bool {
        let named = self.record.as_ref().is_none_or(|name| *name == record.name);
        let value = record.values.get(&self.key);
        named && value.is_some_and(|value| self.value.matches(value))
    }
}

/// `*` does not match a `/`, `**` does.
const EXACT: MatchOptions = MatchOptions {
    case_sensitive: true,
    require_literal_separator: true,
    require_literal_leading_dot: false,
};
