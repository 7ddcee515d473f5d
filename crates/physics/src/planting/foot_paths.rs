//! Offsets of each foot, frame by frame, that keep it still in stance and above the ground.

use nalgebra::Vector3;

use skiagraph_core::body::LinkFrames;
use skiagraph_core::contact::{ContactTrack, GroundTrackInput, Stance, stances};

/// Time in which the rate of a foot's offset decays after lift-off, seconds.
const RATES_DIE_OUT_S: f64 = 0.05;

/// Offsets of one foot from its current path, world, metres, one per frame, such that it is still in all frames in
/// which the moved foot counts as standing.
///
/// A foot that is held up to the last frame of its recorded stance starts its flight later and ends it earlier than
/// the recorded foot: in some frames around the stance it is so low and slow that it counts as standing, and skates.
/// It is therefore held in these frames too: the stance is widened by one window of speeds on each side and relabelled
/// until stable. Because the recorded foot is faster further from the stance, this adds few frames.
pub(super) fn planted(clip: &GroundTrackInput<'_>, track: &ContactTrack) -> Vec<Vector3<f64>> {
    let mut held: Vec<bool> = track.frames.iter().map(|frame| frame.in_contact).collect();
    loop {
        let offsets = offsets(track, &stances(&held), clip);
        let frames: Vec<LinkFrames> =
            clip.frames.iter().zip(&offsets).map(|(frames, offset)| moved(frames, &track.links, offset)).collect();
        let Some(planned) = (GroundTrackInput { frames: &frames, ..*clip }).track(&track.name, track.links.clone())
        else {
            return offsets;
        };
        let before = held.clone();
        for stance in planned.stances() {
            held[stance.start.saturating_sub(1)..(stance.end + 1).min(before.len())].fill(true);
        }
        if held == before {
            return offsets;
        }
    }
}

/// Offsets of one foot that hold it in its recorded stances only: skating around them is left to the subsequent
/// simulation, and feet that are held longer swing faster.
pub(crate) fn planted_in_recorded_stances(clip: &GroundTrackInput<'_>, track: &ContactTrack) -> Vec<Vector3<f64>> {
    offsets(track, &track.stances(), clip)
}

fn moved(frames: &LinkFrames, links: &[usize], by: &Vector3<f64>) -> LinkFrames {
    let mut moved = frames.clone();
    links.iter().for_each(|&link| moved.0[link].translation.vector += by);
    moved
}

/// Offsets of one foot that hold it in these stances.
///
/// In a stance the foot keeps its orientation, and its offset is such that the material at its lowest point does not
/// move: it stands, or rolls without slipping, with its lowest point at z = 0; its free position on the ground is the
/// nearest to its recorded mean. Between two stances a smooth step joins the offsets, whose rates decay within 0.05 s
/// of the recording; the foot is raised wherever it would sink.
fn offsets(track: &ContactTrack, stances: &[Stance], clip: &GroundTrackInput<'_>) -> Vec<Vector3<f64>> {
    let frames = clip.frames;
    let mut offsets = vec![Vector3::zeros(); frames.len()];
    for stance in stances {
        plant(track, frames, stance, &mut offsets[stance.clone()]);
    }
    for pair in stances.windows(2) {
        let rates = [slope(&pair[0], true), slope(&pair[1], false)];
        let reach = RATES_DIE_OUT_S * clip.frames_per_second / clip.pace.at(pair[0].end - 1);
        join(&mut offsets, pair[0].end - 1, pair[1].start, rates, reach);
    }
    if let (Some(first), Some(last)) = (stances.first(), stances.last()) {
        let (before, after) = (offsets[first.start], offsets[last.end - 1]);
        offsets[..first.start].fill(before);
        offsets[last.end..].fill(after);
    }
    for (frame, offset) in offsets.iter_mut().enumerate() {
        offset.z = offset.z.max(-track.frames[frame].gap_m);
    }
    offsets
}

fn plant(track: &ContactTrack, frames: &[LinkFrames], stance: &Stance, offsets: &mut [Vector3<f64>]) {
    let slide = |frame: usize, of: usize| {
        let contact = &track.frames[of];
        let in_link = frames[of][contact.link].inverse_transform_point(&contact.point);
        frames[frame + 1][contact.link] * in_link - frames[frame][contact.link] * in_link
    };
    for (i, frame) in stance.clone().enumerate() {
        if i > 0 {
            let slid = (slide(frame - 1, frame - 1) + slide(frame - 1, frame)) * 0.5;
            offsets[i] = offsets[i - 1] - slid;
        }
    }
    let mean = offsets.iter().sum::<Vector3<f64>>() / offsets.len() as f64;
    for (offset, frame) in offsets.iter_mut().zip(stance.clone()) {
        *offset -= mean;
        offset.z = -track.frames[frame].gap_m;
    }
}

/// The two frames of a stance that determine its offset's rate at its end or its beginning.
fn slope(stance: &Stance, at_end: bool) -> [usize; 2] {
    if at_end {
        [(stance.end - 1).saturating_sub(1).max(stance.start), stance.end - 1]
    } else {
        [stance.start, (stance.start + 1).min(stance.end - 1)]
    }
}

/// Joins two offsets, `from` and `to` frames: a smooth step plus the rates at both ends (change per frame), which
/// decay within `reach` frames so that they do not carry the foot away.
fn join(offsets: &mut [Vector3<f64>], from: usize, to: usize, rates: [[usize; 2]; 2], reach: f64) {
    let span = (to - from) as f64;
    let reach = reach.min(span);
    let [leaving, arriving] = rates.map(|[a, b]| offsets[b] - offsets[a]);
    let (start, end) = (offsets[from], offsets[to]);
    // rises at rate 1, and returns smoothly to 0 after `reach` frames
    let decaying = |frames: f64| frames * (1.0 - (frames / reach).min(1.0)) * (1.0 - (frames / reach).min(1.0));
    for (i, offset) in offsets[from + 1..to].iter_mut().enumerate() {
        let after = (i + 1) as f64;
        let t = after / span;
        *offset = start + (end - start) * (t * t * (3.0 - 2.0 * t)) + leaving * decaying(after)
            - arriving * decaying(span - after);
    }
}
