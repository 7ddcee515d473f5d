//! Whether an estimate is in metres: its body has about the size of the start pose.

use super::{UNITS_OF_LENGTH, distance};
use crate::benchmark_set::{BlindSet, Estimates};
use crate::body::Markers;
use crate::evaluation::quantile;

/// A body so many times as large as the start pose is in other units.
const TOO_LARGE: f64 = 5.0;
/// A unit is named where the size fits it to this factor.
const FITS: f64 = 1.5;
/// Units that are guessed, in metres: a body in any larger one may be right.
const LARGEST_GUESS: f64 = 0.1;

/// A size so near to the ratio of two units is no tracker that collapses.
const NEARLY: f64 = 1.15;

/// Refuses an estimate whose body is many times as large as the start pose, or smaller by just the factor of a unit.
/// Any other small one may be a tracker that collapses, and is measured. Of numbers that were declared as a unit, of so
/// many metres, those are refused too whose size is just right in another unit.
///
/// # Errors
/// The sizes, and the units that they suggest.
pub(crate) fn check_scale(set: &BlindSet, estimates: &Estimates, declared: Option<f64>) -> Result<(), String> {
    let body = &set.start.body;
    let start = body.markers(&body.link_frames(&set.start.pose));
    let frames = estimates.sequences.iter().flat_map(|sequence| &sequence.markers);
    let mut ratios: Vec<f64> = frames.filter_map(|frame| ratio(frame, &start)).collect();
    ratios.sort_by(f64::total_cmp);
    let Some(typical) = quantile(&ratios, 0.5) else { return Ok(()) };
    let fits = |size: f64| (typical / size).max(size / typical) < FITS;
    let mut small_units = UNITS_OF_LENGTH.iter().filter(|(.., metres)| *metres < LARGEST_GUESS);
    if small_units.clone().any(|(.., metres)| fits(*metres)) {
        return Err(format!(
            "the estimated body has {typical:.4} of the size of the start pose: its numbers seem to be metres, declared as \
             another unit; say --units m"
        ));
    }
    if let Some(unit) = declared.and_then(|declared| other_unit(typical, declared)) {
        return Err(format!(
            "the estimated body is {typical:.3} times as large as the start pose: its numbers seem to be declared as \
             another unit; say --units {unit}, or leave --units out after turning them to metres"
        ));
    }
    if typical <= TOO_LARGE {
        return Ok(());
    }
    let unit = small_units.find(|(.., metres)| fits(1.0 / metres));
    let guess =
        unit.map_or_else(|| "in other units".to_owned(), |(word, plural, _)| format!("in {plural} (--units {word})"));
    Err(format!(
        "the estimated body is {typical:.0} times as large as the start pose: it seems to be {guess}, expected metres"
    ))
}

/// The unit in which a body is about as large as the start pose that is `typical` times as large in the declared one.
fn other_unit(typical: f64, declared: f64) -> Option<&'static str> {
    let fits = |metres: f64| {
        let size = typical * metres / declared;
        size.max(1.0 / size) < NEARLY
    };
    UNITS_OF_LENGTH.iter().find(|(.., metres)| *metres != declared && fits(*metres)).map(|(unit, ..)| *unit)
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
