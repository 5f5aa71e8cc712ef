//! Contract between both ends of a service, beside the layout of the messages: settings of the services, and the meaning of
//! numbers and bits. The C header and the reference are made of it.

use strum::{EnumMessage, VariantArray};
use tipwatch_mechanics::Contribution;
use tipwatch_mechanics::prediction::{Law, PredictionGap};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{Basis, InputFault, Level};
use tipwatch_suspension::Status;

use crate::wire::command::{HoldReason, Mode, status_number};
use crate::wire::hash::Fnv1a;
use crate::wire::refusal::Refusal;
use crate::wire::topics::{
    EVENT_BETWEEN, EVENT_ROW, Kind, MAGIC, MAX_BORROWED, MAX_NODES, MAX_READERS, Topic,
    WireAcknowledge, WireCommand, WireMachine, WireProgress, WireRefusal, WireSample, WireSession,
    WireVerdict,
};

/// Coding of the number of an enumeration on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coding {
    /// The number itself.
    Number,
    /// A bit of a set; the number is that of the bit.
    Bit,
    /// The first index of an array.
    Index,
}

/// A number of an enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Name, in lower case with underscores.
    pub name: &'static str,
    /// Its number; of a set, that of its bit.
    pub number: u32,
    /// Meaning.
    pub doc: String,
}

/// An enumeration on the wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enumeration {
    /// Name in C, without "tipwatch_".
    pub name: &'static str,
    /// Fields that carry the enumeration.
    pub fields: &'static str,
    /// Coding of the numbers in those fields.
    pub coding: Coding,
    /// The numbers, ascending.
    pub entries: Vec<Entry>,
}

/// All enumerations.
#[must_use]
pub fn enumerations() -> Vec<Enumeration> {
    let mut statuses = entries(|status: Status| status_number(Some(status)));
    statuses.insert(
        0,
        entry(
            "not_asked",
            status_number(None),
            "The optimiser was not asked.",
        ),
    );
    let events = vec![
        entry("row", EVENT_ROW, "A row."),
        entry(
            "between",
            EVENT_BETWEEN,
            "Between rows: the numbers are those of the last row.",
        ),
    ];
    // one enumeration a row: its numbers, how they stand in the fields, its name in C, the fields
    macro_rules! enumerations {
        ($($numbers:tt $coding:ident $name:literal $fields:literal;)*) => {
            vec![$(Enumeration {
                name: $name,
                fields: $fields,
                coding: Coding::$coding,
                entries: enumerations!(@entries $numbers),
            }),*]
        };
        (@entries ($entries:expr)) => { $entries };
        (@entries $type:ident) => { entries(|variant: $type| variant as u32) };
    }
    enumerations! {
        Level Number "level" "level, latched_level, alarm, inherited_alarm of the verdict; level of the command";
        Basis Number "basis" "basis of the verdict";
        InputFault Bit "fault" "faults, cautions, held_faults, held_cautions of the verdict";
        Reason Bit "reason" "reasons, held_reasons of the verdict";
        (events) Number "event" "event of the verdict and of the command";
        Contribution Index "cause" "causes of the verdict, and predicted_cause less 1";
        Law Index "law" "assumed motions of the predictions of the verdict";
        PredictionGap Number "prediction_gap" "prediction_gap of the verdict";
        Refusal Number "refusal_reason" "refusal of the verdict; reason of the refusal";
        Kind Number "kind" "kind of the sample";
        Mode Number "mode" "mode of the command";
        HoldReason Bit "hold_reason" "reasons of the command";
        (statuses) Number "status" "status of the command";
    }
}

fn entry(name: &'static str, number: u32, doc: &str) -> Entry {
    Entry {
        name,
        number,
        doc: doc.replace('\n', " ").replace(['[', ']', '`'], ""),
    }
}

fn entries<T>(number: impl Fn(T) -> u32) -> Vec<Entry>
where
    T: VariantArray + EnumMessage + Copy + Into<&'static str>,
{
    let one = |&variant: &T| {
        let doc = variant.get_documentation().unwrap_or_default();
        entry(variant.into(), number(variant), doc)
    };
    T::VARIANTS.iter().map(one).collect()
}

/// A service and its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceSettings {
    /// Name of the message in C, without "tipwatch_".
    pub message: &'static str,
    /// Suffix of the service name.
    pub suffix: &'static str,
    /// Buffer of each subscriber (messages).
    pub buffer: usize,
    /// History (messages).
    pub history: usize,
    /// Maximum number of publishers.
    pub writers: usize,
    /// Whether there is an event service of the same name.
    pub has_events: bool,
}

/// Visitor of the message type of each service.
pub trait EachService {
    /// Visits the service with this message type; `message` is the name of the message in C, without "tipwatch_".
    fn service<T: Topic>(&mut self, message: &'static str);
}

/// Visits all services: the only list of them.
pub fn each_service(each: &mut impl EachService) {
    each.service::<WireSession>("session");
    each.service::<WireSample>("sample");
    each.service::<WireMachine>("machine");
    each.service::<WireVerdict>("verdict");
    each.service::<WireCommand>("command");
    each.service::<WireRefusal>("refusal");
    each.service::<WireAcknowledge>("acknowledge");
    each.service::<WireProgress>("progress");
}

/// All services.
#[must_use]
pub fn services() -> Vec<ServiceSettings> {
    struct Settings(Vec<ServiceSettings>);
    impl EachService for Settings {
        fn service<T: Topic>(&mut self, message: &'static str) {
            self.0.push(ServiceSettings {
                message,
                suffix: T::SUFFIX,
                buffer: T::QUEUE,
                history: T::HISTORY,
                writers: T::WRITERS,
                has_events: T::HAS_EVENTS,
            });
        }
    }
    let mut settings = Settings(Vec::new());
    each_service(&mut settings);
    settings.0
}

/// Hash over names, layouts and settings of all services: what header and library of C must have in common.
#[must_use]
pub fn contract_number() -> u64 {
    struct Number(Fnv1a);
    impl EachService for Number {
        fn service<T: Topic>(&mut self, _message: &'static str) {
            let names = self.0.bytes(T::SUFFIX.as_bytes());
            let named = names.bytes(T::TYPE_NAME.as_bytes());
            let laid_out = named.number(MAGIC).number(T::LAYOUT);
            let queued = laid_out.number(T::QUEUE as u64).number(T::HISTORY as u64);
            let written = queued.number(T::WRITERS as u64);
            self.0 = written.number(u64::from(T::HAS_EVENTS));
        }
    }
    let mut number = Number(Fnv1a::new());
    each_service(&mut number);
    let own = number.0.number(MAX_READERS as u64);
    own.number(MAX_NODES as u64)
        .number(MAX_BORROWED as u64)
        .finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_distinct_and_documented() {
        for Enumeration {
            name,
            coding,
            entries,
            ..
        } in enumerations()
        {
            for pair in entries.windows(2) {
                assert!(pair[0].number < pair[1].number, "{name}: {pair:?}");
            }
            for entry in &entries {
                assert!(!entry.doc.is_empty(), "{name}: {entry:?}");
                // a C enumeration is an int
                assert!(
                    coding != Coding::Bit || entry.number < 31,
                    "{name}: {entry:?}"
                );
            }
        }
    }

    #[test]
    fn names_are_those_of_tables_and_screens() {
        let lists = enumerations();
        let of = |name: &str| {
            let list = lists.iter().find(|list| list.name == name).unwrap();
            list.entries.iter().map(|e| e.name).collect::<Vec<_>>()
        };
        assert_eq!(of("level"), Level::ALL.map(Level::name));
        assert_eq!(of("fault"), InputFault::ALL.map(InputFault::name));
        assert_eq!(of("reason"), Reason::ALL.map(Reason::name));
        assert_eq!(of("cause"), Contribution::ALL.map(Contribution::name));
        assert_eq!(
            of("status")[1..],
            Status::VARIANTS
                .iter()
                .map(|s| s.name())
                .collect::<Vec<_>>()
        );
    }
}
