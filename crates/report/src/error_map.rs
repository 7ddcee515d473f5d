//! The error of every marker and in every camera over time.

use super::plots::{Colour, SpanPlot, SpanRow};
use skiagraph_eval::Evaluation;

/// Limits between the six shades, from light to dark.
type ShadeLimits = [f64; 5];
/// Millimetres: half of the radius of a limb, its radius, its diameter, a lost marker, twice that.
const OF_MARKERS: ShadeLimits = [25.0, 50.0, 100.0, 150.0, 300.0];
/// Pixels.
const OF_CAMERAS: ShadeLimits = [2.0, 5.0, 10.0, 20.0, 40.0];

/// A name with its error in every part of the sequence.
type Course<'a> = (String, &'a [Option<f64>]);

pub(super) struct ErrorMap {
    pub(super) plot: SpanPlot,
    pub(super) how_to_read: String,
}

/// The error of every marker over time; `None` if there is none.
pub(super) fn of_markers(evaluation: &Evaluation) -> Option<ErrorMap> {
    let joints = evaluation.per_joint.iter();
    let courses: Vec<Course<'_>> =
        joints.map(|joint| (joint.joint.replace('_', " "), joint.over_time.as_slice())).collect();
    let how = "A row per marker. A dark stretch in one row is a limb that is lost for a while; a dark column, all of the body.";
    map(how, &courses, (OF_MARKERS, "mm"), evaluation.frames)
}

/// The 2-D error in every camera over time; `None` if there is none.
pub(super) fn of_cameras(evaluation: &Evaluation) -> Option<ErrorMap> {
    let cameras = evaluation.per_camera.iter();
    let courses: Vec<Course<'_>> = cameras.map(|camera| (camera.camera.clone(), camera.over_time.as_slice())).collect();
    let how = "A row per camera: distance between true and estimated markers in its images. A row that is darker than the \
               others is a camera that the estimate does not fit: look at its calibration and timing.";
    map(how, &courses, (OF_CAMERAS, "px"), evaluation.frames)
}

fn map(how: &str, courses: &[Course<'_>], (limits, unit): (ShadeLimits, &str), frames: usize) -> Option<ErrorMap> {
    let known = |parts: &[Option<f64>]| -> Vec<(usize, f64)> {
        parts.iter().enumerate().filter_map(|(at, error)| Some((at, (*error)?))).collect()
    };
    let edges = |at: usize, parts: &[Option<f64>]| [at, at + 1].map(|edge| (edge * frames / parts.len().max(1)) as f64);
    let all = courses
        .iter()
        .flat_map(|(name, parts)| known(parts).into_iter().map(move |(at, error)| (name, edges(at, parts), error)));
    let all: Vec<(&String, [f64; 2], f64)> = all.collect();
    if all.is_empty() {
        return None;
    }
    let row = |(name, span, error): &(&String, [f64; 2], f64)| SpanRow {
        name: (*name).clone(),
        colour: Colour::Ramp(limits.iter().filter(|limit| error >= limit).count() as u8),
        spans: vec![*span],
    };
    let rows = all.iter().map(row).collect();
    let [a, b, c, d, e] = limits;
    let how_to_read = format!("{how} Shades change at {a}, {b}, {c}, {d} and {e} {unit}; a gap has no estimate.");
    let plot = SpanPlot { x_label: "set frame, from 0".into(), x_range: [0.0, frames as f64], rows };
    Some(ErrorMap { plot, how_to_read })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_shaded_by_their_error_and_a_part_without_estimate_is_a_gap() {
        let parts = [Some(10.0), None, Some(60.0), Some(400.0)];
        let made = map("", &[("wrist".to_owned(), &parts)], (OF_MARKERS, "mm"), 8).unwrap();
        let found: Vec<_> = made.plot.rows.iter().map(|row| (row.colour, row.spans[0])).collect();
        assert_eq!(
            found,
            [(Colour::Ramp(0), [0.0, 2.0]), (Colour::Ramp(2), [4.0, 6.0]), (Colour::Ramp(5), [6.0, 8.0]),]
        );
        assert!(map("", &[("wrist".to_owned(), &[None, None])], (OF_MARKERS, "mm"), 8).is_none());
    }
}
