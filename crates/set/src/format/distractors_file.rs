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
    if files.has(PATH) { from_files(&files.read(BODIES_PATH)?, &files.read(PATH)?) } else { Ok(Vec::new()) }
}

/// The distractors of files written by [`to_files`].
fn from_files(bodies: &[u8], motions: &[u8]) -> Result<Vec<Distractor>, SetError> {
    let bodies = body_file::bodies_from_json(BODIES_PATH, bodies)?;
    let npz = Npz::from_bytes(PATH, motions)?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};

    #[test]
    fn distractors_are_read_back_and_files_that_do_not_belong_together_are_refused() {
        let other = |name: &str, frames| Distractor { name: name.into(), body: person(), poses: walk(frames).poses };
        let two = [other("one", 3), other("another", 5)];
        let [bodies, motions] = to_files(&two).unwrap().map(|(_, bytes)| bytes);
        assert_eq!(from_files(&bodies, &motions).unwrap(), two);
        let [_, single] = to_files(&two[..1]).unwrap().map(|(_, bytes)| bytes);
        assert!(from_files(&bodies, &single).unwrap_err().to_string().contains("1 names for 2 bodies"));
    }
}
