//! Latched topics: their last message is given to everybody who subscribes later, so it counts until the next one.

use std::collections::BTreeMap;

use crate::message::{Topic, TopicWriter};

/// Whether the last message of a topic counts until the next one: by its name, or by the record of its writer in the log.
///
/// ROS 1 writes `latching=1` into the header of a connection; rosbag2 the quality of service that was offered, in YAML:
/// `durability: 1` or `durability: transient_local`.
pub(crate) fn is_latched(name: &str, says: &BTreeMap<String, String>) -> bool {
    let is_known = ["tf_static", "robot_description"].contains(&last_part(name));
    let is_latching = says.get("latching").is_some_and(|value| value == "1");
    let qos = says.get("offered_qos_profiles");
    is_known || is_latching || qos.is_some_and(|qos| is_transient_local(qos))
}

impl Topic {
    /// Whether the last message of the topic counts until the next one, also for later subscribers.
    #[must_use]
    pub fn is_latched(&self) -> bool {
        let says_so = |writer: &TopicWriter| is_latched(&self.name, &writer.says);
        // a topic without writers goes by its name
        let by_name = is_static_transform(&self.name) || is_latched(&self.name, &BTreeMap::new());
        by_name || self.writers.iter().any(says_so)
    }
}

/// Whether a topic carries static transforms, each publisher its own.
pub(crate) fn is_static_transform(name: &str) -> bool {
    last_part(name) == "tf_static"
}

fn last_part(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Whether one of the profiles keeps its last messages for late joiners.
fn is_transient_local(qos: &str) -> bool {
    let values = qos.split("durability").skip(1).filter_map(|rest| {
        let value = rest.trim_start_matches(['"', '\'']).trim_start();
        let value = value.strip_prefix(':')?.trim_start();
        let value = value.trim_start_matches(['"', '\'']);
        let is_of_value = |c: char| c.is_ascii_alphanumeric() || c == '_';
        value.split(|c| !is_of_value(c)).next()
    });
    values
        .into_iter()
        .any(|value| value == "1" || value.eq_ignore_ascii_case("transient_local"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latched_topics_are_known_by_name_or_writer() {
        let says = |key: &str, value: &str| BTreeMap::from([(key.to_owned(), value.to_owned())]);
        let qos = |text: &str| is_latched("/map", &says("offered_qos_profiles", text));
        assert!(is_latched("/robot/tf_static", &BTreeMap::new()));
        assert!(is_latched("/robot_description", &BTreeMap::new()));
        assert!(!is_latched("/tf", &BTreeMap::new()));
        assert!(is_latched("/map", &says("latching", "1")));
        assert!(!is_latched("/map", &says("latching", "0")));
        // Foxy to Iron
        assert!(qos(
            "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9\n"
        ));
        assert!(!qos(
            "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: 1\n"
        ));
        // Jazzy
        assert!(qos(
            "- history: keep_last\n  reliability: reliable\n  durability: transient_local\n"
        ));
        assert!(!qos(
            "- history: keep_last\n  reliability: reliable\n  durability: volatile\n"
        ));
        // one of two publishers
        assert!(qos("[{durability: 2}, {\"durability\": 1, depth: 3}]"));
        assert!(!qos("") && !qos("durability") && !qos("durability: 12"));
    }
}
