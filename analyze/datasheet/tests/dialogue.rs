//! Questions instead of a sheet.

use std::io::Cursor;

use strum::IntoEnumIterator;
use tipwatch_datasheet::{Sheet, Template, ask, questions};

#[test]
fn answers_become_a_sheet_and_a_machine() {
    let template = Template::WheelLoader;
    let answers = [
        ("name", "Loader 7"),
        ("mass", "15.2 t"),
        ("height", "3280 mm"),
        ("axles.0.track", "1960 mm"),
        ("axles.0.load", "7000"),
        ("axles.0.tyre", "20.5R25"),
        ("axles.1.behind", "3.2"),
        ("axles.1.track", "1960 mm"),
        ("axles.1.load", "8.2 t"),
        ("axles.1.tyre", "20.5R25"),
        ("axles.1.pendulum", "13"),
        ("articulation.behind", "1.6"),
        ("articulation.angle", "37"),
        ("arm.ahead", "-0.75"),
        ("arm.height", "2.05"),
        ("arm.segments.0.length", "2.55"),
        ("arm.segments.0.range", "-45, 42"),
        ("arm.segments.0.at", "-36"),
        ("arm.tool.length", "1.15"),
    ];
    let mut input = String::from("\n");
    for question in questions(template, 2) {
        let answer = answers.iter().find(|(key, _)| *key == question.key);
        if question.key == "mass" {
            // a mistake is asked again
            input.push_str("heavy\n");
        }
        input.push_str(answer.map_or("", |(_, answer)| answer));
        input.push('\n');
    }
    let mut output = Vec::new();
    let text = ask(template, &mut Cursor::new(input), &mut output).unwrap();
    let machine = Sheet::from_toml(&text, "answers").and_then(|sheet| sheet.machine());
    let machine = machine.unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(machine.stated_axle_loads(), Some(vec![7000.0, 8200.0]));
    let output = String::from_utf8(output).unwrap();
    assert!(output.contains("found \"heavy\""), "{output}");
}

/// Every key that is asked for is a key of the sheet.
#[test]
fn every_question_is_a_key_of_the_sheet() {
    for template in Template::iter() {
        let axles = if template == Template::CrawlerExcavator {
            0
        } else {
            2
        };
        let mut input = if axles == 0 {
            String::new()
        } else {
            String::from("\n")
        };
        for question in questions(template, axles) {
            let answer = match question.key.rsplit('.').next().unwrap() {
                "name" => "x",
                "tyre" => "20.5R25",
                "range" => "-10, 20",
                _ => "1",
            };
            input.push_str(answer);
            input.push('\n');
        }
        let text = ask(template, &mut Cursor::new(input), &mut Vec::new()).unwrap();
        let Err(refused) = Sheet::from_toml(&text, "answers") else {
            continue;
        };
        let refused = refused.to_string();
        assert!(
            !refused.contains("unknown field") && !refused.contains("missing field"),
            "{template}: {refused}\n{text}"
        );
    }
}

/// Returns the example's value at a key such as `axles.0.load`, as someone would type it.
fn typed(example: &toml::Table, key: &str) -> Option<String> {
    let mut parts = key.split('.');
    let mut value = example.get(parts.next()?)?;
    for part in parts {
        value = match part.parse::<usize>() {
            Ok(index) => value.get(index)?,
            Err(_) => value.get(part)?,
        };
    }
    let text = |value: &toml::Value| match value {
        toml::Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    Some(match value {
        toml::Value::Array(pair) => pair.iter().map(text).collect::<Vec<_>>().join(", "),
        single => text(single),
    })
}

/// Whoever answers with the numbers of an example gets its machine: the questions leave out nothing that decides about
/// mass, axle loads, reach and outriggers.
#[test]
fn answers_with_the_numbers_of_an_example_give_its_machine() {
    for template in Template::iter() {
        let example: toml::Table = template.example().parse().unwrap();
        let axles = example
            .get("axles")
            .map_or(0, |a| a.as_array().unwrap().len());
        let mut input = match template {
            Template::CrawlerExcavator => String::new(),
            _ => format!("{axles}\n"),
        };
        for question in questions(template, axles) {
            let after = question.after.as_ref();
            if after.is_some_and(|key| typed(&example, key).is_none()) {
                continue;
            }
            // the example's arm ends at its wrist
            let is_flange = question.key == "arm.segments.3.length";
            let other = if is_flange { "5 mm" } else { "" };
            let answer = typed(&example, &question.key).unwrap_or(other.into());
            assert!(
                !answer.is_empty() || !question.is_required,
                "{template}: the example has no {}",
                question.key
            );
            input.push_str(&answer);
            input.push('\n');
        }
        let text = ask(template, &mut Cursor::new(input), &mut Vec::new()).unwrap();
        let built = |text: &str| {
            let machine = Sheet::from_toml(text, "sheet").and_then(|sheet| sheet.machine());
            machine.unwrap_or_else(|e| panic!("{template}: {e}\n{text}"))
        };
        let [asked, written] = [text.as_str(), template.example()].map(built);
        assert_eq!(asked.mass, written.mass, "{template}");
        assert_eq!(
            asked.stated_axle_loads(),
            written.stated_axle_loads(),
            "{template}"
        );
        let ratio = asked.reach / written.reach;
        assert!(
            (0.98..1.02).contains(&ratio),
            "{template}: {} m, {} m",
            asked.reach,
            written.reach
        );
        let pads = |machine: &tipwatch_datasheet::Machine| {
            let names = machine.links.iter().map(|link| link.name.clone());
            names.filter(|name| name.starts_with("outrigger")).count()
        };
        assert_eq!(pads(&asked), pads(&written), "{template}");
        let places = |machine: &tipwatch_datasheet::Machine| machine.wheels.len();
        assert_eq!(places(&asked), places(&written), "{template}");
    }
}

#[test]
fn an_early_end_of_the_answers_is_an_error() {
    let ended = ask(Template::Forklift, &mut Cursor::new("2\n"), &mut Vec::new());
    assert!(ended.unwrap_err().to_string().contains("end of the input"));
}
