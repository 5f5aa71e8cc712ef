//! Parses definitions in OMG IDL, as ROS 2 embeds them for types that are written in it (`ros2idl`).
//!
//! Recorders embed one file for the message and one for each type nested in it, each below a line of `=` signs and a
//! line `IDL: package/msg/Type`.

use std::collections::HashMap;

use super::{
    error::SchemaError,
    types::{Field, FieldType, NumberType, Repetition, normal_type_name},
};

/// Types nested deeper than this are taken as recursive.
const MAX_DEPTH: usize = 32;

/// The fields of all structures in a text.
pub(super) fn parse(
    text: &str,
    type_name: &str,
) -> Result<HashMap<String, Vec<Field>>, SchemaError> {
    let mut parser = Parser {
        tokens: tokens(text),
        at: 0,
        type_name,
        scope: Vec::new(),
        names: Names::default(),
    };
    while parser.at < parser.tokens.len() {
        parser.definition(0)?;
    }
    let names = &parser.names;
    let mut types = HashMap::new();
    for (name, members) in &names.structs {
        let field = |member: &Member| names.field(member, name, type_name);
        let fields: Result<Vec<Field>, SchemaError> = members.iter().map(field).collect();
        types.insert(normal_type_name(name), fields?);
    }
    Ok(types)
}

/// A word, a sign or a literal, and its line.
struct Token {
    text: String,
    line: usize,
}

/// The tokens of a text, without comments, directives and the lines that recorders insert.
fn tokens(text: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let mut is_comment = false;
    for (index, line) in text.lines().enumerate() {
        let trimmed = line.trim();
        let is_separator = trimmed.len() >= 3 && trimmed.bytes().all(|byte| byte == b'=');
        if !is_comment && (is_separator || trimmed.starts_with('#') || trimmed.starts_with("IDL:"))
        {
            continue;
        }
        let mut push = |text: &str| {
            tokens.push(Token {
                text: text.to_owned(),
                line: index + 1,
            });
        };
        let mut rest = trimmed;
        while let Some(first) = rest.chars().next() {
            if is_comment {
                let Some((_, after)) = rest.split_once("*/") else {
                    break;
                };
                (rest, is_comment) = (after, false);
                continue;
            }
            if rest.starts_with("//") {
                break;
            }
            let length = if rest.starts_with("/*") {
                is_comment = true;
                2
            } else if first.is_whitespace() {
                first.len_utf8()
            } else {
                let length = token_bytes(rest, first);
                push(&rest[..length]);
                length
            };
            rest = &rest[length..];
        }
    }
    tokens
}

/// The length of the token at the front.
fn token_bytes(rest: &str, first: char) -> usize {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    if first == '"' || first == '\'' {
        let mut is_escaped = false;
        let closing = rest.char_indices().skip(1).find(|(_, c)| {
            let ends = *c == first && !is_escaped;
            is_escaped = *c == '\\' && !is_escaped;
            ends
        });
        return closing.map_or(rest.len(), |(at, _)| at + 1);
    }
    if is_word(first) {
        return rest.find(|c| !is_word(c)).unwrap_or(rest.len());
    }
    match rest.starts_with("::") {
        true => 2,
        false => first.len_utf8(),
    }
}

/// A type as written.
#[derive(Debug, Clone)]
enum Spec {
    Number(NumberType),
    Text,
    WideText,
    Sequence(Box<Spec>),
    /// A name, and the module in which it stands.
    Named {
        scope: String,
        name: String,
    },
}

/// A field or an alias, with the sizes of its array.
#[derive(Debug, Clone)]
struct Member {
    name: String,
    spec: Spec,
    sizes: Vec<u32>,
}

/// Definitions in a text, by scoped name with slashes.
#[derive(Default)]
struct Names {
    structs: HashMap<String, Vec<Member>>,
    aliases: HashMap<String, Member>,
    enums: Vec<String>,
    constants: HashMap<String, u32>,
}

struct Parser<'p> {
    tokens: Vec<Token>,
    at: usize,
    type_name: &'p str,
    scope: Vec<String>,
    names: Names,
}

impl Parser<'_> {
    fn error(&self) -> SchemaError {
        let token = self.tokens.get(self.at).or(self.tokens.last());
        SchemaError::Line {
            type_name: self.type_name.to_owned(),
            line: token.map_or(1, |token| token.line),
            found: match self.tokens.get(self.at) {
                Some(token) => token.text.chars().take(80).collect(),
                None => "the end".to_owned(),
            },
        }
    }

    fn peek(&self) -> &str {
        self.tokens.get(self.at).map_or("", |token| &token.text)
    }

    fn next(&mut self) -> Result<String, SchemaError> {
        let token = self.tokens.get(self.at).ok_or_else(|| self.error())?;
        let text = token.text.clone();
        self.at += 1;
        Ok(text)
    }

    fn takes(&mut self, text: &str) -> bool {
        let is_next = self.peek() == text;
        self.at += usize::from(is_next);
        is_next
    }

    fn expect(&mut self, text: &str) -> Result<(), SchemaError> {
        match self.takes(text) {
            true => Ok(()),
            false => Err(self.error()),
        }
    }

    fn word(&mut self) -> Result<String, SchemaError> {
        let is_word = |c: char| c.is_alphabetic() || c == '_';
        match self.peek().starts_with(is_word) {
            true => self.next(),
            false => Err(self.error()),
        }
    }

    fn scoped(&self, name: &str) -> String {
        let mut all = self.scope.clone();
        all.push(name.to_owned());
        all.join("/")
    }

    fn definition(&mut self, depth: usize) -> Result<(), SchemaError> {
        if depth > MAX_DEPTH {
            return Err(self.error());
        }
        self.annotations()?;
        match self.next()?.as_str() {
            ";" => Ok(()),
            "module" => {
                let name = self.word()?;
                self.scope.push(name);
                self.expect("{")?;
                while !self.takes("}") {
                    self.definition(depth + 1)?;
                }
                self.scope.pop();
                Ok(())
            }
            "struct" => self.structure(),
            "typedef" => {
                let spec = self.spec(0)?;
                for member in self.declarators(&spec)? {
                    let name = self.scoped(&member.name);
                    self.names.aliases.insert(name, member);
                }
                Ok(())
            }
            "const" => self.constant(),
            "enum" => {
                let name = self.word()?;
                self.names.enums.push(self.scoped(&name));
                while !self.takes(";") {
                    self.next()?;
                }
                Ok(())
            }
            _ => {
                self.at -= 1;
                Err(self.error())
            }
        }
    }

    fn structure(&mut self) -> Result<(), SchemaError> {
        let name = self.word()?;
        let name = self.scoped(&name);
        self.expect("{")?;
        let mut members = Vec::new();
        while !self.takes("}") {
            self.annotations()?;
            let spec = self.spec(0)?;
            members.extend(self.declarators(&spec)?);
        }
        self.names.structs.insert(name, members);
        Ok(())
    }

    /// A constant, which matters only as the size of an array.
    fn constant(&mut self) -> Result<(), SchemaError> {
        let mut tokens = Vec::new();
        while !self.takes(";") {
            tokens.push(self.next()?);
        }
        if let [.., name, equals, value] = tokens.as_slice()
            && equals == "="
            && let Ok(value) = value.parse()
        {
            let name = self.scoped(name);
            self.names.constants.insert(name, value);
        }
        Ok(())
    }

    /// Passes over annotations such as `@verbatim (language="comment", text="...")`.
    fn annotations(&mut self) -> Result<(), SchemaError> {
        while self.takes("@") {
            self.scoped_name()?;
            if !self.takes("(") {
                continue;
            }
            let mut open = 1_usize;
            while open > 0 {
                match self.next()?.as_str() {
                    "(" => open += 1,
                    ")" => open -= 1,
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn scoped_name(&mut self) -> Result<String, SchemaError> {
        self.takes("::");
        let mut name = self.word()?;
        while self.takes("::") {
            name = format!("{name}/{}", self.word()?);
        }
        Ok(name)
    }

    fn spec(&mut self, depth: usize) -> Result<Spec, SchemaError> {
        if depth > MAX_DEPTH {
            return Err(self.error());
        }
        let first = self.peek().to_owned();
        let number = match first.as_str() {
            "boolean" => Some(NumberType::Bool),
            "octet" | "uint8" | "char" => Some(NumberType::U8),
            "int8" => Some(NumberType::I8),
            "int16" | "short" => Some(NumberType::I16),
            "uint16" => Some(NumberType::U16),
            "int32" => Some(NumberType::I32),
            "uint32" => Some(NumberType::U32),
            "int64" => Some(NumberType::I64),
            "uint64" => Some(NumberType::U64),
            "float" => Some(NumberType::F32),
            "double" => Some(NumberType::F64),
            _ => None,
        };
        if let Some(number) = number {
            self.at += 1;
            return Ok(Spec::Number(number));
        }
        match first.as_str() {
            "long" | "unsigned" => self.long(),
            "string" | "wstring" => {
                self.at += 1;
                if self.takes("<") {
                    self.next()?;
                    self.expect(">")?;
                }
                Ok(match first.as_str() {
                    "string" => Spec::Text,
                    _ => Spec::WideText,
                })
            }
            "sequence" => {
                self.at += 1;
                self.expect("<")?;
                let element = self.spec(depth + 1)?;
                if self.takes(",") {
                    self.next()?;
                }
                self.expect(">")?;
                Ok(Spec::Sequence(Box::new(element)))
            }
            // their encoding is not that of any number here
            "wchar" | "fixed" | "any" | "Object" | "map" => Err(self.error()),
            _ => Ok(Spec::Named {
                scope: self.scope.join("/"),
                name: self.scoped_name()?,
            }),
        }
    }

    /// `long`, `unsigned long long` and their like.
    fn long(&mut self) -> Result<Spec, SchemaError> {
        let is_unsigned = self.takes("unsigned");
        if is_unsigned && self.takes("short") {
            return Ok(Spec::Number(NumberType::U16));
        }
        self.expect("long")?;
        let is_longer = self.takes("long");
        if self.peek() == "double" {
            return Err(self.error());
        }
        Ok(Spec::Number(match (is_unsigned, is_longer) {
            (false, false) => NumberType::I32,
            (true, false) => NumberType::U32,
            (false, true) => NumberType::I64,
            (true, true) => NumberType::U64,
        }))
    }

    /// The names behind a type, each with its sizes, up to the semicolon.
    fn declarators(&mut self, spec: &Spec) -> Result<Vec<Member>, SchemaError> {
        let mut members = Vec::new();
        loop {
            let name = self.word()?;
            let mut sizes = Vec::new();
            while self.takes("[") {
                sizes.push(self.size()?);
                self.expect("]")?;
            }
            members.push(Member {
                name,
                spec: spec.clone(),
                sizes,
            });
            if self.takes(";") {
                return Ok(members);
            }
            self.expect(",")?;
        }
    }

    fn size(&mut self) -> Result<u32, SchemaError> {
        let literal = self.peek().parse::<u32>().ok();
        let found = match literal {
            Some(size) => {
                self.at += 1;
                Some(size)
            }
            None => {
                let name = self.scoped_name()?;
                let inner = self.scoped(&name);
                let constants = &self.names.constants;
                constants
                    .get(&inner)
                    .or_else(|| constants.get(&name))
                    .copied()
            }
        };
        found.filter(|size| *size > 0).ok_or_else(|| self.error())
    }
}

impl Names {
    /// The scoped name that is meant in a module.
    fn resolved(&self, scope: &str, name: &str) -> String {
        let is_known = |full: &String| {
            self.structs.contains_key(full)
                || self.aliases.contains_key(full)
                || self.enums.contains(full)
        };
        let mut scope = scope;
        while !scope.is_empty() {
            let full = format!("{scope}/{name}");
            if is_known(&full) {
                return full;
            }
            scope = scope.rsplit_once('/').map_or("", |(outer, _)| outer);
        }
        name.to_owned()
    }

    fn field(
        &self,
        member: &Member,
        struct_name: &str,
        type_name: &str,
    ) -> Result<Field, SchemaError> {
        let found = self.flat(&member.spec, &member.sizes, 0);
        let (field_type, repetition) = found.ok_or_else(|| SchemaError::WrongKind {
            path: format!("{}.{}", normal_type_name(struct_name), member.name),
            expected: "a number, a string, a structure, or one array or sequence of them"
                .to_owned(),
            found: format!("another type in the IDL of {type_name}"),
        })?;
        Ok(Field {
            name: member.name.clone(),
            field_type,
            repetition,
        })
    }

    /// The type without aliases; `None` for an array of arrays whose encoding is not that of one array.
    fn flat(&self, spec: &Spec, sizes: &[u32], depth: usize) -> Option<(FieldType, Repetition)> {
        if depth > MAX_DEPTH {
            return None;
        }
        let (field_type, inner) = match spec {
            Spec::Number(number) => (FieldType::Number(*number), Repetition::Once),
            Spec::Text => (FieldType::Text, Repetition::Once),
            Spec::WideText => (FieldType::WideText, Repetition::Once),
            Spec::Sequence(element) => match self.flat(element, &[], depth + 1)? {
                (element, Repetition::Once) => (element, Repetition::Sequence),
                _ => return None,
            },
            Spec::Named { scope, name } => {
                let full = self.resolved(scope, name);
                match self.aliases.get(&full) {
                    Some(alias) => self.flat(&alias.spec, &alias.sizes, depth + 1)?,
                    None if self.enums.contains(&full) => {
                        (FieldType::Number(NumberType::U32), Repetition::Once)
                    }
                    None => (
                        FieldType::Message(normal_type_name(&full)),
                        Repetition::Once,
                    ),
                }
            }
        };
        let count = sizes
            .iter()
            .try_fold(1_u32, |all, size| all.checked_mul(*size))?;
        let repetition = match (inner, sizes) {
            (inner, []) => inner,
            (Repetition::Once, _) => Repetition::Fixed(count),
            // the elements of an array of arrays follow each other
            (Repetition::Fixed(inner), _) => Repetition::Fixed(inner.checked_mul(count)?),
            (Repetition::Sequence, _) => return None,
        };
        Some((field_type, repetition))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "================================================================================\n\
        IDL: own/msg/Load\n// generated\n#include \"own/msg/Point.idl\"\n\
        module own {\n  module msg {\n    module Load_Constants {\n      @verbatim (language=\"comment\", text=\n\
        \x20       \"a (bracket\" \"and; more\")\n      const uint8 MOST = 3;\n    };\n\
        typedef double double__3[3];\n    /* over\n    lines */ @default (value=1)\n    struct Load {\n\
        @unit(value=\"N\") double force;\n boolean a, b;\n unsigned long long count;\n long long2;\n\
        string<10> name;\n sequence<own::msg::Point> points;\n sequence<float, 4> list;\n\
        double__3 size;\n octet grid[2][Load_Constants::MOST];\n Kind kind;\n };\n\
        enum Kind { @value(1) A, B };\n  };\n};\n===\nIDL: own/msg/Point\n\
        module own { module msg { struct Point { double x; double y; }; }; };\n";

    #[test]
    fn structures_aliases_and_sizes_are_followed() {
        let types = parse(TEXT, "own/msg/Load").unwrap();
        let load = &types["own/Load"];
        let names: Vec<&str> = load.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "force", "a", "b", "count", "long2", "name", "points", "list", "size", "grid",
                "kind"
            ]
        );
        let kinds: Vec<_> = load
            .iter()
            .map(|field| (field.field_type.clone(), field.repetition))
            .collect();
        let number = FieldType::Number;
        assert_eq!(kinds[3], (number(NumberType::U64), Repetition::Once));
        assert_eq!(kinds[4], (number(NumberType::I32), Repetition::Once));
        assert_eq!(
            kinds[6],
            (FieldType::Message("own/Point".into()), Repetition::Sequence)
        );
        assert_eq!(kinds[8], (number(NumberType::F64), Repetition::Fixed(3)));
        assert_eq!(kinds[9], (number(NumberType::U8), Repetition::Fixed(6)));
        assert_eq!(kinds[10], (number(NumberType::U32), Repetition::Once));
        assert_eq!(types["own/Point"].len(), 2);
    }

    #[test]
    fn what_cannot_be_followed_is_refused_with_its_line() {
        for (text, line) in [
            ("struct A {\n  wchar c;\n};", 2),
            ("struct A {\n double x\n};", 3),
            ("module m {\n", 1),
            ("struct A { double x[0]; };", 1),
            ("union U switch(long) {};", 1),
        ] {
            match parse(text, "a/A") {
                Err(SchemaError::Line { line: found, .. }) => assert_eq!(found, line, "{text}"),
                other => panic!("{text}: {other:?}"),
            }
        }
        assert!(parse("struct A { sequence<sequence<double>> x; };", "a/A").is_err());
        let endless = "module a { typedef B A; typedef A B; struct S { A a; }; };";
        assert!(parse(endless, "a/S").is_err());
        assert!(parse(&"module a {".repeat(100_000), "a/S").is_err());
    }
}
