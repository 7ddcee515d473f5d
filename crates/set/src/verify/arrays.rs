//! Names and other arrays that follow from the rest of a set and must match exactly.

use crate::input::excerpt;
use crate::npz::{Npz, Values};

/// Describes the arrays of texts that differ from the expected ones.
pub(super) fn wrong_names(found: &Npz, expected: &Npz) -> Vec<String> {
    let texts = expected.iter().filter_map(|(name, array)| match &array.values {
        Values::Text(texts) => Some((name, texts)),
        _ => None,
    });
    texts.filter_map(|(name, expected)| wrong_texts(found, name, expected)).collect()
}

fn wrong_texts(found: &Npz, name: &str, expected: &[String]) -> Option<String> {
    let Some(Values::Text(texts)) = found.get(name).map(|array| &array.values) else {
        return Some(format!("{name} is missing or not an array of texts"));
    };
    if texts.len() != expected.len() {
        return Some(format!("{name} has {} names, expected {}", texts.len(), expected.len()));
    }
    let (at, (text, expected)) = texts.iter().zip(expected).enumerate().find(|(_, (a, b))| a != b)?;
    Some(format!("{name}[{at}] is {:?}, expected {expected:?}", excerpt(text)))
}

/// Describes an array of integers that differs from the expected one.
pub(super) fn wrong_numbers(found: &Npz, name: &str, expected: &[i64]) -> Option<String> {
    let Some(Values::I64(numbers)) = found.get(name).map(|array| &array.values) else {
        return Some(format!("{name} is missing or not an array of integers"));
    };
    if numbers.len() != expected.len() {
        return Some(format!("{name} has {} numbers, expected {}", numbers.len(), expected.len()));
    }
    let (at, (number, expected)) = numbers.iter().zip(expected).enumerate().find(|(_, (a, b))| a != b)?;
    Some(format!("{name}[{at}] is {number}, expected {expected}"))
}
