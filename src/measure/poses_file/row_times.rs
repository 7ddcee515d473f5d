//! Which frame of the set each row of a file with times is: programs leave out frames at the ends or in between, or
//! write another rate.

use crate::mocap::{MOST_POINTS, PointFile};

/// A row belongs to a frame if its time is within this share of a frame: the rounding of times to milliseconds.
const NEAR: f64 = 0.1;
/// Steps between rows are uniform if the longest is at most this many times the shortest.
const UNIFORM: f64 = 1.5;
/// Times agree with a rate if they are less than this from it at the last row, frames,
const DRIFT: f64 = 0.5;
/// or if the rates differ by less than this share: times with few digits, 59.94 for 60. No usual rates are so near.
const SAME_RATE: f64 = 0.02;
/// Rates that differ by more than this share are noted.
const NOTED: f64 = 1e-4;

/// The rows at the frames of a set with `rate` frames a second, by their times; with `from_first`, the first row is
/// frame 0 whatever its time. A file with one row for every frame and uniform steps of this rate is unchanged, whatever
/// rate it declares. So is one whose declared rate and times are of the same other rate, because one of set and file is
/// wrong.
///
/// # Errors
/// A message if no row is at a frame of the set.
pub(super) fn at_frames(points: PointFile, rate: f64, frames: usize, from_first: bool) -> Result<PointFile, String> {
    let [Some(first), Some(last)] = [points.times_s.first(), points.times_s.last()] else { return Ok(points) };
    let (own, declared) = (own_rate(&points.times_s), points.frames_per_second);
    let differing = own.zip(declared).filter(|(own, declared)| !are_near(*own, *declared, SAME_RATE));
    if points.frames.len() == frames && own.is_some_and(|own| fits(own, rate, frames)) {
        return Ok(in_order(points, own, rate));
    }
    let agree = own.is_some() && declared.is_some() && differing.is_none();
    if points.frames.len() == frames && (frames == 1 || agree) {
        return Ok(points);
    }
    // with a shift, the file may be longer than the set
    let (origin, end) = if from_first { (*first, points.frames.len().max(frames)) } else { (0.0, frames) };
    if end.saturating_mul(points.names.len()) > MOST_POINTS {
        return Err(format!("expected at most {MOST_POINTS} points, found {} in {end} frames", points.names.len()));
    }
    let placed = |rate: f64| rows_of_frames(&points.times_s, origin, rate, end);
    // 59.94 declared for 60
    let nearly = declared.filter(|declared| *declared != rate && are_near(*declared, rate, SAME_RATE));
    let (rows, by_declared) = (placed(rate), nearly.map(placed));
    let rows = match by_declared {
        Some(better) if better.iter().flatten().count() > rows.iter().flatten().count() => better,
        _ => rows,
    };
    let (count, used) = (points.frames.len(), rows.iter().flatten().count());
    if used == 0 {
        return Err(format!(
            "its {count} rows are at {first} to {last} s, and none is at one of the set's {frames} frames, 0 to {} s at \
             {rate} frames a second; use --shift with the set's frame of the first row, or correct the times",
            frames.saturating_sub(1) as f64 / rate
        ));
    }
    let mut notes = points.notes;
    notes.extend(differing.map(|(own, declared)| {
        format!(
            "its header declares {declared} frames a second, but its rows' times are those of {own:.2}: the rows are \
             placed by their times"
        )
    }));
    if let (Some(one), false) = (rows.iter().position(Option::is_none), from_first) {
        let lost = frames - used;
        notes.push(format!("no row is at {lost} of the set's {frames} frames (the first: {one}), which are lost"));
    }
    if used < count {
        notes.push(format!("{} of {count} rows are at no frame of the set, and were not used", count - used));
    }
    let nothing = vec![None; points.names.len()];
    let row = |row: &Option<usize>| row.and_then(|row| points.frames.get(row)).unwrap_or(&nothing).clone();
    let frames = rows.iter().map(row).collect();
    Ok(PointFile { frames, frames_per_second: Some(rate), times_s: Vec::new(), notes, ..points })
}

/// The rate of rows with uniform steps.
fn own_rate(times: &[f64]) -> Option<f64> {
    let (first, last) = (times.first()?, times.last()?);
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let is_uniform = steps().fold(0.0, f64::max) <= UNIFORM * steps().fold(f64::INFINITY, f64::min);
    (is_uniform && last > first).then(|| (times.len() - 1) as f64 / (last - first))
}

fn are_near(one: f64, other: f64, share: f64) -> bool {
    (one / other - 1.0).abs() < share
}

/// Whether rows of a rate are the frames of a set with another one, in order.
fn fits(own: f64, rate: f64, frames: usize) -> bool {
    let steps = frames.saturating_sub(1) as f64;
    (steps * rate / own - steps).abs() < DRIFT || are_near(own, rate, SAME_RATE)
}

/// A file whose rows are the frames in order, with the set's rate, and a note if it has another one.
fn in_order(mut points: PointFile, own: Option<f64>, rate: f64) -> PointFile {
    let differing = points.frames_per_second.filter(|declared| !are_near(*declared, rate, NOTED));
    if let (Some(own), Some(declared)) = (own, differing) {
        points.notes.push(format!(
            "its header declares {declared} frames a second and its rows' times are those of {own:.2}; it has one row for \
             every frame of the set, and was read at {rate} frames a second"
        ));
        points.frames_per_second = Some(rate);
    }
    points
}

/// For each of `end` frames, the first row whose time is at it.
fn rows_of_frames(times: &[f64], origin: f64, rate: f64, end: usize) -> Vec<Option<usize>> {
    let mut rows = vec![None; end];
    for (row, time) in times.iter().enumerate() {
        if let Some(at) = frame_at((time - origin) * rate).and_then(|frame| rows.get_mut(frame)) {
            at.get_or_insert(row);
        }
    }
    rows
}

/// The frame nearest to a time, in frames, if it is near.
fn frame_at(time: f64) -> Option<usize> {
    let nearest = time.round();
    ((time - nearest).abs() <= NEAR && nearest >= 0.0).then_some(nearest as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file whose rows have these times, and the row's number as a position.
    fn file(times: &[f64]) -> PointFile {
        let frames = (0..times.len()).map(|row| vec![Some([row as f64, 0.0, 0.0])]).collect();
        PointFile { names: vec!["pelvis".to_owned()], times_s: times.to_vec(), frames, ..PointFile::default() }
    }

    fn rows(found: &PointFile) -> Vec<Option<usize>> {
        found.frames.iter().map(|frame| frame[0].map(|place| place[0] as usize)).collect()
    }

    #[test]
    fn rows_are_placed_by_time_and_missing_frames_are_lost() {
        let last_missing = at_frames(file(&[0.0, 0.1, 0.2]), 10.0, 4, false).unwrap();
        assert_eq!(rows(&last_missing), [Some(0), Some(1), Some(2), None]);
        assert_eq!(last_missing.notes, ["no row is at 1 of the set's 4 frames (the first: 3), which are lost"]);
        let gap = at_frames(file(&[0.0, 0.3]), 10.0, 4, false).unwrap();
        assert_eq!(rows(&gap), [Some(0), None, None, Some(1)]);
        let slower = at_frames(file(&[0.0, 0.2, 0.4]), 10.0, 5, false).unwrap();
        assert_eq!(rows(&slower), [Some(0), None, Some(1), None, Some(2)]);
        let faster = at_frames(file(&[0.0, 0.05, 0.1, 0.15]), 10.0, 2, false).unwrap();
        assert_eq!(rows(&faster), [Some(0), Some(2)]);
        assert_eq!(faster.notes, ["2 of 4 rows are at no frame of the set, and were not used"]);
        assert_eq!(rows(&at_frames(file(&[5.0, 5.1]), 10.0, 9, true).unwrap())[..3], [Some(0), Some(1), None]);
    }

    #[test]
    fn one_uniform_row_for_every_frame_is_unchanged_and_other_times_are_refused() {
        let whole = file(&[0.1, 0.2, 0.3]);
        assert_eq!(at_frames(whole.clone(), 10.0, 3, false).unwrap(), whole);
        assert_eq!(rows(&at_frames(file(&[0.0, 0.1, 0.3]), 10.0, 3, false).unwrap()), [Some(0), Some(1), None]);
        let slower = at_frames(file(&[0.0, 0.2, 0.4]), 10.0, 3, false).unwrap();
        assert_eq!(rows(&slower), [Some(0), None, Some(1)]);
        let message = at_frames(file(&[12.5, 12.6]), 10.0, 3, false).unwrap_err();
        assert!(message.contains("rows are at 12.5 to 12.6 s") && message.contains("--shift"), "{message}");
    }

    /// A file with these times and a declared rate.
    fn declaring(rate: f64, times: &[f64]) -> PointFile {
        PointFile { frames_per_second: Some(rate), ..file(times) }
    }

    fn steps(count: u32, rate: f64) -> Vec<f64> {
        (0..count).map(|row| f64::from(row) / rate).collect()
    }

    #[test]
    fn times_of_the_rows_win_over_the_rate_in_the_header() {
        // the header is wrong
        let found = at_frames(declaring(30.0, &steps(5, 60.0)), 60.0, 5, false).unwrap();
        assert_eq!(
            (rows(&found), found.frames_per_second),
            ((0..5).map(Some).collect::<Vec<Option<usize>>>(), Some(60.0))
        );
        assert!(found.notes[0].contains("declares 30 frames a second"), "{:?}", found.notes);
        // the header is that of the set
        for (own, expected) in
            [(120.0, [Some(0), Some(2), Some(4), None, None]), (30.0, [Some(0), None, Some(1), None, Some(2)])]
        {
            let found = at_frames(declaring(60.0, &steps(5, own)), 60.0, 5, false).unwrap();
            assert_eq!(rows(&found), expected);
            assert!(found.notes[0].contains(&format!("are those of {own:.2}")), "{:?}", found.notes);
        }
        // header and times agree on another rate, which is refused later
        let other = declaring(30.0, &steps(5, 30.0));
        assert_eq!(at_frames(other.clone(), 60.0, 5, false).unwrap(), other);
    }

    #[test]
    fn a_rate_of_59_94_is_read_as_60_with_a_note() {
        let own = 60.0 / 1.001;
        for (count, frames) in [(900, 900), (899, 900)] {
            let found = at_frames(declaring(59.94, &steps(count, own)), 60.0, frames, false).unwrap();
            let expected: Vec<Option<usize>> = (0..frames).map(|row| (row < count as usize).then_some(row)).collect();
            assert_eq!((rows(&found), found.frames_per_second), (expected, Some(60.0)));
            assert_eq!(found.notes.len(), 1, "{:?}", found.notes);
        }
    }
}
