//! Where the ground is: where feet rest, or z = 0 of the file.

use std::ops::Range;

use super::{Judgement, lowest, place};
use crate::retarget::Ground;
use crate::retarget::anatomy::SubjectFrame;
use skiagraph_core::body::Landmark;

/// Which ground a motion stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GroundChoice {
    /// Height 0 of the file.
    File,
    /// Beneath the soles of the feet.
    Feet,
}

/// A foot rests if its ankle stays within this height, metres, for [`REACH`] seconds on either side. The top of a
/// flight has it too, but is not the lowest place of the feet.
const REST: f64 = 0.015;
const REACH: f64 = 0.05;
/// Feet that rest at heights farther apart than this stand on stairs, or on a platform: less is a raised heel, metres.
const ONE_LEVEL: f64 = 0.15;
/// Height of the ankle above the sole, metres.
const ANKLE: f64 = 0.08;
/// Share of the rests on the lowest level that make it the ground.
const MOSTLY: f64 = 0.25;
/// The lower ankle is at most this far above its height at rest while the foot rolls on the ground, metres.
const TOUCHES: f64 = 0.05;
/// The body may be this far below height 0 of a file whose height 0 is the ground, metres.
const BELOW: f64 = 0.1;

/// Finds the ground in all frames of the subject, of which `used` are used.
pub(super) fn find(
    subject: &[SubjectFrame],
    used: Range<usize>,
    rate: f64,
    choice: Option<GroundChoice>,
    judgement: &mut Judgement,
) {
    if let Some(choice) = choice {
        judgement.ground = if choice == GroundChoice::File { Ground::Recorded } else { Ground::Feet };
        return;
    }
    let rests = rests(subject, rate);
    let lows: Vec<f64> = subject.iter().map(lowest).collect();
    let low = super::quantile(lows.iter().copied(), 0.05);
    let is_above_zero = low > -BELOW;
    let heights = |share: f64| super::quantile(rests.iter().copied(), share);
    if rests.is_empty() {
        // runners and dancers touch the ground again and again, who flies or falls does not
        if flies(subject) && is_above_zero {
            judgement.ground = Ground::Recorded;
            judgement.note(
                "no foot rests in the recording, the body is in the air: height 0 of the file is the ground; set `ground = \
                 \"feet\"` of `[motion]` to put the feet on it"
                    .to_owned(),
            );
        }
        return;
    }
    let (lower, upper) = (heights(0.1) - ANKLE, heights(0.9) - ANKLE);
    let level = heights(0.2);
    let at_lowest = rests.iter().filter(|ankle| **ankle < lower + ANKLE + ONE_LEVEL).count();
    // feet on a stool now and then: soles and file agree
    let agree = lower.abs() < BELOW && at_lowest as f64 > MOSTLY * rests.len() as f64;
    if upper - lower > ONE_LEVEL && !agree || low < lower - ONE_LEVEL {
        if is_above_zero {
            judgement.ground = Ground::Recorded;
        } else {
            judgement.ground = Ground::BelowAnkles(low.min(lower) + ANKLE);
        }
        judgement.note(format!(
            "feet rest {lower:.2} to {upper:.2} m high, and the body reaches down to {low:.2} m: the ground is {}; set \
             `ground` of `[motion]` to \"file\" or \"feet\" to override",
            if is_above_zero { "height 0 of the file" } else { "where the body is lowest" }
        ));
        return;
    }
    if !subject[used].iter().any(|frame| lower_ankle(frame) < level + TOUCHES) {
        judgement.ground = Ground::BelowAnkles(level);
        judgement.note(
            "no foot is on the ground in the frames used: the ground is where feet rest in the other frames of the file"
                .to_owned(),
        );
    }
}

/// Heights of the lower ankle in the frames in which it rests and nothing is much lower.
fn rests(subject: &[SubjectFrame], rate: f64) -> Vec<f64> {
    let reach = (libm::round(REACH * rate) as usize).max(1);
    let mut found = Vec::new();
    for frame in reach..subject.len().saturating_sub(reach) {
        let height = |frame: &SubjectFrame, ankle: Landmark| place(frame, ankle).z;
        let own = &subject[frame];
        // frames of markers that are not used repeat the nearest one
        if own.markers == subject[frame - 1].markers {
            continue;
        }
        let side = if height(own, Landmark::LeftAnkle) < height(own, Landmark::RightAnkle) {
            Landmark::LeftAnkle
        } else {
            Landmark::RightAnkle
        };
        let around = subject[frame - reach..=frame + reach].iter().map(|frame| height(frame, side));
        let [least, most] = around.fold([f64::MAX, f64::MIN], |[least, most], z| [least.min(z), most.max(z)]);
        let ankle = height(own, side);
        if most - least < REST && lowest(own) > ankle - ONE_LEVEL {
            found.push(ankle);
        }
    }
    found
}

fn lower_ankle(frame: &SubjectFrame) -> f64 {
    place(frame, Landmark::LeftAnkle).z.min(place(frame, Landmark::RightAnkle).z)
}

/// Whether the body is in the air: the lower foot rises or falls, and never comes down to its lowest level and up
/// again.
fn flies(subject: &[SubjectFrame]) -> bool {
    let lows: Vec<f64> = subject.iter().map(lower_ankle).collect();
    let [lowest, highest] = lows.iter().fold([f64::MAX, f64::MIN], |[low, high], z| [low.min(*z), high.max(*z)]);
    let touches = |w: &[f64]| w[1] < w[0] && w[1] < w[2] && w[1] < lowest + ONE_LEVEL;
    highest - lowest > ONE_LEVEL && !lows.windows(3).any(touches)
}
