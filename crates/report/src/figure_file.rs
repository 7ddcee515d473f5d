//! A figure as a separate file, for papers and slides.

use super::plots::Svg;

/// A figure as an SVG file.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureFile {
    /// Its name without `.svg`.
    pub name: String,
    /// Its caption in plain text: what it shows and how to read it.
    pub caption: String,
    /// The SVG: colours for white paper, no style sheet, so that every SVG program shows it alike.
    pub svg: String,
}

impl FigureFile {
    /// A figure as a file: name without ending, caption, drawing.
    pub fn new(name: &str, caption: String, svg: &Svg) -> Self {
        Self { name: name.to_owned(), caption, svg: svg.for_paper() }
    }
}
