//! The entries of a rosbag2 `metadata.yaml` that reading needs.

use std::collections::BTreeMap;

use yaml_rust2::{
    Yaml, YamlLoader,
    parser::{Event, Parser},
};

/// Recorders nest six levels deep. The loader recurses, so damaged text must not nest without limit.
const MAX_DEPTH: usize = 32;

/// Absent entries are empty.
#[derive(Default)]
pub(super) struct Metadata {
    pub(super) files: Vec<String>,
    /// Contents of the files that the recorder noted, by file name; empty before version 5.
    pub(super) contents: BTreeMap<String, FileContents>,
    pub(super) compression_format: String,
    pub(super) compression_mode: String,
    /// Number of messages that the recorder wrote, by topic.
    pub(super) message_counts: BTreeMap<String, u64>,
}

/// Contents of a file of the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FileContents {
    /// The log times of its first and its last message (ns).
    pub(super) span_ns: (i64, i64),
    pub(super) message_count: Option<u64>,
}

impl FileContents {
    fn of(entry: &Yaml) -> Option<Self> {
        let first_ns = entry["starting_time"]["nanoseconds_since_epoch"].as_i64()?;
        let duration_ns = entry["duration"]["nanoseconds"].as_i64()?;
        let is_span = first_ns >= 0 && duration_ns >= 0;
        is_span.then_some(Self {
            span_ns: (first_ns, first_ns.checked_add(duration_ns)?),
            message_count: (entry["message_count"].as_i64())
                .and_then(|count| u64::try_from(count).ok()),
        })
    }
}

impl Metadata {
    /// Whether every message is compressed; `None` without metadata.
    pub(super) fn packs_messages(&self) -> Option<bool> {
        let is_packed = self.compression_mode.eq_ignore_ascii_case("message");
        (!self.files.is_empty()).then_some(is_packed && !self.compression_format.is_empty())
    }

    /// The metadata, or what is wrong with the text.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        check_structure(text)?;
        let documents = YamlLoader::load_from_str(text).map_err(|error| error.to_string())?;
        let information = documents
            .first()
            .map(|root| &root["rosbag2_bagfile_information"])
            .filter(|information| information.as_hash().is_some())
            .ok_or("expected the key rosbag2_bagfile_information, found none")?;
        let text_at = |key: &str| information[key].as_str().unwrap_or_default().to_owned();
        let list_at = |key: &str| information[key].as_vec().into_iter().flatten();
        let files = list_at("relative_file_paths").filter_map(Yaml::as_str);
        let mut metadata = Self {
            files: files.map(str::to_owned).collect(),
            contents: list_at("files")
                .filter_map(|entry| {
                    let name = entry["path"].as_str()?.to_owned();
                    Some((name, FileContents::of(entry)?))
                })
                .collect(),
            compression_format: text_at("compression_format"),
            compression_mode: text_at("compression_mode"),
            message_counts: BTreeMap::new(),
        };
        for topic in list_at("topics_with_message_count") {
            let name = topic["topic_metadata"]["name"].as_str();
            let count = topic["message_count"].as_i64().map(u64::try_from);
            if let (Some(name), Some(Ok(count))) = (name, count) {
                let sum: &mut u64 = metadata.message_counts.entry(name.to_owned()).or_default();
                *sum = sum.saturating_add(count);
            }
        }
        Ok(metadata)
    }
}

/// Refuses text that would make the loader recurse too deeply or, through aliases, grow without limit.
fn check_structure(text: &str) -> Result<(), String> {
    let mut parser = Parser::new_from_str(text);
    let mut depth = 0_usize;
    loop {
        let (event, mark) = parser.next_token().map_err(|error| error.to_string())?;
        match event {
            Event::SequenceStart(..) | Event::MappingStart(..) => depth += 1,
            Event::SequenceEnd | Event::MappingEnd => depth = depth.saturating_sub(1),
            Event::Alias(_) => return Err(format!("line {}: found an alias", mark.line())),
            Event::StreamEnd => return Ok(()),
            _ => {}
        }
        if depth > MAX_DEPTH {
            return Err(format!("line {}: nested too deeply", mark.line()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_counts_are_read_in_block_and_flow_style() {
        let block = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - one_0.db3\n    - 'two.db3'\n\
            \x20 topics_with_message_count:\n    - topic_metadata:\n        name: /a\n\
            \x20       offered_qos_profiles:\n          - depth: 5\n      message_count: 7\n\
            \x20   - message_count: 3\n      topic_metadata:\n        name: '/a'\n\
            \x20 message_count: 99\n";
        let metadata = Metadata::parse(block).unwrap();
        assert_eq!(metadata.files, ["one_0.db3", "two.db3"]);
        let expected = BTreeMap::from([("/a".to_owned(), 10)]);
        assert_eq!(metadata.message_counts, expected);
        let flow = "{rosbag2_bagfile_information: {relative_file_paths: [\"a.mcap\", b.mcap], \
            compression_format: \"\"}}";
        let metadata = Metadata::parse(flow).unwrap();
        assert_eq!(metadata.files, ["a.mcap", "b.mcap"]);
        assert!(metadata.compression_format.is_empty());
    }

    #[test]
    fn times_and_counts_of_files_are_read() {
        let entry = |name: &str, first_ns: i64, duration_ns: i64| {
            format!(
                "    - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: {first_ns}\n      \
                duration:\n        nanoseconds: {duration_ns}\n      message_count: 7\n"
            )
        };
        let text = format!(
            "rosbag2_bagfile_information:\n  files:\n{}{}{}    - path: none.mcap\n    - 5\n",
            entry("a.mcap", 100, 50),
            entry("before.mcap", -1, 50),
            entry("beyond.mcap", i64::MAX, 1),
        );
        let contents = FileContents {
            span_ns: (100, 150),
            message_count: Some(7),
        };
        assert_eq!(
            Metadata::parse(&text).unwrap().contents,
            BTreeMap::from([("a.mcap".to_owned(), contents)])
        );
    }

    #[test]
    fn damaged_metadata_is_refused_with_a_reason() {
        let refused = |text: &str| Metadata::parse(text).err().unwrap();
        assert!(refused("a: [1, 2\nb: }").contains("line"));
        assert!(refused("").contains("rosbag2_bagfile_information"));
        assert!(refused(&"- ".repeat(100_000)).contains("too deeply"));
        assert!(refused("a: &a [1]\nb: [*a, *a]").contains("alias"));
    }
}
