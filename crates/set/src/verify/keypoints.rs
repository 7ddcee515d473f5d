//! Compares both files of the keypoints with those that body, cameras, settings and key give.

use super::parts::ReadParts;
use super::{CheckOutcome, Fault};
use crate::files::SetFiles;
use crate::keypoints_file::{self, PATH, TRUTH_PATH};
use crate::npz::{Array, Npz, Values};

/// Tolerance of what was found (float32), pixels and shares: parameters of cameras are rounded in files.
const FOUND_TOLERANCE: f64 = 5e-3;
/// Tolerance of the truth, pixels and metres.
const EXACT_TOLERANCE: f64 = 1e-6;

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let (facts, seed) = parts.observed();
    let Some(settings) = facts.keypoints else {
        let stray = [PATH, TRUTH_PATH].into_iter().filter(|path| files.has(path));
        let faults = stray.map(|path| Fault::new(path, "is present, but set.toml states no keypoints")).collect();
        return Ok(("the set has no keypoints".to_owned(), faults));
    };
    let (truth, _) = parts.scene()?;
    let (rig, seed) = (parts.filming()?, seed.ok_or("not checked: truth/key.txt cannot be read")?);
    let expected = keypoints_file::to_npz(truth, &rig, &settings, &facts.corruption, seed);
    let mut faults = Vec::new();
    for ((path, tolerance), expected) in
        [(PATH, FOUND_TOLERANCE), (TRUTH_PATH, EXACT_TOLERANCE)].into_iter().zip(&expected)
    {
        if !files.has(path) {
            faults.push(Fault::new(path, "is missing: set.toml states keypoints"));
            continue;
        }
        let bytes = files.read(path).map_err(|_| format!("not checked: {path} cannot be read"))?;
        match Npz::from_bytes(path, &bytes) {
            Ok(found) => faults.extend(differences(path, expected, &found, tolerance)),
            Err(error) => faults.push(Fault::new(path, error.detail)),
        }
    }
    let (frames, cameras) = (truth.frames.len(), rig.cameras());
    Ok((format!("{frames} frames of {} in {cameras} cameras", settings.layout.name()), faults))
}

fn differences(path: &str, expected: &Npz, found: &Npz, tolerance: f64) -> Vec<Fault> {
    let of_array = |(name, array): (&str, &Array)| match found.get(name) {
        None => Some(format!("has no array {name:?}")),
        Some(own) => difference(array, own, tolerance).map(|detail| format!("{name}: {detail}")),
    };
    let known = expected.iter().filter_map(of_array);
    let unknown = found.iter().filter(|(name, _)| expected.get(name).is_none());
    let unknown = unknown.map(|(name, _)| format!("the array {name:?} does not belong to this file"));
    known.chain(unknown).map(|detail| Fault::new(path, detail)).collect()
}

fn difference(expected: &Array, found: &Array, tolerance: f64) -> Option<String> {
    if expected.shape != found.shape {
        return Some(format!("has shape {:?}, expected {:?}", found.shape, expected.shape));
    }
    if std::mem::discriminant(&expected.values) != std::mem::discriminant(&found.values) {
        return Some("has numbers of another type, which trackers would refuse".to_owned());
    }
    let as_f64s = |values: &Values| match values {
        Values::F64(values) => Some(values.clone()),
        Values::F32(values) => Some(values.iter().map(|x| f64::from(*x)).collect()),
        _ => None,
    };
    let (Some(a), Some(b)) = (as_f64s(&expected.values), as_f64s(&found.values)) else {
        return (expected != found).then(|| "differs from what body, cameras and settings give".to_owned());
    };
    let same = |a: f64, b: f64| (a.is_nan() && b.is_nan()) || (a - b).abs() <= tolerance;
    let wrong = a.iter().zip(&b).filter(|(a, b)| !same(**a, **b)).count();
    let (at, (a, b)) = a.iter().zip(&b).enumerate().find(|(_, (a, b))| !same(**a, **b))?;
    Some(format!(
        "{wrong} numbers differ from what body, cameras and settings give, first number {at}: {b}, expected {a}"
    ))
}
