//! Compares beginnings of contact with heel strikes that were labelled in the recordings themselves.
//!
//! The labelling rule, after Ghoussayni et al. (2004, Gait and Posture 20: speed of the foot below a threshold), uses
//! only the recorded ankle joint (`lfoot`, `rfoot` in the skeleton's file): a heel strike is the first frame after a
//! swing in which the ankle's speed, a central difference over one frame either way at 120 Hz, is below 0.5 m/s. The
//! heel stops when it strikes, and the ankle then turns about it at 0.2 to 0.5 m/s while the sole comes down. Every
//! label was checked against the heights of ankle and ball: at each, the ball is past its highest point and the ankle
//! within 20 mm of its lowest. The rule depends on neither the ground, nor the body's solids, nor the retargeting.

use skiagraph_core::body::shipped;
use skiagraph_core::contact::{ContactRule, GroundContacts};
use skiagraph_truth::mocap::{ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, retarget};

/// Clip; frames of the left and of the right foot's heel strikes, from 0 at 120 Hz, without those of the first 50 ms.
const LABELS: [(&str, [&[usize]; 2]); 2] =
    [("49_01", [&[99, 264, 428, 594], &[8, 182, 346, 509]]), ("16_15", [&[136, 278, 417], &[64, 203, 344]])];
/// A beginning of contact further than this from a heel strike does not match it, frames at 120 Hz: 50 ms.
const TOLERANCE: usize = 6;

#[test]
fn contact_begins_where_the_heel_strikes() {
    let Some(folder) = crate::support::test_data("mocap/cmu_asf_amc") else { return };
    let (mut hits, mut missed, mut extra, mut lags) = (0, 0, 0, Vec::new());
    for (clip, labels) in LABELS {
        let recording = read(&folder.join(format!("{clip}.amc")), &ReadOptions::default()).unwrap();
        let walk = retarget(&recording, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap();
        let found = GroundContacts::from_motion(&walk.humanoid, &walk.motion, &ContactRule::default()).unwrap();
        for (foot, labels) in found.feet.iter().zip(labels) {
            let begins: Vec<usize> = foot.stances().iter().map(|s| s.start).filter(|f| *f >= TOLERANCE).collect();
            let near = |a: usize, b: usize| a.abs_diff(b) <= TOLERANCE;
            let of_label = |label: &usize| begins.iter().find(|begin| near(**begin, *label));
            lags.extend(labels.iter().filter_map(|l| of_label(l).map(|b| *b as f64 - *l as f64)));
            hits += labels.iter().filter(|l| of_label(l).is_some()).count();
            missed += labels.iter().filter(|l| of_label(l).is_none()).count();
            extra += begins.iter().filter(|b| !labels.iter().any(|l| near(**b, *l))).count();
            println!("{clip} {}: labelled {labels:?}, found {begins:?}", foot.name);
        }
    }
    let f1 = 2.0 * hits as f64 / (2 * hits + missed + extra) as f64;
    let lag = 1000.0 / 120.0 * lags.iter().sum::<f64>() / lags.len() as f64;
    println!(
        "{hits} hits, {missed} missed, {extra} extra: F1 {f1:.3}; contact begins {lag:.0} ms after the label on average"
    );
    assert!(f1 >= 0.95, "{f1}");
}
