//! The report in another language: every sentence stands in its table, and no page is half translated.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use proc_macro2::{TokenStream, TokenTree};
use tipwatch_tests::{data, write_edited};

/// Words that only English text has.
const ENGLISH: [&str; 23] = [
    "the", "of", "and", "is", "were", "with", "from", "by", "that", "which", "not", "its", "are",
    "has", "than", "this", "no", "be", "it", "off", "to", "for", "would",
];

/// The macros whose first literal is a sentence of the table.
const MACROS: [&str; 3] = ["say", "word", "message"];

/// The sentences of a file.
fn sentences(tokens: TokenStream, found: &mut BTreeSet<String>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    for (i, token) in tokens.iter().enumerate() {
        let TokenTree::Group(group) = token else {
            continue;
        };
        sentences(group.stream(), found);
        let called = match (
            i.checked_sub(2).map(|at| &tokens[at]),
            i.checked_sub(1).map(|at| &tokens[at]),
        ) {
            (Some(TokenTree::Ident(name)), Some(TokenTree::Punct(mark))) => {
                mark.as_char() == '!' && MACROS.iter().any(|it| name == it)
            }
            _ => false,
        };
        if called && let Some(TokenTree::Literal(literal)) = group.stream().into_iter().next() {
            let literal: syn::LitStr = syn::parse2(TokenTree::from(literal).into()).unwrap();
            found.insert(literal.value());
        }
    }
}

/// The sentences of all files below a folder.
fn sentences_below(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.ends_with("target") {
                sentences_below(&path, found);
            }
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let tokens = fs::read_to_string(&path).unwrap().parse();
            sentences(
                tokens.unwrap_or_else(|e| panic!("{}: {e}", path.display())),
                found,
            );
        }
    }
}

#[test]
fn every_sentence_has_its_german_and_every_german_its_sentence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut said = BTreeSet::new();
    for folder in ["ingest", "mechanics", "calibration", "analyze"] {
        sentences_below(&root.join(folder), &mut said);
    }
    assert!(said.len() > 500, "{} sentences", said.len());
    let table = tipwatch_language::german();
    let lacking: Vec<&String> = said.iter().filter(|it| !table.contains_key(*it)).collect();
    assert!(lacking.is_empty(), "without German: {lacking:#?}");
    let names = tipwatch_language::german_names();
    let unused: Vec<&String> = (table.keys())
        .filter(|it| !said.contains(*it) && !names.contains_key(*it))
        .collect();
    assert!(unused.is_empty(), "no longer said: {unused:#?}");
}

/// Runs the program in German, and gives the text that a reader sees.
fn german(arguments: &[&str], log: &str) -> String {
    let out = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
    command
        .args(arguments)
        .args(["--lang", "de", "--out"])
        .arg(out.path());
    let run = command.output().unwrap();
    let printed = String::from_utf8(run.stdout).unwrap();
    let report = fs::read_to_string(out.path().join("report.html"));
    let report =
        report.unwrap_or_else(|e| panic!("{log}: {e}: {}", String::from_utf8_lossy(&run.stderr)));
    assert!(report.contains("<html lang=\"de\">"), "{log}");
    printed + "\n" + &visible(&report)
}

/// Returns the texts of a page: those between its tags, and those that a screen reader reads in them.
fn visible(page: &str) -> String {
    let mut text = String::new();
    let mut rest = page;
    while let Some(at) = rest.find('<') {
        text.push_str(&rest[..at]);
        text.push('\n');
        rest = &rest[at..];
        for silent in ["script", "style"] {
            if rest.starts_with(&format!("<{silent}")) {
                let end = format!("</{silent}>");
                rest = &rest[rest.find(&end).unwrap()..];
            }
        }
        let end = rest.find('>').map_or(rest.len(), |end| end + 1);
        for attribute in ["alt=\"", "aria-label=\"", "title=\"", "placeholder=\""] {
            if let Some(begin) = rest[..end].find(attribute) {
                let value = &rest[begin + attribute.len()..end];
                text.push_str(&value[..value.find('"').unwrap_or(value.len())]);
                text.push('\n');
            }
        }
        rest = &rest[end..];
    }
    text + rest
}

/// Lines with words that only English has.
fn english(text: &str) -> Vec<String> {
    let is_english = |line: &&str| {
        let words = line.split(|c: char| !(c.is_alphanumeric() || "_/.-".contains(c)));
        words.into_iter().any(|word| ENGLISH.contains(&word))
    };
    text.lines().filter(is_english).map(str::to_owned).collect()
}

/// Returns a line without the parts that a reader copies into the machine file, which holds numbers as programs read them.
fn prose(line: &str) -> String {
    let (mut text, mut rest) = (String::new(), line);
    while let Some((before, snippet)) = rest.split_once("scale = ") {
        text += before;
        rest = snippet.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    }
    text += rest;
    let offset = text.split_once("offset = {");
    let around = offset.and_then(|(before, snippet)| Some((before, snippet.split_once('}')?.1)));
    match around {
        Some((before, after)) => format!("{before}{after}"),
        None => text,
    }
}

/// Lines with a number that has a point, but for that of a version.
fn decimal_points(text: &str) -> Vec<String> {
    let has_point = |line: &&str| {
        let three: Vec<char> = prose(line).chars().collect();
        let is_number =
            |of: &[char]| of[0].is_ascii_digit() && of[1] == '.' && of[2].is_ascii_digit();
        !line.starts_with("tipwatch ") && three.windows(3).any(is_number)
    };
    text.lines().filter(has_point).map(str::to_owned).collect()
}

#[test]
fn english_words_are_found() {
    assert_eq!(
        decimal_points("1,5\n1.5 m\ntipwatch 0.1.0\nam 5."),
        ["1.5 m"]
    );
    let snippets = "mit scale = 1.25 oder scale = 0.5.\noffset = { \"/a\" = 0.01 }, 2,5 ms";
    assert!(decimal_points(snippets).is_empty());
    assert_eq!(decimal_points("scale = 1.25 auf 2.5 m").len(), 1);
    assert_eq!(
        decimal_points("offset = { \"/a\" = 0.01 }, 2.5 ms").len(),
        1
    );
    assert_eq!(english("Rad HL\nthe wheel\n/of/the\n"), ["the wheel"]);
    let page = "<p>a</p><script>b</script><img alt=\"c\">d";
    assert_eq!(
        visible(page).split_whitespace().collect::<Vec<_>>(),
        ["a", "c", "d"]
    );
}

#[test]
fn no_report_is_half_german() {
    let page = german(&["tipwatch", "demo"], "demo");
    let left = english(&page);
    assert!(left.is_empty(), "demo: {left:#?}");
    let points = decimal_points(&page);
    assert!(points.is_empty(), "demo: {points:#?}");
    for log in LOGS {
        let (log, machine): (PathBuf, PathBuf) = (data(log), data(log).with_extension("toml"));
        let log = log.to_str().unwrap();
        let arguments = [
            "tipwatch",
            "analyze",
            log,
            "--machine",
            machine.to_str().unwrap(),
        ];
        let page = german(&arguments, log);
        let left = english(&page);
        assert!(left.is_empty(), "{log}: {left:#?}");
        let points = decimal_points(&page);
        assert!(points.is_empty(), "{log}: {points:#?}");
    }
}

/// Its page, the reports beside it and what is printed; and no record of another language is taken for one of this.
#[test]
fn no_page_of_a_fleet_is_half_german() {
    let folder = tempfile::tempdir().unwrap();
    let policy = folder.path().join("policy.toml");
    let rule = "name = \"Abnahme\"\n[[rule]]\nname = \"Abheben\"\nevent = \"wheel_lift\"\n";
    fs::write(&policy, rule).unwrap();
    let out = folder.path().join("fleet");
    let screen = |language: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
        command.args(["tipwatch", "screen", "--resume", "--machine"]);
        command.arg(data("tiny_lift.toml"));
        command.args(["tiny.mcap", "tiny_lift.mcap"].map(data));
        command
            .arg("--policy")
            .arg(&policy)
            .args(["--reports", "all"]);
        command.args(["--lang", language, "--out"]).arg(&out);
        let run = command.output().unwrap();
        String::from_utf8(run.stdout).unwrap()
    };
    screen("en");
    let reports = || {
        let folders = fs::read_dir(out.join("reports")).unwrap();
        let pages = folders.map(|entry| entry.unwrap().path().join("report.html"));
        pages
            .filter(|page| page.exists())
            .collect::<BTreeSet<PathBuf>>()
    };
    let in_english = reports();
    let printed = screen("de");
    let in_german: Vec<PathBuf> = reports().difference(&in_english).cloned().collect();
    assert_eq!((in_english.len(), in_german.len()), (2, 2));
    let mut pages = vec![(PathBuf::from("stdout"), printed)];
    for page in in_german.into_iter().chain([out.join("fleet.html")]) {
        let text = fs::read_to_string(&page).unwrap();
        assert!(text.contains("<html lang=\"de\">"), "{}", page.display());
        pages.push((page, visible(&text)));
    }
    for (page, text) in pages {
        let left = english(&text);
        assert!(left.is_empty(), "{}: {left:#?}", page.display());
        let points = decimal_points(&text);
        assert!(points.is_empty(), "{}: {points:#?}", page.display());
    }
}

/// A reader copies it into the machine file.
#[test]
fn scale_in_a_german_sentence_is_one_of_a_machine_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edited.mcap");
    write_edited(&data("tiny_lift.mcap"), &path, &mut |_, values| {
        if values.topic == "/imu/data" {
            for axis in ["x", "y", "z"] {
                values.scale(&format!("force.{axis}"), 0.8);
            }
        }
    });
    let machine = data("tiny_lift.toml");
    let (log, machine) = (path.to_str().unwrap(), machine.to_str().unwrap());
    let page = german(&["tipwatch", "analyze", log, "--machine", machine], log);
    let scales: Vec<f64> = (page.split("scale = ").skip(1))
        .map(|behind| {
            let number = behind.split_whitespace().next().unwrap();
            let snippet: toml::Table = toml::from_str(&format!("scale = {number}")).unwrap();
            snippet["scale"].as_float().unwrap()
        })
        .collect();
    assert!(!scales.is_empty(), "{page}");
    let is_right = |scale: &f64| (scale - 1.25).abs() < 0.05;
    assert!(scales.iter().all(is_right), "{scales:?}");
}

/// Alternative texts tell those who do not see a drawing or a figure its content: in both languages the same numbers, in other
/// words.
#[test]
fn alternative_texts_tell_the_findings_in_both_languages() {
    let labels = |log: &str, language: &str| -> Vec<String> {
        let out = tempfile::tempdir().unwrap();
        let (log, machine) = (data(log), data(log).with_extension("toml"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
        command.args(["tipwatch", "analyze"]).arg(&log);
        command.arg("--machine").arg(&machine);
        command.args(["--lang", language, "--out"]).arg(out.path());
        let run = command.output().unwrap();
        assert!(
            run.status.success(),
            "{}",
            String::from_utf8_lossy(&run.stderr)
        );
        let report = fs::read_to_string(out.path().join("report.html")).unwrap();
        let labels = report.split("aria-label=\"").skip(1);
        let labels = labels.map(|label| label.split('"').next().unwrap().to_owned());
        labels.collect()
    };
    let numbers = |label: &str| -> Vec<String> {
        // the decimal mark is that of the language
        let label = label.replace(',', ".");
        let parts = label.split(|c: char| !c.is_ascii_digit() && c != '.');
        let parts = parts.map(|part| part.trim_matches('.').to_owned());
        parts.filter(|part| !part.is_empty()).collect()
    };
    for log in ["tip_over.mcap", "forklift.mcap"] {
        let [english, german] = ["en", "de"].map(|language| labels(log, language));
        assert_eq!(english.len(), german.len(), "{log}");
        for (english, german) in english.iter().zip(&german) {
            assert_eq!(
                numbers(english),
                numbers(german),
                "{log}: {english} / {german}"
            );
            assert!(numbers(english).len() < 3 || english != german, "{english}");
        }
        let tells = |labels: &[String], all: &[&str]| {
            let has_all = |label: &&String| all.iter().all(|words| label.contains(words));
            let label = labels.iter().find(has_all);
            label.is_some_and(|label| numbers(label).len() >= 2)
        };
        // what each wheel carries, how gravity leans, and when what began
        for all in [
            ["RL carries ", "the zero moment point is "],
            ["Centre of mass ", "gravity leans "],
            ["off the ground from t = ", "tipping over about the "],
        ] {
            assert!(tells(&english, &all), "{log}: {all:?}: {english:#?}");
        }
        for all in [
            ["RL trägt ", "der Nullmomentpunkt liegt "],
            ["Schwerpunkt ", "die Schwerkraft neigt sich um "],
            ["abgehoben ab t = ", "Zeitlicher Verlauf"],
        ] {
            assert!(tells(&german, &all), "{log}: {all:?}: {german:#?}");
        }
    }
}

/// Logs that say much: a fall, an unstated load, losses, sparse rows, a crane, a forklift, a machine that rests.
const LOGS: [&str; 7] = [
    "tip_over.mcap",
    "unstated_load.mcap",
    "second_paper.mcap",
    "crane.mcap",
    "forklift.mcap",
    "lift_payload.mcap",
    "commissioning.mcap",
];
