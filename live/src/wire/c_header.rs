//! The wire for C and C++, and for whoever reads C: made from the same definitions as the Rust types.

use std::fmt::Write;

use crate::wire::topics::{
    ACKNOWLEDGE_QUEUE, ACKNOWLEDGE_SUFFIX, COMMAND_QUEUE, COMMAND_SUFFIX, DEFAULT_SERVICE, LATEST,
    LAYOUT_ATTRIBUTE, MACHINE_SUFFIX, MAGIC, MAX_BORROWED, MAX_JOINTS, MAX_NODES, MAX_PLACES,
    MAX_READERS, MAX_VALUES, NAME_BYTES, ONE_WRITER, PROGRESS_QUEUE, PROGRESS_SUFFIX, SAMPLE_QUEUE,
    SAMPLES_SUFFIX, SESSION_SUFFIX, VERDICT_QUEUE, VERDICT_SUFFIX, Wire, WireAcknowledge,
    WireCommand, WireMachine, WireProgress, WireSample, WireSession, WireVerdict,
};

const BEGINNING: &str = "\
/* Messages of tipwatch-live in shared memory (iceoryx2 0.10). Made by `tipwatch-live header`: do not edit.
 *
 * Every service has the attribute \"layout\" with the value of NAME_LAYOUT; its settings stand beside the
 * messages in book/src/reference/services.md. Numbers are in the computer's own byte order. */
#ifndef TIPWATCH_LIVE_H
#define TIPWATCH_LIVE_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define TIPWATCH_STATIC_ASSERT static_assert
#else
#define TIPWATCH_STATIC_ASSERT _Static_assert
#endif

";

/// The header.
#[must_use]
pub fn c_header() -> String {
    let mut text = String::from(BEGINNING);
    for (name, number) in [
        ("MAGIC", MAGIC),
        ("SAMPLE_QUEUE", SAMPLE_QUEUE as u64),
        ("VERDICT_QUEUE", VERDICT_QUEUE as u64),
        ("COMMAND_QUEUE", COMMAND_QUEUE as u64),
        ("LATEST", LATEST as u64),
        ("ACKNOWLEDGE_QUEUE", ACKNOWLEDGE_QUEUE as u64),
        ("PROGRESS_QUEUE", PROGRESS_QUEUE as u64),
        ("ONE_WRITER", ONE_WRITER as u64),
        ("MAX_READERS", MAX_READERS as u64),
        ("MAX_BORROWED", MAX_BORROWED as u64),
        ("MAX_NODES", MAX_NODES as u64),
        ("MAX_VALUES", MAX_VALUES as u64),
        ("MAX_JOINTS", MAX_JOINTS as u64),
        ("MAX_PLACES", MAX_PLACES as u64),
        ("NAME_BYTES", NAME_BYTES as u64),
    ] {
        let _ = writeln!(text, "#define TIPWATCH_{name} UINT64_C({number})");
    }
    for (name, value) in [
        ("DEFAULT_SERVICE", DEFAULT_SERVICE),
        ("SESSION_SUFFIX", SESSION_SUFFIX),
        ("SAMPLES_SUFFIX", SAMPLES_SUFFIX),
        ("MACHINE_SUFFIX", MACHINE_SUFFIX),
        ("VERDICT_SUFFIX", VERDICT_SUFFIX),
        ("COMMAND_SUFFIX", COMMAND_SUFFIX),
        ("ACKNOWLEDGE_SUFFIX", ACKNOWLEDGE_SUFFIX),
        ("PROGRESS_SUFFIX", PROGRESS_SUFFIX),
        ("LAYOUT_ATTRIBUTE", LAYOUT_ATTRIBUTE),
    ] {
        let _ = writeln!(text, "#define TIPWATCH_{name} \"{value}\"");
    }
    message::<WireSession>(&mut text, "session");
    message::<WireSample>(&mut text, "sample");
    message::<WireMachine>(&mut text, "machine");
    message::<WireVerdict>(&mut text, "verdict");
    message::<WireCommand>(&mut text, "command");
    message::<WireAcknowledge>(&mut text, "acknowledge");
    message::<WireProgress>(&mut text, "progress");
    text.push_str("\n#endif\n");
    text
}

fn message<T: Wire>(text: &mut String, name: &str) {
    let upper = name.to_uppercase();
    let _ = writeln!(text, "\n/*{} */", T::DOC.join("\n *"));
    let _ = writeln!(text, "#define TIPWATCH_{upper}_TYPE \"{}\"", T::TYPE_NAME);
    let _ = writeln!(
        text,
        "#define TIPWATCH_{upper}_LAYOUT \"{:016x}\"",
        T::LAYOUT
    );
    let _ = writeln!(text, "struct tipwatch_{name} {{");
    for field in T::FIELDS {
        let doc = field.doc.join("\n     *").replace(['[', ']', '`'], "");
        let dimensions: String = field.dimensions.iter().map(|n| format!("[{n}]")).collect();
        let _ = writeln!(text, "    /*{doc} */");
        let _ = writeln!(text, "    {} {}{dimensions};", field.c_type, field.name);
    }
    let _ = writeln!(text, "}};");
    let sizes = T::FIELDS
        .last()
        .map_or(0, |last| last.offset + size_of::<u64>());
    let _ = writeln!(
        text,
        "TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_{name}) == {sizes}, \"tipwatch_{name}\");"
    );
}
