//! Pages: where the next block goes, and the line at the foot of each page.

use anyhow::{Context, Result};
use krilla::Document;
use krilla::color::rgb;
use krilla::destination::XyzDestination;
use krilla::geom::{PathBuilder, Point, Rect};
use krilla::num::NormalizedF32;
use krilla::outline::{Outline, OutlineNode};
use krilla::page::{Page, PageSettings};
use krilla::paint::{Fill, Stroke};
use krilla::surface::Surface;
use krilla::text::TextDirection;
use tipwatch_language::say;

use super::text::Letters;

/// A4 (points).
pub(super) const PAGE: [f32; 2] = [595.28, 841.89];
const MARGIN: f32 = 36.0;
/// Width of the text on a page.
const WIDTH: f32 = PAGE[0] - 2.0 * MARGIN;
/// Room between columns.
const GUTTER: f32 = 10.0;
/// Sizes at which a page is tried, as shares of the usual ones, until everything stands on it. At the last one, tables have
/// letters of 5 points.
const SCALES: [f32; 9] = [1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6];
/// Largest height of a block on one page.
pub(super) const HEIGHT: f32 = PAGE[1] - 2.0 * MARGIN;
const TEXT: f32 = 9.0;
const FOOT: f32 = 7.0;
/// Height of a line as a share of its letters.
pub(super) const LEADING: f32 = 1.3;

/// An element at its place on a page: from the left and from the top of the page (points).
pub(super) enum Mark {
    Text {
        at: [f32; 2],
        size: f32,
        bold: bool,
        text: String,
    },
    Path {
        path: krilla::geom::Path,
        fill: Option<([u8; 3], f32)>,
        stroke: Option<([u8; 3], f32, bool)>,
    },
}

/// The pages so far.
pub(super) struct Flow<'d> {
    document: &'d mut Document,
    pub(super) letters: Letters,
    title: String,
    pages: Vec<Vec<Mark>>,
    /// The first free line of the last page.
    pub(super) y: f32,
    headings: Vec<(String, usize, f32)>,
    /// Of the column that is being filled: its distance from the left margin, and its width.
    indent: f32,
    pub(super) width: f32,
    /// Sizes as a share of the usual ones.
    pub(super) scale: f32,
}

impl<'d> Flow<'d> {
    /// # Errors
    /// The font cannot be read.
    pub(super) fn new(document: &'d mut Document, title: &str) -> Result<Self> {
        Ok(Self {
            document,
            letters: Letters::new().context("font")?,
            title: title.into(),
            pages: vec![Vec::new()],
            y: MARGIN,
            headings: Vec::new(),
            indent: 0.0,
            width: WIDTH,
            scale: 1.0,
        })
    }

    pub(super) fn title(&mut self, title: &str, subtitle: &str) {
        self.paragraph(title, 16.0, true, 0.0);
        self.paragraph(subtitle, TEXT, false, 0.0);
    }

    /// A heading of a section; it never stands alone at the foot of a page.
    pub(super) fn heading(&mut self, text: &str) {
        self.y += 10.0 * self.scale;
        self.room(64.0 * self.scale);
        let text_of_outline = self.letters.known(text);
        let page = self.pages.len() - 1;
        self.headings.push((text_of_outline, page, self.y));
        self.paragraph(text, 12.5, true, 0.0);
    }

    /// A heading within a section.
    pub(super) fn small_heading(&mut self, text: &str) {
        self.y += 4.0 * self.scale;
        self.room(48.0 * self.scale);
        self.paragraph(text, 10.0, true, 0.0);
    }

    pub(super) fn plain(&mut self, text: &str) {
        self.paragraph(text, TEXT, false, 0.0);
    }

    /// An entry of a list at a depth from 0.
    pub(super) fn item(&mut self, depth: usize, text: &str) {
        let indent = 10.0 * (depth + 1) as f32;
        let letters = TEXT * self.scale;
        self.room(letters * LEADING);
        let at = [indent - 8.0, self.y + letters];
        self.text(at, letters, false, "–");
        let size = if depth == 0 { TEXT } else { TEXT - 1.0 };
        self.paragraph(text, size, false, indent);
    }

    /// Lays out so small that all of it stands on the rest of the page, if it can be read then.
    pub(super) fn one_page(&mut self, mut lay_out: impl FnMut(&mut Self)) {
        let (page, y, headings) = (self.pages.len() - 1, self.y, self.headings.len());
        let marks = self.pages[page].len();
        for scale in SCALES {
            self.pages.truncate(page + 1);
            self.pages[page].truncate(marks);
            self.headings.truncate(headings);
            (self.y, self.scale) = (y, scale);
            lay_out(self);
            if self.pages.len() == page + 1 {
                break;
            }
        }
        self.scale = 1.0;
    }

    /// Lays out columns side by side; what does not fit on the page follows on the next one.
    pub(super) fn columns(&mut self, count: usize, mut lay_out: impl FnMut(&mut Self, usize)) {
        let (left, whole, top, page) = (self.indent, self.width, self.y, self.pages.len());
        let width = (whole - GUTTER * (count.max(1) - 1) as f32) / count.max(1) as f32;
        let mut lowest = top;
        for column in 0..count {
            // a column that went on to another page begins the next one there
            if self.pages.len() == page {
                self.y = top;
            }
            self.indent = left + column as f32 * (width + GUTTER);
            self.width = width;
            lay_out(self, column);
            lowest = if self.pages.len() == page {
                lowest.max(self.y)
            } else {
                self.y
            };
        }
        (self.indent, self.width, self.y) = (left, whole, lowest);
    }

    fn paragraph(&mut self, text: &str, size: f32, bold: bool, indent: f32) {
        let size = size * self.scale;
        for line in self.letters.lines(text, size, self.width - indent) {
            self.room(size * LEADING);
            self.text([indent, self.y + size], size, bold, &line);
            self.y += size * LEADING;
        }
        self.y += 0.3 * size;
    }

    /// Begins a new page unless so much room is left.
    pub(super) fn room(&mut self, height: f32) {
        if self.y + height > PAGE[1] - MARGIN && self.y > MARGIN {
            self.pages.push(Vec::new());
            self.y = MARGIN;
        }
    }

    /// Begins a new page unless this one is empty.
    pub(super) fn break_page(&mut self) {
        self.room(PAGE[1]);
    }

    /// A text at a place from the left margin and from the top of the page.
    pub(super) fn text(&mut self, [x, y]: [f32; 2], size: f32, bold: bool, text: &str) {
        self.mark(Mark::Text {
            at: [self.left() + x, y],
            size,
            bold,
            text: self.letters.known(text),
        });
    }

    pub(super) fn mark(&mut self, mark: Mark) {
        if let Some(page) = self.pages.last_mut() {
            page.push(mark);
        }
    }

    /// A filled rectangle from the left margin.
    pub(super) fn rectangle(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2], grey: u8) {
        let rectangle = Rect::from_xywh(self.left() + x, y, width, height);
        let path = rectangle.and_then(|rectangle| {
            let mut builder = PathBuilder::new();
            builder.push_rect(rectangle);
            builder.finish()
        });
        if let Some(path) = path {
            let fill = Some(([grey; 3], 1.0));
            self.mark(Mark::Path {
                path,
                fill,
                stroke: None,
            });
        }
    }

    /// The elements of each page.
    #[cfg(test)]
    pub(super) fn pages(&self) -> &[Vec<Mark>] {
        &self.pages
    }

    /// The left end of the column (points).
    pub(super) fn left(&self) -> f32 {
        MARGIN + self.indent
    }

    /// Returns the end of a page (points from its top).
    pub(super) fn end() -> f32 {
        PAGE[1] - MARGIN
    }

    /// Writes the pages, with their numbers.
    pub(super) fn finish(self) {
        let count = self.pages.len();
        let foot = self.letters.lines(&self.title, FOOT, WIDTH - 90.0);
        let foot = foot.into_iter().next().unwrap_or_default();
        for (index, marks) in self.pages.iter().enumerate() {
            let Some(settings) = PageSettings::from_wh(PAGE[0], PAGE[1]) else {
                continue;
            };
            let mut page: Page<'_> = self.document.start_page_with(settings);
            let mut surface = page.surface();
            for mark in marks {
                draw(&mut surface, &self.letters, mark);
            }
            let number = say!("page {} of {count}", index + 1);
            let right = PAGE[0] - MARGIN - self.letters.width(&number, FOOT);
            for (x, text) in [(MARGIN, &foot), (right, &number)] {
                let mark = Mark::Text {
                    at: [x, PAGE[1] - 26.0],
                    size: FOOT,
                    bold: false,
                    text: text.clone(),
                };
                draw(&mut surface, &self.letters, &mark);
            }
            surface.finish();
            page.finish();
        }
        let mut outline = Outline::new();
        for (text, page, y) in self.headings {
            let place = XyzDestination::new(page, Point::from_xy(MARGIN, y));
            outline.push_child(OutlineNode::new(text, place));
        }
        self.document.set_outline(outline);
    }
}

fn paint([red, green, blue]: [u8; 3]) -> krilla::paint::Paint {
    rgb::Color::new(red, green, blue).into()
}

fn opaque(opacity: f32) -> NormalizedF32 {
    NormalizedF32::new(opacity.clamp(0.0, 1.0)).unwrap_or(NormalizedF32::ONE)
}

fn draw(surface: &mut Surface<'_>, letters: &Letters, mark: &Mark) {
    let black = [26, 26, 26];
    match mark {
        Mark::Text {
            at,
            size,
            bold,
            text,
        } => {
            surface.set_fill(Some(Fill {
                paint: paint(black),
                ..Fill::default()
            }));
            surface.set_stroke(bold.then(|| Stroke {
                paint: paint(black),
                width: 0.03 * size,
                ..Stroke::default()
            }));
            let place = Point::from_xy(at[0], at[1]);
            let direction = TextDirection::LeftToRight;
            surface.draw_text(place, letters.font.clone(), *size, text, false, direction);
        }
        Mark::Path { path, fill, stroke } => {
            surface.set_fill(fill.map(|(colour, opacity)| Fill {
                paint: paint(colour),
                opacity: opaque(opacity),
                ..Fill::default()
            }));
            surface.set_stroke(stroke.map(|(colour, width, dashed)| Stroke {
                paint: paint(colour),
                width,
                dash: dashed.then(|| krilla::paint::StrokeDash {
                    array: vec![3.0, 3.0],
                    offset: 0.0,
                }),
                ..Stroke::default()
            }));
            surface.draw_path(path);
        }
    }
}
