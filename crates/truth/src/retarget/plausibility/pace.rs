//! How fast time runs: nobody runs or steps faster than sprinters, and steps follow each other evenly.

use nalgebra::{Isometry3, Vector3};

use super::{Judgement, place, quantile};
use crate::retarget::anatomy::SubjectFrame;
use skiagraph_core::body::Landmark as L;

/// Speed of the pelvis, m/s: the fastest sprinter reached 12.4 (`[Graubner 2011]`).
const FASTEST_RUN: f64 = 13.0;
/// Acceleration of the pelvis, m/s2, over [`REACH`] on either side, seconds; less is the noise of markers. Who drops
/// 1.3 m and stops within 0.05 s has 110.
const HARDEST_PUSH: f64 = 140.0;
const REACH: f64 = 0.05;
/// Strides a second, at which legs of this share of their length change places: the fastest sprinters reach 2.5
/// (`[Salo 2011]`).
const FASTEST_STRIDES: f64 = 2.6;
const LEAST_STRIDE: f64 = 0.25;
/// A movement this many times as long as those before and after it, which are nearly equal, skips a row.
const SKIPS: f64 = 1.6;
const NEARLY_EQUAL: f64 = 1.25;
/// Shorter movements are noise, metres.
const LEAST_STEP: f64 = 0.002;
/// Shares of the frames in which limits are exceeded; fewer frames than this are an error with a note of its own.
const NOTED: f64 = 0.02;
const MOST: f64 = 0.08;
const LEAST_FRAMES: usize = 3;
/// Rates of less are those of time-lapse pictures, Hz.
const LEAST_RATE: f64 = 2.0;
/// Equal frames for longer are noted, seconds: people tremble.
const LONGEST_STILL: f64 = 0.5;

/// Refuses a recording whose time runs too fast or hardly at all. `rate` is its own.
pub(super) fn judge(subject: &[SubjectFrame], rate: f64, judgement: &mut Judgement) {
    let remedy = format!(
        "the file's {rate:.4} frames a second may be wrong, rows be missing, or rows be of several people: set `source_hz` of \
         `[motion]` to the rate at which it was recorded"
    );
    if rate < LEAST_RATE {
        judgement.refuse(format!(
            "it has less than {LEAST_RATE} frames a second, as with times in milliseconds, or with the time between frames \
             as the rate: {remedy}"
        ));
        return;
    }
    if let Some(found) = strides(subject, rate).filter(|found| *found > FASTEST_STRIDES) {
        judgement.refuse(format!("the legs make {found:.1} strides a second (limit {FASTEST_STRIDES}): {remedy}"));
    }
    let pelvis: Vec<Vector3<f64>> = subject.iter().map(|frame| place(frame, L::Pelvis)).collect();
    let runs = pelvis.windows(2).filter(|pair| (pair[1] - pair[0]).norm() * rate > FASTEST_RUN).count();
    let reach = (libm::round(REACH * rate) as usize).max(1);
    let seconds = reach as f64 / rate;
    let is_pushed =
        |w: &&[Vector3<f64>]| (w[0] + w[2 * reach] - 2.0 * w[reach]).norm() > HARDEST_PUSH * seconds * seconds;
    let pushes = pelvis.windows(2 * reach + 1).filter(is_pushed).count();
    let steps: Vec<f64> = subject.windows(2).map(|pair| mean_step(&pair[0], &pair[1])).collect();
    let is_skip = |w: &&[f64]| {
        let (short, long) = (w[0].min(w[2]), w[0].max(w[2]));
        short > LEAST_STEP && long < NEARLY_EQUAL * short && w[1] > SKIPS * long
    };
    let skips = steps.windows(3).filter(is_skip).count();
    let kinds = [
        (runs, format!("the pelvis moves faster than {FASTEST_RUN} m/s, which no runner reaches,"), remedy.as_str()),
        (pushes, format!("the pelvis is accelerated with more than {HARDEST_PUSH} m/s2"), &remedy),
        (
            skips,
            "the body moves twice as far as before and after".to_owned(),
            "rows are missing; export it with all rows",
        ),
    ];
    for (count, what, remedy) in kinds {
        let share = count as f64 / subject.len().max(1) as f64;
        let limit = if share > MOST { MOST } else { NOTED };
        if count >= LEAST_FRAMES && share > limit {
            let (found, limit) = (100.0 * share, 100.0 * limit);
            judgement
                .find(share > MOST, format!("{what} in {found:.0} % of the frames (limit {limit:.0} %): {remedy}"));
        }
    }
}

/// Mean movement of the landmarks from one frame to the next, metres.
fn mean_step(before: &SubjectFrame, after: &SubjectFrame) -> f64 {
    let moved = before.markers.iter().zip(&after.markers).filter_map(|(a, b)| Some((b.as_ref()? - a.as_ref()?).norm()));
    moved.sum::<f64>() / before.markers.len() as f64
}

/// Strides a second by the time in which the legs change places; `None` without two such times, as in one kick.
fn strides(subject: &[SubjectFrame], rate: f64) -> Option<f64> {
    let mut changes = Vec::new();
    let mut front: Option<bool> = None;
    for (index, frame) in subject.iter().enumerate() {
        let left = place(frame, L::LeftHip) - place(frame, L::RightHip);
        let forward = left.cross(&Vector3::z()).try_normalize(1e-6)?;
        let leg = (place(frame, L::LeftHip) - place(frame, L::LeftAnkle)).norm();
        let apart = (place(frame, L::LeftAnkle) - place(frame, L::RightAnkle)).dot(&forward);
        if apart.abs() < LEAST_STRIDE * leg || front == Some(apart > 0.0) {
            continue;
        }
        if front.replace(apart > 0.0).is_some() {
            changes.push(index as f64 / rate);
        }
    }
    // noise of markers changes places again and again between two strides
    (changes.len() > 2).then(|| 0.5 / quantile(changes.windows(2).map(|pair| pair[1] - pair[0]), 0.75))
}

/// Notes frames that are exactly equal for long, in a recording that moves otherwise.
pub(super) fn judge_still_frames(frames: &[Vec<Isometry3<f64>>], rate: f64, judgement: &mut Judgement) {
    let mut start = 1;
    for run in frames.chunk_by(|one, next| one == next).map(<[_]>::len) {
        let seconds = (run - 1) as f64 / rate;
        if run < frames.len() && seconds > LONGEST_STILL {
            judgement.note(format!(
                "{run} used frames from number {start} on are exactly equal ({seconds:.1} s, limit {LONGEST_STILL} s): the body \
                 was lost, or an animator held it"
            ));
            return;
        }
        start += run;
    }
}
