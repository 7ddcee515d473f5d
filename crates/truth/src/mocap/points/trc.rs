//! TRC, the marker format of OpenSim and Pose2Sim: a header of five lines, then one row per frame. The up axis is
//! usually Y; the file does not declare it.

use super::{MOST_POINTS, PointFile, metres_per_unit};
use crate::input::excerpt;
use crate::mocap::UpAxis;

/// Parses the text of a TRC file. `declared` is the length of the unit in metres if that of the header is not
/// known.
///
/// # Errors
/// A message with the line and what was expected.
pub fn parse(text: &str, declared: Option<f64>) -> Result<PointFile, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim_end_matches('\r')));
    let mut line = |what: &str| lines.next().ok_or_else(|| format!("the file ends before {what}"));
    let (_, kind) = line("the first line")?;
    if !kind.starts_with("PathFileType") {
        return Err("line 1: expected PathFileType, found something else".to_owned());
    }
    let (_, keys) = line("the header keys")?;
    let (at, values) = line("the header values")?;
    let header: Vec<(&str, &str)> = keys.split('\t').map(str::trim).zip(values.split('\t').map(str::trim)).collect();
    let header_value = |name: &str| header.iter().find(|(key, _)| *key == name).map(|(_, value)| *value);
    let rate = header_value("DataRate")
        .and_then(|rate| rate.parse::<f64>().ok())
        .filter(|rate| rate.is_finite() && *rate > 0.0);
    let rate = rate.ok_or_else(|| format!("line {at}: DataRate: expected frames per second"))?;
    let unit = header_value("Units").unwrap_or_default();
    let metres_per_unit = metres_per_unit(unit)
        .or(declared)
        .ok_or_else(|| format!("line {at}: Units: expected m, cm, mm, in or ft, found {:?}", excerpt(unit)))?;
    let count = |name: &str| header_value(name).and_then(|count| count.parse::<usize>().ok());
    let (frame_count, marker_count) = (count("NumFrames"), count("NumMarkers"));
    let (_, columns) = line("the marker names")?;
    // names are in every third column; the cells between are empty
    let names: Vec<String> =
        columns.split('\t').skip(2).map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect();
    if names.is_empty() {
        return Err("line 4: expected Frame#, Time and marker names, separated by tabs".to_owned());
    }
    line("the coordinate names")?;
    if let Some(declared) = marker_count.filter(|declared| *declared != names.len()) {
        return Err(format!(
            "line {at}: NumMarkers: expected {declared} marker names, as declared, found {}: correct NumMarkers or the \
             names",
            names.len()
        ));
    }
    let (mut frames, mut numbers, mut times) = (Vec::new(), Vec::new(), Vec::new());
    for (at, row) in lines.filter(|(_, row)| !row.trim().is_empty()) {
        if (frames.len() + 1).saturating_mul(names.len()) > MOST_POINTS {
            return Err(format!("line {at}: more than {MOST_POINTS} points"));
        }
        frames.push(frame(at, row, &names)?);
        let mut fields = row.split('\t').map(|field| field.trim().parse::<f64>().unwrap_or(f64::NAN));
        numbers.push(fields.next().unwrap_or(f64::NAN));
        times.push(fields.next().unwrap_or(f64::NAN));
    }
    let differs = frame_count.filter(|declared| *declared != frames.len());
    let note = |declared| format!("NumFrames is {declared}, but the file has {} rows, which were read", frames.len());
    let notes = differs.map(note).into_iter().collect();
    Ok(PointFile {
        times_s: times_of_rows(numbers, times, rate),
        names,
        frames_per_second: Some(rate),
        metres_per_unit: Some(metres_per_unit),
        up: Some(UpAxis::Y),
        up_is_usual: true,
        frames,
        notes,
    })
}

/// The times of the rows: the column `Time` if it increases, else from the frame numbers (the first frame is 0 or 1).
/// Empty if neither increases.
fn times_of_rows(numbers: Vec<f64>, times: Vec<f64>, rate: f64) -> Vec<f64> {
    let first = if numbers.first() == Some(&0.0) { 0.0 } else { 1.0 };
    let by_number = numbers.iter().map(|number| (number - first) / rate).collect();
    let increases =
        |times: &Vec<f64>| times.iter().all(|time| time.is_finite()) && times.is_sorted_by(|one, next| one < next);
    [times, by_number].into_iter().find(increases).unwrap_or_default()
}

/// Treats points exactly at the origin as missing, since many programs write missing points so, with a note. Only for
/// recordings: pose estimates may have their root at the origin in every frame.
pub(super) fn zeros_as_missing(mut points: PointFile) -> PointFile {
    let mut zeros = 0;
    for point in points.frames.iter_mut().flatten().filter(|point| **point == Some([0.0; 3])) {
        *point = None;
        zeros += 1;
    }
    if zeros > 0 {
        points.notes.push(format!("{zeros} points at exactly 0, 0, 0 in all frames treated as missing"));
    }
    points
}

/// Parses a row: frame number, time, and three numbers per marker, empty if the marker is missing.
fn frame(at: usize, row: &str, names: &[String]) -> Result<Vec<Option<[f64; 3]>>, String> {
    let fields: Vec<&str> = row.split('\t').skip(2).map(str::trim).collect();
    let number = |index: usize, name: &str| match fields.get(index).copied().unwrap_or_default() {
        "" => Ok(None),
        text if text.eq_ignore_ascii_case("nan") => Ok(None),
        text => match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(format!("line {at}: {}: expected a number, found {:?}", excerpt(name), excerpt(text))),
        },
    };
    let point = |(index, name): (usize, &String)| match [
        number(3 * index, name)?,
        number(3 * index + 1, name)?,
        number(3 * index + 2, name)?,
    ] {
        [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
        [None, None, None] => Ok(None),
        _ => Err(format!("line {at}: {}: expected three numbers or none", excerpt(name))),
    };
    names.iter().enumerate().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n60\t60\t2\t2\tmm\n\
                        Frame#\tTime\tpelvis\t\t\thead\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0.0\t1\t2\t3\t4\t5\t6\n2\t0.1\t\t\t\t7\t8\t9\n";

    #[test]
    fn an_opensim_file_is_read() {
        let found = parse(FILE, None).unwrap();
        assert_eq!(
            (found.names.as_slice(), found.frames_per_second),
            (&["pelvis".to_owned(), "head".to_owned()][..], Some(60.0))
        );
        assert_eq!((found.metres_per_unit, found.up), (Some(0.001), Some(UpAxis::Y)));
        assert_eq!(found.frames[1], [None, Some([7.0, 8.0, 9.0])]);
    }

    #[test]
    fn points_at_zero_are_missing_and_a_byte_order_mark_is_skipped() {
        let text = format!("\u{feff}{}", FILE.replace("\t1\t2\t3", "\t0\t0.0\t-0"));
        let found = zeros_as_missing(parse(&text, None).unwrap());
        assert_eq!(found.frames[0], [None, Some([4.0, 5.0, 6.0])]);
        assert_eq!(found.notes, ["1 points at exactly 0, 0, 0 in all frames treated as missing"]);
        assert_eq!(zeros_as_missing(parse(FILE, None).unwrap()).notes, Vec::<String>::new());
    }

    #[test]
    fn a_wrong_number_of_frames_is_noted_and_rows_have_times() {
        let found = parse(&FILE.replace("60\t60\t2\t2", "60\t60\t9\t2"), None).unwrap();
        assert_eq!(found.notes, ["NumFrames is 9, but the file has 2 rows, which were read"]);
        assert_eq!((found.frames.len(), found.times_s), (2, vec![0.0, 0.1]));
        // without times, frame numbers give them
        let numbered = FILE.replace("1\t0.0\t1", "1\t\t1").replace("2\t0.1", "4\t");
        assert_eq!(parse(&numbered, None).unwrap().times_s, [0.0, 0.05]);
        assert!(parse(&numbered.replace("\n4\t", "\n1\t"), None).unwrap().times_s.is_empty());
        let of_unknown = parse(&FILE.replace("mm", "px"), Some(0.01)).unwrap();
        assert_eq!(of_unknown.metres_per_unit, Some(0.01), "instead of one that is not known");
        for (unit, metres) in [("m", 1.0), ("Meters", 1.0), ("CM", 0.01), ("millimeters", 0.001), ("ft", 0.3048)] {
            assert_eq!(parse(&FILE.replace("mm", unit), None).unwrap().metres_per_unit, Some(metres), "{unit}");
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, part) in [
            (FILE.replace("PathFileType", "Type"), "line 1"),
            (FILE.replace("mm", "px"), "found \"px\""),
            (FILE.replace("\n60\t", "\nfast\t"), "DataRate"),
            (FILE.replace("1\t2\t3", "1\ttwo\t3"), "line 7: pelvis: expected a number, found \"two\""),
            (FILE.replace("1\t2\t3", "1\t\t3"), "three numbers or none"),
            (FILE.replace("60\t60\t2\t2", "60\t60\t2\t3"), "NumMarkers: expected 3 marker names, as declared, found 2"),
            ("PathFileType\n".to_owned(), "ends before"),
        ] {
            let message = parse(&text, None).unwrap_err();
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
