//! The actor at its zero pose: units, axes, left and right.

use nalgebra::{Point3, Vector3};

use super::parts::ReadParts;
use super::{CheckOutcome, Fault};
use crate::body::{Humanoid, LANDMARKS, Landmark, LinkFrames, Markers};
use crate::truth_file::ACTOR_PATH;

/// Range of heights from the ankles to the top of the head, metres: from a small child to more than any human.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.4..=2.8;

/// Markers of the left side with their counterparts.
const SIDES: [(Landmark, Landmark); 6] = [
    (Landmark::LeftShoulder, Landmark::RightShoulder),
    (Landmark::LeftElbow, Landmark::RightElbow),
    (Landmark::LeftWrist, Landmark::RightWrist),
    (Landmark::LeftHip, Landmark::RightHip),
    (Landmark::LeftKnee, Landmark::RightKnee),
    (Landmark::LeftAnkle, Landmark::RightAnkle),
];

pub(super) fn check(parts: &ReadParts) -> CheckOutcome {
    let truth = parts.truth.as_ref().ok_or("not checked: the truth cannot be read")?;
    let actor = &truth.actor;
    let frames = actor.link_frames(&actor.zero_pose());
    let markers = actor.markers(&frames);
    let mut faults = Vec::new();
    faults.extend(height_fault(&markers));
    faults.extend(side_faults(actor, &markers));
    faults.extend(handedness_fault(actor, &frames, &markers));
    let faults = faults.into_iter().map(|detail| Fault::new(ACTOR_PATH, detail)).collect();
    Ok((format!("{} links, {} markers", actor.links.len(), markers.iter().flatten().count()), faults))
}

fn place(markers: &Markers, landmark: Landmark) -> Option<Point3<f64>> {
    markers[landmark as usize]
}

fn ankles(markers: &Markers) -> Option<Point3<f64>> {
    Some(nalgebra::center(&place(markers, Landmark::LeftAnkle)?, &place(markers, Landmark::RightAnkle)?))
}

fn height_fault(markers: &Markers) -> Option<String> {
    let height = (place(markers, Landmark::HeadTop)? - ankles(markers)?).norm();
    let unit = [(1000.0, "millimetres"), (100.0, "centimetres"), (39.37, "inches")]
        .into_iter()
        .find(|(factor, _)| (1.0..2.2).contains(&(height / factor)));
    let guess = unit.map(|(_, unit)| format!("; its lengths look like {unit}")).unwrap_or_default();
    (!HEIGHTS_M.contains(&height)).then(|| {
        format!(
            "the actor measures {height:.3} m from ankles to head; expected {} to {} m{guess}",
            HEIGHTS_M.start(),
            HEIGHTS_M.end()
        )
    })
}

/// Markers on a link whose name has the other side.
fn side_faults(actor: &Humanoid, markers: &Markers) -> Vec<String> {
    let mut faults = Vec::new();
    for (landmark, marker) in LANDMARKS.iter().zip(&actor.markers) {
        let Some(link) = marker.map(|marker| actor.links[marker.link].name.to_lowercase()) else { continue };
        let (name, has) = (landmark.name(), |word: &str| link.contains(word));
        let crossed = (name.starts_with("left") && has("right") && !has("left"))
            || (name.starts_with("right") && has("left") && !has("right"));
        if crossed {
            faults.push(format!("marker {name} is on link {link:?}: left and right are exchanged"));
        }
    }
    let across = |(left, right): (Landmark, Landmark)| Some(place(markers, left)? - place(markers, right)?);
    let Some(hips) = across((Landmark::LeftHip, Landmark::RightHip)) else { return faults };
    for (left, right) in SIDES {
        if across((left, right)).is_some_and(|across| across.dot(&hips) < 0.0) {
            let (left, right) = (left.name(), right.name());
            faults.push(format!("{left} and {right} are on the opposite sides to the hips at the zero pose"));
        }
    }
    faults
}

/// Feet point forward; with up and forward known, the side of the left hip distinguishes a body from its mirror image.
fn handedness_fault(actor: &Humanoid, frames: &LinkFrames, markers: &Markers) -> Option<String> {
    let left = place(markers, Landmark::LeftHip)? - place(markers, Landmark::RightHip)?;
    let up = place(markers, Landmark::HeadTop)? - ankles(markers)?;
    let feet = actor.foot_links().into_iter().zip([Landmark::LeftAnkle, Landmark::RightAnkle]);
    let forward: Vec<Vector3<f64>> = feet
        .filter_map(|(links, ankle)| {
            let middles: Vec<Vector3<f64>> = links
                .iter()
                .flat_map(|link| actor.links[*link].solids.iter().map(move |solid| (*link, solid)))
                .filter_map(|(link, solid)| Some((frames[link] * solid.middle()?).coords))
                .collect();
            let middle = middles.iter().sum::<Vector3<f64>>() / middles.len().max(1) as f64;
            (!middles.is_empty()).then(|| middle - place(markers, ankle).unwrap_or_default().coords)
        })
        .collect();
    let forward = forward.iter().sum::<Vector3<f64>>();
    let expected = left.cross(&up);
    // a foot that is part of the shank, or has no clear direction, is not conclusive
    let cosine = forward.dot(&expected) / (forward.norm() * expected.norm());
    let is_foot = forward.norm() > 0.02 && cosine.abs() > 0.3;
    (is_foot && cosine < 0.0).then(|| {
        "the feet point backwards for this left, right and up: the body is mirrored, or left and right are exchanged"
            .to_owned()
    })
}
