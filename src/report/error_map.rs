//! The error of every marker and in every camera over time.

use super::figures::{Figure, ResponsiveSvg, seed_note};
use super::plots::{Colour, SpanPlot, SpanRow};
use super::{ReportError, ReportRun};

/// Limits between the six shades, from light to dark.
type Limits = [f64; 5];
/// Millimetres: half of the radius of a limb, its radius, its diameter, a lost marker, twice that.
const OF_MARKERS: Limits = [25.0, 50.0, 100.0, 150.0, 300.0];
/// Pixels.
const OF_CAMERAS: Limits = [2.0, 5.0, 10.0, 20.0, 40.0];

/// A name with its error in every part of the sequence.
type Course<'a> = (String, &'a [Option<f64>]);

/// The error of every marker over time.
pub(super) fn markers(run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let joints = run.run.evaluation.per_joint.iter();
    let courses: Vec<Course<'_>> =
        joints.map(|joint| (joint.joint.replace('_', " "), joint.over_time.as_slice())).collect();
    let how = "A row per marker. A dark stretch in one row is a limb that is lost for a while; a dark column, all of the body.";
    map("markers-over-time", "Error of each marker over time", how, &courses, (OF_MARKERS, "mm"), run)
}

/// The 2-D error in every camera over time.
pub(super) fn cameras(run: &ReportRun<'_>) -> Result<Option<Figure>, ReportError> {
    let cameras = run.run.evaluation.per_camera.iter();
    let courses: Vec<Course<'_>> =
        cameras.map(|camera| (camera.camera.clone(), camera.over_time.as_slice())).collect();
    let how = "A row per camera: distance between true and estimated markers in its images. A row that is darker than the \
               others is a camera that the estimate does not fit: look at its calibration and timing.";
    map("cameras-over-time", "2-D error in each camera over time", how, &courses, (OF_CAMERAS, "px"), run)
}

fn map(
    id: &'static str,
    title: &'static str,
    how: &str,
    courses: &[Course<'_>],
    (limits, unit): (Limits, &str),
    run: &ReportRun<'_>,
) -> Result<Option<Figure>, ReportError> {
    let worst = courses.iter().flat_map(|(name, parts)| parts.iter().enumerate().map(move |(at, e)| (name, at, *e)));
    let worst = worst.filter_map(|(name, at, error)| Some((name, at, error?))).max_by(|a, b| a.2.total_cmp(&b.2));
    let Some((name, at, error)) = worst else { return Ok(None) };
    let frames = run.run.evaluation.frames;
    let edges = |at: usize, parts: usize| [at, at + 1].map(|edge| (edge * frames / parts.max(1)) as f64);
    let rows = courses.iter().flat_map(|(name, parts)| {
        let known = parts.iter().enumerate().filter_map(|(at, error)| Some((at, (*error)?)));
        known.map(|(at, error)| SpanRow {
            name: name.clone(),
            colour: Colour::Ramp(limits.iter().filter(|limit| error >= **limit).count() as u8),
            spans: vec![edges(at, parts.len())],
        })
    });
    let first = edges(at, courses.first().map_or(1, |(_, parts)| parts.len()))[0];
    let finding = format!("greatest: {name}, {error:.0} {unit} from frame {first:.0}");
    let x_range = [0.0, frames as f64];
    let plot = SpanPlot { x_label: "set frame, from 0".into(), x_range, rows: rows.collect(), finding };
    let [a, b, c, d, e] = limits;
    let how_to_read = format!(
        "{how} Shades change at {a}, {b}, {c}, {d} and {e} {unit}; a gap has no estimate.{}",
        seed_note(run)
    );
    let plot = ResponsiveSvg::new(true, |width| plot.svg(width))?;
    Ok(Some(Figure { id, title, how_to_read, plot, about_search: false, over_frames: true }))
}
