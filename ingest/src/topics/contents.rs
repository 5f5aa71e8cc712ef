//! Contents of the topics of a log: their time spans, and the first and last value of every number that can be addressed.

use std::{collections::BTreeMap, ops::ControlFlow};

use serde::Serialize;

use crate::{
    decode::{Fields, Layout, MOST_FIELDS, NumberPaths, is_can_frame, number_paths},
    formats::{collect_numbers, is_row},
    log::Log,
    message::{Error, Losses, Topic, TopicId},
    schema::FieldPath,
};

/// Messages beyond this are not kept to look into: images and clouds of points.
const MOST_BYTES: usize = 1 << 20;

/// Contents of a topic.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TopicContents {
    /// Intact messages.
    pub messages: u64,
    /// Log time (ns) of the first.
    pub start_ns: Option<i64>,
    /// Log time (ns) of the last.
    pub end_ns: Option<i64>,
    /// The numbers in its messages, as far as they can be addressed and one of the two has them.
    pub fields: Vec<FieldContents>,
    /// Reason why not all numbers are listed.
    pub note: Option<String>,
}

/// A number in the first and the last message of a topic. Rows of a table may each have some of the numbers: there it is
/// the first and the last number of the column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldContents {
    /// Its path, as the machine file takes it.
    pub field: String,
    /// Number in the first message; `None` if it has none.
    pub first: Option<f64>,
    /// Number in the last message; `None` if it has none.
    pub last: Option<f64>,
}

/// Data kept of a topic during the pass.
#[derive(Default)]
struct TopicTally {
    messages: u64,
    span_ns: Option<(i64, i64)>,
    first: Vec<u8>,
    last: Vec<u8>,
    is_too_large: bool,
}

impl TopicContents {
    /// Returns the time from the first message to the last (s).
    #[must_use]
    pub fn duration_s(&self) -> Option<f64> {
        let (start_ns, end_ns) = self.start_ns.zip(self.end_ns)?;
        Some(end_ns.saturating_sub(start_ns) as f64 * 1e-9)
    }

    /// Messages per second; `None` for less than two, or without time between them.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        let periods = self.messages.checked_sub(1).filter(|count| *count > 0)? as f64;
        let duration_s = self.duration_s().filter(|duration| *duration > 0.0)?;
        Some(periods / duration_s)
    }
}

/// Reads a whole log and returns the contents of every topic, in the order of the topics.
pub fn topic_contents(log: &Log) -> Result<(Vec<TopicContents>, Losses), Error> {
    let ids: Vec<TopicId> = log.topics().iter().map(|topic| topic.id).collect();
    let mut seen: BTreeMap<TopicId, TopicTally> = BTreeMap::new();
    let is_table = |topic: TopicId| {
        (log.topics().get(topic.index())).is_some_and(|topic| is_row(&topic.type_name))
    };
    let losses = log.read(&ids, &mut |message| {
        let seen = seen.entry(message.topic).or_default();
        seen.messages += 1;
        let time_ns = message.log_time_ns;
        let (first, last) = seen.span_ns.unwrap_or((time_ns, time_ns));
        seen.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        seen.is_too_large |= message.data.len() > MOST_BYTES;
        if !seen.is_too_large && is_table(message.topic) {
            collect_numbers(message.data, &mut seen.first, &mut seen.last);
        } else if !seen.is_too_large {
            let kept = match seen.messages {
                1 => &mut seen.first,
                _ => &mut seen.last,
            };
            kept.clear();
            kept.extend_from_slice(message.data);
        }
        ControlFlow::Continue(())
    })?;
    let contents = log.topics().iter().map(|topic| match seen.get(&topic.id) {
        Some(seen) => contents_of(topic, seen),
        None => TopicContents::default(),
    });
    Ok((contents.collect(), losses))
}

fn contents_of(topic: &Topic, seen: &TopicTally) -> TopicContents {
    let (fields, note) = match () {
        // the messages on a bus are listed by themselves
        () if is_can_frame(&topic.type_name) => (Vec::new(), None),
        () if seen.is_too_large => (
            Vec::new(),
            Some(format!(
                "not looked into: a message has more than {MOST_BYTES} bytes"
            )),
        ),
        () => fields_of(topic, seen),
    };
    TopicContents {
        messages: seen.messages,
        start_ns: seen.span_ns.map(|span| span.0),
        end_ns: seen.span_ns.map(|span| span.1),
        fields,
        note,
    }
}

/// The numbers in two messages.
fn fields_of(topic: &Topic, seen: &TopicTally) -> (Vec<FieldContents>, Option<String>) {
    let last = match seen.messages {
        1 => &seen.first,
        _ => &seen.last,
    };
    let NumberPaths { paths, is_cut } = number_paths(topic, &seen.first);
    let parsed: Vec<FieldPath> = paths.iter().filter_map(|path| path.parse().ok()).collect();
    // an unsupported encoding or a missing definition is told even where nothing can be listed
    let layout = match Layout::of_topic(topic, &parsed) {
        Ok(layout) => layout,
        Err(error) => return (Vec::new(), Some(error.to_string())),
    };
    let mut fields = Fields::new();
    let mut problem = None;
    let mut numbers = |message: &[u8]| -> Vec<f64> {
        match layout.decode(message, &mut fields) {
            Ok(()) => (0..parsed.len()).map(|at| fields.number(at)).collect(),
            Err(error) => {
                problem.get_or_insert(format!("a message cannot be decoded: {error}"));
                vec![f64::NAN; parsed.len()]
            }
        }
    };
    let (first, last) = (numbers(&seen.first), numbers(last));
    let known = |number: &f64| Some(*number).filter(|number| number.is_finite());
    let all = parsed.iter().zip(first.iter().zip(&last));
    let listed = all.filter_map(|(path, (first, last))| {
        let (first, last) = (known(first), known(last));
        (first.is_some() || last.is_some()).then(|| FieldContents {
            field: path.to_string(),
            first,
            last,
        })
    });
    let mut listed: Vec<FieldContents> = listed.collect();
    let is_cut = is_cut || listed.len() > MOST_FIELDS;
    listed.truncate(MOST_FIELDS);
    let cut = is_cut.then(|| format!("only the first {} fields are listed", listed.len()));
    (listed, problem.or(cut))
}
