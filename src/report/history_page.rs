//! The page of a baseline's history: its values over its versions.

use serde::Serialize;

use super::ReportError;
use super::displayed::{number, symbol};
use super::figures::ResponsiveSvg;
use super::html::render_page;
use super::plots::{Colour, Line, LinePlot, Stroke};
use crate::evaluation::{Direction, Metric};

const TEMPLATE: &str = include_str!("history.html");

/// One version of a baseline.
#[derive(Clone, Debug, Default)]
pub struct BaselineVersion {
    /// Its commit with its date, or its file.
    pub label: String,
    /// The subject of the commit.
    pub about: String,
    /// Version of the program that saved it; empty if it cannot be read.
    pub version: String,
    /// Number of clips.
    pub clips: usize,
    /// Number of runs.
    pub runs: usize,
    /// Identity of its sets: values on other sets are not comparable.
    pub sets: String,
    /// Its values, the same metrics in all versions; empty if it cannot be read.
    pub values: Vec<VersionValue>,
}

/// A metric of a version.
#[derive(Clone, Debug)]
pub struct VersionValue {
    /// The metric.
    pub metric: &'static Metric,
    /// Mean over clips.
    pub mean: Option<f64>,
    /// The 95 % interval of the mean.
    pub ends: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct HistoryPage<'a> {
    title: &'a str,
    first: &'a str,
    last: &'a str,
    heads: Vec<String>,
    rows: Vec<VersionRow<'a>>,
    figures: Vec<HistoryFigure>,
}

#[derive(Serialize)]
struct VersionRow<'a> {
    number: usize,
    label: &'a str,
    about: &'a str,
    version: &'a str,
    runs: String,
    values: Vec<String>,
    /// Whether its sets differ from those of the version before.
    other_sets: bool,
}

#[derive(Serialize)]
struct HistoryFigure {
    title: &'static str,
    better: &'static str,
    #[serde(flatten)]
    plot: ResponsiveSvg,
}

/// A page with a plot per metric and a table of all versions, the oldest first.
///
/// # Errors
/// [`ReportError`] without a readable version.
pub fn history_page(title: &str, versions: &[BaselineVersion]) -> Result<String, ReportError> {
    let readable = versions.iter().find(|version| !version.values.is_empty()).ok_or(ReportError::NoRun)?;
    let metrics: Vec<&Metric> = readable.values.iter().map(|value| value.metric).collect();
    let head = |metric: &&Metric| match symbol(metric.unit) {
        "" => metric.title.to_owned(),
        unit => format!("{}, {unit}", metric.title),
    };
    let page = HistoryPage {
        title,
        first: versions.first().map_or("", |version| &version.label),
        last: versions.last().map_or("", |version| &version.label),
        heads: metrics.iter().map(head).collect(),
        rows: versions.iter().enumerate().map(|(at, version)| row(versions, at, version)).collect(),
        figures: metrics
            .iter()
            .enumerate()
            .map(|(at, metric)| figure(versions, at, metric, &head(metric)))
            .collect::<Result<_, _>>()?,
    };
    render_page(TEMPLATE, &page)
}

fn other_sets(versions: &[BaselineVersion], at: usize) -> bool {
    let readable = |version: &&BaselineVersion| !version.values.is_empty();
    let before = versions[..at].iter().rfind(readable);
    before.zip(versions.get(at).filter(readable)).is_some_and(|(before, own)| before.sets != own.sets)
}

fn row<'a>(versions: &[BaselineVersion], at: usize, version: &'a BaselineVersion) -> VersionRow<'a> {
    let value = |value: &VersionValue| value.mean.map_or("-".to_owned(), |mean| number(mean, value.metric.unit));
    VersionRow {
        number: at + 1,
        label: &version.label,
        about: &version.about,
        version: &version.version,
        runs: format!("{} of {} clip{}", version.runs, version.clips, if version.clips == 1 { "" } else { "s" }),
        values: version.values.iter().map(value).collect(),
        other_sets: other_sets(versions, at),
    }
}

fn figure(
    versions: &[BaselineVersion],
    metric: usize,
    about: &Metric,
    label: &str,
) -> Result<HistoryFigure, ReportError> {
    let value = |version: &'_ BaselineVersion| version.values.get(metric).map(|value| (value.mean, value.ends));
    let places = || versions.iter().enumerate().map(|(at, version)| ((at + 1) as f64, value(version)));
    let points = places().map(|(x, value)| (x, value.and_then(|(mean, _)| mean))).collect();
    let band = places().map(|(x, value)| (x, value.and_then(|(_, ends)| ends))).collect();
    let marks = (0..versions.len()).filter(|at| other_sets(versions, *at));
    let plot = LinePlot {
        x_label: "version, from the oldest".into(),
        y_label: label.to_owned(),
        lines: vec![Line { band, ..Line::new("mean and 95 % interval", Stroke::solid(Colour::Blue), points) }],
        y_from: Some(0.0),
        marks: marks.map(|at| ((at + 1) as f64, "other sets".to_owned())).collect(),
        ..LinePlot::default()
    };
    let better = match about.direction {
        Direction::HigherIsBetter => "Higher is better.",
        _ => "Lower is better.",
    };
    Ok(HistoryFigure { title: about.title, better, plot: ResponsiveSvg::of_lines(&plot, false, [330, 300, 270])? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::find_metric;

    #[test]
    fn a_page_has_every_version_and_marks_other_sets_and_unreadable_ones() {
        let metric = find_metric("humaneva_mm").unwrap();
        let version = |label: &str, sets: &str, mean: f64| BaselineVersion {
            label: label.to_owned(),
            sets: sets.to_owned(),
            values: vec![VersionValue { metric, mean: Some(mean), ends: Some([mean - 1.0, mean + 1.0]) }],
            ..BaselineVersion::default()
        };
        let broken = BaselineVersion { label: "c".to_owned(), about: "not JSON".to_owned(), ..Default::default() };
        let versions = [version("a", "x", 50.0), version("<b>", "x", 40.0), broken.clone(), version("d", "y", 41.5)];
        let page = history_page("walk", &versions).unwrap();
        assert!(page.contains("&lt;b&gt;") && page.contains("41.5") && page.contains("not JSON"));
        assert_eq!(page.matches("class=\"other\"").count(), 1, "only the last has other sets");
        assert!(history_page("walk", &[broken]).is_err());
    }
}
