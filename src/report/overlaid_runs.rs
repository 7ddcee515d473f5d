//! The page of several runs on one set: all skeletons over the same image of each camera, errors over time, tables.

use nalgebra::Point3;
use serde::Serialize;
use tiny_skia::PathSegment;

use super::cell::{CELL_HEIGHT, CELL_WIDTH, OverlaidView, span, window};
use super::comparison::{COLOURS, error_plot, shown};
use super::displayed::{between, number, symbol};
use super::drawing::encoded;
use super::html::render_page;
use super::overlay::{PictureWindow, bones_path, marker_bones};
use super::plots::{Size, Svg, hex};
use super::{ComparedMethod, ReportError, base64};
use crate::body::{LANDMARKS, Markers};
use crate::camera::{Camera, CameraRig};
use crate::evaluation::{Metric, Unit};
use crate::observation::Image;
use crate::raster::{Mask, PixelBounds};

const TEMPLATE: &str = include_str!("overlaid_runs.html");

/// The greatest number of runs on a page: more skeletons on one picture cannot be told apart.
pub const MOST_OVERLAID: usize = 6;

/// The input of the page. All runs are of one set.
#[derive(Clone, Copy, Debug)]
pub struct OverlaidRuns<'a> {
    /// The set's name.
    pub title: &'a str,
    /// Frames per second.
    pub frames_per_second: f64,
    /// The runs, at most [`MOST_OVERLAID`].
    pub runs: &'a [ComparedMethod],
    /// Hints about runs that may have been misread.
    pub hints: &'a [String],
    /// The frames with pictures, in their order.
    pub moments: &'a [OverlaidMoment],
}

/// One frame of the set, with the estimates of all runs.
#[derive(Clone, Debug)]
pub struct OverlaidMoment {
    /// Frame number.
    pub frame: usize,
    /// The runs, by their number, that have one of their greatest errors in this frame.
    pub worst_of: Vec<usize>,
    /// The cameras in this frame.
    pub rig: CameraRig,
    /// The observed silhouette of every camera.
    pub observed: Vec<Mask>,
    /// The image of every camera, if the set has images; `None` for a camera that took none. Empty otherwise.
    pub images: Vec<Option<Image>>,
    /// The mask of the props in every camera; empty without props.
    pub props: Vec<Mask>,
    /// The actor's markers.
    pub truth: Markers,
    /// One estimate per run.
    pub estimates: Vec<OverlaidEstimate>,
}

/// A run's estimate in one frame.
#[derive(Clone, Copy, Debug)]
pub struct OverlaidEstimate {
    /// The seed: the one with the greatest error in this frame.
    pub seed: u64,
    /// Mean marker error, mm; `None` without an estimate.
    pub error_mm: Option<f64>,
    /// The estimated markers.
    pub markers: Markers,
}

#[derive(Serialize)]
struct OverlaidPage<'a> {
    title: String,
    set: &'a str,
    runs: Vec<RunOnPage<'a>>,
    hints: &'a [String],
    metrics: Vec<TableRow>,
    markers: Vec<TableRow>,
    plot: String,
    narrow: String,
    moments: Vec<MomentOnPage>,
    width: u32,
    height: u32,
}

#[derive(Serialize)]
struct RunOnPage<'a> {
    name: &'a str,
    tracker: &'a str,
    /// The colour of its skeleton.
    colour: String,
}

/// One value of every run.
#[derive(Serialize)]
struct TableRow {
    name: String,
    /// What the metric says; empty for a marker.
    meaning: &'static str,
    cells: Vec<TableCell>,
}

#[derive(Serialize)]
struct TableCell {
    value: String,
    interval: Option<String>,
    /// Whether no other run has a better value.
    best: bool,
}

#[derive(Serialize)]
struct MomentOnPage {
    frame: usize,
    time: String,
    /// The runs for which it was chosen, with their errors.
    worst: Vec<String>,
    /// Error and seed of every run.
    errors: Vec<String>,
    views: Vec<ViewOnPage>,
}

#[derive(Serialize)]
struct ViewOnPage {
    camera: String,
    alt: String,
    png: String,
    /// The true skeleton, as an SVG path.
    truth: String,
    /// The skeleton of every run.
    paths: Vec<String>,
}

/// The page: self-contained HTML with inline plots, pictures and a short script that hides runs.
///
/// # Errors
/// [`ReportError`] without a run, or if a plot or picture cannot be drawn.
pub fn overlaid_runs_page(input: &OverlaidRuns<'_>) -> Result<String, ReportError> {
    if input.runs.is_empty() {
        return Err(ReportError::NoRun);
    }
    let plot = error_plot(input.runs);
    let (Svg(plot), Svg(narrow)) =
        (plot.svg(Size { width: 1160, height: 420 })?, plot.svg(Size { width: 350, height: 360 })?);
    let names: Vec<&str> = input.runs.iter().map(|run| run.name.as_str()).collect();
    let page = OverlaidPage {
        title: names.join(", "),
        set: input.title,
        runs: input.runs.iter().zip(COLOURS).map(|(run, colour)| run_on_page(run, colour.on_dark())).collect(),
        hints: input.hints,
        metrics: shown().map(|metric| metric_row(input.runs, metric)).collect(),
        markers: LANDMARKS.iter().map(|landmark| marker_row(input.runs, landmark.name())).collect(),
        plot,
        narrow,
        moments: input.moments.iter().map(|moment| moment_on_page(input, moment)).collect::<Result<_, _>>()?,
        width: CELL_WIDTH,
        height: CELL_HEIGHT,
    };
    render_page(TEMPLATE, &page)
}

fn run_on_page(run: &ComparedMethod, colour: [u8; 3]) -> RunOnPage<'_> {
    RunOnPage { name: &run.name, tracker: &run.tracker, colour: hex(colour) }
}

/// A metric of every run with its interval.
fn metric_row(runs: &[ComparedMethod], metric: &Metric) -> TableRow {
    let values: Vec<_> = runs.iter().map(|run| run.summary.metrics.get(metric.name)).collect();
    let cell = |value: &Option<&crate::evaluation::MetricSummary>| {
        let Some(value) = value else { return missing() };
        TableCell {
            value: number(value.mean, metric.unit),
            interval: value.ci95.map(|ends| between(ends.low, ends.high, metric.unit)),
            best: values.iter().flatten().all(|other| !metric.is_worse(value.mean, other.mean)),
        }
    };
    let unit = symbol(metric.unit);
    let name = if unit.is_empty() { metric.title.to_owned() } else { format!("{}, {unit}", metric.title) };
    TableRow { name, meaning: metric.meaning, cells: values.iter().map(cell).collect() }
}

/// The mean error of a marker in every run.
fn marker_row(runs: &[ComparedMethod], marker: &str) -> TableRow {
    let find = |run: &ComparedMethod| run.summary.per_joint.iter().find(|joint| joint.joint == marker).cloned();
    let found: Vec<_> = runs.iter().map(find).collect();
    let least = found.iter().flatten().map(|joint| joint.mean_mm).fold(f64::INFINITY, f64::min);
    let cell = |joint: &Option<crate::evaluation::JointSummary>| {
        let Some(joint) = joint else { return missing() };
        TableCell {
            value: number(joint.mean_mm, Unit::Millimetre),
            interval: joint.ci95.map(|ends| between(ends.low, ends.high, Unit::Millimetre)),
            best: joint.mean_mm <= least,
        }
    };
    TableRow { name: marker.replace('_', " "), meaning: "", cells: found.iter().map(cell).collect() }
}

fn missing() -> TableCell {
    TableCell { value: "–".to_owned(), interval: None, best: false }
}

fn moment_on_page(input: &OverlaidRuns<'_>, moment: &OverlaidMoment) -> Result<MomentOnPage, ReportError> {
    let of_runs = || input.runs.iter().zip(&moment.estimates);
    let error = |estimate: &OverlaidEstimate| match estimate.error_mm {
        Some(error) => format!("{error:.0} mm (seed {})", estimate.seed),
        None => "no estimate".to_owned(),
    };
    let of_run = |run: &usize| {
        let error = moment.estimates.get(*run)?.error_mm?;
        Some(format!("{} ({error:.0} mm)", input.runs.get(*run)?.name))
    };
    Ok(MomentOnPage {
        frame: moment.frame,
        time: format!("{:.2} s", moment.frame as f64 / input.frames_per_second),
        worst: moment.worst_of.iter().filter_map(of_run).collect(),
        errors: of_runs().map(|(run, estimate)| format!("{} {}", run.name, error(estimate))).collect(),
        views: (0..moment.rig.cameras.len())
            .filter_map(|camera| view(moment, camera).transpose())
            .collect::<Result<_, _>>()?,
    })
}

/// One camera's picture; `None` without an observation.
fn view(moment: &OverlaidMoment, index: usize) -> Result<Option<ViewOnPage>, ReportError> {
    let camera = &moment.rig.cameras[index];
    let Some(observed) = moment.observed.get(index) else { return Ok(None) };
    let nobody = [None; LANDMARKS.len()];
    let overlaid = OverlaidView {
        camera,
        observed,
        image: moment.images.get(index).and_then(Option::as_ref),
        estimated: None,
        props: moment.props.get(index),
        truth: &nobody,
        estimate: &nobody,
    };
    let all = moment.estimates.iter().map(|estimate| &estimate.markers).chain([&moment.truth]);
    let bounds = all.fold(overlaid.bounds(), |bounds, markers| bounds.union(&bounds_of(camera, markers)));
    let (span, name) = (span(&bounds), camera.name.clone());
    let window = window(&bounds, span);
    Ok(Some(ViewOnPage {
        alt: format!("{name}, frame {}: the skeletons of all runs over the camera's image", moment.frame),
        camera: name,
        png: base64::encode(&encoded(&overlaid.draw(&bounds, span)?)?),
        truth: svg_path(camera, &window, &moment.truth),
        paths: moment.estimates.iter().map(|estimate| svg_path(camera, &window, &estimate.markers)).collect(),
    }))
}

/// The box around the markers that are inside the image.
fn bounds_of(camera: &Camera, markers: &Markers) -> PixelBounds {
    let inside = |marker: &Option<Point3<f64>>| {
        let pixel = camera.project(&(*marker)?)?;
        camera.pinhole.contains(&pixel).then_some((pixel.x as u32, pixel.y as u32))
    };
    let one = |(x, y)| PixelBounds { left: x, top: y, right: x + 1, bottom: y + 1 };
    let found: Vec<PixelBounds> = markers.iter().filter_map(inside).map(one).collect();
    let none = PixelBounds { left: 0, top: 0, right: 0, bottom: 0 };
    found.iter().copied().reduce(|all, one| all.union(&one)).unwrap_or(none)
}

/// A skeleton as the data of an SVG path, in pixels of the picture.
fn svg_path(camera: &Camera, window: &PictureWindow, markers: &Markers) -> String {
    let Some(path) = bones_path(&marker_bones(markers), window.projection(camera)) else { return String::new() };
    let place = |letter: char, at: tiny_skia::Point| format!("{letter}{:.1} {:.1}", at.x, at.y);
    let segment = |segment: PathSegment| match segment {
        PathSegment::MoveTo(at) => place('M', at),
        PathSegment::LineTo(at) => place('L', at),
        // bones have no curves
        _ => String::new(),
    };
    path.segments().map(segment).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::report::fixture::{Story, camera_in_front, with_input};
    use crate::test_figure::{standing, translated};

    fn run(name: &str, beside_m: f64) -> ComparedMethod {
        let story = Story { seeds: 3, beside_m, ..Story::default() };
        let summary = with_input(&story, |input| input.summary.clone());
        let errors = vec![vec![None, Some(1.0), Some(1000.0 * beside_m)]; 3];
        let (name, tracker, frozen) = (name.to_owned(), "a tracker".to_owned(), BTreeMap::new());
        ComparedMethod { name, tracker, knows_truth: false, summary, frozen, errors }
    }

    #[test]
    fn a_page_has_the_skeletons_of_all_runs_on_one_picture_of_each_camera() {
        let (camera, markers) = (camera_in_front(), standing());
        let beside = translated(&markers, nalgebra::Vector3::new(0.0, 0.3, 0.0));
        let estimate = |markers, error_mm| OverlaidEstimate { seed: 7, error_mm, markers };
        let moment = OverlaidMoment {
            frame: 2,
            worst_of: vec![1],
            rig: CameraRig { cameras: vec![camera.clone(), camera] },
            observed: vec![Mask::new(320, 240), Mask::new(320, 240)],
            images: vec![],
            props: vec![],
            truth: markers,
            estimates: vec![estimate(markers, Some(0.0)), estimate(beside, Some(300.0)), estimate([None; 15], None)],
        };
        let runs = [run("mine", 0.0), run("<theirs>", 0.3), run("none", 0.1)];
        let input = OverlaidRuns {
            title: "Walk",
            frames_per_second: 50.0,
            runs: &runs,
            hints: &[],
            moments: std::slice::from_ref(&moment),
        };
        let html = overlaid_runs_page(&input).unwrap();
        assert_eq!(html.matches("data:image/png;base64,").count(), 2);
        assert_eq!(html.matches("<path class=\"run run0\" d=\"M").count(), 2);
        assert_eq!(html.matches("<path class=\"run run1\" d=\"M").count(), 2);
        assert_eq!(html.matches("<path class=\"run run2\" d=\"\"").count(), 2, "nothing to draw");
        assert!(html.contains("&lt;theirs&gt; 300 mm (seed 7)") && !html.contains("<theirs>"));
        assert!(html.contains("0.04 s: among the worst of &lt;theirs&gt; (300 mm)<"));
        assert!(html.contains("none no estimate"));
        assert_eq!(html.matches("<td>left wrist</td>").count(), 1);
        let outside = html.replace("http://www.w3.org/2000/svg", "");
        assert!(["http:", "https:", "@import", "<link"].iter().all(|reference| !outside.contains(reference)));
    }

    #[test]
    fn a_path_goes_through_the_projections_of_the_markers() {
        let (camera, markers) = (camera_in_front(), standing());
        let window = PictureWindow { corner: nalgebra::Point2::new(10.0, 20.0), scale: 2.0 };
        let path = svg_path(&camera, &window, &markers);
        let wrist = camera.project(&markers[LANDMARKS.iter().position(|l| l.name() == "left_wrist").unwrap()].unwrap());
        let at = 2.0 * (wrist.unwrap() - window.corner);
        assert!(path.contains(&format!("L{:.1} {:.1}", at.x as f32, at.y as f32)), "{path}");
        assert_eq!(path.matches('M').count(), 14);
    }
}
