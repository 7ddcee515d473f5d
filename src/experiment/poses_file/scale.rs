//! Whether an estimate is in metres: its body has about the size of the start pose.

use super::distance;
use crate::benchmark_set::{BlindSet, Estimates};
use crate::body::Markers;
use crate::evaluation::quantile;

/// A body so many times as large as the start pose is in other units.
const TOO_LARGE: f64 = 5.0;
/// A unit is named where the size fits it to this factor.
const FITS: f64 = 1.5;
const UNITS: [(&str, f64); 3] = [
    ("millimetres (--units mm; of .npz, multiply by 0.001)", 1000.0),
    ("centimetres (--units cm; of .npz, multiply by 0.01)", 100.0),
    ("inches (--units in; of .npz, multiply by 0.0254)", 39.37),
];

/// Refuses an estimate whose body is many times as large as the start pose, or smaller by just the factor of a unit.
/// Any other small one may be a tracker that collapses, and is measured.
///
/// # Errors
/// The sizes, and the units that they suggest.
pub(in crate::experiment) fn check_scale(set: &BlindSet, estimates: &Estimates) -> Result<(), String> {
    let body = &set.start.body;
    let start = body.markers(&body.link_frames(&set.start.pose));
    let frames = estimates.sequences.iter().flat_map(|sequence| &sequence.markers);
    let mut ratios: Vec<f64> = frames.filter_map(|frame| ratio(frame, &start)).collect();
    ratios.sort_by(f64::total_cmp);
    let Some(typical) = quantile(&ratios, 0.5) else { return Ok(()) };
    let fits = |factor: f64| (typical / factor).max(factor / typical) < FITS;
    if UNITS.iter().any(|(_, factor)| fits(1.0 / factor)) {
        return Err(format!(
            "the estimated body has {typical:.4} of the size of the start pose: its numbers seem to be metres, declared as \
             another unit; say --units m"
        ));
    }
    if typical <= TOO_LARGE {
        return Ok(());
    }
    let unit = UNITS.iter().find(|(_, factor)| fits(*factor));
    let guess = unit.map_or_else(|| "in other units".to_owned(), |(unit, _)| format!("in {unit}"));
    Err(format!(
        "the estimated body is {typical:.0} times as large as the start pose: it seems to be {guess}, expected metres"
    ))
}

/// Size of the estimate relative to that of the start, by the markers that both have; `None` for fewer than three.
fn ratio(estimate: &Markers, start: &Markers) -> Option<f64> {
    let pairs = estimate.iter().zip(start).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    let (estimate, start): (Vec<_>, Vec<_>) = pairs.unzip();
    if estimate.len() < 3 {
        return None;
    }
    let extent = |points: &[nalgebra::Point3<f64>]| points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max);
    let (estimate, start) = (extent(&estimate), extent(&start));
    (start > 0.0).then(|| estimate / start)
}
