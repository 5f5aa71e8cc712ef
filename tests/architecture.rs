//! Dependency rules: the folders of a crate form floors, and a file imports only from its own floor or from below.
//!
//! `TIPWATCH_TREE=path` checks another tree.

mod graph;
mod sources;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use graph::{Graph, circles};
use sources::{Crate, Imports};

/// Most rooms (folders and files) at the top of a crate.
const MOST_ROOMS: usize = 14;

/// Crates that a crate may use, and the order of its rooms.
struct Rule {
    folder: &'static str,
    crates: Vec<&'static str>,
    /// The rooms at its top, lowest floor first; empty for a crate without declared floors.
    floors: Vec<&'static str>,
}

/// The folder of each crate, the crates that it may use, and the rooms at its top, lowest floor first; none for a crate
/// without declared floors.
const RULES: [[&str; 3]; 17] = [
    ["packaging/allocator", "", ""],
    // in what the macro writes
    ["packaging/language/macros", "tipwatch_language", ""],
    ["packaging/language", "tipwatch_language_macros", ""],
    [
        "mechanics",
        "tipwatch_language",
        "named number geometry machine state dynamics estimation wheel_loads closed_form verdict explain \
         evaluate prediction studies",
    ],
    [
        "mechanics/suspension",
        "tipwatch_mechanics",
        "error condensed prediction cost solve problem guard hydraulics control replay protocol",
    ],
    [
        "calibration",
        "tipwatch_language tipwatch_mechanics",
        "commissioning identification",
    ],
    [
        "ingest/can",
        "tipwatch_language",
        "bits frame unit tally container message j1939 database decoder",
    ],
    [
        "ingest/storage",
        "",
        "redact error runtime ranges key listing counted place arguments bucket folder object",
    ],
    [
        "ingest",
        "tipwatch_can tipwatch_language tipwatch_storage",
        "table schema message file decode formats log topics clock columns write",
    ],
    [
        "ingest/binding",
        "tipwatch_calibration tipwatch_can tipwatch_ingest tipwatch_language tipwatch_mechanics",
        "",
    ],
    [
        "analyze/datasheet",
        "tipwatch_mechanics",
        "error quantity prior sheet body weights output dialogue",
    ],
    [
        "analyze",
        "tipwatch_allocator tipwatch_binding tipwatch_can tipwatch_datasheet tipwatch_calibration \
         tipwatch_ingest tipwatch_language tipwatch_mechanics tipwatch_storage tipwatch_suspension",
        "base load events analysis policy tables page suspension report setup output compare screen cli",
    ],
    [
        "live",
        "tipwatch_binding tipwatch_calibration tipwatch_can tipwatch_ingest tipwatch_mechanics \
         tipwatch_storage tipwatch_suspension",
        "safety_limits system wire node alarm guard monitor control replay record operator bridge cli",
    ],
    ["live/client", "tipwatch_live", "failure service client c"],
    [
        "packaging",
        "tipwatch_analyze tipwatch_live",
        "bill third_party pages",
    ],
    [
        "analyze/python",
        "tipwatch_allocator tipwatch_analyze tipwatch_binding tipwatch_ingest tipwatch_mechanics \
         tipwatch_storage",
        "call program settings arrays table inputs pose evaluation machine read analysis studies identify \
         screen",
    ],
    ["tests/benchmarks", "", "processors figure table attempts"],
];

fn tree() -> PathBuf {
    let own = || Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    std::env::var_os("TIPWATCH_TREE").map_or_else(own, PathBuf::from)
}

/// The crates of the workspace, without the tests.
fn crates() -> Vec<String> {
    let text = std::fs::read_to_string(tree().join("Cargo.toml")).unwrap();
    let members = text
        .split_once("members = [")
        .unwrap()
        .1
        .split_once(']')
        .unwrap()
        .0;
    let names = members.split(',').map(|name| name.trim().trim_matches('"'));
    let crates = names.filter(|name| !name.is_empty() && *name != "tests");
    crates.map(String::from).collect()
}

#[track_caller]
fn assert_none(complaints: &[String]) {
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
}

/// A crate of the tree with its rule.
struct Known {
    rule: Rule,
    src: PathBuf,
    sources: Crate,
    imports: Imports,
}

/// The crates of the tree, read once for all tests.
static KNOWN: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let known = |name: String| {
        let rule = RULES.into_iter().find(|[folder, ..]| *folder == name);
        let [folder, crates, floors] =
            rule.unwrap_or_else(|| panic!("{name}: no rule in tests/architecture.rs; add one"));
        let rule = Rule {
            folder,
            crates: crates.split_whitespace().collect(),
            floors: floors.split_whitespace().collect(),
        };
        let src = tree().join(&name).join("src");
        let sources = Crate::read(&src);
        let imports = sources.imports();
        Known {
            rule,
            src,
            sources,
            imports,
        }
    };
    crates().into_iter().map(known).collect()
});

/// Complaints about every crate of the tree.
fn about_crates(complaints: impl Fn(&Known) -> Vec<String>) -> Vec<String> {
    let about = |known: &Known| -> Vec<String> {
        let found = complaints(known).into_iter();
        found
            .map(|text| format!("{}: {text}", known.rule.folder))
            .collect()
    };
    KNOWN.iter().flat_map(about).collect()
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    assert_none(&about_crates(|known| circles_of_files(&known.imports)));
}

#[test]
fn no_folders_import_each_other_in_a_circle() {
    assert_none(&about_crates(|known| circles_of_folders(&known.imports)));
}

#[test]
fn folders_import_only_from_floors_below() {
    assert_none(&about_crates(|known| {
        let floors = &known.rule.floors;
        [
            missing_floors(&rooms(&known.src), floors),
            upward(&known.imports, floors),
        ]
        .concat()
    }));
}

#[test]
fn a_crate_has_few_rooms_at_the_top() {
    assert_none(&about_crates(|known| {
        let rooms = rooms(&known.src);
        let complaint = format!(
            "{} rooms at the top, expected at most {MOST_ROOMS}: put those that change together into a folder: {}",
            rooms.len(),
            rooms.join(", ")
        );
        Vec::from_iter((rooms.len() > MOST_ROOMS).then_some(complaint))
    }));
}

#[test]
fn every_folder_states_its_purpose_in_its_first_line() {
    assert_none(&about_crates(|known| folders_without_a_purpose(&known.src)));
}

#[test]
fn crates_use_only_those_below_them() {
    assert_none(&about_crates(|known| {
        foreign_crates(&known.sources, &known.rule.crates)
    }));
}

#[test]
fn mechanics_never_names_the_suspension_crate() {
    let mut complaints = Vec::new();
    let own = tree().join("mechanics/suspension");
    let all = files(&tree().join("mechanics")).into_iter();
    for file in all.filter(|file| !file.starts_with(&own)) {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        if text.contains("tipwatch_suspension") || text.contains("tipwatch-suspension") {
            complaints.push(format!(
                "{}: names the crate of the active suspension; move what needs it there",
                file.display()
            ));
        }
    }
    assert_none(&complaints);
}

/// Folders and files at the top of a crate.
fn rooms(src: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(src).unwrap().map(|entry| entry.unwrap());
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let is_room = |name: &String| {
        let is_code = name.ends_with(".rs") || !name.contains('.');
        is_code && !["lib.rs", "main.rs"].contains(&name.as_str())
    };
    let mut rooms: Vec<String> = names.filter(is_room).map(|name| room(&name)).collect();
    rooms.sort();
    rooms.dedup();
    rooms.retain(|name| {
        src.join(format!("{name}.rs")).exists() || !files(&src.join(name)).is_empty()
    });
    rooms
}

/// The room that a file is in.
fn room(file: &str) -> String {
    let first = file.split('/').next().unwrap_or(file);
    first.trim_end_matches(".rs").to_string()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path),
        }
    }
    found.sort();
    found
}

/// Describes an import: "a uses X, Y of b".
fn told(imports: &Imports, from: &str, to: &str) -> String {
    let items = imports.get(&(from.to_string(), to.to_string()));
    let items: Vec<&str> = items.into_iter().flatten().map(String::as_str).collect();
    format!("{from} uses {} of {to}", items.join(", "))
}

fn circles_of_files(imports: &Imports) -> Vec<String> {
    let mut graph = Graph::new();
    for (from, to) in imports.keys() {
        graph.entry(from.clone()).or_default().insert(to.clone());
    }
    let complaint = |(circle, size): (Vec<String>, usize)| {
        let next = circle.iter().cycle().skip(1);
        let uses = circle
            .iter()
            .zip(next)
            .map(|(from, to)| told(imports, from, to));
        let uses = uses.collect::<Vec<_>>().join("; ");
        format!(
            "circle among {size} files: {uses}; move what both need down into a file of its own, or pass it as an argument"
        )
    };
    circles(&graph).into_iter().map(complaint).collect()
}

/// Circles among the folders and files of each folder, where no circle of files is the reason.
fn circles_of_folders(imports: &Imports) -> Vec<String> {
    let mut graphs: BTreeMap<String, Graph> = BTreeMap::new();
    let mut reasons: BTreeMap<(String, String), String> = BTreeMap::new();
    for (from, to) in imports.keys() {
        let (a, b): (Vec<_>, Vec<_>) = (from.split('/').collect(), to.split('/').collect());
        let common = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
        // a facade belongs to the folder above
        if [&a, &b]
            .iter()
            .any(|path| ["mod.rs", "lib.rs"].contains(&path[common]))
        {
            continue;
        }
        let beside = |path: &[&str]| path[common].to_string();
        let (below, above) = (beside(&a), beside(&b));
        let folder = graphs.entry(a[..common].join("/")).or_default();
        folder
            .entry(below.clone())
            .or_default()
            .insert(above.clone());
        let key = (format!("{}/{below}", a[..common].join("/")), above);
        reasons
            .entry(key)
            .or_insert_with(|| told(imports, from, to));
    }
    let mut complaints = Vec::new();
    for (folder, graph) in &graphs {
        for (circle, size) in circles(graph) {
            if circle.iter().all(|name| name.ends_with(".rs")) {
                continue;
            }
            let next = circle.iter().cycle().skip(1);
            let key = |(a, b): (&String, &String)| (format!("{folder}/{a}"), b.clone());
            let uses = circle
                .iter()
                .zip(next)
                .map(|pair| reasons[&key(pair)].clone());
            complaints.push(format!(
                "circle among {size} folders of \"{folder}\", {}: {}; move what both need down into a folder of its own, or pass it as an argument",
                circle.join(" -> "),
                uses.collect::<Vec<_>>().join("; ")
            ));
        }
    }
    complaints
}

fn missing_floors(rooms: &[String], floors: &[&str]) -> Vec<String> {
    let complaint = |room: &String| {
        format!(
            "{room} is in no list of floors; add it in tests/architecture.rs above all that it uses"
        )
    };
    let missing = rooms
        .iter()
        .filter(|room| !floors.is_empty() && !floors.contains(&room.as_str()));
    missing.map(complaint).collect()
}

fn upward(imports: &Imports, floors: &[&str]) -> Vec<String> {
    let floor = |file: &str| match floors.iter().position(|floor| *floor == room(file)) {
        _ if file == "lib.rs" => Some(floors.len()),
        floor => floor,
    };
    let is_upward = |(from, to): &&(String, String)| match (floor(from), floor(to)) {
        (Some(from), Some(to)) => from < to,
        _ => false,
    };
    let complaint = |(from, to): &(String, String)| {
        format!(
            "upward import from {} to {}: {}; move it down into {} or below, or pass it as an argument",
            room(from),
            room(to),
            told(imports, from, to),
            room(from)
        )
    };
    let upward = imports
        .keys()
        .filter(|_| !floors.is_empty())
        .filter(is_upward);
    upward.map(complaint).collect()
}

fn folders_without_a_purpose(src: &Path) -> Vec<String> {
    let is_facade = |path: &PathBuf| path.ends_with("mod.rs") || path.ends_with("lib.rs");
    let says = |path: &PathBuf| std::fs::read_to_string(path).unwrap().starts_with("//! ");
    let silent = files(src)
        .into_iter()
        .filter(is_facade)
        .filter(|path| !says(path));
    let complaint = |path: PathBuf| {
        let path = path.strip_prefix(src).unwrap().display().to_string();
        format!("{path}: the first line must say what the folder is for: \"//! ...\"")
    };
    silent.map(complaint).collect()
}

fn foreign_crates(found: &Crate, allowed: &[&str]) -> Vec<String> {
    let crates = found.crates();
    let foreign = crates
        .iter()
        .filter(|(_, name)| !allowed.contains(&name.as_str()));
    let complaint = |(file, name): &(String, String)| {
        format!(
            "{file} uses the crate {name}, expected only {allowed:?}; move it into a crate above both, or pass it as an argument"
        )
    };
    foreign.map(complaint).collect()
}

/// Tests of the checks themselves on made-up sources.
mod made_up {
    use super::*;

    fn imports(sources: &[(&str, &str)]) -> Imports {
        Crate::of(&owned(sources)).imports()
    }

    fn owned(sources: &[(&str, &str)]) -> Vec<(String, String)> {
        sources
            .iter()
            .map(|(file, text)| ((*file).into(), (*text).into()))
            .collect()
    }

    fn pairs(sources: &[(&str, &str)]) -> Vec<String> {
        let imports = imports(sources);
        imports
            .keys()
            .map(|(from, to)| told(&imports, from, to))
            .collect()
    }

    #[test]
    fn every_form_of_import_is_detected() {
        let target = (
            "b.rs",
            "pub struct B; pub fn f() {} pub mod inner { pub struct I; }",
        );
        for user in [
            "use crate::b::B;",
            "use super::b::{B};",
            "use crate::{b::{self, B}};",
            "fn f() -> crate::b::B { todo!() }",
            "use crate::b; fn f() -> b::B { todo!() }",
            "use crate::b as other; fn f(_: &other::B) {}",
            "use crate::b; fn f() { println!(\"{:?}\", b::B); }",
            "mod deep { use super::super::b::B; }",
            "fn f() { use crate::b::B; }",
        ] {
            let found = pairs(&[("lib.rs", "mod a; mod b;"), ("a.rs", user), target]);
            assert_eq!(found, ["a.rs uses B of b.rs"], "{user}");
        }
        let inner = pairs(&[
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "use crate::b::inner::I;"),
            target,
        ]);
        assert_eq!(inner, ["a.rs uses I of b.rs"]);
    }

    #[test]
    fn tests_and_other_crates_are_ignored() {
        for user in [
            "#[cfg(test)] mod tests { use crate::b::B; }",
            "#[cfg(test)] use crate::b::B;",
            "#[test] fn f() { crate::b::B; }",
            "#[cfg(test)] mod tests;",
            "use std::fmt; use other::b::B; fn f(b: Option<B>) -> fmt::Result { Ok(()) }",
        ] {
            let tests = ("a/tests.rs", "use crate::b::B;");
            let mut sources = vec![
                ("lib.rs", "mod a; mod b;"),
                ("a/mod.rs", user),
                ("b.rs", "pub struct B;"),
            ];
            if user.ends_with("tests;") {
                sources.push(tests);
            }
            assert_eq!(pairs(&sources), [""; 0], "{user}");
        }
    }

    #[test]
    fn imports_through_facades_count_where_items_are_defined() {
        let facade = (
            "b/mod.rs",
            "mod c; mod d; pub use self::c::C; pub(crate) use d::*;",
        );
        let found = pairs(&[
            ("lib.rs", "mod a; mod b; pub use b::C;"),
            ("a.rs", "use crate::b::{C, D}; use crate::C as Again;"),
            facade,
            ("b/c.rs", "use super::D; pub struct C;"),
            ("b/d.rs", "pub struct D;"),
        ]);
        assert_eq!(
            found,
            [
                "a.rs uses C of b/c.rs",
                "a.rs uses D of b/d.rs",
                "b/c.rs uses D of b/d.rs"
            ]
        );
    }

    #[test]
    fn a_macro_that_its_file_passes_on_counts_there() {
        let found = pairs(&[
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "use crate::b::m;"),
            ("b.rs", "macro_rules! m { () => {} } pub(crate) use m;"),
        ]);
        assert_eq!(found, ["a.rs uses m of b.rs"]);
    }

    #[test]
    fn a_circle_of_files_is_named_with_its_items() {
        let found = circles_of_files(&imports(&[
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a.rs", "use crate::b::B; pub struct A;"),
            ("b.rs", "use crate::c::C; pub struct B;"),
            ("c.rs", "use crate::a::A; pub struct C;"),
        ]));
        let [complaint] = &found[..] else {
            panic!("{found:?}")
        };
        for part in [
            "among 3 files",
            "a.rs uses B of b.rs",
            "c.rs uses A of a.rs",
            "move what both need down",
        ] {
            assert!(complaint.contains(part), "{complaint}");
        }
        // items that mod.rs itself defines and its files use
        let found = circles_of_files(&imports(&[
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "mod b; use b::B; pub struct A(B);"),
            ("a/b.rs", "use super::A; pub struct B;"),
        ]));
        assert_eq!(found.len(), 1, "{found:?}");
    }

    #[test]
    fn a_circle_of_folders_without_one_of_files_is_found() {
        let found = circles_of_folders(&imports(&[
            ("lib.rs", "mod a; mod b;"),
            ("a/mod.rs", "pub mod x; pub mod y;"),
            ("a/x.rs", "use crate::b::z::Z;"),
            ("a/y.rs", "pub struct Y;"),
            ("b/mod.rs", "pub mod z; pub mod w;"),
            ("b/z.rs", "pub struct Z;"),
            ("b/w.rs", "use crate::a::y::Y;"),
        ]));
        let [complaint] = &found[..] else {
            panic!("{found:?}")
        };
        assert!(
            complaint.contains("a -> b") && complaint.contains("b/w.rs uses Y of a/y.rs"),
            "{complaint}"
        );
    }

    #[test]
    fn an_upward_import_is_named_with_the_way_out() {
        let sources = [
            ("lib.rs", "mod low; mod high;"),
            ("low/mod.rs", "mod x;"),
            ("low/x.rs", "use crate::high::H;"),
            ("high.rs", "pub struct H;"),
        ];
        let found = upward(&imports(&sources), &["low", "high"]);
        let [complaint] = &found[..] else {
            panic!("{found:?}")
        };
        for part in [
            "from low to high",
            "low/x.rs uses H of high.rs",
            "move it down into low",
        ] {
            assert!(complaint.contains(part), "{complaint}");
        }
        assert!(upward(&imports(&sources), &["high", "low"]).is_empty());
        let rooms = ["low".to_string(), "high".into(), "new".into()];
        assert_eq!(missing_floors(&rooms, &["low", "high"]).len(), 1);
    }

    #[test]
    fn a_crate_that_must_not_be_used_is_named() {
        let sources = [(
            "lib.rs",
            "use tipwatch_mechanics::Machine; #[cfg(test)] use tipwatch_live::X;",
        )];
        let found = Crate::of(&owned(&sources));
        assert!(foreign_crates(&found, &["tipwatch_mechanics"]).is_empty());
        let complaints = foreign_crates(&found, &[]);
        assert!(
            complaints[0].contains("lib.rs uses the crate tipwatch_mechanics"),
            "{complaints:?}"
        );
    }
}
