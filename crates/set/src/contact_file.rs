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
//!
//! For an actor with mass also, with D degrees of freedom (definitions in [`Dynamics`]):
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `centre_of_mass` | (T, 3) | m |
//! | `zmp`, `zmp_is_defined` | (T, 2), (T) | zero-moment point on the ground, m; (0, 0) in flight, where it is undefined |
//! | `zmp_margin`, `zmp_margin_is_defined` | (T) | distance from it to the border of the support polygon, m, negative outside; 0 if undefined |
//! | `support`, `support_count` | (T, V, 2), (T) | the support polygon's corners, anticlockwise, m, padded with NaN; their number |
//! | `residual_wrench` | (T) | part of the root wrench that no ground force within friction cones of `friction` explains, body weights |
//! | `effort` | (T, D) | effort of every degree of freedom of `dof_names`, N m or N |
//! | `beyond_limits`, `too_fast` | (T) | number of degrees of freedom beyond their position limits, and beyond their velocity limits |
//! | `mass` | () | mass of the actor, kg |

use crate::body::LinkFrames;
use crate::contact::{ContactRule, ContactTrack, GroundContacts, LinkPair, PropContact, PropContacts, SelfCollision};
use crate::dynamics::{Dynamics, DynamicsFrame, GROUND_FRICTION};
use crate::npz::{Array, Npz};
use crate::parallel;
use crate::scene::GroundTruth;

pub(super) const PATH: &str = "truth/contact.npz";

/// The arrays; `None` for an actor without feet.
pub(super) fn to_npz(truth: &GroundTruth) -> Option<Npz> {
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
    if let Ok(dynamics) = Dynamics::from_motion(actor, &truth.motion(), &contacts, GROUND_FRICTION) {
        push_dynamics(&mut npz, truth, &dynamics);
    }
    Some(npz)
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

fn push_dynamics(npz: &mut Npz, truth: &GroundTruth, dynamics: &Dynamics) {
    let frames = &dynamics.frames;
    let (count, dofs) = (frames.len(), truth.actor.degrees_of_freedom.len());
    let centres: Vec<f64> =
        frames.iter().flat_map(|f| [f.centre_of_mass.x, f.centre_of_mass.y, f.centre_of_mass.z]).collect();
    npz.push("centre_of_mass", Array::new(&[count, 3], centres));
    let points = frames.iter().map(|f| f.zero_moment_point.map_or([0.0; 2], |point| [point.x, point.y]));
    npz.push("zmp", Array::new(&[count, 2], points.flatten().collect::<Vec<_>>()));
    let defined: Vec<bool> = frames.iter().map(|f| f.zero_moment_point.is_some()).collect();
    npz.push("zmp_is_defined", Array::new(&[count], defined));
    npz.push("zmp_margin", Array::new(&[count], frames.iter().map(|f| f.margin_m.unwrap_or(0.0)).collect::<Vec<_>>()));
    let defined: Vec<bool> = frames.iter().map(|f| f.margin_m.is_some()).collect();
    npz.push("zmp_margin_is_defined", Array::new(&[count], defined));
    let corners = frames.iter().map(|f| f.support.len()).max().unwrap_or(0);
    let padded = |f: &DynamicsFrame| {
        let mut row = vec![f64::NAN; 2 * corners];
        row.chunks_exact_mut(2)
            .zip(&f.support)
            .for_each(|(place, point)| place.copy_from_slice(point.coords.as_slice()));
        row
    };
    npz.push("support", Array::new(&[count, corners, 2], frames.iter().flat_map(padded).collect::<Vec<_>>()));
    npz.push("support_count", Array::new(&[count], frames.iter().map(|f| f.support.len() as i64).collect::<Vec<_>>()));
    npz.push("residual_wrench", Array::new(&[count], frames.iter().map(|f| f.residual).collect::<Vec<_>>()));
    let efforts: Vec<f64> = frames.iter().flat_map(|f| f.efforts.iter().copied()).collect();
    npz.push("effort", Array::new(&[count, dofs], efforts));
    npz.push("dof_names", Array::names(truth.actor.degrees_of_freedom.iter().map(|dof| dof.name.as_str())));
    for (name, kind) in [("beyond_limits", 0), ("too_fast", 1)] {
        let counts: Vec<i64> = frames.iter().map(|f| f.violations[kind] as i64).collect();
        npz.push(name, Array::new(&[count], counts));
    }
    npz.push("mass", Array::new(&[], vec![dynamics.mass]));
    npz.push("friction", Array::new(&[], vec![GROUND_FRICTION]));
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
    use nalgebra::Point3;

    use crate::body::Inertia;
    use crate::contact::GroundContacts;
    use crate::fixture::small_set;
    use crate::npz::Values;

    #[test]
    fn the_file_holds_the_contact_of_the_truth() {
        let mut truth = small_set(3).unwrap().truth.ground_truth;
        assert!(
            to_npz(&truth).unwrap().f64s(PATH, "effort", &[None, None]).is_err(),
            "a body without mass has no dynamics"
        );
        let (mass, tensor) = (7.0, nalgebra::Matrix3::from_diagonal_element(0.1));
        truth.actor.links[0].inertia = Some(Inertia { mass, centre_of_mass: Point3::origin(), tensor });
        let npz = to_npz(&truth).unwrap();
        let contacts = GroundContacts::from_motion(&truth.actor, &truth.motion(), &ContactRule::default()).unwrap();
        let links = contacts.links.len();
        let gaps = npz.f64s(PATH, "gap", &[Some(3), Some(links)]).unwrap();
        assert_eq!(gaps[links + 2], contacts.links[2].frames[1].gap_m);
        let velocities = npz.f64s(PATH, "foot_velocity", &[Some(3), Some(2), Some(3)]).unwrap();
        assert_eq!(velocities[6 + 3], contacts.feet[1].frames[1].velocity.x);
        assert_eq!(npz.bools(PATH, "foot_in_contact", &[Some(3), Some(2)]).unwrap().len(), 6);
        let dynamics = Dynamics::from_motion(&truth.actor, &truth.motion(), &contacts, GROUND_FRICTION).unwrap();
        let residuals = npz.f64s(PATH, "residual_wrench", &[Some(3)]).unwrap();
        assert_eq!(residuals[1], dynamics.frames[1].residual);
        let dofs = truth.actor.degrees_of_freedom.len();
        assert_eq!(npz.f64s(PATH, "effort", &[Some(3), Some(dofs)]).unwrap()[dofs], dynamics.frames[1].efforts[0]);
        assert_eq!(npz.f64s(PATH, "mass", &[]).unwrap(), [dynamics.mass]);
        for name in ["beyond_limits", "too_fast"] {
            let Some(Array { values: Values::I64(counts), .. }) = npz.get(name) else { panic!("{name}") };
            assert_eq!(counts.len(), 3);
        }
        let Some(Array { values: Values::I64(counts), .. }) = npz.get("support_count") else { panic!("support_count") };
        let most = counts.iter().copied().max().unwrap() as usize;
        let corners = npz.f64s(PATH, "support", &[Some(3), Some(most), Some(2)]).unwrap();
        for (frame, expected) in dynamics.frames.iter().enumerate() {
            assert_eq!(counts[frame], expected.support.len() as i64);
            let row = &corners[2 * most * frame..2 * most * (frame + 1)];
            let (held, empty) = row.split_at(2 * expected.support.len());
            assert!(held.iter().copied().eq(expected.support.iter().flat_map(|point| [point.x, point.y])));
            assert!(empty.iter().all(|x| x.is_nan()));
        }
        let bytes = npz.to_bytes(PATH).unwrap();
        // NaN is not equal to itself: the bytes are compared
        assert_eq!(Npz::from_bytes(PATH, &bytes).unwrap().to_bytes(PATH).unwrap(), bytes);
    }

    #[test]
    fn an_actor_without_feet_has_no_contact_file() {
        let mut truth = small_set(1).unwrap().truth.ground_truth;
        truth.actor.markers = [None; 15];
        assert!(to_npz(&truth).is_none());
    }
}
