//! Which frame of the set each row of a file with times is: programs leave out frames at the ends or in between, or
//! write another rate.

use crate::mocap::{MOST_POINTS, PointFile};

/// A row belongs to a frame if its time is within this share of a frame: the rounding of times to milliseconds.
const NEAR: f64 = 0.1;
/// Steps between rows are uniform if the longest is at most this many times the shortest.
const UNIFORM: f64 = 1.5;

/// The rows at the frames of a set with `rate` frames a second, by their times; with `from_first`, the first row is
/// frame 0 whatever its time. A file with one row for every frame and uniform steps, of its own declared rate or this
/// one, is unchanged.
///
/// # Errors
/// A message if no row is at a frame of the set.
pub(super) fn at_frames(points: PointFile, rate: f64, frames: usize, from_first: bool) -> Result<PointFile, String> {
    let steps = || points.times_s.windows(2).map(|pair| pair[1] - pair[0]);
    let is_uniform = steps().fold(0.0, f64::max) <= UNIFORM * steps().fold(f64::INFINITY, f64::min);
    let [Some(first), Some(last)] = [points.times_s.first(), points.times_s.last()] else { return Ok(points) };
    // a file that declares no rate may have another one
    let is_of_rate = points.frames_per_second.is_some() || ((last - first) * rate + 1.0 - frames as f64).abs() < 0.5;
    if points.frames.len() == frames && is_uniform && is_of_rate {
        return Ok(points);
    }
    // with a shift, the file may be longer than the set
    let (origin, end) = if from_first { (*first, points.frames.len().max(frames)) } else { (0.0, frames) };
    if end.saturating_mul(points.names.len()) > MOST_POINTS {
        return Err(format!("expected at most {MOST_POINTS} points, found {} in {end} frames", points.names.len()));
    }
    let mut rows = vec![None; end];
    for (row, time) in points.times_s.iter().enumerate() {
        let at = frame_at((time - origin) * rate).and_then(|frame| rows.get_mut(frame));
        at.map(|at| at.get_or_insert(row));
    }
    let (count, used) = (points.frames.len(), rows.iter().flatten().count());
    if used == 0 {
        return Err(format!(
            "its {count} rows are at {first} to {last} s, and none is at one of the set's {frames} frames, 0 to {} s at \
             {rate} frames a second; use --shift with the set's frame of the first row, or correct the times",
            frames.saturating_sub(1) as f64 / rate
        ));
    }
    let mut notes = points.notes;
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
}
