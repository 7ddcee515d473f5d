//! Dynamics against closed forms.

use approx::assert_relative_eq;
use nalgebra::Point2;

use super::*;
use crate::contact::ContactRule;
use crate::dynamics::GRAVITY;
use crate::test_bodies::standing;

#[test]
fn a_standing_person_needs_only_ground_forces() {
    let (body, motion) = standing(5);
    let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default()).unwrap();
    let found = Dynamics::from_motion(&body, &motion, &contacts, 0.8).unwrap();
    for frame in &found.frames {
        let point = frame.zero_moment_point.unwrap();
        assert!((point - frame.centre_of_mass.xy()).norm() < 1e-9, "at rest it is below the centre of mass");
        assert!(frame.support.len() >= 4 && frame.margin_m.unwrap() > 0.01, "{frame:?}");
        assert!(frame.residual < 1e-3, "{}", frame.residual);
        assert_eq!(frame.violations, [0, 0]);
    }
    let summary = found.summary();
    assert!(summary.outside == 0.0 && summary.greatest_effort_per_kg < 1.5, "{summary:?}");
}

/// A rigid body with constant acceleration: the zero-moment point lags by `a h / g` behind the centre of mass.
#[test]
fn the_zero_moment_point_of_an_accelerating_body_lags_as_in_the_cart_table_model() {
    let (body, mut motion) = standing(13);
    let speeding_up = 2.0;
    for (frame, pose) in motion.poses.iter_mut().enumerate() {
        let time = frame as f64 / 60.0;
        pose.world_from_root.translation.x += 0.5 * speeding_up * time * time;
    }
    let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default()).unwrap();
    let found = Dynamics::from_motion(&body, &motion, &contacts, 0.8).unwrap();
    let frame = &found.frames[6];
    let centre = frame.centre_of_mass;
    let expected = Point2::new(centre.x - speeding_up * centre.z / GRAVITY, centre.y);
    assert!((frame.zero_moment_point.unwrap() - expected).norm() < 1e-6, "{frame:?}");
    assert_relative_eq!(found.mass, body.total_mass());
}

/// Recordings float slightly above the ground, and feet that strike the ground touch it before they stand.
#[test]
fn slightly_floating_and_sliding_bodies_are_supported() {
    let (body, still) = standing(13);
    let (mut high, mut sliding) = (still.clone(), still);
    high.poses.iter_mut().for_each(|pose| pose.world_from_root.translation.z += 0.015);
    for (frame, pose) in sliding.poses.iter_mut().enumerate() {
        pose.world_from_root.translation.x += 2.0 * frame as f64 / 60.0;
    }
    for (motion, stands) in [(high, true), (sliding, false)] {
        let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default()).unwrap();
        assert_eq!(contacts.feet[0].frames[6].in_contact, stands);
        let frame = Dynamics::from_motion(&body, &motion, &contacts, 0.8).unwrap().frames[6].clone();
        assert!(frame.residual < 1e-3 && frame.margin_m.unwrap() > 0.01, "{frame:?}");
    }
}

#[test]
fn a_floating_body_has_no_support() {
    let (body, mut motion) = standing(5);
    motion.poses.iter_mut().for_each(|pose| pose.world_from_root.translation.z += 0.5);
    let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default()).unwrap();
    let found = Dynamics::from_motion(&body, &motion, &contacts, 0.8).unwrap();
    for frame in &found.frames {
        assert_relative_eq!(frame.residual, 1.0, max_relative = 1e-9);
        assert!(frame.margin_m.is_none() && frame.support.is_empty());
    }
}
