//! What a robot's file says that no robot can be: parts in millimetres, limits in degrees.

use core::f64::consts::PI;

use skiagraph_core::body::{BoundingBall, DegreeOfFreedom, Humanoid, JointKind};
use skiagraph_core::input::plain;

/// A link this many times as large as the body, from joint to joint, is in another unit.
const LARGEST_PART: f64 = 3.0;
/// No hinge turns by more than two turns; a limit of at most two turns in degrees is one in degrees. What is larger
/// stands for no limit.
const LIMIT_RAD: f64 = 4.0 * PI;
const LIMIT_DEG: f64 = 720.0;

pub(crate) fn doubts(body: &Humanoid) -> Vec<String> {
    large_part(body).into_iter().chain(limits_in_degrees(body)).collect()
}

fn large_part(body: &Humanoid) -> Option<String> {
    let frames = body.link_frames(&body.zero_pose());
    let mut size = 0.0_f64;
    for a in &frames.0 {
        for b in &frames.0 {
            size = size.max((a.translation.vector - b.translation.vector).norm());
        }
    }
    let across = body.links.iter().map(|link| (2.0 * BoundingBall::around(&link.solids).radius, &link.name));
    let large: Vec<(f64, &String)> = across.filter(|(across, _)| *across > LARGEST_PART * size.max(0.1)).collect();
    let (across, link) = large.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let others = if large.len() > 1 { format!(", and {} more", large.len() - 1) } else { String::new() };
    Some(format!(
        "link `{}`{others}: its geometry is {across:.1} m across, {:.0} times the body from joint to joint ({size:.2} m): in \
         millimetres? Give its <mesh> scale=\"0.001 0.001 0.001\"",
        plain(link),
        across / size.max(1e-3)
    ))
}

fn limits_in_degrees(body: &Humanoid) -> Option<String> {
    let mut hinges = Vec::new();
    for joint in &body.joints {
        if let JointKind::Revolute { drive, .. } = &joint.kind {
            hinges.extend(body.degrees_of_freedom.get(drive.degree_of_freedom));
        }
    }
    let is_in_degrees = |hinge: &&&DegreeOfFreedom| {
        let most = hinge.lower.abs().max(hinge.upper.abs());
        most > LIMIT_RAD && most <= LIMIT_DEG
    };
    let first = hinges.iter().find(is_in_degrees)?;
    let count = hinges.iter().filter(is_in_degrees).count();
    Some(format!(
        "joint `{}`: its limits are {} to {} rad, more than two turns, as those of {count} of {} hinges: in degrees? A URDF has \
         radians: {:.4} to {:.4}",
        plain(&first.name),
        first.lower,
        first.upper,
        hinges.len(),
        first.lower.to_radians(),
        first.upper.to_radians()
    ))
}

#[cfg(test)]
mod tests {
    use skiagraph_core::body::{Solid, shipped};

    use super::*;

    // A camera of 6 cm in millimetres was drawn 60 m large, and limits of 149 were no limits.
    #[test]
    fn parts_in_millimetres_and_limits_in_degrees_are_noted() {
        let mut body = shipped("actor").unwrap();
        assert_eq!(doubts(&body), Vec::<String>::new());
        let head = body.find_link("head").unwrap();
        body.links[head].solids =
            vec![Solid::Box { link_from_box: nalgebra::Isometry3::identity(), half_extents: [30.0, 5.0, 5.0] }];
        let knee = body.find_degree_of_freedom("left_knee_flexion").unwrap();
        body.degrees_of_freedom[knee].upper = 149.0;
        let notes = doubts(&body);
        assert!(notes[0].contains("link `head`: its geometry is 61.6 m across"), "{notes:?}");
        assert!(notes[1].contains("limits are") && notes[1].contains("in degrees?"), "{notes:?}");
    }
}
