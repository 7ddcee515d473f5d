//! The folder of `skiagraph bound`: `bound.json` and a page.

use serde::Serialize;
use serde_json::json;

use super::least_error::{BoundReport, FrameBound, SourceBound};
use crate::artefacts::{Artefact, ArtefactKind, Destination, MadeBy};
use crate::common::{ExperimentError, to_json};
use skiagraph_report::ReportError;
use skiagraph_report::html::render_page;
use skiagraph_report::plots::{Colour, Line, LinePlot, Size, SpanPlot, SpanRow, Stroke, Svg};

const BOUND_FILE: &str = "bound.json";
const BOUND_PAGE: &str = "bound.html";
const TEMPLATE: &str = include_str!("bound.html");

const WIDTH: u32 = 1000;
const HEIGHT: u32 = 260;
const MOST_ROWS: usize = 20;

pub fn write_bound(report: &BoundReport, to: Destination<'_>) -> Result<(), ExperimentError> {
    let noise: Vec<&str> = report.sources.iter().map(|source| source.noise.as_str()).collect();
    let run = report.run.as_ref().map(|run| &run.tracker);
    let settings = json!({"name": report.name, "cameras": report.cameras, "noise": noise, "--run": run});
    let made_by = MadeBy::new("skiagraph bound", settings);
    let folder = Artefact::begin_folder(to, ArtefactKind::Folder, made_by)?;
    folder.write(BOUND_FILE, &to_json(report)?)?;
    folder.write(BOUND_PAGE, page(report)?.as_bytes())?;
    folder.finish()?;
    Ok(())
}

#[derive(Serialize)]
struct BoundPage<'a> {
    title: &'a str,
    report: &'a BoundReport,
    plots: Vec<String>,
}

fn page(report: &BoundReport) -> Result<String, ReportError> {
    let mut plots = Vec::new();
    for source in &report.sources {
        let Svg(plot) = over_time(report, source)?;
        plots.push(plot);
        if !source.unseen.is_empty() {
            let Svg(plot) = unseen(report, source)?;
            plots.push(plot);
        }
    }
    render_page(TEMPLATE, &BoundPage { title: &report.name, report, plots })
}

fn over_time(report: &BoundReport, source: &SourceBound) -> Result<Svg, ReportError> {
    let lines = vec![
        course(report, source, "worst marker, frame alone", Colour::Orange, |frame| frame.worst_alone_mm),
        course(report, source, "mean, frame alone", Colour::Blue, |frame| frame.mean.alone_mm),
        course(report, source, "mean, filter", Colour::Purple, |frame| frame.mean.filtered_mm),
    ];
    let plot = LinePlot {
        title: Some(format!("least error from {}", source.source)),
        x_label: "time, s".to_owned(),
        y_label: "mm".to_owned(),
        lines,
        logarithmic: true,
        ..LinePlot::default()
    };
    plot.svg(Size { width: WIDTH, height: HEIGHT })
}

fn course(
    report: &BoundReport,
    source: &SourceBound,
    name: &str,
    colour: Colour,
    value: fn(&FrameBound) -> f64,
) -> Line {
    let frames = source.per_frame.iter();
    let points = frames.map(|frame| (frame.frame as f64 / report.frames_per_second, Some(value(frame))));
    Line::new(name, Stroke::solid(colour), points.collect())
}

fn unseen(report: &BoundReport, source: &SourceBound) -> Result<Svg, ReportError> {
    let mut rows = Vec::new();
    for direction in source.unseen.iter().take(MOST_ROWS) {
        // a frame lasts until the next one
        let stretches = direction.frames.iter().map(|[first, last]| [*first, last + 1]);
        let spans = stretches.map(|ends| ends.map(|frame| frame as f64 / report.frames_per_second)).collect();
        rows.push(SpanRow { name: direction.name.clone(), colour: Colour::Orange, spans });
    }
    let plot = SpanPlot {
        x_label: format!("time, s; bars: not seen by {}", source.source),
        x_range: [0.0, report.frames.max(1) as f64 / report.frames_per_second],
        rows,
    };
    plot.svg(WIDTH)
}
