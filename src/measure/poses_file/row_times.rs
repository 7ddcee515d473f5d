//! Which frame of the set each row of a file with times is: programs leave out frames at the ends or in between, or
//! write another rate.

use skiagraph_truth::mocap::{MOST_POINTS, PointFile};

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

pub(super) struct PlacedRows {
    pub(super) points: PointFile,
    /// Whether rows are where their times and the shift say; else row r is frame r, and the shift is still to be made.
    pub(super) is_by_time: bool,
    /// Whether the first row is at frame 1 without a shift: times may be those of frame numbers that count from 1.
    pub(super) begins_at_one: bool,
}

/// The rows at the frames of a set with `rate` frames a second, by their times, moved by `shift` frames. A file with
/// one row for every frame and uniform steps of this rate is unchanged, whatever rate it declares. So is one whose
/// declared rate and times are of the same other rate, because one of set and file is wrong.
///
/// # Errors
/// A message if no row, or only one of several, is at a frame of the set.
pub(super) fn at_frames(points: PointFile, rate: f64, frames: usize, shift: Option<i64>) -> Result<PlacedRows, String> {
    let in_order = |points: PointFile| PlacedRows { points, is_by_time: false, begins_at_one: false };
    let [Some(first), Some(last)] = [points.times_s.first(), points.times_s.last()] else {
        return Ok(in_order(points));
    };
    let (own, declared) = (own_rate(&points.times_s), points.frames_per_second);
    let differing = own.zip(declared).filter(|(own, declared)| !are_near(*own, *declared, SAME_RATE));
    if points.frames.len() == frames && own.is_some_and(|own| fits(own, rate, frames)) {
        return Ok(in_order(with_rate(points, own, rate)));
    }
    let agree = own.is_some() && declared.is_some() && differing.is_none();
    if points.frames.len() == frames && (frames == 1 || agree) {
        return Ok(in_order(points));
    }
    if frames.saturating_mul(points.names.len()) > MOST_POINTS {
        return Err(format!("expected at most {MOST_POINTS} points, found {} in {frames} frames", points.names.len()));
    }
    let moved = shift.unwrap_or(0) as f64;
    let placed = |rate: f64| rows_of_frames(&points.times_s, moved, rate, frames);
    // 59.94 declared for 60
    let nearly = declared.filter(|declared| *declared != rate && are_near(*declared, rate, SAME_RATE));
    let (rows, by_declared) = (placed(rate), nearly.map(placed));
    let rows = match by_declared {
        Some(better) if better.iter().flatten().count() > rows.iter().flatten().count() => better,
        _ => rows,
    };
    let (count, used) = (points.frames.len(), rows.iter().flatten().count());
    if used == 0 || used == 1 && count.min(frames) > 1 {
        let (what, to_first) = (if used == 0 { "none" } else { "only one" }, -(first * rate).round());
        return Err(format!(
            "its {count} rows are at {first} to {last} s, and {what} is at one of the set's {frames} frames, 0 to {} s at \
             {rate} frames a second; use --shift {to_first} if its first row is the set's frame 0, or correct the times",
            frames.saturating_sub(1) as f64 / rate
        ));
    }
    let begins_at_one = shift.is_none() && rows.iter().position(Option::is_some) == Some(1);
    let mut notes = points.notes;
    notes.extend(differing.map(|(own, declared)| {
        format!(
            "its header declares {declared} frames a second, but its rows' times are those of {own:.2}: the rows are \
             placed by their times"
        )
    }));
    if let Some(one) = rows.iter().position(Option::is_none) {
        let lost = frames - used;
        notes.push(format!("no row is at {lost} of the set's {frames} frames (the first: {one}), which are lost"));
    }
    if used < count {
        notes.push(format!("{} of {count} rows are at no frame of the set, and were not used", count - used));
    }
    let nothing = vec![None; points.names.len()];
    let row = |row: &Option<usize>| row.and_then(|row| points.frames.get(row)).unwrap_or(&nothing).clone();
    let frames = rows.iter().map(row).collect();
    let points = PointFile { frames, frames_per_second: Some(rate), times_s: Vec::new(), notes, ..points };
    Ok(PlacedRows { points, is_by_time: true, begins_at_one })
}

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
fn with_rate(mut points: PointFile, own: Option<f64>, rate: f64) -> PointFile {
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

/// For each of `end` frames, the first row whose time, moved by `shift` frames, is at it.
fn rows_of_frames(times: &[f64], shift: f64, rate: f64, end: usize) -> Vec<Option<usize>> {
    let mut rows = vec![None; end];
    for (row, time) in times.iter().enumerate() {
        if let Some(at) = frame_at(time * rate + shift).and_then(|frame| rows.get_mut(frame)) {
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

    fn placed(points: PointFile, rate: f64, frames: usize, shift: Option<i64>) -> Result<PointFile, String> {
        at_frames(points, rate, frames, shift).map(|placed| placed.points)
    }

    fn rows(found: &PointFile) -> Vec<Option<usize>> {
        found.frames.iter().map(|frame| frame[0].map(|place| place[0] as usize)).collect()
    }

    #[test]
    fn rows_are_placed_by_time_and_missing_frames_are_lost() {
        let last_missing = placed(file(&[0.0, 0.1, 0.2]), 10.0, 4, None).unwrap();
        assert_eq!(rows(&last_missing), [Some(0), Some(1), Some(2), None]);
        assert_eq!(last_missing.notes, ["no row is at 1 of the set's 4 frames (the first: 3), which are lost"]);
        let gap = placed(file(&[0.0, 0.3]), 10.0, 4, None).unwrap();
        assert_eq!(rows(&gap), [Some(0), None, None, Some(1)]);
        let slower = placed(file(&[0.0, 0.2, 0.4]), 10.0, 5, None).unwrap();
        assert_eq!(rows(&slower), [Some(0), None, Some(1), None, Some(2)]);
        let faster = placed(file(&[0.0, 0.05, 0.1, 0.15]), 10.0, 2, None).unwrap();
        assert_eq!(rows(&faster), [Some(0), Some(2)]);
        assert_eq!(faster.notes, ["2 of 4 rows are at no frame of the set, and were not used"]);
        assert_eq!(rows(&placed(file(&[5.0, 5.1]), 10.0, 9, Some(-50)).unwrap())[..3], [Some(0), Some(1), None]);
    }

    #[test]
    fn one_uniform_row_for_every_frame_is_unchanged_and_other_times_are_refused() {
        let whole = file(&[0.1, 0.2, 0.3]);
        assert_eq!(placed(whole.clone(), 10.0, 3, None).unwrap(), whole);
        assert_eq!(rows(&placed(file(&[0.0, 0.1, 0.3]), 10.0, 3, None).unwrap()), [Some(0), Some(1), None]);
        let slower = placed(file(&[0.0, 0.2, 0.4]), 10.0, 3, None).unwrap();
        assert_eq!(rows(&slower), [Some(0), None, Some(1)]);
        let message = placed(file(&[12.5, 12.6]), 10.0, 3, None).unwrap_err();
        assert!(message.contains("rows are at 12.5 to 12.6 s") && message.contains("--shift -125 "), "{message}");
        let touching = placed(file(&[0.2, 0.3, 0.4]), 10.0, 3, None).map(|found| rows(&found));
        assert_eq!(touching.unwrap(), [Some(0), Some(1), Some(2)], "one row for every frame");
        let message = placed(file(&[0.3, 0.4, 0.5]), 10.0, 4, None).unwrap_err();
        assert!(message.contains("only one is at") && message.contains("--shift -3 "), "{message}");
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
        let found = placed(declaring(30.0, &steps(5, 60.0)), 60.0, 5, None).unwrap();
        assert_eq!(
            (rows(&found), found.frames_per_second),
            ((0..5).map(Some).collect::<Vec<Option<usize>>>(), Some(60.0))
        );
        assert!(found.notes[0].contains("declares 30 frames a second"), "{:?}", found.notes);
        // the header is that of the set
        for (own, expected) in
            [(120.0, [Some(0), Some(2), Some(4), None, None]), (30.0, [Some(0), None, Some(1), None, Some(2)])]
        {
            let found = placed(declaring(60.0, &steps(5, own)), 60.0, 5, None).unwrap();
            assert_eq!(rows(&found), expected);
            assert!(found.notes[0].contains(&format!("are those of {own:.2}")), "{:?}", found.notes);
        }
        // header and times agree on another rate, which is refused later
        let other = declaring(30.0, &steps(5, 30.0));
        assert_eq!(placed(other.clone(), 60.0, 5, None).unwrap(), other);
    }

    #[test]
    fn times_of_numbers_that_count_from_one_are_recognised() {
        let one_late = at_frames(file(&[0.1, 0.2]), 10.0, 3, None).unwrap();
        assert!(one_late.begins_at_one && one_late.is_by_time);
        let moved = at_frames(file(&[0.1, 0.2]), 10.0, 3, Some(-1)).unwrap();
        assert_eq!((rows(&moved.points), moved.begins_at_one), (vec![Some(0), Some(1), None], false));
    }

    #[test]
    fn a_rate_of_59_94_is_read_as_60_with_a_note() {
        let own = 60.0 / 1.001;
        for (count, frames) in [(900, 900), (899, 900)] {
            let found = placed(declaring(59.94, &steps(count, own)), 60.0, frames, None).unwrap();
            let expected: Vec<Option<usize>> = (0..frames).map(|row| (row < count as usize).then_some(row)).collect();
            assert_eq!((rows(&found), found.frames_per_second), (expected, Some(60.0)));
            assert_eq!(found.notes.len(), 1, "{:?}", found.notes);
        }
    }
}
