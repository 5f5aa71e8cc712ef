//! The language in which the programs speak: English as the sentences stand in the source, or another one by a table
//! of them.

// the macro names this crate by its path
extern crate self as tipwatch_language;

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Condvar, Mutex, OnceLock, PoisonError};

pub use tipwatch_language_macros::say;

/// A language.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Language {
    /// English.
    #[default]
    English,
    /// German.
    German,
}

static CHOSEN: AtomicU8 = AtomicU8::new(Language::English as u8);

/// Chooses the language of the whole process. What was said before stays as it was said.
pub fn choose(language: Language) {
    CHOSEN.store(language as u8, Ordering::Relaxed);
}

/// Those who speak, and those who wait to.
struct Speakers {
    /// The language of those who speak now.
    language: Language,
    /// Number of those who speak now.
    count: usize,
    /// Number of those who ever asked to speak.
    asked: u64,
    /// Number of those who ever spoke.
    admitted: u64,
}

static SPEAKERS: Mutex<Speakers> = Mutex::new(Speakers {
    language: Language::English,
    count: 0,
    asked: 0,
    admitted: 0,
});

/// Told when nobody speaks any more, and when it is the next one's turn.
static SILENCE: Condvar = Condvar::new();

/// One of those who speak, until it is dropped.
#[derive(Debug)]
#[must_use = "the language is chosen only while this value lives"]
pub struct Speaking(());

/// Chooses the language for a part of a process with several callers. Those who speak another language are awaited, and
/// those who asked before: first come, first served. A thread that speaks must not ask again, for no language.
pub fn speak(language: Language) -> Speaking {
    let mut speakers = SPEAKERS.lock().unwrap_or_else(PoisonError::into_inner);
    let turn = speakers.asked;
    speakers.asked += 1;
    while speakers.admitted != turn || (speakers.count > 0 && speakers.language != language) {
        let told = SILENCE.wait(speakers);
        speakers = told.unwrap_or_else(PoisonError::into_inner);
    }
    speakers.admitted += 1;
    speakers.count += 1;
    speakers.language = language;
    choose(language);
    // the next in turn may speak the same
    SILENCE.notify_all();
    Speaking(())
}

impl Drop for Speaking {
    fn drop(&mut self) {
        let mut speakers = SPEAKERS.lock().unwrap_or_else(PoisonError::into_inner);
        speakers.count -= 1;
        if speakers.count == 0 {
            choose(Language::default());
            SILENCE.notify_all();
        }
    }
}

/// The language of the process.
#[must_use]
pub fn chosen() -> Language {
    match is_english() {
        true => Language::English,
        false => Language::German,
    }
}

/// Whether the process speaks English.
#[must_use]
pub fn is_english() -> bool {
    CHOSEN.load(Ordering::Relaxed) == Language::English as u8
}

/// The tag of the language of the process (ISO 639).
#[must_use]
pub fn tag() -> &'static str {
    match chosen() {
        Language::English => "en",
        Language::German => "de",
    }
}

/// A text without placeholders, in the language of the process: of a constant, which [`message!`] marks.
#[must_use]
pub fn told(english: &str) -> &str {
    match is_english() {
        true => english,
        false => of_english(english).unwrap_or(english),
    }
}

/// A name that a program also reads (a kind of event, a cause, a signal) as words, in the language of the process. Of a
/// compound name ("lift_position") the quantities are said in it; the name of a joint or a link stays as it is.
#[must_use]
pub fn named(name: &str) -> String {
    let readable = name.replace('_', " ");
    if is_english() {
        return readable;
    }
    if let Some(whole) = of_english(&readable) {
        return whole.into();
    }
    let words: Vec<&str> = readable.split(' ').collect();
    let mut said: Vec<Cow<'_, str>> = Vec::new();
    let mut at = 0;
    while at < words.len() {
        let longest = (at + 1..=words.len()).rev();
        let known = longest.filter_map(|end| {
            Some((
                end,
                parts_of_names().get(&words[at..end].join(" "))?.as_str(),
            ))
        });
        let (end, word) = known
            .map(|(end, word)| (end, word.into()))
            .next()
            .unwrap_or((at + 1, words[at].into()));
        said.push(word);
        at = end;
    }
    said.join(" ")
}

/// A text without placeholders, in the language of the process.
#[macro_export]
macro_rules! word {
    ($english:literal) => {
        $crate::told($english)
    };
}

/// A text of a constant, which stands in the table of each language; [`told`] says it.
#[macro_export]
macro_rules! message {
    ($english:literal) => {
        $english
    };
}

/// Numbers, signs and units as the language of the process writes them: with its decimal mark. Not for names, which may hold
/// versions.
#[must_use]
pub fn decimals(text: impl Into<String>) -> String {
    let text = text.into();
    match is_english() {
        true => text,
        false => with_commas(&text),
    }
}

/// Returns the text with a comma in place of a point between two digits.
fn with_commas(text: &str) -> String {
    let bytes = text.as_bytes();
    let is_digit = |at: Option<usize>| {
        at.and_then(|at| bytes.get(at))
            .is_some_and(u8::is_ascii_digit)
    };
    let letters = text.char_indices().map(|(at, letter)| {
        let is_mark = letter == '.' && is_digit(at.checked_sub(1)) && is_digit(Some(at + 1));
        if is_mark { ',' } else { letter }
    });
    letters.collect()
}

/// The value of a placeholder, as [`say!`] makes it. A number has the decimal mark of the language, and is known by its
/// type: a text stays as it is, which may be a name that looks like a number, or what a program reads.
#[derive(Debug)]
pub struct Value<'a, T: ?Sized>(pub &'a T);

/// A type with a decimal mark.
pub trait Number {}

impl Number for f32 {}
impl Number for f64 {}
impl<T: Number + ?Sized> Number for &T {}

/// The text of a number. It takes the value itself, so that a call finds it before that of [`OfAny`].
pub trait OfNumber {
    /// The text in the language of a sentence that is not English.
    fn said(self, text: String) -> String;
}

impl<T: Number + ?Sized> OfNumber for Value<'_, T> {
    fn said(self, text: String) -> String {
        with_commas(&text)
    }
}

/// The text of anything else.
pub trait OfAny {
    /// The text in the language of a sentence that is not English.
    fn said(&self, text: String) -> String;
}

impl<T: ?Sized> OfAny for Value<'_, T> {
    fn said(&self, text: String) -> String {
        text
    }
}

/// A sentence of the language of the process: the text of its placeholders by their names or numbers. A sentence that
/// the table lacks stays English.
#[must_use]
pub fn filled(english: &'static str, values: &[(&str, String)]) -> String {
    let template = of_english(english).unwrap_or(english);
    let mut text = String::with_capacity(template.len() + 16 * values.len());
    let mut unnamed = 0;
    let mut said: HashMap<&str, usize> = HashMap::new();
    for part in parts(template) {
        match part {
            Part::Text(literal) => text.push_str(literal),
            Part::Placeholder(name) => {
                let name: Cow<'_, str> = match name.is_empty() {
                    true => unnamed.to_string().into(),
                    false => name.into(),
                };
                unnamed += usize::from(matches!(name, Cow::Owned(_)));
                let of_name: Vec<_> = values.iter().filter(|(its, _)| *its == name).collect();
                let Some((key, _)) = of_name.first() else {
                    continue;
                };
                // one name may stand twice, in two formats
                let times = said.entry(key).or_default();
                let (_, value) = of_name[(*times).min(of_name.len() - 1)];
                text.push_str(value);
                *times += 1;
            }
        }
    }
    text
}

/// The names of the placeholders of a template: numbers for those without a name.
#[must_use]
pub fn placeholder_names(template: &str) -> Vec<String> {
    let mut unnamed = 0;
    let names = parts(template).filter_map(|part| match part {
        Part::Text(_) => None,
        Part::Placeholder("") => {
            unnamed += 1;
            Some((unnamed - 1).to_string())
        }
        Part::Placeholder(name) => Some(name.to_owned()),
    });
    names.collect()
}

/// A part of a template.
enum Part<'a> {
    Text(&'a str),
    /// Name of the placeholder, without its format.
    Placeholder(&'a str),
}

/// The parts of a template, whose grammar is that of [`format!`].
fn parts(template: &str) -> impl Iterator<Item = Part<'_>> {
    let mut rest = template;
    std::iter::from_fn(move || {
        let at = match rest.find(['{', '}']) {
            None if rest.is_empty() => return None,
            None => rest.len(),
            Some(at) => at,
        };
        if at > 0 {
            let (text, after) = rest.split_at(at);
            rest = after;
            return Some(Part::Text(text));
        }
        let (brace, after) = rest.split_at(1);
        if after.starts_with(brace) {
            rest = &after[1..];
            return Some(Part::Text(brace));
        }
        let end = after.find('}').unwrap_or(after.len());
        rest = after.get(end + 1..).unwrap_or_default();
        let name = after[..end].split(':').next();
        Some(Part::Placeholder(name.unwrap_or_default()))
    })
}

/// A sentence of the table of the language of the process.
fn of_english(english: &str) -> Option<&'static str> {
    german().get(english).map(String::as_str)
}

/// The German sentences, by where their English ones stand.
const GERMAN: [&str; 8] = [
    include_str!("german/names.toml"),
    include_str!("german/parts.toml"),
    include_str!("german/findings.toml"),
    include_str!("german/page.toml"),
    include_str!("german/analysis.toml"),
    include_str!("german/machine.toml"),
    include_str!("german/compare.toml"),
    include_str!("german/fleet.toml"),
];

/// The German of every English sentence.
///
/// # Panics
/// If the table is not TOML, which a test excludes.
#[must_use]
pub fn german() -> &'static HashMap<String, String> {
    static TABLE: OnceLock<HashMap<String, String>> = OnceLock::new();
    TABLE.get_or_init(|| GERMAN.iter().flat_map(|text| table(text)).collect())
}

/// The German of the names that programs read too, and of the parts of such names: no macro marks them.
#[must_use]
pub fn german_names() -> HashMap<String, String> {
    let files = GERMAN[..2].iter();
    files.flat_map(|text| table(text)).collect()
}

/// The German of the parts of compound names.
fn parts_of_names() -> &'static HashMap<String, String> {
    static TABLE: OnceLock<HashMap<String, String>> = OnceLock::new();
    TABLE.get_or_init(|| table(GERMAN[1]))
}

fn table(text: &str) -> HashMap<String, String> {
    toml::from_str(text).expect("a test has read the table")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholders_are_those_of_format() {
        let names = |text| placeholder_names(text);
        assert_eq!(names("{a:.2} {} {{x}} {1} {}"), ["a", "0", "1", "1"]);
        assert_eq!(names("no {{ brace }}"), Vec::<String>::new());
    }

    #[test]
    fn a_sentence_is_filled_in_the_order_of_its_language() {
        let values = [("0", "first".to_owned()), ("1", "second".to_owned())];
        assert_eq!(
            filled("{1} before {0}, {{}}", &values),
            "second before first, {}"
        );
        let twice = [("x", "1.0".to_owned()), ("x", "1.00".to_owned())];
        assert_eq!(filled("{x:.1} {x:.2} {x}", &twice), "1.0 1.00 1.00");
    }

    #[test]
    fn numbers_have_the_decimal_mark_of_the_language() {
        let number = -1.25;
        assert_eq!(Value(&number).said("-1.25".into()), "-1,25");
        assert_eq!(Value(&&number).said("-1.2".into()), "-1,2");
        assert_eq!(with_commas("t = 1.20 ± 0.3 s."), "t = 1,20 ± 0,3 s.");
        assert_eq!(decimals("1.5"), "1.5", "English");
    }

    /// A topic may be called so, and a machine file reads no comma.
    #[test]
    fn text_that_looks_like_a_number_stays_as_it_is() {
        let name = String::from("1.2");
        assert_eq!(Value(&name).said(name.clone()), "1.2");
        assert_eq!(Value(name.as_str()).said(name.clone()), "1.2");
        assert_eq!(Value(&name.as_str()).said(name.clone()), "1.2");
        assert_eq!(filled("scale = {0}", &[("0", name)]), "scale = 1.2");
        assert_eq!(Value(&3).said("3".into()), "3");
    }

    #[test]
    fn english_is_as_format_writes_it() {
        let (time_s, word) = (1.25, "wheel");
        let said = say!("At t = {time_s:.1} s {word} {}: {0:?} {n}", "FL", n = 3);
        assert_eq!(said, "At t = 1.2 s wheel FL: \"FL\" 3");
    }

    /// Every German sentence has the placeholders of its English one.
    #[test]
    fn the_table_keeps_every_placeholder() {
        for (english, german) in german() {
            let sorted = |text: &str| {
                let mut names = placeholder_names(text);
                names.sort();
                names.dedup();
                names
            };
            assert_eq!(sorted(english), sorted(german), "{english} = {german}");
        }
    }
}
