//! `poses.txt` of PARSEC's bodytrack: a line of 31 numbers for every frame, which move the body of the
//! `BodyShapeParameters.txt` beside it.

use std::path::Path;

use super::{MOST_POINTS, PointFile};
use crate::benchmark_set::{BODYTRACK_NUMBERS, BodytrackBody};
use crate::body::LANDMARKS;
use crate::common::ExperimentError;
use crate::input::{self, excerpt, limits};

const SHAPE_FILE: &str = "BodyShapeParameters.txt";
const MILLIMETRE: f64 = 0.001;

/// HumanEva's markers of its body, in its unit.
///
/// # Errors
/// [`ExperimentError`] that names the file, and the line of `poses.txt`.
pub(super) fn read(path: &Path) -> Result<PointFile, ExperimentError> {
    let text = |path: &Path| {
        input::read_to_string(path, limits::ARRAYS)
            .map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })
    };
    let shape = path.with_file_name(SHAPE_FILE);
    let malformed = |path: &Path, detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let poses = text(path)?;
    if !shape.is_file() {
        let detail = format!(
            "its body is described by {SHAPE_FILE}, which is not in the same folder; copy it there from the folder that \
             bodytrack was run in (skiagraph export --to bodytrack writes it)"
        );
        return Err(malformed(path, detail));
    }
    let body = BodytrackBody::from_text(&text(&shape)?).map_err(|detail| malformed(&shape, detail))?;
    let frames = frames(&poses, &body).map_err(|detail| malformed(path, detail))?;
    let names = LANDMARKS.map(|landmark| landmark.name().to_owned()).to_vec();
    Ok(PointFile { names, frames, metres_per_unit: Some(MILLIMETRE), ..PointFile::default() })
}

/// One row of points per frame.
type PointFrames = Vec<Vec<Option<[f64; 3]>>>;

fn frames(text: &str, body: &BodytrackBody) -> Result<PointFrames, String> {
    let mut frames = Vec::new();
    for (line, number) in text.trim_end().lines().zip(1..) {
        if (frames.len() + 1) * LANDMARKS.len() > MOST_POINTS {
            return Err(format!("line {number}: expected at most {} frames", MOST_POINTS / LANDMARKS.len()));
        }
        let pose = numbers(line).map_err(|detail| format!("line {number}: {detail}"))?;
        let in_millimetres = |place: nalgebra::Point3<f64>| (place / MILLIMETRE).coords.into();
        let markers = pose.map_or([None; LANDMARKS.len()], |pose| body.markers(&pose));
        frames.push(markers.map(|place| place.map(in_millimetres)).to_vec());
    }
    if frames.is_empty() { Err("expected a line for every frame, found none".to_owned()) } else { Ok(frames) }
}

/// The numbers of a line; `None` if all are NaN, for a frame without an estimate.
fn numbers(line: &str) -> Result<Option<[f64; BODYTRACK_NUMBERS]>, String> {
    if line.trim().is_empty() {
        return Err(format!("expected the {BODYTRACK_NUMBERS} numbers of a pose, found an empty line"));
    }
    let is_nan = |field: &str| field.parse::<f64>().is_ok_and(f64::is_nan);
    if line.split_whitespace().all(is_nan) && line.split_whitespace().count() == BODYTRACK_NUMBERS {
        return Ok(None);
    }
    let number = |field: &str| {
        let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
        let hint = if is_nan(field) { "; a frame without an estimate has nan for all numbers" } else { "" };
        number.ok_or_else(|| format!("expected a number, found {:?}{hint}", excerpt(field)))
    };
    let found = line.split_whitespace().map(number).collect::<Result<Vec<f64>, String>>()?;
    let count = found.len();
    let found: Result<[f64; BODYTRACK_NUMBERS], Vec<f64>> = found.try_into();
    found.map(Some).map_err(|_| format!("expected the {BODYTRACK_NUMBERS} numbers of a pose, found {count}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYLINDERS: &str = "80 60 1 1\n";
    const LENGTHS: &str = "500 100 400 410 0 110 420 430 0 180 300 250 0 190 310 260 0 220";

    fn body() -> BodytrackBody {
        BodytrackBody::from_text(&format!("{}{LENGTHS}", CYLINDERS.repeat(10))).unwrap()
    }

    /// Lines of a zero pose at a place, with some numbers set.
    fn line(set: &[(usize, f64)]) -> String {
        let mut numbers = [0.0; BODYTRACK_NUMBERS];
        [(3, 1000.0), (4, 2000.0), (5, 900.0)].iter().chain(set).for_each(|(index, number)| numbers[*index] = *number);
        numbers.map(|number| number.to_string()).join(" ") + " \n"
    }

    /// By hand: arms point backwards at zero.
    #[test]
    fn the_kinematics_agree_with_positions_computed_by_hand() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let at = |set: &[(usize, f64)], name: &str, expected: [f64; 3]| {
            let marker = LANDMARKS.iter().position(|landmark| landmark.name() == name).unwrap();
            let found = frames(&line(set), &body()).unwrap()[0][marker].unwrap();
            let apart = (0..3).map(|i| (found[i] - expected[i]).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{name} {set:?}: {found:?}, expected {expected:?}");
        };
        at(&[], "pelvis", [1000.0, 2000.0, 900.0]);
        at(&[], "thorax", [1000.0, 2000.0, 1400.0]);
        at(&[], "head_top", [1000.0, 2000.0, 1620.0]);
        at(&[], "left_hip", [1000.0, 2100.0, 900.0]);
        at(&[], "right_hip", [1000.0, 1890.0, 900.0]);
        at(&[], "left_ankle", [1000.0, 2100.0, 90.0]);
        at(&[], "left_shoulder", [1000.0, 2180.0, 1400.0]);
        at(&[], "right_shoulder", [1000.0, 1810.0, 1400.0]);
        at(&[], "left_elbow", [700.0, 2180.0, 1400.0]);
        at(&[], "right_wrist", [430.0, 1810.0, 1400.0]);
        // arms down, elbows bent forwards
        at(&[(17, -quarter), (19, -quarter)], "left_elbow", [1000.0, 2180.0, 1100.0]);
        at(&[(17, -quarter), (19, -quarter)], "left_wrist", [1250.0, 2180.0, 1100.0]);
        at(&[(23, quarter), (25, quarter)], "right_wrist", [1260.0, 1810.0, 1090.0]);
        // knee bent backwards; thigh raised forwards; head nodded forwards; the whole body turned to +y
        at(&[(9, -quarter)], "left_ankle", [590.0, 2100.0, 500.0]);
        at(&[(11, quarter)], "right_knee", [1420.0, 1890.0, 900.0]);
        at(&[(29, -quarter)], "head_top", [1220.0, 2000.0, 1400.0]);
        at(&[(2, quarter)], "left_elbow", [820.0, 1700.0, 1400.0]);
        at(&[(2, quarter), (1, quarter)], "thorax", [1000.0, 2500.0, 900.0]);
    }

    #[test]
    fn a_line_of_nan_is_a_lost_frame_and_blank_lines_at_the_end_are_skipped() {
        let found = frames(&(line(&[]) + &"nan ".repeat(31) + "\n" + &line(&[]) + "\n\n"), &body()).unwrap();
        let lost: Vec<bool> = found.iter().map(|frame| frame.iter().all(Option::is_none)).collect();
        assert_eq!(lost, [false, true, false]);
    }

    #[test]
    fn damaged_poses_are_refused_with_their_line() {
        let refused = |text: String, words: &str| {
            let message = frames(&text, &body()).unwrap_err();
            assert!(message.contains(words), "{message}");
        };
        refused(line(&[]) + "1 2 3\n", "line 2: expected the 31 numbers of a pose, found 3");
        refused(line(&[]) + &line(&[(4, f64::NAN)]), "line 2: expected a number, found \"NaN\"");
        refused("\n\n".to_owned(), "found none");
        refused(line(&[]) + "\n" + &line(&[]), "line 2: expected the 31 numbers of a pose, found an empty line");
        for (old, new, words) in [
            ("80 60", "-80 60", "line 1: expected a radius or factor of a cylinder greater than 0, found -80"),
            ("500 100 400", "500 100 0", "line 11: expected a length greater than 0, found 0"),
            ("500 100 400", "500 -1 400", "line 11: expected a length of at least 0, found -1"),
            ("0 220", "0 220 7", "expected 58 numbers (4 of each of 10 cylinders, and 18 lengths), found 59"),
        ] {
            let text = format!("{}{LENGTHS}", CYLINDERS.repeat(10)).replacen(old, new, 1);
            let message = BodytrackBody::from_text(&text).unwrap_err();
            assert!(message.contains(words), "{message}");
        }
        let shape = BodytrackBody::from_text("1 2 3").unwrap_err();
        assert!(shape.contains("expected 58 numbers") && shape.contains("found 3"), "{shape}");
    }
}
