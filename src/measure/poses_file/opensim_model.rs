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
    // OpenSim itself judges a file that is no text
    let text = input::read_to_string(model, limits::ROBOT).unwrap_or_default();
    check_model(&text).map_err(|detail| malformed(model, detail))?;
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

/// Refuses XML of something else, such as a robot or settings of OpenSim; OpenSim itself judges everything else.
fn check_model(text: &str) -> Result<(), String> {
    let Ok(document) = roxmltree::Document::parse(text) else { return Ok(()) };
    let root = document.root_element();
    let content = if root.has_tag_name("OpenSimDocument") { root.first_element_child() } else { Some(root) };
    match content.map(|element| element.tag_name().name()) {
        Some("Model") => Ok(()),
        other => Err(format!(
            "--model: expected an OpenSim model, a <Model> in an <OpenSimDocument>, found <{}>",
            excerpt(other.unwrap_or("OpenSimDocument"))
        )),
    }
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
    let of_line = |line: &str| {
        let (key, value) = line.split_once('=')?;
        key.trim().eq_ignore_ascii_case("inDegrees").then(|| value.trim().to_ascii_lowercase())
    };
    let declared: BTreeSet<String> = header(text).filter_map(of_line).collect();
    let declared: Vec<&str> = declared.iter().map(String::as_str).collect();
    match declared.as_slice() {
        ["yes" | "true"] => Ok(true),
        ["no" | "false"] => Ok(false),
        [] => Err(format!("{EXPECTED}, which has no such line")),
        [one] => Err(format!("{EXPECTED}, found {:?}", excerpt(one))),
        several => Err(format!("{EXPECTED}, found {}", several.join(" and "))),
    }
}

/// Refuses two columns of one coordinate, and what OpenSim reads in silence as something else: words among the
/// numbers as 0, infinite numbers, and an empty line as the end. Angles may be NaN, for a frame without an estimate.
fn check_table(text: &str) -> Result<(), String> {
    let mut lines = (1..).zip(text.trim_end().lines()).skip(header(text).count() + 1);
    let labels = lines.next().map_or("", |(_, labels)| labels);
    if !labels.contains('\t') {
        return Err(format!("expected columns separated by tabs, found {:?}", excerpt(labels)));
    }
    let mut known = BTreeSet::new();
    if let Some(twice) = labels.split_whitespace().map(coordinate_of).find(|name| !known.insert(*name)) {
        return Err(format!("expected one column of each coordinate, found {:?} twice", excerpt(twice)));
    }
    for (line, row) in lines {
        let mut fields = row.split_whitespace();
        let is_time = |field: &str| field.parse::<f64>().is_ok_and(f64::is_finite);
        let is_angle = |field: &str| field.parse::<f64>().is_ok_and(|angle| !angle.is_infinite());
        match fields.next() {
            None => return Err(format!("line {line}: expected a row of numbers, found an empty line")),
            Some(time) if !is_time(time) => {
                return Err(format!("line {line}: expected a time, found {:?}", excerpt(time)));
            }
            Some(_) => {}
        }
        if let Some(word) = fields.find(|field| !is_angle(field)) {
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
    fn xml_that_is_no_model_is_refused_by_its_element() {
        for text in ["<OpenSimDocument>\n<!-- a --><Model/></OpenSimDocument>", "<Model name='leg'/>", "not XML"] {
            assert_eq!(check_model(text), Ok(()), "{text}");
        }
        for (text, found) in [
            ("<robot/>", "found <robot>"),
            ("<OpenSimDocument><ScaleTool/></OpenSimDocument>", "found <ScaleTool>"),
            ("<OpenSimDocument/>", "found <OpenSimDocument>"),
        ] {
            let message = check_model(text).unwrap_err();
            assert!(message.contains("expected an OpenSim model") && message.ends_with(found), "{message}");
        }
    }

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
        assert!(of("inDegrees=yes\ninDegrees=no").unwrap_err().contains("found no and yes"));
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
        let row = |row: &str| check_table(&format!("inDegrees=no\nendheader\ntime\tknee\n{row}\n0.1\t1\n\n"));
        assert_eq!(row("0\tnan"), Ok(()));
        for (spoiled, words) in [("", "an empty line"), ("0\tinf", "found \"inf\""), ("nan\t1", "expected a time")] {
            assert!(row(spoiled).unwrap_err().contains(words), "{spoiled}");
        }
        assert!(of("time knee hip").unwrap_err().contains("separated by tabs"));
    }

    #[test]
    fn a_note_names_at_most_five_coordinates_that_are_lacking() {
        let of = |names: &str| note_of_lacking(&format!("DataType=Vec3\nlacking={names}\nendheader\n"));
        assert_eq!(of(""), None);
        assert!(of("a").unwrap().ends_with("keep the model's default: a"));
        assert!(of("a,b,c,d,e,f,g").unwrap().ends_with(": a, b, c, d, e and 2 more"));
    }
}
