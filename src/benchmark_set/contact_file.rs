//! `truth/contact.npz`: contact of the actor, for T frames, K links with flesh, P pairs of them. Absent for an actor whose feet
//! have no geometry.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `gap` | (T, K) | signed height of the link's lowest point above z = 0, m |
//! | `point`, `velocity` | (T, K, 3) | that point, m, and the velocity of the material there, m/s |
//! | `in_contact` | (T, K) | whether it stands, by the thresholds of `rule` |
//! | `foot_gap`, `foot_point`, `foot_velocity`, `foot_in_contact` | (T, 2, ...) | the same of the left and the right foot |
//! | `self_depth` | (T, P) | depth by which two links are inside each other, m; 0 apart |
//!
//! `link_names` (K) and `pair_names` (P, "one two") name the columns, `left_out_names` the pairs that are not looked at because
//! they are adjacent or touch in the bind pose; `rule` holds m, m/s, m, m/s, s, s as `rule_names` says.

use rayon::prelude::*;

use super::{Array, Npz};
use crate::body::LinkFrames;
use crate::contact::{ContactRule, ContactTrack, GroundContacts, LinkPair, SelfCollision};
use crate::scene::GroundTruth;

pub(super) const PATH: &str = "truth/contact.npz";

/// The arrays; `None` for an actor without feet.
pub(super) fn to_npz(truth: &GroundTruth) -> Option<Npz> {
    let rule = ContactRule::default();
    let frames: Vec<LinkFrames> = truth.frames.iter().map(|frame| frame.link_frames.clone()).collect();
    let actor = &truth.actor;
    let contacts = GroundContacts::of_frames(actor, actor, &frames, truth.frames_per_second, &rule).ok()?;
    let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![truth.frames_per_second]))]);
    push_tracks(&mut npz, "", &contacts.links);
    push_tracks(&mut npz, "foot_", &contacts.feet);
    npz.push("link_names", Array::names(contacts.links.iter().map(|track| track.name.as_str())));
    let own = SelfCollision::new(actor);
    let depths: Vec<Vec<f64>> = frames.par_iter().map(|frames| own.depths_m(frames)).collect();
    npz.push("self_depth", Array::new(&[frames.len(), own.pairs().len()], depths.concat()));
    let names = |pair: LinkPair| own.names(pair).join(" ");
    let pairs: Vec<String> = own.pairs().iter().map(|&pair| names(pair)).collect();
    let left_out: Vec<String> = own.left_out().iter().map(|&(pair, _)| names(pair)).collect();
    npz.push("pair_names", Array::names(pairs.iter().map(String::as_str)));
    npz.push("left_out_names", Array::names(left_out.iter().map(String::as_str)));
    let rule = [
        ("enter_gap_m", rule.enter_gap_m),
        ("enter_speed_m_per_s", rule.enter_speed_m_per_s),
        ("leave_gap_m", rule.leave_gap_m),
        ("leave_speed_m_per_s", rule.leave_speed_m_per_s),
        ("speed_window_s", rule.speed_window_s),
        ("shortest_s", rule.shortest_s),
    ];
    npz.push("rule", Array::new(&[rule.len()], rule.map(|(_, value)| value).to_vec()));
    npz.push("rule_names", Array::names(rule.map(|(name, _)| name)));
    Some(npz)
}

fn push_tracks(npz: &mut Npz, prefix: &str, tracks: &[ContactTrack]) {
    let frames = tracks.first().map_or(0, |track| track.frames.len());
    let all = || (0..frames).flat_map(move |frame| tracks.iter().map(move |track| &track.frames[frame]));
    let (plain, vector) = ([frames, tracks.len()], [frames, tracks.len(), 3]);
    let name = |what: &str| format!("{prefix}{what}");
    npz.push(&name("gap"), Array::new(&plain, all().map(|c| c.gap_m).collect::<Vec<_>>()));
    let points: Vec<f64> = all().flat_map(|c| [c.point.x, c.point.y, c.point.z]).collect();
    npz.push(&name("point"), Array::new(&vector, points));
    let velocities: Vec<f64> = all().flat_map(|c| [c.velocity.x, c.velocity.y, c.velocity.z]).collect();
    npz.push(&name("velocity"), Array::new(&vector, velocities));
    npz.push(&name("in_contact"), Array::new(&plain, all().map(|c| c.in_contact).collect::<Vec<_>>()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark_set::fixture::small_set;
    use crate::contact::GroundContacts;

    #[test]
    fn the_file_holds_what_contact_says_of_the_truth() {
        let truth = small_set(3).unwrap().truth.ground_truth;
        let npz = to_npz(&truth).unwrap();
        let contacts = GroundContacts::of_motion(&truth.actor, &truth.motion(), &ContactRule::default()).unwrap();
        let links = contacts.links.len();
        let gaps = npz.f64s(PATH, "gap", &[Some(3), Some(links)]).unwrap();
        assert_eq!(gaps[links + 2], contacts.links[2].frames[1].gap_m);
        let velocities = npz.f64s(PATH, "foot_velocity", &[Some(3), Some(2), Some(3)]).unwrap();
        assert_eq!(velocities[6 + 3], contacts.feet[1].frames[1].velocity.x);
        assert_eq!(npz.bools(PATH, "foot_in_contact", &[Some(3), Some(2)]).unwrap().len(), 6);
        let bytes = npz.to_bytes(PATH).unwrap();
        assert_eq!(Npz::from_bytes(PATH, &bytes).unwrap(), npz);
    }

    #[test]
    fn an_actor_without_feet_has_no_contact_file() {
        let mut truth = small_set(1).unwrap().truth.ground_truth;
        truth.actor.markers = [None; 15];
        assert!(to_npz(&truth).is_none());
    }
}
