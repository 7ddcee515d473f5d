//! TRC, the marker format of OpenSim and Pose2Sim: a header of five lines, then one row per frame. The up axis is
//! usually Y; the file does not declare it.

use super::{MOST_POINTS, PointFile, metres_per_unit};
use crate::mocap::UpAxis;
use crate::mocap::options::MAX_RATE;
use crate::mocap::text_cursor::Lines;
use skiagraph_core::input::excerpt;

/// Parses the text of a TRC file. `declared` is the length of the unit in metres if that of the header is not
/// known.
pub fn parse(text: &str, declared: Option<f64>) -> Result<PointFile, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = Lines(text).enumerate().map(|(index, line)| (index + 1, line));
    let mut line = |what: &str| lines.next().ok_or_else(|| format!("the file ends before {what}"));
    let (_, kind) = line("the first line")?;
    if !kind.starts_with("PathFileType") {
        return Err("line 1: expected PathFileType, found something else".to_owned());
    }
    let (_, keys) = line("the header keys")?;
    if keys.contains(',') {
        return Err(
            "line 2: expected keys separated by tabs, found commas: replace the commas of the file by tabs".to_owned()
        );
    }
    let (at, values) = line("the header values")?;
    // values may be missing, or have more than one tab between them
    let are_all = keys.split_whitespace().count() == values.split_whitespace().count();
    let split: fn(&str) -> Vec<&str> = if are_all { words } else { fields };
    let header: Vec<(&str, &str)> = split(keys).into_iter().zip(split(values)).collect();
    let header_value = |name: &str| header.iter().find(|(key, _)| *key == name).map(|(_, value)| *value);
    let rate = header_value("DataRate")
        .and_then(|rate| rate.parse::<f64>().ok())
        .filter(|rate| rate.is_finite() && *rate > 0.0);
    let rate_line = at;
    let unit = header_value("Units").unwrap_or_default();
    let metres_per_unit = metres_per_unit(unit)
        .or(declared)
        .ok_or_else(|| format!("line {at}: Units: expected m, cm, mm, in or ft, found {:?}", excerpt(unit)))?;
    let count = |name: &str| header_value(name).and_then(|count| count.parse::<usize>().ok());
    let (frame_count, marker_count) = (count("NumFrames"), count("NumMarkers"));
    let (_, columns) = line("the marker names")?;
    let columns = Columns::of(columns).or_padded(columns, marker_count);
    let names = &columns.names;
    if names.is_empty() {
        return Err("line 4: expected Frame#, Time and marker names, separated by tabs".to_owned());
    }
    line("the coordinate names")?;
    if let Some(declared) = marker_count.filter(|declared| ![names.len(), columns.named()].contains(declared)) {
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
        let row = columns.fields(at, row)?;
        frames.push(frame(at, &row[2..], names)?);
        let number = |field: &str| field.parse::<f64>().unwrap_or(f64::NAN);
        numbers.push(number(row[0]));
        times.push(number(row[1]));
    }
    // times may be in milliseconds
    let rates = rate_of_rows(&times).filter(|_| rate.is_none()).map(|own| [own, 1000.0 * own]);
    let own_rate = rates.into_iter().flatten().find(|rate| (1.0..=MAX_RATE).contains(rate));
    let rate = rate.or(own_rate).ok_or_else(|| {
        format!("line {rate_line}: DataRate: expected frames per second, here or by times in the column Time")
    })?;
    let differs = frame_count.filter(|declared| *declared != frames.len());
    let note = |declared| format!("NumFrames is {declared}, but the file has {} rows, which were read", frames.len());
    let mut notes: Vec<String> = differs.map(note).into_iter().collect();
    if own_rate.is_some() {
        notes.push(format!("DataRate is missing: read at {rate:.3} frames a second by the column Time"));
    }
    let unnamed = names.len() - columns.named();
    if unnamed > 0 {
        notes.push(format!("{unnamed} columns of line 4 without a name: their points are not used"));
    }
    let mut points = PointFile {
        times_s: times_of_rows(&numbers, times, rate),
        names: columns.names,
        frames_per_second: Some(rate),
        metres_per_unit: Some(metres_per_unit),
        up: Some(UpAxis::Y),
        up_is_usual: true,
        frames,
        notes,
    };
    let every = median_step(&numbers).unwrap_or(1.0);
    if every > 1.0 && rate_of_rows(&points.times_s).is_some_and(|own| are_near(own * every, rate)) {
        points.frames_per_second = Some(rate / every);
        points
            .notes
            .push(format!("Frame# grows by {every} a row: read at {} frames a second, not {rate}", rate / every));
    }
    Ok(points)
}

/// The markers' columns.
struct Columns {
    /// Empty for a column without a name.
    names: Vec<String>,
    /// Whether names are in every third column, so that a missing one leaves a gap.
    are_spaced: bool,
    /// Whether blanks are between the names; then rows may begin with a tab.
    are_padded: bool,
}

impl Columns {
    fn of(line: &str) -> Self {
        let cells: Vec<&str> = fields(line).into_iter().skip(2).collect();
        let are_spaced = cells.iter().enumerate().all(|(index, cell)| index % 3 == 0 || cell.is_empty());
        let mut names: Vec<&str> = if are_spaced {
            cells.iter().step_by(3).copied().collect()
        } else {
            cells.into_iter().filter(|name| !name.is_empty()).collect()
        };
        while names.last().is_some_and(|name| name.is_empty()) {
            names.pop();
        }
        Self { names: names.into_iter().map(str::to_owned).collect(), are_spaced, are_padded: false }
    }

    /// These, or the words of the line if only those are as many as declared.
    fn or_padded(self, line: &str, declared: Option<usize>) -> Self {
        let names: Vec<String> = words(line).into_iter().skip(2).map(str::to_owned).collect();
        if [self.names.len(), self.named()].map(Some).contains(&declared) || Some(names.len()) != declared {
            return self;
        }
        Self { names, are_spaced: true, are_padded: true }
    }

    fn named(&self) -> usize {
        self.names.iter().filter(|name| !name.is_empty()).count()
    }

    /// The fields of a row: frame number, time and at most the coordinates of all names.
    fn fields<'a>(&self, at: usize, row: &'a str) -> Result<Vec<&'a str>, String> {
        let mut found = fields(if self.are_padded { row.trim_start() } else { row });
        let words = words(row);
        let expected = 2 + 3 * self.names.len();
        // two tabs between all fields, or spaces
        if words.len() == expected && (found.len() == 1 || found.len() + 1 >= 2 * expected) {
            return Ok(words);
        }
        let behind = found.get(expected..).unwrap_or_default();
        if !self.are_spaced && behind.iter().any(|field| !field.is_empty()) {
            let (points, names) = (found.len().div_ceil(3) - 1, self.names.len());
            return Err(format!(
                "line {at}: expected coordinates of {names} markers, as line 4 has {names} names, found {points}: give \
                 every three columns a name"
            ));
        }
        found.resize(expected, "");
        Ok(found)
    }
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// The fields of a line between tabs.
fn fields(line: &str) -> Vec<&str> {
    line.split('\t').map(str::trim).collect()
}

/// Rates of header and rows are the same if they differ by less than this share: 59.94 for 60, and rounded times.
const SAME_RATE: f64 = 0.02;

fn are_near(one: f64, other: f64) -> bool {
    (one / other - 1.0).abs() < SAME_RATE
}

/// The median difference of increasing numbers.
fn median_step(numbers: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len().saturating_sub(1) / 2).copied().filter(|step| *step > 0.0 && step.is_finite())
}

/// How many rows a step of time takes, at least 1.
fn rows_of_step(pair: &[f64], usual: f64) -> f64 {
    ((pair[1] - pair[0]) / usual).round().max(1.0)
}

/// Rows per second by their times, whether or not some are missing.
fn rate_of_rows(times: &[f64]) -> Option<f64> {
    let usual = median_step(times)?;
    let rows: f64 = times.windows(2).map(|pair| rows_of_step(pair, usual)).sum();
    Some(rows / (times.last()? - times.first()?))
}

/// Checks the times of a recording against its rate, and adds empty rows where some are missing.
///
/// # Errors
/// A message for times of another rate, unless `rate` is set, and for gaps longer than the recording.
pub(super) fn with_missing_rows(mut points: PointFile, rate: Option<f64>) -> Result<PointFile, String> {
    let (own, declared) = (rate_of_rows(&points.times_s), rate.or(points.frames_per_second));
    let (Some(usual), Some(own), Some(declared)) = (median_step(&points.times_s), own, declared) else {
        return Ok(points);
    };
    // times may be in milliseconds
    if rate.is_none() && !are_near(own, declared) && !are_near(own * 1000.0, declared) {
        return Err(format!(
            "DataRate is {declared} frames a second, but the column Time has {own:.4}: set `source_hz` to the right one"
        ));
    }
    let mut frames = Vec::with_capacity(points.frames.len());
    let (mut missing, mut first) = (0, None);
    let all = points.frames.len();
    for (row, frame) in std::mem::take(&mut points.frames).into_iter().enumerate() {
        let step = points.times_s.get(row.wrapping_sub(1)..=row).map_or(1.0, |pair| rows_of_step(pair, usual));
        let lost = (step - 1.0) as usize;
        missing = lost.saturating_add(missing);
        if missing > all {
            return Err(format!("the column Time jumps before row {} of {all}: use a part without the gap", row + 1));
        }
        if lost > 0 {
            first.get_or_insert(frames.len() + 1);
        }
        frames.resize(frames.len() + lost, vec![None; points.names.len()]);
        frames.push(frame);
    }
    points.frames = frames;
    if let Some(first) = first {
        let seconds = missing as f64 / declared;
        points.notes.push(format!(
            "{missing} rows ({seconds:.2} s) are missing by the column Time, the first of them frame {first}: interpolated"
        ));
    }
    Ok(points)
}

/// The times of the rows: the column `Time` if it increases, else from the frame numbers (the first frame is 0 or 1).
/// Empty if neither increases.
fn times_of_rows(numbers: &[f64], times: Vec<f64>, rate: f64) -> Vec<f64> {
    let first = if numbers.first() == Some(&0.0) { 0.0 } else { 1.0 };
    let by_number = numbers.iter().map(|number| (number - first) / rate).collect();
    let increases =
        |times: &Vec<f64>| times.iter().all(|time| time.is_finite()) && times.is_sorted_by(|one, next| one < next);
    [times, by_number].into_iter().find(increases).unwrap_or_default()
}

/// Parses the coordinates of a row: three numbers per marker, empty if the marker is missing.
fn frame(at: usize, fields: &[&str], names: &[String]) -> Result<Vec<Option<[f64; 3]>>, String> {
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
    use crate::mocap::points::zeros_as_missing;

    const FILE: &str = "PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n60\t60\t2\t2\tmm\n\
                        Frame#\tTime\tpelvis\t\t\thead\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0.0\t1\t2\t3\t4\t5\t6\n2\t0.1\t\t\t\t7\t8\t9\n";

    #[test]
    fn an_opensim_file_is_read() {
        let found = parse(FILE, None).unwrap();
        assert_eq!(found.names, ["pelvis", "head"]);
        assert_eq!(found.frames_per_second, Some(60.0));
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

    // Programs that pad names with blanks begin rows with a tab.
    #[test]
    fn names_between_blanks_are_split() {
        let padded = FILE.replace("pelvis\t\t\thead\t\t", "   pelvis      head   ");
        let names = ["pelvis", "head"];
        for text in [padded.replace("\n1\t", "\n\t1\t").replace("\n2\t", "\n\t2\t"), padded.clone()] {
            let found = parse(&text, None).unwrap();
            assert_eq!((found.names, found.times_s), (names.map(str::to_owned).to_vec(), vec![0.0, 0.1]));
            assert_eq!(found.frames, parse(FILE, None).unwrap().frames);
        }
        assert!(parse(&padded.replace("60\t60\t2\t2", "60\t60\t2\t3"), None).unwrap_err().contains("NumMarkers"));
    }

    // A file of Blender's with a DataRate of 0 was refused, though its rows have times.
    #[test]
    fn times_give_the_rate_that_is_missing() {
        let found = parse(&FILE.replace("\n60\t", "\n0\t"), None).unwrap();
        assert_eq!(found.frames_per_second, Some(10.0));
        assert_eq!(found.notes, ["DataRate is missing: read at 10.000 frames a second by the column Time"]);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, part) in [
            (FILE.replace("PathFileType", "Type"), "line 1"),
            (FILE.replace("mm", "px"), "found \"px\""),
            (FILE.replace('\t', ","), "separated by tabs, found commas"),
            (FILE.replace("\n60\t", "\nfast\t").replace("\t0.1\t", "\t\t"), "line 3: DataRate"),
            (FILE.replace("1\t2\t3", "1\ttwo\t3"), "line 7: pelvis: expected a number, found \"two\""),
            (FILE.replace("1\t2\t3", "1\t\t3"), "three numbers or none"),
            (FILE.replace("60\t60\t2\t2", "60\t60\t2\t3"), "NumMarkers: expected 3 marker names, as declared, found 2"),
            ("PathFileType\n".to_owned(), "ends before"),
        ] {
            let message = parse(&text, None).unwrap_err();
            assert!(message.contains(part), "{part}: {message}");
        }
    }

    /// A file of two markers with these frame numbers and times, and 60 frames a second in its header.
    fn rows(numbers_and_times: &[(u32, f64)]) -> String {
        let head: String = FILE.split_inclusive('\n').take(6).collect();
        let row = |(number, time): &(u32, f64)| format!("{number}\t{time}\t1\t2\t3\t4\t5\t6\n");
        head + &numbers_and_times.iter().map(row).collect::<String>()
    }

    fn recording(text: &str) -> Result<PointFile, String> {
        with_missing_rows(parse(text, None).unwrap(), None)
    }

    // Every third row with the header's rate of all was played three times as fast.
    #[test]
    fn rows_left_out_regularly_lower_the_rate() {
        let found = recording(&rows(&[(1, 0.0), (4, 0.05), (7, 0.1)])).unwrap();
        assert_eq!((found.frames_per_second, found.frames.len()), (Some(20.0), 3));
        assert!(found.notes.contains(&"Frame# grows by 3 a row: read at 20 frames a second, not 60".to_owned()));
    }

    // A header's rate that is not that of the times was used without a word.
    #[test]
    fn a_rate_that_contradicts_the_times_is_refused() {
        let text = rows(&[(1, 0.0), (2, 0.02), (3, 0.04)]);
        let message = recording(&text).unwrap_err();
        assert!(message.contains("DataRate is 60") && message.contains("has 50.0000: set `source_hz`"), "{message}");
        assert!(with_missing_rows(parse(&text, None).unwrap(), Some(50.0)).is_ok());
        for fine in [[0.0, 0.017, 0.033], [0.0, 16.667, 33.333], [0.0; 3]] {
            let found = recording(&rows(&[(1, fine[0]), (2, fine[1]), (3, fine[2])])).unwrap();
            assert_eq!((found.frames_per_second, found.frames.len()), (Some(60.0), 3), "{fine:?}");
        }
    }

    // The rows before and after a gap were played without a pause.
    #[test]
    fn missing_rows_are_frames_without_points() {
        let found = recording(&rows(&[(1, 0.0), (2, 1.0 / 60.0), (5, 4.0 / 60.0), (6, 5.0 / 60.0)])).unwrap();
        let is_seen: Vec<bool> = found.frames.iter().map(|frame| frame[0].is_some()).collect();
        assert_eq!(is_seen, [true, true, false, false, true, true]);
        assert!(found.notes.iter().any(|note| note.starts_with("2 rows (0.03 s) are missing by the column Time")));
        assert!(recording(&rows(&[(1, 0.0), (2, 1.0 / 60.0), (3, 9e9)])).unwrap_err().contains("jumps before row 3"));
    }

    // Points were given to the names of their neighbours.
    #[test]
    fn columns_without_a_name_keep_their_place() {
        let unnamed = FILE.replace("pelvis\t\t\thead", "\t\t\thead").replace("60\t60\t2\t2", "60\t60\t2\t1");
        let found = parse(&unnamed, None).unwrap();
        assert_eq!(found.names, ["", "head"]);
        assert_eq!(found.frames[0][1], Some([4.0, 5.0, 6.0]));
        assert!(found.notes[0].starts_with("1 columns of line 4 without a name"), "{:?}", found.notes);
        let close = FILE.replace("pelvis\t\t\thead\t\t", "pelvis\thead").replace("\t4\t5\t6", "\t4\t5\t6\t7\t8\t9");
        let message = parse(&close, None).unwrap_err();
        assert!(message.contains("line 7: expected coordinates of 2 markers"), "{message}");
        assert!(message.contains("found 3"), "{message}");
    }

    // Two tabs between the values of the header, or between all fields, shifted what followed.
    #[test]
    fn double_tabs_are_read_as_one() {
        let plain = parse(&FILE.replace("2\t0.1\t\t\t\t7", "2\t0.1\t1\t1\t1\t7"), None).unwrap();
        let double = |from: &str, text: &str| {
            let (before, after) = text.split_at(text.find(from).unwrap());
            before.to_owned() + &after.replace('\t', "\t\t")
        };
        let text = FILE.replace("2\t0.1\t\t\t\t7", "2\t0.1\t1\t1\t1\t7");
        assert_eq!(parse(&text.replace("60\t60\t2\t2\tmm", " 60\t\t60\t\t2\t\t2\t\tmm"), None).unwrap(), plain);
        assert_eq!(parse(&double("\n1\t", &text), None).unwrap(), plain);
    }
}
