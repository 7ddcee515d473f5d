//! Checks `truth/recording.npz`: the fingerprints that identify frames of the test in training data.
//!
//! A fingerprint is made from the recording, which sets do not contain. But the actor performs the recording, so the
//! distances between landmarks of the truth are close to a row of it, even if the motion was joined, repeated, mirrored
//! or sped up.

use super::parts::ReadParts;
use super::{CheckOutcome, Fault};
use crate::files::SetFiles;
use crate::parallel;
use crate::recording_file::{self, PATH};
use crate::retarget::MotionFingerprint;
use crate::{ContactFacts, SourceRecording};

/// Tolerance of the median distance from the nearest row, leg lengths: retargeting, foot planting and variations change
/// the motion.
const TOLERANCE: f32 = 0.1;

/// Greatest number of true frames that are compared.
const SAMPLED_FRAMES: usize = 100;

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let truth = parts.truth.as_ref().ok_or("not checked: the truth cannot be read")?;
    let facts = parts.facts.as_ref();
    if !files.has(PATH) {
        let was_recorded = facts.is_some_and(|facts| facts.retargeting.is_some());
        let detail = "is missing, but according to facts.toml the motion was recorded; without it, models that learned \
                      from the test cannot be detected";
        let faults = was_recorded.then(|| Fault::new(PATH, detail)).into_iter().collect();
        return Ok(("the set has no recording".to_owned(), faults));
    }
    let bytes = files.read(PATH).map_err(|_| format!("not checked: {PATH} cannot be read"))?;
    let recordings =
        recording_file::from_npz(PATH, &bytes).map_err(|_| format!("not checked: {PATH} cannot be read"))?;
    let mut details: Vec<String> = recordings.iter().filter_map(wrong_rows).collect();
    let rows = recordings.iter().filter_map(|recording| recording.fingerprint.as_ref()).flat_map(|own| &own.rows);
    let all = MotionFingerprint { rows: rows.copied().collect() };
    // a body that fell no longer follows the recording
    let simulation =
        facts.and_then(|facts| facts.contact.as_ref()).and_then(|ContactFacts { simulation, .. }| simulation.as_ref());
    let fell = simulation.and_then(|simulation| simulation.fell_at_frame).unwrap_or(usize::MAX);
    let frames = truth.frames.len().min(fell.max(1));
    let step = frames.div_ceil(SAMPLED_FRAMES).max(1);
    let apart = parallel::map(frames.div_ceil(step), |index| all.nearest(&truth.frames[index * step].markers));
    let mut apart: Vec<f32> = apart.into_iter().flatten().collect();
    apart.sort_by(f32::total_cmp);
    if let Some(middle) = apart.get(apart.len() / 2).filter(|middle| **middle > TOLERANCE || middle.is_nan()) {
        details.push(format!(
            "fingerprint: in half of {} frames the distances between the actor's landmarks are {middle:.3} leg lengths or \
             more from every row; expected at most {TOLERANCE}: it belongs to another motion, so models that learned \
             from the test cannot be detected",
            apart.len()
        ));
    }
    let faults = details.into_iter().map(|detail| Fault::new(PATH, detail)).collect();
    Ok((format!("{} recordings, {} rows of fingerprints", recordings.len(), all.rows.len()), faults))
}

/// A fingerprint whose rows do not match the frames of its recording.
fn wrong_rows(recording: &SourceRecording) -> Option<String> {
    let SourceRecording { first_frame, last_frame, .. } = *recording;
    let name = recording.describe();
    let Some(fingerprint) = &recording.fingerprint else {
        return Some(format!("{name:?} has no fingerprint, so its frames cannot be identified by content"));
    };
    let expected = last_frame.checked_sub(first_frame).and_then(|more| more.checked_add(1));
    let rows = fingerprint.rows.len();
    (last_frame != usize::MAX && expected != Some(rows))
        .then(|| format!("{name:?} has {rows} rows of fingerprints, which does not match its frames"))
}
