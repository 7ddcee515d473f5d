//! Checks that an estimate is in metres, by the size of its body relative to the start pose.

use super::{UNITS_OF_LENGTH, distance};
use crate::benchmark_set::{BlindSet, Estimates};
use crate::body::Markers;
use crate::evaluation::quantile;

/// A body this many times as large as the start pose is in another unit.
const TOO_LARGE: f64 = 5.0;
/// A unit is suggested if it explains the size within this factor.
const FITS: f64 = 1.5;
/// Only units below this, in metres, are guessed, because a body in a larger unit may be right.
const LARGEST_GUESS: f64 = 0.1;

/// A size this near to the ratio of two units is a wrong unit and not a collapsed tracker.
const NEARLY: f64 = 1.15;

/// Refuses an estimate whose body is many times as large as the start pose, or smaller by the factor of a unit. Other
/// small bodies may come from a collapsed tracker, and are measured. If a unit was `declared`, in metres, a size that
/// is right in another unit is refused too.
///
/// # Errors
/// A message with the size and the suggested unit.
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
            "the estimated body has {typical:.4} times the size of the start pose: its numbers seem to be metres, declared \
             as another unit; use --units m"
        ));
    }
    if let Some(unit) = declared.and_then(|declared| other_unit(typical, declared)) {
        return Err(format!(
            "the estimated body has {typical:.3} times the size of the start pose: its numbers seem to be declared as \
             another unit; use --units {unit}, or convert them to metres and leave out --units"
        ));
    }
    if typical <= TOO_LARGE {
        return Ok(());
    }
    let unit = small_units.find(|(.., metres)| fits(1.0 / metres));
    let guess =
        unit.map_or_else(|| "in another unit".to_owned(), |(word, plural, _)| format!("in {plural} (--units {word})"));
    Err(format!(
        "the estimated body has {typical:.0} times the size of the start pose: it seems to be {guess}, expected metres"
    ))
}

/// The unit in which a body has about the size of the start pose, if it has `typical` times that size in the declared
/// unit.
fn other_unit(typical: f64, declared: f64) -> Option<&'static str> {
    let fits = |metres: f64| {
        let size = typical * metres / declared;
        size.max(1.0 / size) < NEARLY
    };
    UNITS_OF_LENGTH.iter().find(|(.., metres)| *metres != declared && fits(*metres)).map(|(unit, ..)| *unit)
}

/// Size of the estimate relative to the start pose, by the markers that both have; `None` for fewer than three.
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
