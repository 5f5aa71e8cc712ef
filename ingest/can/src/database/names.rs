//! Meaning of the names and descriptions of signals: long names, counters, checksums, and values that are no numbers.

use can_dbc::AttributeValue;

/// The name that an attribute states, if it is another than the short one.
pub(super) fn long_name<'d>(attribute: Option<&'d AttributeValue>, short: &str) -> Option<&'d str> {
    match attribute? {
        AttributeValue::String(name) => {
            (!name.trim().is_empty() && name != short).then(|| name.trim())
        }
        _ => None,
    }
}

/// Whether a description of a raw value declares that it is not a number: by whole words, since a default is no fault.
pub(super) fn is_not_a_number(description: &str) -> bool {
    /// Texts that count as the whole description only.
    const WHOLE: [&str; 4] = ["na", "nan", "init", "err"];
    const WORDS: [&str; 17] = [
        "sna",
        "invalid",
        "error",
        "errors",
        "erroneous",
        "fault",
        "faults",
        "faulty",
        "faulted",
        "undefined",
        "unavailable",
        "notavailable",
        "notavail",
        "notvalid",
        "sensorerror",
        "sensorfault",
        "signalerror",
    ];
    /// Words that deny a number only with "not" or "no" before them.
    const DENIED: [&str; 4] = ["available", "avail", "valid", "defined"];
    const DENIALS: [&str; 4] = ["no", "not", "non", "without"];
    let words = words(description);
    let is =
        |list: &[&str], word: Option<&String>| word.is_some_and(|w| list.contains(&w.as_str()));
    let says = |(place, word): (usize, &String)| {
        let is_denied = is(&DENIALS, place.checked_sub(1).and_then(|at| words.get(at)));
        let is_free = is(&["free"], words.get(place + 1));
        if is(&DENIED, Some(word)) {
            return is_denied;
        }
        // also "no sensor error"
        let is_denied = is_denied || is(&["no", "without"], words.first());
        is(&WORDS, Some(word)) && !is_denied && !is_free
    };
    let says_signal_not = words.windows(2).any(|pair| pair == ["signal", "not"]);
    WHOLE.contains(&words.concat().as_str())
        || says_signal_not
        || words.iter().enumerate().any(says)
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

/// Whether a name denotes a counter of messages, rather than of hours, loads or strokes.
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

/// Whether a name denotes a checksum.
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
            "SensorFault",
            "Signal not available",
            "signal not received",
            "NOT_VALID",
            "N/A",
            "NaN",
            "ERROR_2",
        ] {
            assert!(is_not_a_number(text), "{text}");
        }
        for text in [
            "Forward",
            "No error",
            "NoFault",
            "no sensor error",
            "fault-free",
            "On",
            "Nail",
            "Neutral",
            "Default",
            "DefaultMode",
            "defaulted",
            "Terror",
            "Not invalid",
            "Trailer not present",
            "Available",
        ] {
            assert!(!is_not_a_number(text), "{text}");
        }
    }
}
