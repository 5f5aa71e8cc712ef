//! What names and descriptions say about a signal.

/// Whether a description of a raw value says that it is not a number.
pub(super) fn is_not_a_number(description: &str) -> bool {
    const WHOLE: [&str; 5] = ["sna", "na", "nan", "n/a", "init"];
    const PARTS: [&str; 9] = [
        "notavailable",
        "notavail",
        "unavailable",
        "invalid",
        "error",
        "fault",
        "undefined",
        "notvalid",
        "signalnot",
    ];
    let words: String = description.to_lowercase();
    let joined: String = words
        .chars()
        .filter(|c| c.is_alphanumeric() || *c == '/')
        .collect();
    let is_negated = ["noerror", "nofault"]
        .iter()
        .any(|part| joined.contains(part));
    WHOLE.contains(&joined.as_str())
        || !is_negated && PARTS.iter().any(|part| joined.contains(part))
}

/// Words of a name: `AliveCounter_1` is alive, counter, 1.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut last_is_upper = true;
    for c in name.chars() {
        let starts = c.is_uppercase() && !last_is_upper;
        if starts || !c.is_alphanumeric() {
            words.push(String::new());
        }
        last_is_upper = c.is_uppercase();
        if c.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Whether a name is that of a counter of messages, and not of hours, loads or strokes.
pub(super) fn is_counter(name: &str) -> bool {
    const COUNTERS: [&str; 4] = ["counter", "cnt", "ctr", "count"];
    const OF_MESSAGES: [&str; 11] = [
        "alive", "rolling", "message", "msg", "sequence", "seq", "frame", "life", "live", "rc",
        "mc",
    ];
    const WHOLE: [&str; 6] = [
        "alivecounter",
        "rollingcounter",
        "messagecounter",
        "msgcounter",
        "framecounter",
        "sequencecounter",
    ];
    let words = words(name);
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    let joined = words.concat();
    has(&COUNTERS) && (words.len() == 1 || has(&OF_MESSAGES))
        || WHOLE.iter().any(|whole| joined.contains(whole))
}

/// Whether a name is that of a checksum.
pub(super) fn is_checksum(name: &str) -> bool {
    let joined = words(name).concat();
    joined.contains("checksum")
        || joined.contains("chksum")
        || words(name).iter().any(|word| word.starts_with("crc"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_of_messages_are_told_from_others() {
        for name in [
            "AliveCounter",
            "RollingCnt_1",
            "MSG_COUNTER",
            "Counter",
            "rolling_counter",
            "MC_Cnt",
        ] {
            assert!(is_counter(name), "{name}");
        }
        for name in [
            "HourCounter",
            "LoadCycleCount",
            "StrokeCounter",
            "BoomAngle",
            "Encounter",
            "Message",
        ] {
            assert!(!is_counter(name), "{name}");
        }
        assert!(is_checksum("EEC1_CRC8") && is_checksum("Checksum") && !is_checksum("Crane"));
    }

    #[test]
    fn descriptions_say_what_is_not_a_number() {
        for text in [
            "SNA",
            "Not available",
            "not_available",
            "Error",
            "Sensor fault",
            "Invalid value",
        ] {
            assert!(is_not_a_number(text), "{text}");
        }
        for text in ["Forward", "No error", "On", "Nail", "Neutral"] {
            assert!(!is_not_a_number(text), "{text}");
        }
    }
}
