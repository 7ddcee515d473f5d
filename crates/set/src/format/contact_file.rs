//! `truth/contact.npz`: contact of the actor, for T frames, K links with geometry, P pairs of them. Absent if the
//! actor's feet have no geometry.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `gap` | (T, K) | signed height of the link's lowest point above z = 0, m |
//! | `point`, `velocity` | (T, K, 3) | that point, m, and the velocity of the material there, m/s |
//! | `in_contact` | (T, K) | whether it is in contact, by the thresholds of `rule` |
//! | `foot_gap`, `foot_point`, `foot_velocity`, `foot_in_contact` | (T, 2, ...) | the same for the left and the right foot |
//! | `self_depth` | (T, P) | penetration depth of two links, m; 0 if they are apart |
//!
//! `link_names` (K) and `pair_names` (P, "one two") name the columns, `left_out_names` the pairs that are not checked
//! because they are adjacent or touch in the bind pose; `rule` holds the values named in `rule_names` (m, m/s, m, m/s,
//! s, s).
//!
//! In scenes with Q props (`truth/props.json`) also:
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `prop_gap` | (T, Q, K) | signed distance between prop and link, m, negative inside; infinite if far away (see [`PropContact`]) |
//! | `prop_point`, `prop_slip` | (T, Q, K, 3) | the link's nearest or deepest point, m, NaN far away; its velocity along the prop, m/s |
//! | `prop_in_contact` | (T, Q, K) | whether it touches, by the thresholds of `rule` |
//! | `prop_names` | (Q) | |

use skiagraph_core::body::LinkFrames;
use skiagraph_core::contact::{
    ContactRule, ContactTrack, GroundContacts, LinkPair, PropContact, PropContacts, SelfCollision,
};
use skiagraph_core::npz::{Array, Npz};
use skiagraph_core::parallel;
use skiagraph_truth::scene::GroundTruth;

pub(crate) const PATH: &str = "truth/contact.npz";

/// The arrays; `None` for an actor without feet.
pub(crate) fn to_npz(truth: &GroundTruth) -> Option<Npz> {
    let rule = ContactRule::default();
    let frames: Vec<LinkFrames> = truth.frames.iter().map(|frame| frame.link_frames.clone()).collect();
    let actor = &truth.actor;
    let contacts = GroundContacts::from_frames(actor, &frames, truth.frames_per_second, &rule).ok()?;
    let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![truth.frames_per_second]))]);
    push_tracks(&mut npz, "", &contacts.links);
    push_tracks(&mut npz, "foot_", &contacts.feet);
    npz.push("link_names", Array::names(contacts.links.iter().map(|track| track.name.as_str())));
    let own = SelfCollision::new(actor);
    let depths = parallel::map(frames.len(), |frame| own.depths_m(&frames[frame]));
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
    push_props(&mut npz, truth, &frames);
    Some(npz)
}

/// Arrays that earlier versions also wrote, about balance and forces.
const GONE: &str = "centre_of_mass zmp zmp_is_defined zmp_margin zmp_margin_is_defined support support_count \
                    residual_wrench effort dof_names beyond_limits too_fast mass friction";

/// Whether a file is `expected` with the arrays of earlier versions.
pub(crate) fn is_of_earlier_version(found: &[u8], expected: &[u8]) -> bool {
    let Ok(found) = Npz::from_bytes(PATH, found) else { return false };
    let mut kept = Npz::default();
    for (name, array) in found.iter().filter(|(name, _)| GONE.split(' ').all(|gone| gone != *name)) {
        kept.push(name, array.clone());
    }
    kept.to_bytes(PATH).is_ok_and(|bytes| bytes == expected)
}

fn push_props(npz: &mut Npz, truth: &GroundTruth, frames: &[LinkFrames]) {
    let (rule, props) = (ContactRule::default(), truth.props.len());
    if props == 0 {
        return;
    }
    let found = PropContacts::from_frames(&truth.actor, &truth.props, frames, truth.frames_per_second, &rule);
    let Ok(found) = found else { return };
    let (count, links) = (frames.len(), found.tracks.len() / props);
    let all = || (0..count).flat_map(|frame| found.tracks.iter().map(move |track| &track.frames[frame]));
    let shape = [count, props, links];
    let vectors = |of: fn(&PropContact) -> [f64; 3]| {
        Array::new(&[count, props, links, 3], all().flat_map(of).collect::<Vec<_>>())
    };
    npz.push("prop_gap", Array::new(&shape, all().map(|c| c.gap_m).collect::<Vec<_>>()));
    npz.push("prop_point", vectors(|c| c.point.coords.into()));
    npz.push("prop_slip", vectors(|c| c.slip.into()));
    npz.push("prop_in_contact", Array::new(&shape, all().map(|c| c.in_contact).collect::<Vec<_>>()));
    npz.push("prop_names", Array::names(truth.props.iter().map(|prop| prop.name.as_str())));
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
    use crate::fixture::small_set;
    use skiagraph_core::contact::GroundContacts;

    #[test]
    fn the_file_holds_the_contact_of_the_truth() {
        let truth = small_set(3).unwrap().truth.ground_truth;
        let npz = to_npz(&truth).unwrap();
        let contacts = GroundContacts::from_motion(&truth.actor, &truth.motion(), &ContactRule::default()).unwrap();
        let links = contacts.links.len();
        let gaps = npz.f64s(PATH, "gap", &[Some(3), Some(links)]).unwrap();
        assert_eq!(gaps[links + 2], contacts.links[2].frames[1].gap_m);
        let velocities = npz.f64s(PATH, "foot_velocity", &[Some(3), Some(2), Some(3)]).unwrap();
        assert_eq!(velocities[6 + 3], contacts.feet[1].frames[1].velocity.x);
        assert_eq!(npz.bools(PATH, "foot_in_contact", &[Some(3), Some(2)]).unwrap().len(), 6);
        let bytes = npz.to_bytes(PATH).unwrap();
        // NaN is not equal to itself: the bytes are compared
        assert_eq!(Npz::from_bytes(PATH, &bytes).unwrap().to_bytes(PATH).unwrap(), bytes);
    }

    #[test]
    fn arrays_of_earlier_versions_are_known() {
        let truth = small_set(3).unwrap().truth.ground_truth;
        let expected = to_npz(&truth).unwrap();
        let with = |name: &str| {
            let mut npz = expected.clone();
            npz.push(name, Array::new(&[], vec![70.0]));
            npz.to_bytes(PATH).unwrap()
        };
        let bytes = expected.to_bytes(PATH).unwrap();
        assert!(is_of_earlier_version(&with("mass"), &bytes));
        assert!(!is_of_earlier_version(&with("anything"), &bytes));
    }
}
