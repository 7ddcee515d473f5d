//! `truth/recording.npz`: the recordings of the actor's motion, with fingerprints that identify their frames in other
//! files.
//!
//! It is part of the truth, because the fingerprint of a frame, even hashed, could confirm a guessed pose. Therefore
//! `skiagraph track` does not compare fingerprints; it records the sources of its models (`learned_from.npz` of a run,
//! in the same format), and `skiagraph evaluate` refuses a run whose models learned from the test.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `clip`, `sha256` | (n) | name and SHA-256 of every recording's file; empty if unknown |
//! | `frames` | (n, 2) | first and last frame used, in the file's numbering, from 1 |
//! | `fingerprint` | (N, 16) | distances between landmarks in leg lengths, for all frames of all recordings |
//! | `fingerprint_rows` | (n) | number of frames of every recording; 0 without a fingerprint |
//! | `fingerprint_version` | () | 1 |

use super::truth_file::names;
use crate::SetError;
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_truth::retarget::{FINGERPRINT_DISTANCES, MotionFingerprint};

pub(crate) const PATH: &str = "truth/recording.npz";

/// Version of the definition of the fingerprint.
const VERSION: i64 = 1;

/// A recording or a part of one, with all data that identify the same frames in other files.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceRecording {
    /// Its name as given by the user.
    pub clip: String,
    /// SHA-256 of its file.
    pub sha256: Option<String>,
    /// First frame in the file's numbering, from 1; the frame of the fingerprint's first row.
    pub first_frame: usize,
    /// Last frame, included; `usize::MAX` for the unknown last frame of the recording.
    pub last_frame: usize,
    /// The fingerprint of its frames; `None` for models of older versions.
    pub fingerprint: Option<MotionFingerprint>,
}

impl SourceRecording {
    /// First and last frame of this recording, in its file's numbering, that the other one also has; `None` if there is
    /// none.
    ///
    /// Parts of the same file (by hash, or by name if a hash is missing) share frames with the same numbers. In
    /// addition, frames are compared by their fingerprints.
    pub fn shared_frames(&self, other: &Self) -> Option<(usize, usize)> {
        let name = |clip: &str| clip.rsplit(['/', '\\']).next().map(str::to_owned);
        let same_file = match (&self.sha256, &other.sha256) {
            (Some(a), Some(b)) => a.eq_ignore_ascii_case(b),
            _ => name(&self.clip) == name(&other.clip),
        };
        let numbered = (self.first_frame.max(other.first_frame), self.last_frame.min(other.last_frame));
        if same_file && numbered.0 <= numbered.1 {
            return Some(numbered);
        }
        let shared = self.fingerprint.as_ref()?.shared_with(other.fingerprint.as_ref()?)?;
        Some((self.first_frame + shared.own.0, self.first_frame + shared.own.1))
    }

    /// Describes name and frames.
    pub fn describe(&self) -> String {
        match self.last_frame {
            usize::MAX if self.first_frame <= 1 => self.clip.clone(),
            usize::MAX => format!("{}, frames {} to the last", self.clip, self.first_frame),
            last => format!("{}, frames {} to {last}", self.clip, self.first_frame),
        }
    }
}

/// The bytes of a file of recordings, at least one. `file` is its name in errors.
///
/// # Errors
/// [`SetError::Malformed`] for more than a file can hold.
pub fn recordings_to_npz(file: &str, recordings: &[SourceRecording]) -> Result<Vec<u8>, SetError> {
    let number = |frame: usize| i64::try_from(frame).unwrap_or(i64::MAX);
    let frames: Vec<i64> = recordings.iter().flat_map(|r| [number(r.first_frame), number(r.last_frame)]).collect();
    let mut npz = Npz::from_iter([
        ("clip", Array::names(recordings.iter().map(|r| r.clip.as_str()))),
        ("sha256", Array::names(recordings.iter().map(|r| r.sha256.as_deref().unwrap_or_default()))),
        ("frames", Array::new(&[recordings.len(), 2], frames)),
    ]);
    push_fingerprints(&mut npz, recordings.iter().map(|r| r.fingerprint.as_ref()));
    Ok(npz.to_bytes(file)?)
}

pub(crate) use self::{recordings_from_npz as from_npz, recordings_to_npz as to_npz};

/// Reads a file of [`recordings_to_npz`].
///
/// # Errors
/// [`SetError::Malformed`] for any other content.
pub fn recordings_from_npz(file: &str, bytes: &[u8]) -> Result<Vec<SourceRecording>, SetError> {
    let npz = Npz::from_bytes(file, bytes)?;
    let malformed =
        || SetError::malformed(file, "expected the arrays clip, sha256 and frames as skiagraph writes them");
    let texts = |name: &str| names(&npz, name).ok_or_else(malformed);
    let (clips, hashes) = (texts("clip")?, texts("sha256")?);
    let Some(Values::I64(frames)) = npz.get("frames").map(|array| &array.values) else { return Err(malformed()) };
    let frames = frames.as_chunks::<2>().0;
    if clips.len() != hashes.len() || clips.len() != frames.len() {
        return Err(malformed());
    }
    let number = |frame: i64| match frame {
        i64::MAX => Ok(usize::MAX),
        frame => usize::try_from(frame).ok().filter(|f| (1..1 << 40).contains(f)).ok_or_else(malformed),
    };
    let fingerprints = read_fingerprints(file, &npz, clips.len())?;
    let all = clips.iter().zip(hashes).zip(frames).zip(fingerprints);
    let recordings = all.map(|(((clip, hash), [first, last]), fingerprint)| {
        Ok(SourceRecording {
            clip: clip.clone(),
            sha256: Some(hash.clone()).filter(|hash| !hash.is_empty()),
            first_frame: number(*first)?,
            last_frame: number(*last)?,
            fingerprint,
        })
    });
    recordings.collect()
}

/// Adds `fingerprint`, `fingerprint_rows` and `fingerprint_version`, with the fingerprints concatenated.
pub fn push_fingerprints<'a>(npz: &mut Npz, fingerprints: impl Iterator<Item = Option<&'a MotionFingerprint>> + Clone) {
    let rows: Vec<i64> = fingerprints.clone().map(|f| f.map_or(0, |f| f.rows.len() as i64)).collect();
    let values: Vec<f32> = fingerprints.flatten().flat_map(|f| f.rows.as_flattened().iter().copied()).collect();
    npz.push("fingerprint_version", Array::new(&[], vec![VERSION]));
    npz.push("fingerprint_rows", Array::new(&[rows.len()], rows));
    npz.push("fingerprint", Array::new(&[values.len() / FINGERPRINT_DISTANCES, FINGERPRINT_DISTANCES], values));
}

/// The fingerprints of `count` recordings; all `None` if the file has none, or has another version.
///
/// # Errors
/// [`SetError::Malformed`] if the sizes of the arrays are inconsistent.
pub fn read_fingerprints(file: &str, npz: &Npz, count: usize) -> Result<Vec<Option<MotionFingerprint>>, SetError> {
    let malformed = || SetError::malformed(file, "the fingerprints of its recordings have inconsistent sizes");
    let values = |name: &str| npz.get(name).map(|array| &array.values);
    match values("fingerprint_version") {
        Some(Values::I64(version)) if *version == [VERSION] => {}
        Some(Values::I64(_)) => return Ok(vec![None; count]),
        None if values("fingerprint").is_none() && values("fingerprint_rows").is_none() => {
            return Ok(vec![None; count]);
        }
        _ => return Err(malformed()),
    }
    let (Some(Values::I64(lengths)), Some(Values::F32(numbers))) = (values("fingerprint_rows"), values("fingerprint"))
    else {
        return Err(malformed());
    };
    let mut rows = numbers.as_chunks::<FINGERPRINT_DISTANCES>().0;
    let mut fingerprints = Vec::new();
    for length in lengths {
        let length = usize::try_from(*length).ok().filter(|n| *n <= rows.len()).ok_or_else(malformed)?;
        let (own, rest) = rows.split_at(length);
        rows = rest;
        fingerprints.push((length > 0).then(|| MotionFingerprint { rows: own.to_vec() }));
    }
    let whole = rows.is_empty() && fingerprints.len() == count && numbers.iter().all(|n| n.is_finite());
    if whole { Ok(fingerprints) } else { Err(malformed()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of a path through the space of distances.
    fn path(first: usize, frames: usize) -> MotionFingerprint {
        let row = |t: usize| std::array::from_fn(|i| (0.05 * (first + t) as f32 * (1.0 + 0.13 * i as f32)).sin());
        MotionFingerprint { rows: (0..frames).map(row).collect() }
    }

    fn part(clip: &str, first_frame: usize, last_frame: usize) -> SourceRecording {
        SourceRecording { clip: clip.to_owned(), sha256: None, first_frame, last_frame, fingerprint: None }
    }

    #[test]
    fn recordings_are_read_back_unchanged() {
        let all = [
            SourceRecording { fingerprint: Some(path(0, 7)), ..part("épaule.bvh", 3, 9) },
            part("old.amc", 1, usize::MAX),
            SourceRecording { sha256: Some("ab".repeat(32)), fingerprint: Some(path(9, 2)), ..part("b.txt", 1, 2) },
        ];
        let bytes = recordings_to_npz("x", &all).unwrap();
        assert_eq!(recordings_from_npz("x", &bytes).unwrap(), all);
        for broken in ["clip", "frames", "fingerprint", "fingerprint_version"] {
            let npz = Npz::from_bytes("x", &bytes).unwrap();
            let names = ["clip", "sha256", "frames", "fingerprint_version", "fingerprint_rows", "fingerprint"];
            let without = names.into_iter().filter(|n| *n != broken).map(|n| (n, npz.get(n).unwrap().clone()));
            let bytes = Npz::from_iter(without).to_bytes("x").unwrap();
            assert!(recordings_from_npz("x", &bytes).is_err(), "{broken}");
        }
    }

    #[test]
    fn parts_of_one_file_share_frames_with_the_same_numbers_and_parts_of_two_files_do_not() {
        let test = part("a/walk.bvh", 100, 200);
        assert_eq!(part("walk.bvh", 150, usize::MAX).shared_frames(&test), Some((150, 200)));
        assert_eq!(part("walk.bvh", 1, 100).shared_frames(&test), Some((100, 100)));
        assert_eq!(part("walk.bvh", 1, 99).shared_frames(&test), None);
        assert_eq!(part("run.bvh", 1, 500).shared_frames(&test), None);
        let with = |clip: &str, hash: &str| SourceRecording { sha256: Some(hash.to_owned()), ..part(clip, 1, 500) };
        assert_eq!(with("walk.bvh", "aa").shared_frames(&with("copy.bvh", "AA")), Some((1, 500)), "a renamed copy");
        assert_eq!(with("walk.bvh", "aa").shared_frames(&with("walk.bvh", "bb")), None);
    }

    #[test]
    fn frames_are_identified_by_their_content_in_any_file_with_any_numbers() {
        let test = SourceRecording { fingerprint: Some(path(100, 101)), ..part("walk.bvh", 100, 200) };
        let copy = SourceRecording { fingerprint: Some(path(150, 90)), ..part("renumbered.bvh", 1, 90) };
        assert_eq!(copy.shared_frames(&test), Some((1, 51)));
        let after = SourceRecording { fingerprint: Some(path(201, 90)), ..part("after.bvh", 1, 90) };
        assert_eq!(after.shared_frames(&test), None);
    }

    #[test]
    fn fingerprints_of_another_version_are_none() {
        let npz = Npz::from_iter([("fingerprint_version", Array::new(&[], vec![2_i64]))]);
        assert_eq!(read_fingerprints("x", &npz, 2).unwrap(), [None, None]);
        assert_eq!(read_fingerprints("x", &Npz::default(), 1).unwrap(), [None]);
    }
}
