//! All numbers of a file in their order.

use serde_json::Value;

use crate::SetError;
use crate::npz::{Array, Npz, Values};

/// Numbers of a file, with the strides of their rows and columns.
pub(super) struct NumberSequence {
    /// Description of the place in the file.
    pub(super) place: String,
    pub(super) numbers: Vec<f64>,
    /// Distances between neighbours along each axis of an array.
    pub(super) strides: Vec<usize>,
}

impl NumberSequence {
    fn new(place: String, numbers: Vec<f64>, shape: &[usize]) -> Self {
        let mut strides = vec![1];
        let mut stride = 1_usize;
        for length in shape.iter().rev() {
            stride = stride.saturating_mul((*length).max(1));
            strides.push(stride);
        }
        strides.dedup();
        Self { place, numbers, strides }
    }

    fn from_array(name: &str, array: &Array) -> Option<Self> {
        let numbers = match &array.values {
            Values::F64(values) => values.clone(),
            Values::F32(values) => values.iter().map(|v| f64::from(*v)).collect(),
            Values::I64(values) => values.iter().map(|v| *v as f64).collect(),
            Values::U8(_) | Values::Bool(_) | Values::Text(_) => return None,
        };
        Some(Self::new(format!("array {name}"), numbers, &array.shape))
    }
}

/// Everything in a file that can be read as numbers.
pub(super) fn sequences(file: &str, bytes: &[u8]) -> Result<Vec<NumberSequence>, SetError> {
    let malformed = |detail: String| SetError::malformed(file, detail);
    if file.ends_with(".npz") {
        let npz = Npz::from_bytes(file, bytes)?;
        // arrays of bytes and texts may contain files
        let inside = npz.iter().flat_map(|(name, array)| match &array.values {
            Values::U8(bytes) => of_bytes(&format!("array {name}"), bytes),
            Values::Text(texts) => of_text(&format!("array {name}"), &texts.join("\n")),
            _ => NumberSequence::from_array(name, array).into_iter().collect(),
        });
        return Ok(inside.collect());
    }
    if file.ends_with(".npy") {
        let array = Array::from_npy(bytes).map_err(malformed)?;
        return Ok(NumberSequence::from_array("of the file", &array).into_iter().collect());
    }
    if file.ends_with(".json") {
        let value: Value = serde_json::from_slice(bytes).map_err(|e| malformed(e.to_string()))?;
        let mut found = Vec::new();
        arrays_of("", &value, &mut found);
        found.push(NumberSequence::new("all numbers".to_owned(), numbers_of(&value), &[]));
        found.extend(of_text("texts", &texts_of(&value).join("\n")));
        return Ok(found);
    }
    Ok(of_bytes("file", bytes))
}

/// Numbers of a text, or of binary data if it is not UTF-8.
fn of_bytes(place: &str, bytes: &[u8]) -> Vec<NumberSequence> {
    match std::str::from_utf8(bytes) {
        Ok(text) => of_text(place, text),
        Err(_) => of_binary(place, bytes),
    }
}

/// The numbers of a text, as a table if all lines with numbers have equally many.
fn of_text(place: &str, text: &str) -> Vec<NumberSequence> {
    let is_part = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let of_line =
        |line: &str| -> Vec<f64> { line.split(|c| !is_part(c)).filter_map(|word| word.parse().ok()).collect() };
    let lines: Vec<Vec<f64>> = text.lines().map(of_line).filter(|numbers| !numbers.is_empty()).collect();
    let width = lines.iter().map(Vec::len).max().unwrap_or(0);
    let shape = if lines.iter().all(|line| line.len() == width) { vec![lines.len(), width] } else { Vec::new() };
    vec![NumberSequence::new(place.to_owned(), lines.concat(), &shape)]
}

/// Little-endian doubles and floats at every alignment.
fn of_binary(place: &str, bytes: &[u8]) -> Vec<NumberSequence> {
    let doubles = (0..8).map(|start| {
        let rest = bytes.get(start..).unwrap_or_default();
        rest.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect::<Vec<f64>>()
    });
    let floats = (0..4).map(|start| {
        let rest = bytes.get(start..).unwrap_or_default();
        rest.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect()
    });
    doubles.chain(floats).map(|numbers| NumberSequence::new(place.to_owned(), numbers, &[])).collect()
}

/// The arrays of a JSON value whose elements are numbers in equal rows.
fn arrays_of(place: &str, value: &Value, found: &mut Vec<NumberSequence>) {
    match value {
        Value::Array(items) => match shape_of(value) {
            Some(shape) => found.push(NumberSequence::new(place.to_owned(), numbers_of(value), &shape)),
            None => items.iter().enumerate().for_each(|(i, item)| arrays_of(&format!("{place}[{i}]"), item, found)),
        },
        Value::Object(entries) => {
            entries.iter().for_each(|(key, item)| arrays_of(&format!("{place}.{key}"), item, found));
        }
        _ => {}
    }
}

/// Shape of an array of numbers in equal rows; `None` for other values.
fn shape_of(value: &Value) -> Option<Vec<usize>> {
    match value {
        Value::Number(_) => Some(Vec::new()),
        Value::Array(items) => {
            let inner = shape_of(items.first()?)?;
            let same = items.iter().all(|item| shape_of(item).as_ref() == Some(&inner));
            same.then(|| [vec![items.len()], inner].concat())
        }
        _ => None,
    }
}

/// The texts of a JSON value in order.
fn texts_of(value: &Value) -> Vec<&str> {
    match value {
        Value::String(text) => vec![text],
        Value::Array(items) => items.iter().flat_map(texts_of).collect(),
        Value::Object(entries) => entries.values().flat_map(texts_of).collect(),
        _ => Vec::new(),
    }
}

fn numbers_of(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(number) => number.as_f64().into_iter().collect(),
        Value::Array(items) => items.iter().flat_map(numbers_of).collect(),
        Value::Object(entries) => entries.values().flat_map(numbers_of).collect(),
        _ => Vec::new(),
    }
}
