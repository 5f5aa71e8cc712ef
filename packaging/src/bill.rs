//! The bill of materials: what the programs are made of, and under which licences.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use spdx::{Expression, ParseMode};

/// Packages whose dependencies are shipped.
const SHIPPED: [&str; 4] = [
    "tipwatch-analyze",
    "tipwatch-client",
    "tipwatch-live",
    "tipwatch-python",
];

/// Licences under which a dependency may be shipped. None obliges the rest of the program.
const ALLOWED: [&str; 17] = [
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "CDLA-Permissive-2.0",
    "ISC",
    "MIT",
    "MIT-0",
    "MPL-2.0",
    "OFL-1.1",
    "Unicode-3.0",
    "Ubuntu-font-1.0", // fonts of the report on paper, unchanged
    "Unlicense",
    "Zlib",
    "bzip2-1.0.6",
];

/// A crate of the programs.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Crate {
    /// Name.
    pub name: String,
    /// Version.
    pub version: String,
    /// Licence as the crate states it; `None` if it states none.
    pub licence: Option<String>,
    /// Source of the crate; `None` for a crate of this repository.
    pub source: Option<String>,
    /// SHA-256 of its archive, from `Cargo.lock`.
    pub sha256: Option<String>,
    /// Authors, as the crate states them.
    pub authors: Vec<String>,
    /// The folder of its sources.
    pub folder: PathBuf,
}

/// The root of the workspace.
#[must_use]
pub fn workspace() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).into()
}

/// All crates that the programs and the Python module consist of, build and test tools left out.
///
/// # Errors
/// Cargo does not know the dependencies, or `Cargo.lock` cannot be read.
pub fn crates(workspace: &Path) -> Result<Vec<Crate>> {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let run = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(["--filter-platform", "x86_64-unknown-linux-gnu"])
        .current_dir(workspace)
        .output()
        .context("cargo metadata: cannot run it")?;
    if !run.status.success() {
        bail!("cargo metadata: {}", String::from_utf8_lossy(&run.stderr));
    }
    let metadata: Value = serde_json::from_slice(&run.stdout)?;
    let lock = std::fs::read_to_string(workspace.join("Cargo.lock")).context("Cargo.lock")?;
    of_metadata(&metadata, &checksums(&lock)?)
}

/// Name and version of each locked package, and the hash of its archive.
fn checksums(lock: &str) -> Result<BTreeMap<(String, String), String>> {
    let lock: toml::Value = toml::from_str(lock).context("Cargo.lock")?;
    let packages = lock.get("package").and_then(toml::Value::as_array);
    let text = |package: &toml::Value, key: &str| {
        let value = package.get(key).and_then(toml::Value::as_str);
        value.map(ToString::to_string)
    };
    let packages = packages.context("Cargo.lock: expected [[package]]")?.iter();
    Ok(packages
        .filter_map(|package| {
            let (name, version) = (text(package, "name")?, text(package, "version")?);
            Some(((name, version), text(package, "checksum")?))
        })
        .collect())
}

/// Returns the crates in the output of `cargo metadata` that are shipped.
fn of_metadata(
    metadata: &Value,
    checksums: &BTreeMap<(String, String), String>,
) -> Result<Vec<Crate>> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let text = |value: &Value| value.as_str().map(ToString::to_string);
    let packages: BTreeMap<String, Value> = list(&metadata["packages"])
        .into_iter()
        .filter_map(|package| Some((text(&package["id"])?, package)))
        .collect();
    let nodes: BTreeMap<String, Value> = list(&metadata["resolve"]["nodes"])
        .into_iter()
        .filter_map(|node| Some((text(&node["id"])?, node)))
        .collect();
    let is_shipped = |package: &&Value| SHIPPED.iter().any(|name| package["name"] == *name);
    let mut open: Vec<String> = (packages.values().filter(is_shipped))
        .filter_map(|package| text(&package["id"]))
        .collect();
    ensure!(
        open.len() == SHIPPED.len(),
        "cargo metadata: expected the packages {}, found {} of them",
        SHIPPED.join(", "),
        open.len()
    );
    let mut seen = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !seen.insert(id.clone()) {
            continue;
        }
        let node = nodes.get(&id).with_context(|| format!("no node {id}"))?;
        for dependency in list(&node["deps"]) {
            // null: a normal dependency; "build" and "dev" are not part of the program
            let kinds = list(&dependency["dep_kinds"]);
            if kinds.iter().any(|kind| kind["kind"].is_null()) {
                open.extend(text(&dependency["pkg"]));
            }
        }
    }
    let mut found = Vec::new();
    for id in seen {
        let package = &packages[&id];
        let name = text(&package["name"]).context("a package without name")?;
        let version = text(&package["version"]).context("a package without version")?;
        let key = (name.clone(), version.clone());
        found.push(Crate {
            licence: text(&package["license"]),
            source: text(&package["source"]),
            sha256: checksums.get(&key).cloned(),
            authors: list(&package["authors"]).iter().filter_map(text).collect(),
            folder: text(&package["manifest_path"])
                .and_then(|manifest| Some(Path::new(&manifest).parent()?.into()))
                .unwrap_or_default(),
            name,
            version,
        });
    }
    found.sort();
    Ok(found)
}

/// Crates that must not be shipped, with the reason: no licence, one that is no SPDX expression, or one that is not
/// allowed.
#[must_use]
pub fn refused(crates: &[Crate]) -> Vec<String> {
    let reason = |found: &Crate| -> Option<String> {
        let Some(licence) = &found.licence else {
            return Some("states no licence".into());
        };
        let expression = match Expression::parse_mode(licence, ParseMode::LAX) {
            Ok(expression) => expression,
            Err(error) => return Some(format!("licence \"{licence}\": {}", error.reason)),
        };
        let is_allowed = expression.evaluate(|required| {
            let name = required.license.id().map(|id| id.name);
            name.is_some_and(|name| ALLOWED.contains(&name))
        });
        (!is_allowed).then(|| format!("licence \"{licence}\" is not allowed"))
    };
    let tell = |found: &Crate| {
        let reason = reason(found)?;
        Some(format!("{} {}: {reason}", found.name, found.version))
    };
    crates.iter().filter_map(tell).collect()
}

/// The bill in CycloneDX 1.5. The same crates give the same bytes.
#[must_use]
pub fn cyclonedx(crates: &[Crate]) -> Value {
    let component = |found: &Crate| {
        let purl = format!("pkg:cargo/{}@{}", found.name, found.version);
        let mut component = json!({
            "type": "library",
            "bom-ref": purl,
            "name": found.name,
            "version": found.version,
            "purl": purl,
            "licenses": [{ "expression": found.licence.as_deref().unwrap_or("").replace('/', " OR ") }],
        });
        if let Some(sha256) = &found.sha256 {
            component["hashes"] = json!([{ "alg": "SHA-256", "content": sha256 }]);
        }
        component
    };
    json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "name": "tipwatch",
                "version": env!("CARGO_PKG_VERSION"),
            },
        },
        "components": crates.iter().map(component).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(licence: Option<&str>) -> Crate {
        Crate {
            name: "some".into(),
            version: "1.0.0".into(),
            licence: licence.map(ToString::to_string),
            source: None,
            sha256: None,
            authors: Vec::new(),
            folder: PathBuf::new(),
        }
    }

    #[test]
    fn licences_that_oblige_or_are_unknown_are_refused() {
        for allowed in [
            "MIT",
            "MIT OR Apache-2.0",
            "MIT/Apache-2.0",
            "GPL-2.0-only OR MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception",
        ] {
            assert_eq!(refused(&[with(Some(allowed))]), Vec::<String>::new());
        }
        for other in [
            "GPL-3.0-only",
            "GPL-2.0",
            "LGPL-3.0-or-later",
            "AGPL-3.0-only",
            "MIT AND GPL-3.0-only",
            "LicenseRef-Some",
            "free of charge",
            "",
        ] {
            assert_eq!(refused(&[with(Some(other))]).len(), 1, "{other}");
        }
        assert_eq!(refused(&[with(None)]).len(), 1);
    }

    #[test]
    fn only_what_is_shipped_is_listed() {
        let package = |name: &str| json!({ "id": name, "name": name, "version": "1.0.0", "license": "MIT", "source": null });
        let dependency =
            |name: &str, kind: Value| json!({ "pkg": name, "dep_kinds": [{ "kind": kind }] });
        let mut packages: Vec<Value> = SHIPPED.iter().map(|name| package(name)).collect();
        packages.extend(["used", "deep", "tool", "test"].map(package));
        let nodes = json!([
            { "id": SHIPPED[0], "deps": [dependency("used", Value::Null), dependency("test", json!("dev"))] },
            { "id": SHIPPED[1], "deps": [dependency("tool", json!("build"))] },
            { "id": SHIPPED[2], "deps": [] },
            { "id": SHIPPED[3], "deps": [] },
            { "id": "used", "deps": [dependency("deep", Value::Null)] },
            { "id": "deep", "deps": [dependency("used", Value::Null)] },
            { "id": "tool", "deps": [] },
            { "id": "test", "deps": [] },
        ]);
        let metadata = json!({ "packages": packages, "resolve": { "nodes": nodes } });
        let lock = "[[package]]\nname = \"used\"\nversion = \"1.0.0\"\nchecksum = \"ab\"\n";
        let crates = of_metadata(&metadata, &checksums(lock).unwrap()).unwrap();
        let names: Vec<_> = crates.iter().map(|found| found.name.as_str()).collect();
        let shipped = [&["deep"][..], &SHIPPED, &["used"]].concat();
        assert_eq!(names, shipped);
        let used = crates.last().unwrap();
        assert_eq!(used.sha256.as_deref(), Some("ab"));
        let bill = cyclonedx(&crates);
        assert_eq!(bill["components"][5]["hashes"][0]["content"], "ab");
        let none = json!({ "packages": [], "resolve": { "nodes": [] } });
        assert!(of_metadata(&none, &BTreeMap::new()).is_err());
    }
}
