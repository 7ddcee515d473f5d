//! Judges whether a recording can be the motion of a human body, before it becomes the truth.
//!
//! The body tells by itself which way is up, which side is left, how long its bones are, how fast time runs and where
//! the ground is. What no body can do is refused with the key that mends it; what is rare is noted. Every limit has
//! room for cartwheels, handstands, falls, crawling and the noise of markers: `scenarios/README.md` has the table.

mod bones;
mod floor;
mod gliding;
mod pace;
mod sides;
mod up;

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Vector3;

use super::anatomy::{Anatomy, SubjectFrame};
use super::residuals::OUT_OF_REACH;
use super::{Ground, RetargetError, RetargetReport};
use crate::mocap::{Clip, UpAxis, UpSource};
use skiagraph_core::body::Landmark;

pub use floor::GroundChoice;

/// What the judgement looks at, in words.
pub const JUDGED: &str = "up, sides, bones, pace, fit and ground";

/// How the note of an implausible recording that is used begins.
pub const ACCEPTED: &str = "implausible, accepted by `accept_implausible`: ";

/// Something that is rare, or that no body can do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Whether no body can do it.
    pub is_refusal: bool,
    /// The number, the limit, what explains it and what to do.
    pub text: String,
}

impl Finding {
    /// The note for a recording that is used all the same.
    pub fn note(&self) -> String {
        let accepted = if self.is_refusal { ACCEPTED } else { "" };
        format!("{accepted}{}", self.text)
    }
}

/// The judgement of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Everything that was found.
    pub findings: Vec<Finding>,
    /// Where the ground of the motion is.
    pub ground: Ground,
}

impl Judgement {
    /// The first reason to refuse the recording.
    pub fn refusal(&self) -> Option<&str> {
        self.findings.iter().find(|finding| finding.is_refusal).map(|finding| finding.text.as_str())
    }

    /// Everything that was found, for a recording that is used all the same.
    pub fn notes(&self) -> Vec<String> {
        self.findings.iter().map(Finding::note).collect()
    }

    fn refuse(&mut self, text: String) {
        self.find(true, text);
    }

    fn note(&mut self, text: String) {
        self.find(false, text);
    }

    fn find(&mut self, is_refusal: bool, text: String) {
        self.findings.push(Finding { is_refusal, text });
    }
}

/// The clip with its head up, with a note, if nobody said which axis of the file points up and the body is clear about
/// it. `landmarks` is that of [`super::RetargetOptions`].
#[must_use]
pub fn upright(clip: Clip, landmarks: &BTreeMap<String, String>) -> Clip {
    if clip.up.1 != UpSource::Guess {
        return clip;
    }
    let Ok((_, subject)) = subject_of(&clip, landmarks) else { return clip };
    let Some(found) = up::wrong_up(&clip, &subject) else { return clip };
    let (guessed, axis) = (clip.up.0.name(), found.axis.name());
    let mut clip = clip.with_up(found.axis, UpSource::Guess);
    clip.notes.push(format!("up axis: {axis} after all, not {guessed}, because {}; set `up` to override", found.why));
    clip
}

/// Judges the frames `used` of a recording; its ground is looked for in all frames.
pub fn judge(
    clip: &Clip,
    used: Range<usize>,
    landmarks: &BTreeMap<String, String>,
    ground: Option<GroundChoice>,
) -> Result<Judgement, RetargetError> {
    let (anatomy, all) = subject_of(clip, landmarks)?;
    let mut judgement = Judgement { findings: Vec::new(), ground: Ground::Feet };
    let end = used.end.min(all.len());
    let used = used.start.min(end)..end;
    let subject = &all[used.clone()];
    // no file is guessed to be upside down but by its body
    let is_turned = matches!(clip.up, (UpAxis::MinusY | UpAxis::MinusZ, UpSource::Guess));
    let unusual = anatomy.notes().iter().find(|note| note.starts_with("unusual") && note.contains(", "));
    if let Some(unusual) = unusual.filter(|_| is_turned) {
        let found = "its head is above its feet only if the file is turned upside down";
        judgement
            .refuse(format!("{found}, and it has {unusual}: an animal? If it is a person, set `up` of `[motion]`"));
    }
    if clip.up.1 != UpSource::User {
        up::judge(clip, subject, &mut judgement);
    }
    sides::judge(subject, &anatomy.joint_map(&clip.skeleton), &mut judgement);
    bones::judge(subject, &mut judgement);
    pace::judge(subject, clip.frames_per_second, &mut judgement);
    gliding::judge(subject, &mut judgement);
    pace::judge_still_frames(&clip.frames[used.clone()], clip.frames_per_second, &mut judgement);
    floor::find(&all, used, clip.frames_per_second, ground, &mut judgement);
    Ok(judgement)
}

/// A body that misses the recording in more frames than this is noted, or refused.
const NOTED_OUT_OF_REACH: f64 = 0.1;
const MOST_OUT_OF_REACH: f64 = 0.5;
/// Mean height of the lowest points of the feet, metres, below which the body is in the ground.
const MOST_SUNKEN: f64 = -0.15;

/// Judges how a body performs a recording on a ground. What another robot than a human one cannot do is never
/// refused.
pub fn judge_fit(report: &RetargetReport, ground: Ground, is_human: bool) -> Option<Finding> {
    let share = report.out_of_reach;
    if report.mean_residual_mm.is_nan() {
        let text =
            "joints are in one point, in some frames: leave these out by `first_frame` and `last_frame` of `[motion]`";
        return Some(Finding { is_refusal: true, text: text.to_owned() });
    }
    if share > NOTED_OUT_OF_REACH {
        let is_refusal = is_human && share > MOST_OUT_OF_REACH;
        let limit = if is_refusal { MOST_OUT_OF_REACH } else { NOTED_OUT_OF_REACH };
        let text = format!(
            "in {:.0} % of the frames (limit {:.0} %) the joint limits keep a landmark of the body more than {:.0} mm from its recorded \
             place: joints bend as none can, left and right are wrong (`sides` of `[motion]`), or joints are not what its \
             `joint_map` says",
            100.0 * share,
            100.0 * limit,
            1000.0 * OUT_OF_REACH
        );
        return Some(Finding { is_refusal, text });
    }
    let sunken = report.foot_height.filter(|height| height.mean_mm < 1000.0 * MOST_SUNKEN)?;
    let other = if ground == Ground::Feet { "file" } else { "feet" };
    let text = format!(
        "the feet are {:.0} mm below the ground on average (limit {:.0} mm): set `ground = \"{other}\"` of `[motion]`; if that \
         is refused too, the feet keep no level: use a part in which they do, by `first_frame` and `last_frame`",
        -sunken.mean_mm,
        -1000.0 * MOST_SUNKEN
    );
    Some(Finding { is_refusal: true, text })
}

fn subject_of(
    clip: &Clip,
    landmarks: &BTreeMap<String, String>,
) -> Result<(Anatomy, Vec<SubjectFrame>), RetargetError> {
    let anatomy = Anatomy::from_clip(clip, landmarks)?;
    let subject = (0..clip.frames.len()).map(|frame| anatomy.observe(clip, frame)).collect();
    Ok((anatomy, subject))
}

/// Position of a landmark, metres. Every recording with a body has all of them.
fn place(frame: &SubjectFrame, landmark: Landmark) -> Vector3<f64> {
    frame.markers[landmark as usize].map_or(Vector3::zeros(), |place| place.coords)
}

/// The middle of both ankles.
fn feet(frame: &SubjectFrame) -> Vector3<f64> {
    0.5 * (place(frame, Landmark::LeftAnkle) + place(frame, Landmark::RightAnkle))
}

/// Height of the lowest landmark.
fn lowest(frame: &SubjectFrame) -> f64 {
    frame.markers.iter().flatten().map(|place| place.z).fold(f64::INFINITY, f64::min)
}

fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    super::quantile(values.collect(), share).unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
