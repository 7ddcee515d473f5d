//! `truth/distractors.json` and `truth/distractors.npz`: bodies and motions of people besides the actor; absent without
//! any. Distractor `k` has the arrays `kk_root` (T, 7) and `kk_angles` (T, n) as in `truth.npz`, for at least one
//! frame, and keeps its last pose afterwards; `names` has the names of all distractors.

use super::body_file;
use super::truth_file::{names, push_poses, read_poses};
use crate::SetError;
use crate::files::SetFiles;
use skiagraph_core::npz::{Array, Npz};
use skiagraph_truth::scene::Distractor;

pub(crate) const BODIES_PATH: &str = "truth/distractors.json";
pub(crate) const PATH: &str = "truth/distractors.npz";

fn prefix(index: usize) -> String {
    format!("{index:02}_")
}

/// Paths and bytes of both files.
pub(crate) fn to_files(distractors: &[Distractor]) -> Result<[(&'static str, Vec<u8>); 2], SetError> {
    let bodies: Vec<_> = distractors.iter().map(|other| other.body.clone()).collect();
    let mut npz = Npz::default();
    npz.push("names", Array::names(distractors.iter().map(|other| other.name.as_str())));
    for (index, other) in distractors.iter().enumerate() {
        push_poses(&mut npz, &prefix(index), &[other.poses.len()], &other.body, other.poses.iter());
    }
    Ok([(BODIES_PATH, body_file::bodies_to_json(BODIES_PATH, &bodies)?), (PATH, npz.to_bytes(PATH)?)])
}

/// The people besides the actor; none if the set has no such files.
pub(crate) fn read(files: &SetFiles) -> Result<Vec<Distractor>, SetError> {
    if !files.has(PATH) {
        return Ok(Vec::new());
    }
    let bodies = body_file::bodies_from_json(BODIES_PATH, &files.read(BODIES_PATH)?)?;
    let npz = Npz::from_bytes(PATH, &files.read(PATH)?)?;
    let names = names(&npz, "names").unwrap_or_default();
    if names.len() != bodies.len() {
        let detail = format!("{} names for {} bodies in {BODIES_PATH}", names.len(), bodies.len());
        return Err(SetError::malformed(PATH, detail));
    }
    let each = bodies.into_iter().zip(names).enumerate();
    each.map(|(index, (body, name))| {
        let poses = read_poses(&npz, PATH, &prefix(index), Some(body.degrees_of_freedom.len()))?;
        if poses.is_empty() {
            Err(SetError::malformed(PATH, format!("{}root has no pose", prefix(index))))
        } else {
            Ok(Distractor { name: name.clone(), body, poses })
        }
    })
    .collect()
}
