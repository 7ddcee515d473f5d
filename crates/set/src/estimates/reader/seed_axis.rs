//! Files of a single repetition, without seeds or without the axis of seeds.

use crate::SetError;
use skiagraph_core::npz::{Array, Npz, Values};

/// Arrays of estimates with their number of axes.
const AXES: [(&str, usize); 4] =
    [("estimate_root", 3), ("estimate_angles", 3), ("estimate_markers", 4), ("estimate_joints", 4)];
/// Greatest number of repetitions, because a shape may claim any number.
const MOST_SEEDS: usize = 1_000_000;

/// The archive with `seeds`, and with a leading axis of seeds in every array of estimates. Arrays without this axis are
/// of a single repetition. Without `seeds` the repetitions are numbered from 0.
///
/// # Errors
/// [`SetError::Malformed`] if only some arrays have the axis, or if it is missing and there are several seeds.
pub fn with_seed_axis(file: &str, npz: Npz) -> Result<Npz, SetError> {
    let axes = |name: &str| AXES.iter().find(|(known, _)| *known == name).map(|(_, axes)| *axes);
    type ShapeOf<'a> = (&'a str, usize, &'a [usize]);
    let there: Vec<ShapeOf<'_>> =
        npz.iter().filter_map(|(name, array)| Some((name, axes(name)?, array.shape.as_slice()))).collect();
    let lacks = |(_, axes, shape): &ShapeOf<'_>| shape.len() + 1 == *axes;
    let (without, with): (Vec<ShapeOf<'_>>, Vec<ShapeOf<'_>>) = there.into_iter().partition(lacks);
    if let (Some((one, ..)), Some((other, ..))) = (without.first(), with.first()) {
        let detail = format!(
            "{other} has a leading axis of seeds and {one} has none; use one form for all: (seeds, frames, ...) or \
             (frames, ...)"
        );
        return Err(SetError::malformed(file, &detail));
    }
    let count =
        if without.is_empty() { with.first().and_then(|(_, _, shape)| shape.first().copied()) } else { Some(1) };
    let (is_single, has_seeds) = (!without.is_empty(), npz.get("seeds").is_some());
    let seeds = npz.get("seeds").and_then(|seeds| seeds.shape.first().copied());
    if is_single && seeds.is_some_and(|seeds| seeds != 1) {
        let detail = "has several seeds, but arrays without a leading axis of seeds; expected (seeds, frames, ...)";
        return Err(SetError::malformed(file, detail));
    }
    if !is_single && has_seeds {
        return Ok(npz);
    }
    // a single number becomes a list of one
    let listed = |array: &Array| match (array.shape.is_empty(), &array.values) {
        (true, values) => Array { shape: vec![1], values: values.clone() },
        (false, _) => array.clone(),
    };
    let mut found = Npz::default();
    if !has_seeds {
        let count = i64::try_from(count.unwrap_or(0).min(MOST_SEEDS)).unwrap_or(0);
        found.push("seeds", Array::new(&[count as usize], Values::I64((0..count).collect())));
    }
    for (name, array) in npz.iter() {
        let array = match (name, axes(name).filter(|_| is_single)) {
            ("seeds", _) => listed(array),
            (_, Some(_)) => Array { shape: [&[1], array.shape.as_slice()].concat(), values: array.values.clone() },
            _ => array.clone(),
        };
        found.push(name, array);
    }
    Ok(found)
}
