//! Coordinates of an OpenSim model (`.mot`): OpenSim's own Python package computes the positions that follow from them.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

use super::{PointFile, sto_file};
use crate::common::ExperimentError;
use crate::input::{self, excerpt, limits, plain};

const SCRIPT: &str = include_str!("opensim_model.py");
/// Number of coordinates that a note names.
const MOST_NAMED: usize = 5;
/// Names of Python, in the order in which they are tried.
const PYTHONS: [&str; 2] = ["python3", "python"];

/// Positions of the model's markers, joints and bodies in every row of a motion.
///
/// # Errors
/// [`ExperimentError::Malformed`] if the model is missing, Python or its package opensim is not installed, or OpenSim
/// refuses model or motion.
pub(super) fn positions(model: &Path, motion: &Path) -> Result<PointFile, ExperimentError> {
    let malformed = |path: &Path, detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    if model.is_dir() {
        return Err(malformed(model, "--model: is a folder; expected an .osim file".to_owned()));
    }
    if !model.is_file() {
        return Err(malformed(model, "--model: there is no such file".to_owned()));
    }
    let text = input::read_to_string(motion, limits::ARRAYS)
        .map_err(|source| ExperimentError::Unreadable { path: motion.to_owned(), source })?;
    let in_degrees = in_degrees(&text).map_err(|detail| malformed(motion, detail))?;
    check_table(&text).map_err(|detail| malformed(motion, detail))?;
    let in_degrees = Path::new(if in_degrees { "yes" } else { "no" });
    let done = run(&[model, motion, in_degrees]).map_err(|detail| malformed(motion, detail))?;
    if !done.status.success() {
        let said = String::from_utf8_lossy(&done.stderr);
        let last = plain(said.trim().lines().last().unwrap_or_default());
        return Err(refusal([model, motion], &last));
    }
    let table = String::from_utf8_lossy(&done.stdout);
    let mut points = sto_file::parse(&table).map_err(|detail| malformed(motion, detail))?;
    points.notes.extend(note_of_lacking(&table));
    Ok(points)
}

/// The error for what the script said at its end.
fn refusal([model, motion]: [&Path; 2], said: &str) -> ExperimentError {
    let (path, detail) = if let Some(said) = said.strip_prefix("model: ") {
        (model, format!("OpenSim cannot read the model: {said}"))
    } else if let Some(said) = said.strip_prefix("motion: ") {
        (motion, format!("OpenSim cannot read the motion: {said}"))
    } else if said.starts_with("no module") {
        (motion, format!("--model needs OpenSim's package for Python ({said}): {INSTALL}"))
    } else {
        (motion, format!("OpenSim cannot compute positions with {}: {said}", plain(model.display())))
    };
    ExperimentError::Malformed { path: path.to_owned(), detail }
}

const INSTALL: &str = "pip install opensim, for the python3 that is first on the PATH";

/// Lines of a motion's header.
fn header(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).take_while(|line| !line.eq_ignore_ascii_case(sto_file::HEADER_END))
}

/// Whether the header of a motion declares degrees.
fn in_degrees(text: &str) -> Result<bool, String> {
    const EXPECTED: &str = "expected inDegrees=yes or inDegrees=no in the header";
    let declared = header(text)
        .filter_map(|line| line.split_once('='))
        .find(|(key, _)| key.trim().eq_ignore_ascii_case("inDegrees"))
        .map(|(_, value)| value.trim());
    match declared.map(str::to_ascii_lowercase).as_deref() {
        Some("yes" | "true") => Ok(true),
        Some("no" | "false") => Ok(false),
        Some(other) => Err(format!("{EXPECTED}, found {:?}", excerpt(other))),
        None => Err(format!("{EXPECTED}, which has no such line")),
    }
}

/// Refuses two columns of one coordinate, and words among the numbers, which OpenSim reads as 0.
fn check_table(text: &str) -> Result<(), String> {
    let mut lines = (1..).zip(text.lines()).skip(header(text).count() + 1);
    let labels = lines.next().map_or("", |(_, labels)| labels);
    let mut known = BTreeSet::new();
    if let Some(twice) = labels.split_whitespace().map(coordinate_of).find(|name| !known.insert(*name)) {
        return Err(format!("expected one column of each coordinate, found {:?} twice", excerpt(twice)));
    }
    for (line, row) in lines {
        if let Some(word) = row.split_whitespace().find(|field| field.parse::<f64>().is_err()) {
            return Err(format!("line {line}: expected a number, found {:?}", excerpt(word)));
        }
    }
    Ok(())
}

/// The coordinate's name of a column's label, as in the script.
fn coordinate_of(label: &str) -> &str {
    label.strip_suffix("/value").and_then(|place| place.rsplit_once('/')).map_or(label, |(_, name)| name)
}

/// A note that names coordinates of the model that the motion lacks, as the script's header lists them.
fn note_of_lacking(table: &str) -> Option<String> {
    let lacking = header(table).find_map(|line| line.strip_prefix("lacking="))?;
    let names: Vec<&str> = lacking.split(',').filter(|name| !name.is_empty()).collect();
    let named = names.iter().take(MOST_NAMED).copied().collect::<Vec<_>>().join(", ");
    let more = match names.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!names.is_empty()).then(|| plain(format!("coordinates without a column keep the model's default: {named}{more}")))
}

/// Runs the script with the first Python that is installed.
fn run(arguments: &[&Path]) -> Result<Output, String> {
    for python in PYTHONS {
        match Command::new(python).arg("-c").arg(SCRIPT).args(arguments).output() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            done => return done.map_err(|error| format!("cannot run {python}: {error}")),
        }
    }
    Err(format!("--model needs Python and OpenSim's package for it: {INSTALL}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_declares_degrees_in_any_spelling_or_is_refused() {
        let of = |line: &str| in_degrees(&format!("Coordinates\n{line}\nendheader\ntime\ta\n0\t1\n"));
        for line in ["inDegrees=yes", "inDegrees = Yes", "indegrees=TRUE "] {
            assert_eq!(of(line), Ok(true), "{line}");
        }
        for line in ["inDegrees=no", "inDegrees =False"] {
            assert_eq!(of(line), Ok(false), "{line}");
        }
        assert!(of("nRows=1").unwrap_err().contains("expected inDegrees=yes or inDegrees=no in the header"));
        assert!(of("inDegrees=maybe").unwrap_err().contains("found \"maybe\""));
    }

    #[test]
    fn two_columns_of_one_coordinate_and_words_among_the_numbers_are_refused() {
        let of = |labels: &str| check_table(&format!("inDegrees=no\nendheader\n{labels}\n0\t1\t2\n"));
        assert_eq!(of("time\tknee\thip"), Ok(()));
        assert_eq!(of("time\t/jointset/k/knee/value\t/jointset/k/knee/speed"), Ok(()));
        assert!(of("time\tknee\tknee").unwrap_err().contains("found \"knee\" twice"));
        assert!(of("time\tknee\t/jointset/k/knee/value").unwrap_err().contains("\"knee\" twice"));
        let word = check_table("inDegrees=no\nendheader\ntime\tknee\n0\t1\n0.1\tx\n").unwrap_err();
        assert_eq!(word, "line 5: expected a number, found \"x\"");
    }

    #[test]
    fn a_note_names_at_most_five_coordinates_that_are_lacking() {
        let of = |names: &str| note_of_lacking(&format!("DataType=Vec3\nlacking={names}\nendheader\n"));
        assert_eq!(of(""), None);
        assert!(of("a").unwrap().ends_with("keep the model's default: a"));
        assert!(of("a,b,c,d,e,f,g").unwrap().ends_with(": a, b, c, d, e and 2 more"));
    }
}
