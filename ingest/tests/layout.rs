use proptest::prelude::*;
use tipwatch_ingest::{DecodeError, FieldPath, Fields, Layout, SchemaError};

use crate::support::{self, Cdr, JOINT_STATE, joint_state};

fn paths(texts: &[&str]) -> Vec<FieldPath> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

fn compile(definition: &str, texts: &[&str]) -> Result<Layout, SchemaError> {
    Layout::compile(definition, "pkg/msg/Root", &paths(texts))
}

const EVERYTHING: &str = "string<=8 name\nuint8 LIMIT=3\nfloat64 after_text\nbool flag\n\
    int16 small\nfloat32[3] fixed\nuint8[] raw\nPart[] parts\nPart[2] two_parts\n\
    float64[<=4] bounded\nstring[] labels\nNothing nothing\nuint64 big\nint32[] counts\n\
    float64 last\n===\nMSG: pkg/Part\nuint8 kind\nstring label\nfloat64 x\n\
    ===\nMSG: pkg/Nothing\n";

fn everything(big_endian: bool, name: &str) -> Vec<u8> {
    let mut cdr = Cdr::new(big_endian);
    cdr.text(name)
        .f64(1.5)
        .u8(1)
        .i16(-7)
        .f32(0.5)
        .f32(1.5)
        .f32(2.5);
    cdr.u32(3).u8(9).u8(9).u8(9);
    cdr.u32(3);
    for part in 0..5 {
        cdr.u8(part)
            .text(&"x".repeat(usize::from(part)))
            .f64(f64::from(part) * 10.0);
    }
    cdr.numbers(&[4.0, 5.0])
        .texts(&["one", "", "three"])
        .u8(0)
        .u64(1 << 40);
    cdr.u32(2).i32(-1).i32(70_000).f64(99.0);
    cdr.bytes
}

#[test]
fn all_field_kinds_are_read_at_any_alignment() {
    let wanted = [
        "after_text",
        "flag",
        "small",
        "fixed[]",
        "fixed[1]",
        "parts[].x",
        "parts[].label",
        "bounded[]",
        "bounded[3]",
        "labels[]",
        "big",
        "counts[]",
        "last",
        "name",
    ];
    let layout = compile(EVERYTHING, &wanted).unwrap();
    let mut fields = Fields::new();
    for big_endian in [false, true] {
        for name in ["", "a", "ab", "abc", "abcd", "abcde", "abcdef"] {
            layout
                .decode(&everything(big_endian, name), &mut fields)
                .unwrap();
            let numbers = [0, 1, 2, 4, 10, 12].map(|path| fields.number(path));
            assert_eq!(numbers, [1.5, 1.0, -7.0, 1.5, (1_u64 << 40) as f64, 99.0]);
            assert_eq!(fields.numbers(3), [0.5, 1.5, 2.5]);
            assert_eq!(fields.numbers(5), [0.0, 10.0, 20.0]);
            assert_eq!(fields.texts(6).collect::<Vec<_>>(), [&b""[..], b"x", b"xx"]);
            assert_eq!(fields.numbers(7), [4.0, 5.0]);
            assert!(fields.number(8).is_nan());
            assert_eq!(
                fields.texts(9).collect::<Vec<_>>(),
                [&b"one"[..], b"", b"three"]
            );
            assert_eq!(fields.numbers(11), [-1.0, 70_000.0]);
            assert_eq!(fields.text(13), name.as_bytes());
        }
    }
}

#[test]
fn single_late_field_is_found_past_all_others() {
    let layout = compile(EVERYTHING, &["last"]).unwrap();
    let mut fields = Fields::new();
    for big_endian in [false, true] {
        layout
            .decode(&everything(big_endian, "abc"), &mut fields)
            .unwrap();
        assert_eq!(fields.number(0), 99.0);
    }
}

#[test]
fn wrong_paths_are_explained() {
    let message = |texts: &[&str]| compile(EVERYTHING, texts).unwrap_err().to_string();
    assert!(message(&["missing"]).contains("expected a field of pkg/Root, which has: name, "));
    assert!(message(&["parts[].z"]).contains("expected a field of pkg/Part"));
    assert!(message(&["bounded"]).contains("found an array of number"));
    assert!(message(&["last[]"]).contains("found number"));
    assert!(message(&["parts[]"]).contains("found an array of message pkg/Part"));
    assert!(message(&["last", "last"]).contains("twice"));
    let wide = compile("wstring w\nfloat64 x\n", &["x"]).unwrap_err();
    assert!(matches!(wide, SchemaError::WideString { .. }));
    assert!(compile("float64 x\nwstring w\n", &["x"]).is_ok());
    let endless = compile("Root again\nfloat64 x\n", &["x"]).unwrap_err();
    assert!(matches!(endless, SchemaError::TooLarge { .. }));
}

#[test]
fn other_encodings_and_cut_messages_are_refused() {
    let layout = Layout::compile(
        JOINT_STATE,
        "sensor_msgs/msg/JointState",
        &paths(&["position[]"]),
    );
    let layout = layout.unwrap();
    let mut fields = Fields::new();
    let whole = joint_state(1, &["a"], &[1.0], &[]);
    for end in 0..whole.len() {
        let result = layout.decode(&whole[..end], &mut fields);
        assert!(result.is_ok() || end < whole.len() - 8, "{end}");
    }
    let mut other = whole.clone();
    other[1] = 7;
    let error = layout.decode(&other, &mut fields).unwrap_err();
    assert!(matches!(
        error,
        DecodeError::Encapsulation {
            found: 7,
            name: "XCDR2"
        }
    ));
    let mut many = whole;
    let names_at = 4 + 8 + 4 + "/base".len() + 1 + 2;
    many[names_at..names_at + 4].fill(0xff);
    let error = layout.decode(&many, &mut fields).unwrap_err();
    assert!(
        matches!(error, DecodeError::ImpossibleCount { .. }),
        "{error}"
    );
}

proptest! {
    #![proptest_config(support::proptest_config(2000))]

    #[test]
    fn decoding_arbitrary_bytes_never_panics(
        order in 0_u8..2,
        bytes in proptest::collection::vec(prop_oneof![Just(0_u8), 0..9_u8, any::<u8>()], 0..300),
    ) {
        let layout =
            compile(EVERYTHING, &["fixed[2]", "parts[].label", "labels[]", "counts[]", "last"]);
        let mut fields = Fields::new();
        let message = [&[0, order, 0, 0], bytes.as_slice()].concat();
        let layout = layout.unwrap();
        let _ = layout.decode(&message, &mut fields);
        let _ = layout.decode(&bytes, &mut fields);
        prop_assert!(fields.texts(2).count() <= bytes.len());
    }

    #[test]
    fn arbitrary_definitions_never_panic(
        text in "(\\PC|[ \n\t=#\\[\\]<>/]|string|float64|uint8|MSG:|===\n|x|A/B){0,60}",
        path in "[a-z\\[\\].0-9]{0,12}",
    ) {
        if let Ok(path) = path.parse::<FieldPath>() {
            let _ = Layout::compile(&text, "A/B", &[path]);
        }
        let _ = Layout::compile(&text, &text, &paths(&["x"]));
    }
}
