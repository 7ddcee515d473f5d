//! CSV files with one column per coordinate (`pelvis_x, pelvis_y, pelvis_z, ...`) or one row per point
//! (`frame, name, x, y, z`).

use std::collections::BTreeMap;

use super::{MOST_POINTS, PointFile};
use skiagraph_core::input::excerpt;

const AXES: [&str; 3] = ["x", "y", "z"];

/// The points, and whether the file numbers its frames.
pub(super) fn parse(text: &str) -> Result<(PointFile, bool), String> {
    check_separator(text)?;
    let mut builder = csv::ReaderBuilder::new();
    builder.trim(csv::Trim::All).comment(Some(b'#'));
    let mut reader = builder.from_reader(text.as_bytes());
    let headers: Vec<String> = reader
        .headers()
        .map_err(|e| e.to_string())?
        .iter()
        .map(|name| name.trim_start_matches('\u{feff}').to_owned())
        .collect();
    let at = |name: &str| headers.iter().position(|header| header.eq_ignore_ascii_case(name));
    // anipose calls the frame number fnum
    let frame = at("frame").or_else(|| at("fnum"));
    let name_column = ["name", "marker", "joint"].into_iter().find_map(at);
    // rows of anything may have an `id`: it is that of people if two of them have the same frame and name
    let of_people =
        ["person", "person_id", "subject", "track_id"].into_iter().find_map(at).map(|column| (column, [None; 2]));
    let of_rows = || Some((at("id")?, [Some(frame?), name_column]));
    if let Some((column, key)) = of_people.or_else(of_rows) {
        check_persons(builder.from_reader(text.as_bytes()), column, &headers[column], key)?;
    }
    let points = match (name_column, AXES.map(at), frame) {
        (Some(name), [Some(x), Some(y), Some(z)], Some(frame)) => rows(&mut reader, name, frame, [x, y, z]),
        (Some(_), ..) => {
            Err("line 1: a table with one row per point needs the columns frame, name, x, y and z".to_owned())
        }
        _ => wide(&mut reader, &headers, frame),
    };
    Ok((points?, frame.is_some()))
}

/// Refuses several people: two values of the column in rows that are equal in the columns of the `key`.
fn check_persons(
    mut reader: CsvReader<'_>,
    column: usize,
    header: &str,
    key: [Option<usize>; 2],
) -> Result<(), String> {
    let mut known: BTreeMap<[String; 2], String> = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(with_line)?;
        let field = |column: Option<usize>| column.and_then(|at| record.get(at)).unwrap_or_default().to_owned();
        let person = field(Some(column));
        let line = record.position().map_or(0, csv::Position::line);
        let first = known.entry(key.map(field)).or_insert_with(|| person.clone());
        if *first != person {
            return Err(format!(
                "line {line}: the column {:?} has several people, {:?} and {:?}: keep the rows of one person",
                excerpt(header),
                excerpt(first),
                excerpt(&person)
            ));
        }
    }
    Ok(())
}

/// Refuses fields that are not separated by commas.
fn check_separator(text: &str) -> Result<(), String> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let head = lines.next().filter(|head| !head.contains(','));
    let other =
        head.and_then(|head| [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(c, _)| head.contains(*c)));
    other.map_or(Ok(()), |(_, found)| {
        Err(format!("line 1: expected commas between fields, found {found}; use commas and decimal points"))
    })
}

/// The message of a CSV error, with its line.
fn with_line(error: csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            format!("line {line}: expected {expected_len} fields as in line 1, found {len}")
        }
        _ => error.to_string(),
    }
}

type CsvReader<'a> = csv::Reader<&'a [u8]>;

/// A number, or `None` for an empty field or NaN.
fn number(field: Option<&str>, line: u64, what: &str) -> Result<Option<f64>, String> {
    let field = field.unwrap_or_default();
    if field.is_empty() || field.eq_ignore_ascii_case("nan") {
        return Ok(None);
    }
    match field.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(Some(value)),
        _ => Err(format!("line {line}: {what}: expected a number, found {:?}", excerpt(field))),
    }
}

fn frame_number(field: Option<&str>, line: u64) -> Result<usize, String> {
    let frame = number(field, line, "frame")?.filter(|frame| *frame >= 0.0 && frame.fract() == 0.0 && *frame < 1e9);
    frame.map(|frame| frame as usize).ok_or_else(|| format!("line {line}: frame: expected a whole number from 0"))
}

/// A point of three fields, of which all or none must be given.
fn point(fields: [Option<f64>; 3], line: u64, name: &str) -> Result<Option<[f64; 3]>, String> {
    match fields {
        [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
        [None, None, None] => Ok(None),
        _ => Err(format!("line {line}: {}: expected three numbers or none", excerpt(name))),
    }
}

fn check_size(frames: usize, names: usize) -> Result<(), String> {
    match frames.checked_mul(names.max(1)) {
        Some(points) if points <= MOST_POINTS => Ok(()),
        _ => Err(format!("expected at most {MOST_POINTS} points, found {frames} frames of {names} points")),
    }
}

fn wide(reader: &mut CsvReader<'_>, headers: &[String], frame_column: Option<usize>) -> Result<PointFile, String> {
    let mut columns: BTreeMap<String, [Option<usize>; 3]> = BTreeMap::new();
    let mut order = Vec::new();
    for (index, header) in headers.iter().enumerate() {
        let Some((name, axis)) = header.rsplit_once(['_', '.', ':', ' ']) else { continue };
        let Some(axis) = AXES.iter().position(|known| axis.eq_ignore_ascii_case(known)) else { continue };
        let entry = columns.entry(name.to_owned()).or_insert_with(|| {
            order.push(name.to_owned());
            [None; 3]
        });
        if entry[axis].replace(index).is_some() {
            return Err(format!("line 1: two columns {:?}", excerpt(header)));
        }
    }
    if order.is_empty() {
        return Err("line 1: expected columns as pelvis_x, pelvis_y, pelvis_z, or frame, name, x, y, z".to_owned());
    }
    if let Some((name, _)) = columns.iter().find(|(_, axes)| axes.contains(&None)) {
        return Err(format!("line 1: {:?} needs three columns, for x, y and z", excerpt(name)));
    }
    let mut frames: Vec<Vec<Option<[f64; 3]>>> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(with_line)?;
        let line = record.position().map_or(0, csv::Position::line);
        let frame = match frame_column {
            Some(column) => frame_number(record.get(column), line)?,
            None => frames.len(),
        };
        if frame < frames.len() {
            return Err(format!("line {line}: frame {frame} comes after frame {}", frames.len() - 1));
        }
        check_size(frame + 1, order.len())?;
        // omitted frames have no estimate
        frames.resize(frame, vec![None; order.len()]);
        let mut row = Vec::with_capacity(order.len());
        for name in &order {
            let of = |axis: usize| number(record.get(columns[name][axis].unwrap_or_default()), line, name);
            row.push(point([of(0)?, of(1)?, of(2)?], line, name)?);
        }
        frames.push(row);
    }
    Ok(PointFile { names: order, frames, ..PointFile::default() })
}

fn rows(reader: &mut CsvReader<'_>, name: usize, frame: usize, axes: [usize; 3]) -> Result<PointFile, String> {
    let mut names: Vec<String> = Vec::new();
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    let mut found: Vec<Vec<Option<[f64; 3]>>> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(with_line)?;
        let line = record.position().map_or(0, csv::Position::line);
        let at = frame_number(record.get(frame), line)?;
        let row_name = record.get(name).unwrap_or_default().to_owned();
        let column = *known.entry(row_name.clone()).or_insert_with(|| {
            names.push(row_name.clone());
            names.len() - 1
        });
        check_size(at + 1, names.len())?;
        if found.len() <= at {
            found.resize(at + 1, Vec::new());
        }
        if found[at].len() <= column {
            found[at].resize(column + 1, None);
        }
        let of = |axis: usize| number(record.get(axes[axis]), line, AXES[axis]);
        let place = point([of(0)?, of(1)?, of(2)?], line, &row_name)?;
        if found[at][column].is_some() {
            return Err(format!("line {line}: {:?} occurs twice in frame {at}", excerpt(&row_name)));
        }
        found[at][column] = place;
    }
    found.iter_mut().for_each(|row| row.resize(names.len(), None));
    Ok(PointFile { names, frames: found, ..PointFile::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_column_per_coordinate_and_one_row_per_point_are_equivalent() {
        let (wide, is_numbered) =
            parse("frame,time,pelvis_x,pelvis_y,pelvis_z,head_X,head_Y,head_Z\n0,0,1,2,3,4,5,6\n2,0.2,,,,7,8,9\n")
                .unwrap();
        assert_eq!(wide.names, ["pelvis", "head"]);
        let gap = vec![None, None];
        assert_eq!(
            wide.frames,
            [vec![Some([1.0, 2.0, 3.0]), Some([4.0, 5.0, 6.0])], gap, vec![None, Some([7.0, 8.0, 9.0])]]
        );
        let (rows, _) = parse("frame,name,x,y,z\n0,pelvis,1,2,3\n0,head,4,5,6\n2,head,7,8,9\n").unwrap();
        assert!(is_numbered && !parse("p_x,p_y,p_z\n1,2,3\n").unwrap().1);
        assert_eq!((rows.names, rows.frames), (wide.names, wide.frames));
        assert!(parse("id,frame,p_x,p_y,p_z\n7,0,1,2,3\n8,1,1,2,3\n").is_ok(), "a number of the row");
    }

    #[test]
    fn errors_name_their_line() {
        for (text, part) in [
            ("a,b\n1,2\n", "line 1: expected columns"),
            ("p_x,p_y\n1,2\n", "needs three columns"),
            ("p_x,p_y,p_z\n1,2,three\n", "line 2: p: expected a number, found \"three\""),
            ("p_x,p_y,p_z\n1,,3\n", "line 2: p: expected three numbers or none"),
            ("frame,p_x,p_y,p_z\n1,1,1,1\n0,1,1,1\n", "line 3: frame 0 comes after frame 1"),
            ("frame,p_x,p_y,p_z\n999999999,1,1,1\n", "at most"),
            ("frame,p_x,p_y,p_z\n-1,1,1,1\n", "whole number"),
            ("frame,name,x,y,z\n0,p,1,2,3\n0,p,1,2,3\n", "line 3: \"p\" occurs twice"),
            ("p_x,p_y,p_z\n1,2\n", "line 2"),
            ("frame;p_x;p_y;p_z\n0;1,5;2,5;3,5\n", "line 1: expected commas between fields, found semicolons"),
            ("frame,person,name,x,y,z\n0,1,p,1,2,3\n0,2,p,1,2,3\n", "line 3: the column \"person\" has several people"),
            ("frame,id,p_x,p_y,p_z\n0,a,1,2,3\n0,b,1,2,3\n", "line 3: the column \"id\" has several people, \"a\" and"),
            ("# mine\np_x\tp_y\tp_z\n1\t2\t3\n", "found tabs"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
