//! Fonts, the width of texts, and lines.

use anyhow::{Context, Result};
use krilla::text::Font;
use tipwatch_language::word;
use ttf_parser::Face;

/// The document's font: what is measured and what is embedded.
pub(super) struct Letters {
    pub(super) font: Font,
    face: Face<'static>,
}

impl Letters {
    /// Ubuntu Light, under the Ubuntu Font Licence, which allows embedding.
    ///
    /// # Errors
    /// The font cannot be read.
    pub(super) fn new() -> Result<Self> {
        let bytes = epaint_default_fonts::UBUNTU_LIGHT;
        Ok(Self {
            font: Font::new(bytes.into(), 0).context("the font of the document cannot be read")?,
            face: Face::parse(bytes, 0).context("the font of the document cannot be read")?,
        })
    }

    /// The text with every letter that the font lacks replaced.
    pub(super) fn known(&self, text: &str) -> String {
        let mut known = String::with_capacity(text.len());
        for letter in text.chars() {
            match letter {
                _ if self.face.glyph_index(letter).is_some() && !letter.is_control() => {
                    known.push(letter);
                }
                // ">" would read as a comparison: "-104 > 2767"
                '→' => known.push_str(word!("to")),
                '◀' => known.push('<'),
                '▶' => known.push('>'),
                _ => known.push('?'),
            }
        }
        known
    }

    pub(super) fn width(&self, text: &str, size: f32) -> f32 {
        let units = f32::from(self.face.units_per_em());
        let advance = |letter: char| {
            let glyph = self.face.glyph_index(letter).unwrap_or_default();
            f32::from(self.face.glyph_hor_advance(glyph).unwrap_or(0))
        };
        text.chars().map(advance).sum::<f32>() * size / units
    }

    /// Width of the longest word that is not broken.
    pub(super) fn longest_word(&self, text: &str, size: f32) -> f32 {
        let widths = text.split_whitespace().map(|word| self.width(word, size));
        widths.fold(0.0, f32::max)
    }

    /// The text in lines of at most this width; a word that is wider is broken.
    pub(super) fn lines(&self, text: &str, size: f32, width: f32) -> Vec<String> {
        let text = self.known(text);
        let (mut lines, mut line) = (Vec::new(), String::new());
        for word in text.split_whitespace() {
            let longer = match line.is_empty() {
                true => word.to_string(),
                false => format!("{line} {word}"),
            };
            if self.width(&longer, size) <= width {
                line = longer;
                continue;
            }
            if !line.is_empty() {
                lines.push(std::mem::take(&mut line));
            }
            for letter in word.chars() {
                line.push(letter);
                if self.width(&line, size) > width && line.chars().count() > 1 {
                    line.pop();
                    lines.push(std::mem::replace(&mut line, letter.to_string()));
                }
            }
        }
        lines.push(line);
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_no_wider_than_their_room_and_nothing_is_lost() {
        let letters = Letters::new().unwrap();
        let text = format!("{} load of a wheel ± 2 σ", "0123456789abcdef".repeat(4));
        let lines = letters.lines(&text, 8.0, 100.0);
        assert!(lines.len() > 2 && lines.iter().all(|line| letters.width(line, 8.0) <= 100.0));
        let joined: String = lines.concat().split_whitespace().collect();
        assert_eq!(joined, text.split_whitespace().collect::<String>());
    }

    #[test]
    fn letters_that_the_font_lacks_are_replaced() {
        assert_eq!(Letters::new().unwrap().known("σ ± 日"), "σ ± ?");
    }
}
