//! What `metadata.yaml` of a rosbag2 folder says.

use std::collections::BTreeMap;

/// The few entries of `metadata.yaml` that matter here. They are flat text of a fixed shape, so
/// a YAML parser is not needed.
#[derive(Default)]
pub(crate) struct Metadata {
    pub(crate) files: Vec<String>,
    pub(crate) compression_format: String,
    pub(crate) compression_mode: String,
    /// How many messages the recorder wrote, for each topic.
    pub(crate) message_counts: BTreeMap<String, u64>,
}

impl Metadata {
    pub(crate) fn parse(text: &str) -> Self {
        let mut metadata = Self::default();
        let mut in_files = false;
        let mut topics = None;
        for whole_line in text.lines() {
            let line = whole_line.trim();
            let indent = whole_line.len() - whole_line.trim_start().len();
            if let Some(item) = line.strip_prefix("- ").filter(|_| in_files) {
                metadata.files.push(unquote(item).to_owned());
                continue;
            }
            in_files = false;
            if line.starts_with("topics_with_message_count:") {
                topics = Some((indent, TopicCount::default()));
            } else if let Some((section, count)) = &mut topics {
                if indent > *section || line.starts_with("- ") {
                    count.line(line, &mut metadata.message_counts);
                    continue;
                }
                topics = None;
            }
            if let Some(inline) = line.strip_prefix("relative_file_paths:") {
                in_files = true;
                metadata.files.extend(inline_list(inline));
            } else if let Some(value) = line.strip_prefix("compression_format:") {
                metadata.compression_format = unquote(value).to_owned();
            } else if let Some(value) = line.strip_prefix("compression_mode:") {
                metadata.compression_mode = unquote(value).to_owned();
            }
        }
        metadata
    }
}

/// The name and the count of one topic, which come in either order.
#[derive(Default)]
struct TopicCount {
    name: Option<String>,
    count: Option<u64>,
}

impl TopicCount {
    fn line(&mut self, line: &str, counts: &mut BTreeMap<String, u64>) {
        let line = line.trim_start_matches("- ");
        if let Some(name) = line.strip_prefix("name:") {
            self.name = Some(unquote(name).to_owned());
        } else if let Some(count) = line.strip_prefix("message_count:") {
            self.count = count.trim().parse().ok();
        }
        if let (Some(name), Some(count)) = (&self.name, self.count) {
            *counts.entry(name.clone()).or_default() += count;
            *self = Self::default();
        }
    }
}

fn inline_list(text: &str) -> impl Iterator<Item = String> {
    let inner = text.trim().trim_start_matches('[').trim_end_matches(']');
    inner
        .split(',')
        .map(unquote)
        .filter(|item| !item.is_empty())
        .map(str::to_owned)
}

fn unquote(text: &str) -> &str {
    text.trim().trim_matches(['"', '\''])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_lists_its_files() {
        let text = "a:\n  relative_file_paths:\n    - one_0.db3\n    - 'two.db3'\n  x: 1\n  - no";
        assert_eq!(Metadata::parse(text).files, ["one_0.db3", "two.db3"]);
        let inline = "relative_file_paths: [\"a.mcap\", b.mcap]\ncompression_format: \"\"";
        let metadata = Metadata::parse(inline);
        assert_eq!(metadata.files, ["a.mcap", "b.mcap"]);
        assert!(metadata.compression_format.is_empty());
    }

    #[test]
    fn metadata_counts_messages_in_either_order() {
        let text = "i:\n  topics_with_message_count:\n    - topic_metadata:\n        name: /a\n\
            \x20       offered_qos_profiles:\n          - depth: 5\n      message_count: 7\n\
            \x20 version: 9\n  message_count: 99\n";
        let counts = Metadata::parse(text).message_counts;
        assert_eq!(counts, BTreeMap::from([("/a".to_owned(), 7)]));
        let other = "i:\n  topics_with_message_count:\n  - message_count: 3\n    topic_metadata:\n\
            \x20     name: '/b'\n  files:\n  - message_count: 8\n";
        let counts = Metadata::parse(other).message_counts;
        assert_eq!(counts, BTreeMap::from([("/b".to_owned(), 3)]));
    }
}
