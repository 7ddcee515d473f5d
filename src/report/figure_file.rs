//! A figure as a file of its own, for papers and slides.

use super::plots::Svg;

/// A figure as an SVG file.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureFile {
    /// Its name without `.svg`.
    pub name: String,
    /// What it shows and how to read it, in plain text.
    pub caption: String,
    /// Its text: colours for white paper, no style sheet, so that any program that reads SVG shows it alike.
    pub svg: String,
}

impl FigureFile {
    pub(crate) fn new(name: &str, caption: String, svg: &Svg) -> Self {
        Self { name: name.to_owned(), caption, svg: svg.for_paper() }
    }
}
