//! Secrets of URLs leave the programs by no door: not in messages, records or custody, of any command.
//!
//! Reasons: one function reads the arguments of all programs, one type takes the places of the Python package, errors of places
//! redact themselves, and messages pass [`tipwatch_storage::redact`] once more on their way out.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use syn::visit::{self, Visit};
use tipwatch_tests::data;

const PASSWORD: &str = "pass-word-of-me";
const SIGNATURE: &str = "0123456789abcdef-of-the-url";

/// A URL with both kinds of secrets. Nothing answers at this port.
fn url(scheme: &str, name: &str) -> String {
    format!("{scheme}://me:{PASSWORD}@127.0.0.1:9/{name}?sig={SIGNATURE}")
}

/// Runs a program in `folder`; returns whether it succeeds, and everything that it prints or writes into the folder.
fn traces(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
    let output = command
        .args(arguments)
        .current_dir(folder)
        .env("TIPWATCH_STORAGE_ATTEMPTS", "1")
        .env("TIPWATCH_STORAGE_TIMEOUT", "2")
        .env("XDG_STATE_HOME", folder)
        .output()
        .unwrap();
    let mut text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.is_empty(), "{arguments:?} has said nothing");
    text.push_str(&String::from_utf8_lossy(&output.stdout));
    text.push_str(&contents(folder));
    (output.status.success(), text)
}

/// All files below a folder as text.
fn contents(folder: &Path) -> String {
    let mut text = String::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        text.push_str(&path.display().to_string());
        match path.is_dir() {
            true => text.push_str(&contents(&path)),
            false => text.push_str(&String::from_utf8_lossy(&fs::read(&path).unwrap())),
        }
    }
    text
}

fn holds_no_secret(text: &str, arguments: &[&str]) {
    for secret in [PASSWORD, SIGNATURE] {
        assert!(!text.contains(secret), "{arguments:?}:\n{text}");
    }
}

#[test]
fn no_command_repeats_a_secret_of_its_arguments() {
    let machine = data("tiny_lift.toml");
    let machine = machine.to_str().unwrap();
    let log = data("tiny_lift.mcap");
    let log = log.to_str().unwrap();
    // a place that cannot be reached, one of a scheme that is not supported, and one that is no URL
    for place in [
        url("http", "a.mcap"),
        url("ftp", "a b.mcap"),
        url("http", "").replace("127.0.0.1:9", "not a host"),
        format!("s3://bucket/a.mcap?X-Amz-Signature={SIGNATURE}"),
    ] {
        let place = place.as_str();
        let out = format!("--out={place}");
        let machine_there = format!("--machine={place}");
        for arguments in [
            &[
                "tipwatch",
                "analyze",
                place,
                "--machine",
                machine,
                "--out",
                "a",
            ][..],
            &["tipwatch", "analyze", log, "--machine", machine, &out],
            &["tipwatch", "analyze", log, &machine_there, "--out", "b"],
            &[
                "tipwatch",
                "screen",
                place,
                "--machine",
                machine,
                "--out",
                "c",
            ],
            &[
                "tipwatch",
                "screen",
                log,
                "--machine",
                machine,
                "--records",
                place,
            ],
            &["tipwatch", "compare", place, log, "--machine", machine],
            &["tipwatch", "inspect", place],
            &["tipwatch", "check-machine", machine, "--log", place],
            &["tipwatch", "validate", place, "--machine", machine],
            &["tipwatch", "identify", place, "--machine", machine],
            &[
                "tipwatch",
                "whatif",
                place,
                "--machine",
                machine,
                "--out",
                "d",
            ],
            &["tipwatch", "recover", place, "--out", "e.mcap"],
            &["tipwatch", "verify", place],
            &["tipwatch-live", "replay", place, "--machine", machine],
            &["tipwatch-live", "play", place],
            &["tipwatch-live", "monitor", &machine_there],
            &["tipwatch-live", "record", "f", &machine_there],
            &[
                "tipwatch-live",
                "bridge",
                "--mcap",
                "--machine",
                machine,
                "--definitions",
                place,
            ],
            // usage: the parser repeats the argument
            &["tipwatch", "analyze", log, place, place],
            &["tipwatch-live", "replay", log, place],
        ] {
            let folder = tempfile::tempdir().unwrap();
            let (has_succeeded, text) = traces(folder.path(), arguments);
            // a part of a fleet is done when every log has a record, also of a failure
            assert!(!has_succeeded || arguments[1] == "screen", "{arguments:?}");
            holds_no_secret(&text, arguments);
        }
    }
}

#[test]
fn no_record_of_a_failure_repeats_a_secret_of_a_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let lines = [url("http", "a.mcap"), url("http", "b.mcap")].join("\n");
    fs::write(folder.path().join("logs.txt"), lines).unwrap();
    let machine = data("tiny_lift.toml");
    let arguments = [
        "tipwatch",
        "screen",
        "logs.txt",
        "--machine",
        machine.to_str().unwrap(),
        "--records",
        "records",
    ];
    // of all that was found, what was printed comes first, before the manifest, which has the secrets
    let (_, printed) = traces(folder.path(), &arguments);
    let printed = printed.split(folder.path().to_str().unwrap()).next();
    holds_no_secret(printed.unwrap(), &arguments);
    fs::remove_file(folder.path().join("logs.txt")).unwrap();
    let records = contents(folder.path());
    assert!(records.contains("http://127.0.0.1:9/a.mcap"), "{records}");
    holds_no_secret(&records, &arguments);
}

/// The Rust files below a folder, parsed.
fn sources(folder: &Path) -> Vec<(PathBuf, syn::File)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.append(&mut sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            found.push((path, file));
        }
    }
    found
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Whether a path is `env::args` or `env::args_os`.
fn reads_arguments(path: &syn::Path) -> bool {
    let names: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
    let names: Vec<&str> = names.iter().rev().take(2).map(String::as_str).collect();
    matches!(names[..], ["args" | "args_os", "env"])
}

#[test]
fn one_function_reads_the_arguments_of_all_programs() {
    #[derive(Default)]
    struct Found(usize);
    impl Visit<'_> for Found {
        fn visit_path(&mut self, path: &syn::Path) {
            self.0 += usize::from(reads_arguments(path));
            visit::visit_path(self, path);
        }
    }
    let folders = [
        "ingest/storage",
        "ingest",
        "ingest/binding",
        "analyze",
        "analyze/python",
        "live",
        "live/client",
        "packaging",
    ];
    let mut readers = Vec::new();
    for folder in folders {
        for (path, file) in sources(&root().join(folder).join("src")) {
            let mut found = Found::default();
            found.visit_file(&file);
            if found.0 > 0 {
                readers.push(path.file_name().unwrap().to_str().unwrap().to_owned());
            }
        }
    }
    assert_eq!(readers, ["arguments.rs"]);
}

/// Whether a type names a path or a text of the operating system.
fn is_raw_place(of: &syn::Type) -> bool {
    #[derive(Default)]
    struct Found(bool);
    impl Visit<'_> for Found {
        fn visit_path_segment(&mut self, segment: &syn::PathSegment) {
            let name = segment.ident.to_string();
            self.0 |= matches!(name.as_str(), "PathBuf" | "Path" | "OsString" | "OsStr");
            visit::visit_path_segment(self, segment);
        }
    }
    let mut found = Found::default();
    found.visit_type(of);
    found.0
}

#[test]
fn places_come_from_python_by_one_type() {
    #[derive(Default)]
    struct Found {
        functions: usize,
        raw: Vec<String>,
    }
    impl Found {
        fn look_at(&mut self, attributes: &[syn::Attribute], signature: &syn::Signature) {
            let is_called_from_python = attributes.iter().any(|attribute| {
                let name = attribute.path().segments.last().unwrap().ident.to_string();
                matches!(name.as_str(), "pyfunction" | "pymethods" | "new" | "pyo3")
            });
            if is_called_from_python {
                self.functions += 1;
                self.arguments(signature);
            }
        }

        fn arguments(&mut self, signature: &syn::Signature) {
            for argument in &signature.inputs {
                if let syn::FnArg::Typed(argument) = argument
                    && is_raw_place(&argument.ty)
                {
                    self.raw.push(signature.ident.to_string());
                }
            }
        }
    }
    impl Visit<'_> for Found {
        fn visit_item_fn(&mut self, function: &syn::ItemFn) {
            self.look_at(&function.attrs, &function.sig);
            visit::visit_item_fn(self, function);
        }

        fn visit_item_impl(&mut self, block: &syn::ItemImpl) {
            let is_of_python = block
                .attrs
                .iter()
                .any(|attribute| attribute.path().is_ident("pymethods"));
            for item in &block.items {
                if let (syn::ImplItem::Fn(method), true) = (item, is_of_python) {
                    self.functions += 1;
                    self.arguments(&method.sig);
                }
            }
        }

        fn visit_item_enum(&mut self, of: &syn::ItemEnum) {
            let is_argument = of.attrs.iter().any(|attribute| {
                matches!(&attribute.meta, syn::Meta::List(list) if list.tokens.to_string().contains("FromPyObject"))
            });
            let fields = of.variants.iter().flat_map(|variant| &variant.fields);
            if is_argument && fields.clone().any(|field| is_raw_place(&field.ty)) {
                self.raw.push(of.ident.to_string());
            }
        }
    }
    let mut found = Found::default();
    for (_, file) in sources(&root().join("analyze/python/src")) {
        found.visit_file(&file);
    }
    assert!(found.functions > 30, "{} functions", found.functions);
    assert_eq!(found.raw, [""; 0], "expected call::place::Place");
}
