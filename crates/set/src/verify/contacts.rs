//! Compares `contact.npz` with the contact computed from the poses.

use super::parts::ReadParts;
use super::{CheckOutcome, Fault};
use crate::contact_file;
use crate::files::SetFiles;
use crate::listing::FORMATS;
use crate::npz::{Array, Npz, Values};

/// Tolerance, relative to the greatest number of the array or 1.
const TOLERANCE: f64 = 1e-9;

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let truth = parts.truth.as_ref().ok_or("not checked: the truth cannot be read")?;
    let path = contact_file::PATH;
    let Some(expected) = contact_file::to_npz(truth) else {
        let faults = files.has(path).then(|| Fault::new(path, "is present, but the actor has no feet"));
        return Ok(("the actor has no feet".to_owned(), faults.into_iter().collect()));
    };
    if !files.has(path) {
        // sets with a description of formats have this file
        let missing = files.has(FORMATS).then(|| Fault::new(path, "is missing, but the actor has feet"));
        let looked_at = "the set has no contact.npz; sets of older versions lack it".to_owned();
        return Ok((looked_at, missing.into_iter().collect()));
    }
    let found = files.read(path).map_err(|_| "not checked: contact.npz cannot be read".to_owned())?;
    let found = match Npz::from_bytes(path, &found) {
        Ok(found) => found,
        Err(error) => return Ok((String::new(), vec![Fault::new(path, error.detail)])),
    };
    let mut faults = Vec::new();
    for (name, expected) in expected.iter() {
        let detail = match found.get(name) {
            None => Some("is missing".to_owned()),
            Some(found) => difference(expected, found),
        };
        faults.extend(detail.map(|detail| Fault::new(path, format!("{name} {detail}"))));
    }
    Ok((format!("{} arrays recomputed", expected.iter().count()), faults))
}

/// Describes how two arrays differ.
fn difference(expected: &Array, found: &Array) -> Option<String> {
    if expected.shape != found.shape {
        return Some(format!("has shape {:?}, expected {:?}", found.shape, expected.shape));
    }
    let (Values::F64(a), Values::F64(b)) = (&expected.values, &found.values) else {
        return (expected != found).then(|| "differs from the contact computed from the poses".to_owned());
    };
    let scale = a.iter().filter(|x| x.is_finite()).fold(1.0, |most: f64, x| most.max(x.abs()));
    let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() <= TOLERANCE * scale;
    let wrong = a.iter().zip(b).filter(|(a, b)| !same(**a, **b)).count();
    let (at, (a, b)) = a.iter().zip(b).enumerate().find(|(_, (a, b))| !same(**a, **b))?;
    Some(format!(
        "differs from the contact computed from the poses in {wrong} numbers, first number {at}: {b}, expected {a}"
    ))
}
