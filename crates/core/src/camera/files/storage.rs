//! Matrices, lists and numbers by key: what YAML, TOML and JSON files have of a camera.

use core::f64::consts::TAU;

use serde_json::{Map, Value};

use super::{PlainCamera, rows, turned};
use crate::input::{excerpt, foreign};

/// Greatest difference of two copies of a number, with three digits.
pub(super) const SAME: f64 = 2e-3;

/// The keys of a file, or of one of its cameras.
pub(super) struct Storage(pub(super) Map<String, Value>);

/// What a format calls the parts of a camera; of several names of a part, one or several may be there.
#[derive(Clone, Copy)]
pub(super) struct Names<'a> {
    pub(super) matrix: &'a [&'a str],
    pub(super) lens: &'a [&'a str],
    pub(super) rotation: &'a [&'a str],
    pub(super) translation: &'a [&'a str],
    /// Of the width, and of the height.
    pub(super) size: [&'a [&'a str]; 2],
}

impl Storage {
    fn read_one(text: &str) -> Result<Self, String> {
        // OpenCV writes its directive with a colon, which is not valid YAML
        let rest = text.trim_start_matches('\u{feff}').trim_start();
        let body = match rest.strip_prefix("%YAML") {
            Some(after) => after.split_once('\n').map_or("", |(_, body)| body),
            None => rest,
        };
        let keys = serde_saphyr::from_str(body);
        keys.map(Self).map_err(|e| format!("not YAML of OpenCV: {}", parser_message(body, &e)))
    }

    /// Reads a file, or several as if they were one.
    pub(super) fn read(texts: &[&str]) -> Result<Self, String> {
        let mut all = Map::new();
        for text in texts {
            for (key, entry) in Self::read_one(text)?.0 {
                // the halves of a format may repeat a size, but not with other numbers
                let known = all.get(&key).and_then(numbers_of);
                if known.zip(numbers_of(&entry)).is_some_and(|(one, other)| one != other) {
                    return Err(format!("{}: the two files have different numbers", excerpt(&key)));
                }
                all.insert(key, entry);
            }
        }
        Ok(Self(all))
    }

    /// What the first of these keys has that is there.
    pub(super) fn entry(&self, keys: &[&str]) -> Option<&Value> {
        keys.iter().find_map(|key| self.0.get(*key))
    }

    /// The numbers that one or several of these keys have.
    pub(super) fn numbers<const N: usize>(&self, keys: &[&str]) -> Result<Option<[f64; N]>, String> {
        self.agreed(keys, |numbers| numbers.try_into().ok(), &[N])
    }

    /// The camera without its name.
    pub(super) fn camera(&self, names: Names<'_>, metres_per_unit: f64) -> Result<PlainCamera, String> {
        let missing = |keys: &[&str]| format!("{} is missing", keys[0]);
        let matrix = |numbers: &[f64]| match numbers {
            &[x, y, z] => Some(turned([x, y, z])),
            nine => nine.try_into().ok(),
        };
        let k = self.numbers(names.matrix)?.ok_or_else(|| missing(names.matrix))?;
        self.expect_radians(names.rotation)?;
        let r = self.agreed(names.rotation, matrix, &[9, 3])?.ok_or_else(|| missing(names.rotation))?;
        let t = self.numbers(names.translation)?.ok_or_else(|| missing(names.translation))?;
        let lens = names.lens.iter().find_map(|key| Some((key, self.0.get(*key)?)));
        let distortion = lens.map_or(Ok([0.0; 5]), |(key, entry)| {
            let numbers = numbers_of(entry).ok_or_else(|| unlike(entry, key, &[4, 5, 8, 12, 14]))?;
            super::coefficients(key, &numbers)
        })?;
        let [width, height] = names.size.map(|keys| self.numbers::<1>(keys));
        let size = width?.zip(height?).map(|([width], [height])| super::pixels([width, height])).transpose()?;
        Ok(PlainCamera { name: None, size, k: rows(&k), distortion, r: rows(&r), t, metres_per_unit })
    }

    /// Refuses rotation vectors that are longer than a full turn, which no program writes: they are in degrees.
    fn expect_radians(&self, keys: &[&str]) -> Result<(), String> {
        for key in keys {
            let numbers = self.0.get(*key).and_then(numbers_of).unwrap_or_default();
            let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
            if numbers.len() == 3 && length > TAU {
                return Err(format!(
                    "{key}: expected a rotation vector of at most a full turn, 2 pi, found one of {length:.1}: it seems to be \
                     in degrees; write it in radians"
                ));
            }
        }
        Ok(())
    }

    fn agreed<const N: usize>(
        &self,
        keys: &[&str],
        shaped: impl Fn(&[f64]) -> Option<[f64; N]>,
        counts: &[usize],
    ) -> Result<Option<[f64; N]>, String> {
        let mut first: Option<(&str, [f64; N])> = None;
        for key in keys {
            let Some(entry) = self.0.get(*key) else { continue };
            let numbers = numbers_of(entry).and_then(|numbers| shaped(&numbers));
            let numbers = numbers.ok_or_else(|| unlike(entry, key, counts))?;
            let differs = |(one, other): (&f64, &f64)| (one - other).abs() > SAME * other.abs().max(1.0);
            match first {
                None => first = Some((key, numbers)),
                Some((other, known)) if known.iter().zip(&numbers).any(differs) => {
                    return Err(format!("{other} and {key} are different: remove the wrong one"));
                }
                Some(_) => {}
            }
        }
        Ok(first.map(|(_, numbers)| numbers))
    }
}

/// Rows, columns and numbers of a `!!opencv-matrix`.
pub(super) fn matrix_of(entry: &Value) -> Option<(u64, u64, Vec<f64>)> {
    let side = |key: &str| entry.get(key)?.as_u64();
    let data = entry.get("data")?.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    Some((side("rows")?, side("cols")?, data))
}

/// All numbers of a matrix, a list, a list of rows or a number; `None` for a matrix of another size than it says, and
/// for words.
fn numbers_of(entry: &Value) -> Option<Vec<f64>> {
    match entry {
        Value::Array(rows) => Some(rows.iter().map(numbers_of).collect::<Option<Vec<_>>>()?.concat()),
        Value::Object(_) => {
            let (rows, cols, data) = matrix_of(entry)?;
            (rows.checked_mul(cols) == Some(data.len() as u64)).then_some(data)
        }
        number => Some(vec![number.as_f64()?]),
    }
}

fn unlike(entry: &Value, key: &str, counts: &[usize]) -> String {
    let found = match (matrix_of(entry), numbers_of(entry)) {
        (Some((rows, cols, data)), _) => format!("{} in {rows} rows and {cols} columns", data.len()),
        (None, Some(numbers)) => numbers.len().to_string(),
        (None, None) => "something else".to_owned(),
    };
    format!("{key}: expected {counts:?} numbers, found {found}")
}

/// The parser's message; only the line number for a file without OpenCV matrices, which is not quoted.
fn parser_message(body: &str, error: &serde_saphyr::Error) -> String {
    if body.contains("!!opencv-matrix") {
        foreign(error)
    } else {
        error.location().map_or_else(String::new, |at| format!("line {}", at.line()))
    }
}
