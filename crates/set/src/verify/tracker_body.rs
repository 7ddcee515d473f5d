//! Checks the tracker's body: the actor's own, or one with other lengths and girths.

use super::Fault;
use super::parts::ReadParts;
use crate::body::{Humanoid, Link, Solid, shipped};
use crate::start_file::{self, Start};

/// Relative tolerance of girths.
const TOLERANCE: f64 = 1e-9;

/// Least distance of a centre of mass from the link's frame for measuring how much longer the link is, metres.
const LEAST_ARM_M: f64 = 5e-3;

pub(super) fn fault(parts: &ReadParts, start: &Start) -> Option<Fault> {
    let (facts, truth) = (parts.facts.as_ref()?, parts.truth.as_ref()?);
    let detail = match (facts.matched, start.body.is_same_body(&truth.actor)) {
        (true, false) => Some("according to facts.toml it is the actor's own body, but it differs".to_owned()),
        (false, true) => {
            Some("according to facts.toml it differs from the actor's body, but it is the same".to_owned())
        }
        (true, true) => None,
        (false, false) => {
            let origin = if facts.is_of_one_robot() {
                Some(truth.actor.clone())
            } else {
                facts.trackers_robot().and_then(|name| shipped(name).ok())
            };
            origin.and_then(|origin| no_reshaping(&origin, &start.body))
        }
    };
    detail.map(|detail| Fault::new(start_file::BODY_PATH, detail))
}

/// Why `body` does not follow from `origin` by other lengths and girths: all radii of a link must change by the same
/// factor, its girth, and its mass by its length and its girth squared.
fn no_reshaping(origin: &Humanoid, body: &Humanoid) -> Option<String> {
    if !origin.links.iter().map(|link| &link.name).eq(body.links.iter().map(|link| &link.name)) {
        return Some(format!("its links are not those of the robot {:?}", origin.name));
    }
    // a skin changes the solids below it and their masses
    let skins = [origin, body].map(|body| body.skin.as_ref().map(|skin| &skin.name));
    if skins[0] != skins[1] {
        return None;
    }
    origin.links.iter().zip(&body.links).find_map(|(from, to)| wrong_link(from, to, skins[0].is_some()))
}

fn wrong_link(from: &Link, to: &Link, has_skin: bool) -> Option<String> {
    let name = &to.name;
    if from.solids.len() != to.solids.len() {
        return Some(format!("link {name:?} has {} solids, expected {}", to.solids.len(), from.solids.len()));
    }
    let mut factors = from.solids.iter().zip(&to.solids).flat_map(|(a, b)| radii(b).into_iter().zip(radii(a)));
    let (radius, before) = factors.find(|(_, before)| *before > 0.0)?;
    let girth = radius / before;
    if let Some((radius, before)) = factors.find(|(a, b)| (a - girth * b).abs() > TOLERANCE * a.abs().max(*b)) {
        return Some(format!(
            "link {name:?} is {girth:.6} times as thick by one radius and {:.6} times by another",
            radius / before
        ));
    }
    let (from, to) = from.inertia.as_ref().zip(to.inertia.as_ref()).filter(|_| !has_skin)?;
    let (arm_before, arm) = (from.centre_of_mass.coords.norm(), to.centre_of_mass.coords.norm());
    let expected = from.mass * girth * girth * arm / arm_before;
    let is_off = arm_before > LEAST_ARM_M && (to.mass - expected).abs() > 1e-6 * expected;
    is_off.then(|| {
        format!(
            "link {name:?} is {girth:.6} times as thick and {:.6} times as long, so its mass must be {expected:.6} kg; it is {:.6} kg",
            arm / arm_before,
            to.mass
        )
    })
}

/// The lengths that scale with the girth.
fn radii(solid: &Solid) -> Vec<f64> {
    match solid {
        Solid::TaperedCapsule(capsule) => vec![capsule.radius_a, capsule.radius_b],
        Solid::Cylinder { radius, .. } => vec![*radius],
        Solid::Box { .. } | Solid::Mesh { .. } => Vec::new(),
    }
}
