//! Positions in OpenSim's `.sto` and `.mot`: columns `NAME_tx`, `NAME_ty`, `NAME_tz`, as its inverse kinematics writes
//! the markers of the model, or `NAME` with three numbers in each field.

use super::{MOST_POINTS, PointFile};
use crate::input::excerpt;
use crate::mocap::UpAxis;

const ENDINGS: [&str; 3] = ["_tx", "_ty", "_tz"];
pub(super) const HEADER_END: &str = "endheader";
const ANGLES: &str = "these are not positions but, as it seems, coordinates of an OpenSim model, which has other joints \
                      than the set's body; give its model, an .osim file, with --model, or let OpenSim write positions \
                      (report_marker_locations of its inverse kinematics, or .trc): docs/estimates.md";

/// The points of a file.
///
/// # Errors
/// A message with the line, what was expected and what was found.
pub(super) fn parse(text: &str) -> Result<PointFile, String> {
    let mut lines = text.lines().zip(1..);
    let header: Vec<&str> =
        lines.by_ref().map(|(line, _)| line.trim()).take_while(|line| !line.eq_ignore_ascii_case(HEADER_END)).collect();
    let Some((labels, labelled)) = lines.next() else {
        return Err(format!("expected a line {HEADER_END}, and one with the names of the columns after it"));
    };
    let mut labels = fields(labels);
    if labels.next().is_none_or(|first| !first.eq_ignore_ascii_case("time")) {
        return Err(format!("line {labelled}: expected the names of the columns, the first of them time"));
    }
    let has_vectors = header.iter().any(|line| line.eq_ignore_ascii_case("DataType=Vec3"));
    let labels: Vec<&str> = labels.collect();
    let names = if has_vectors { labels.into_iter().map(str::to_owned).collect() } else { points_of(&labels)? };
    let (mut times_s, mut frames) = (Vec::new(), Vec::new());
    for (line, number) in lines.filter(|(line, _)| !line.trim().is_empty()) {
        let (time, points) = row(line, names.len()).map_err(|detail| format!("line {number}: {detail}"))?;
        if times_s.last().is_some_and(|last| time <= *last) {
            return Err(format!("line {number}: expected a later time than in the line before, found {time}"));
        }
        if (frames.len() + 1) * names.len() > MOST_POINTS {
            return Err(format!("line {number}: expected at most {MOST_POINTS} points in all"));
        }
        times_s.push(time);
        frames.push(points);
    }
    Ok(PointFile { names, times_s, frames, up: Some(UpAxis::Y), up_is_usual: true, ..PointFile::default() })
}

fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace()
}

/// The names of points, which have three columns each.
fn points_of(labels: &[&str]) -> Result<Vec<String>, String> {
    let (triples, rest) = labels.as_chunks::<3>();
    let name = |triple: &[&str; 3]| {
        let name = triple[0].strip_suffix(ENDINGS[0])?;
        let is_of_it = |(label, ending): (&&str, &str)| label.strip_suffix(ending) == Some(name);
        triple.iter().zip(ENDINGS).all(is_of_it).then(|| name.to_owned())
    };
    let names: Option<Vec<String>> = triples.iter().map(name).collect();
    names.filter(|names| rest.is_empty() && !names.is_empty()).ok_or_else(|| ANGLES.to_owned())
}

/// The time of a row, and its points.
type TimedPoints = (f64, Vec<Option<[f64; 3]>>);

/// Time and points of a row; a point with a number that is NaN is missing.
fn row(line: &str, points: usize) -> Result<TimedPoints, String> {
    let numbers = line.split([' ', '\t', ',']).filter(|field| !field.is_empty()).map(number);
    let numbers = numbers.collect::<Result<Vec<f64>, String>>()?;
    match numbers.split_first() {
        Some((time, rest)) if rest.len() == 3 * points && time.is_finite() => {
            let point = |place: &[f64; 3]| place.iter().all(|x| x.is_finite()).then_some(*place);
            Ok((*time, rest.as_chunks::<3>().0.iter().map(point).collect()))
        }
        _ => Err(format!("expected a time and 3 x {points} numbers, found {} numbers", numbers.len())),
    }
}

fn number(field: &str) -> Result<f64, String> {
    field.parse().map_err(|_| format!("expected a number, found {:?}", excerpt(field)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As OpenSim 4.6 writes it.
    const FLAT: &str = "Model Marker Locations from IK\nversion=1\nnRows=2\nnColumns=7\ninDegrees=no\nendheader\n\
                        time\tpelvis_tx\tpelvis_ty\tpelvis_tz\tleft_knee_tx\tleft_knee_ty\tleft_knee_tz\n      \
                        0.00000000\t      0.1\t      0.9\t     -0.2\t  NaN\t  NaN\t  NaN\n      \
                        0.01666667\t1\t2\t3\t4\t5\t6\n";
    const VECTORS: &str = "DataType=Vec3\nversion=3\nOpenSimVersion=4.6\nendheader\ntime\tpelvis\tleft_knee\n\
                           0\t0.1,0.9,-0.2\tnan,nan,nan\n0.01666667\t1,2,3\t4,5,6\n";

    #[test]
    fn both_forms_of_columns_have_the_same_points_in_metres_with_y_up() {
        let flat = parse(FLAT).unwrap();
        assert_eq!(flat.names, ["pelvis", "left_knee"]);
        assert_eq!(flat.frames[0], [Some([0.1, 0.9, -0.2]), None]);
        assert_eq!(flat.frames[1], [Some([1.0, 2.0, 3.0]), Some([4.0, 5.0, 6.0])]);
        assert_eq!((flat.times_s[1], flat.up, flat.metres_per_unit), (0.01666667, Some(UpAxis::Y), None));
        assert_eq!(parse(VECTORS).unwrap(), flat);
    }

    #[test]
    fn coordinates_of_a_model_and_damaged_files_are_refused_with_the_reason() {
        let refused = |text: &str, words: &str| {
            let message = parse(text).unwrap_err();
            assert!(message.contains(words), "{message}");
        };
        refused(&FLAT.replace("left_knee_ty", "knee_angle_l"), "report_marker_locations");
        refused(&FLAT.replace("left_knee_ty", "right_knee_ty"), "coordinates of an OpenSim model");
        refused(&FLAT.replace("endheader", "end"), "expected a line endheader");
        refused(&FLAT.replace("time\t", "t\t"), "line 7: expected the names of the columns");
        refused(&FLAT.replace("\t6\n", "\n"), "line 9: expected a time and 3 x 2 numbers, found 6");
        refused(&FLAT.replace("\t5\t", "\tfive\t"), "line 9: expected a number, found \"five\"");
        refused(&FLAT.replace("0.01666667", "0.0"), "line 9: expected a later time");
        refused("", "expected a line endheader");
    }
}
