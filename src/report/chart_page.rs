//! A page with plots and one table.

use serde::Serialize;

use super::ReportError;
use super::html::render_page;

const TEMPLATE: &str = include_str!("chart_page.html");

/// The content of the page.
#[derive(Debug, Serialize)]
pub(super) struct ChartPage<'a> {
    /// What the page is about, above the title.
    pub(super) kicker: &'static str,
    pub(super) title: &'a str,
    /// Sentences above the plots.
    pub(super) summary: &'a [String],
    /// Inline SVG.
    pub(super) plots: Vec<String>,
    pub(super) heads: &'a [String],
    pub(super) rows: &'a [Vec<String>],
}

impl ChartPage<'_> {
    /// A self-contained page.
    pub(super) fn render(&self) -> Result<String, ReportError> {
        render_page(TEMPLATE, self)
    }
}
