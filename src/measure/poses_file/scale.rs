//! Checks that an estimate is in metres, by the size of its body relative to the start pose.

use nalgebra::Point3;

use super::super::missing_values::{MANY, has_equal_coordinates};
use super::{UNITS_OF_LENGTH, distance};
use skiagraph_core::body::Markers;
use skiagraph_eval::quantile;
use skiagraph_set::{BlindSet, Estimates};

/// A body this many times as large as the start pose is in another unit.
const TOO_LARGE: f64 = 5.0;
/// A unit is suggested if it explains the size within this factor.
const FITS: f64 = 1.5;
/// Only units below this, in metres, are guessed, because a body in a larger unit may be right.
const LARGEST_GUESS: f64 = 0.1;

/// A size this near to the ratio of two units is a wrong unit and not a collapsed tracker.
const NEARLY: f64 = 1.15;

/// Refuses an estimate whose body is many times as large as the start pose, or smaller by the factor of the `unit` in
/// which it was read, metres. Other small bodies may come from a collapsed tracker, and are measured. If a unit was
/// `declared`, in metres, a size that is right in another unit is refused too.
pub(crate) fn check_scale(
    set: &BlindSet,
    estimates: &Estimates,
    unit: Option<f64>,
    declared: Option<f64>,
) -> Result<(), String> {
    let body = &set.start.body;
    let start = body.markers(&body.link_frames(&set.start.pose));
    let frames = estimates.sequences.iter().flat_map(|sequence| &sequence.markers);
    let Some(typical) = median(frames.filter_map(|frame| ratio(frame, &start)).collect()) else { return Ok(()) };
    let fits = |size: f64| (typical / size).max(size / typical) < FITS;
    let mut small_units = UNITS_OF_LENGTH.iter().filter(|(.., metres)| *metres < LARGEST_GUESS);
    if unit.is_some_and(|metres| metres < LARGEST_GUESS && fits(metres)) {
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
    // the unit whose length is right, given the one in which the numbers were read
    let read_in = unit.unwrap_or(1.0);
    let unit = small_units.find(|(.., metres)| fits(read_in / metres));
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
/// Placeholders for missing values, such as -999, -999, -999, are left out.
fn ratio(estimate: &Markers, start: &Markers) -> Option<f64> {
    let pairs = estimate.iter().zip(start).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    let pairs: Vec<(Point3<f64>, Point3<f64>)> = pairs.filter(|(a, _)| !has_equal_coordinates(a)).collect();
    let middle_of = |axis: usize| median(pairs.iter().map(|(a, _)| a[axis]).collect());
    let middle = Point3::new(middle_of(0)?, middle_of(1)?, middle_of(2)?);
    let usual = median(pairs.iter().map(|(a, _)| distance(*a, middle)).collect())?;
    let near = pairs.iter().filter(|(a, _)| distance(*a, middle) <= MANY * usual);
    let (estimate, start): (Vec<_>, Vec<_>) = near.copied().unzip();
    if estimate.len() < 3 {
        return None;
    }
    let extent = |points: &[Point3<f64>]| points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max);
    let (estimate, start) = (extent(&estimate), extent(&start));
    (start > 0.0).then(|| estimate / start)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}
