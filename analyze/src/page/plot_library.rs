//! plotly.js, which draws the figures of the pages.

use std::io;

use maud::{Render, html};

use super::packed::{packed_script, unpack};

/// plotly.js in gzip, in the version that the crate `plotly` writes figures for; the build script packs it.
const PACKED: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.min.js.gz"));

/// Where the plot library is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotLibrary<'a> {
    /// In the page itself.
    Inside,
    /// In a file at this relative address, shared by several pages: [`plot_library_script`].
    Beside(&'a str),
}

impl PlotLibrary<'_> {
    /// Length of its element, or more (bytes).
    pub(super) fn length(self) -> usize {
        match self {
            PlotLibrary::Inside => PACKED.len() / 3 * 4 + 100,
            PlotLibrary::Beside(address) => address.len() + 100,
        }
    }
}

/// The element that holds or loads it.
impl Render for PlotLibrary<'_> {
    fn render_to(&self, page: &mut String) {
        match self {
            PlotLibrary::Inside => packed_script(page, "plot-library", PACKED),
            PlotLibrary::Beside(address) => html! { script src=(address) {} }.render_to(page),
        }
    }
}

/// The plot library as the file that pages with [`PlotLibrary::Beside`] load.
///
/// # Errors
/// An error if the program itself is damaged.
pub fn plot_library_script() -> io::Result<String> {
    unpack(PACKED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_plotly() {
        let script = plot_library_script().unwrap();
        assert!(script.starts_with("/**\n* plotly.js"), "{}", &script[..60]);
        assert!(!script.contains("</script"));
    }
}
