//! `[motion] start_m` and `heading_deg`: where a motion begins, and the body's heading there.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::scenario::MotionSettings;
use skiagraph_core::body::{Humanoid, Motion};

/// Turns a motion of `body` about the vertical and moves it over the ground, so that its first frame has the place and
/// heading of the settings. Without these settings the motion keeps all its bits.
///
/// # Errors
/// A message if a heading is set and the body is upside down in the first frame.
pub(crate) fn place(body: &Humanoid, motion: &mut Motion, settings: &MotionSettings) -> Result<(), String> {
    let Some(first) = motion.poses.first() else { return Ok(()) };
    let was = first.world_from_root.translation.vector;
    let turn = match settings.heading_deg {
        None => UnitQuaternion::identity(),
        Some(wanted) => {
            let heading =
                body.heading(first).ok_or("expected a heading in the first frame, found the body upside down")?;
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wanted.to_radians() - heading)
        }
    };
    if settings.start_m.is_none() && settings.heading_deg.is_none() {
        return Ok(());
    }
    let [x, y] = settings.start_m.unwrap_or([was.x, was.y]);
    let (there, back) = (Vector3::new(x, y, 0.0), Vector3::new(-was.x, -was.y, 0.0));
    let world_from_recorded = Isometry3::from_parts((there + turn * back).into(), turn);
    for pose in &mut motion.poses {
        pose.world_from_root = world_from_recorded * pose.world_from_root;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};

    fn settings(start_m: Option<[f64; 2]>, heading_deg: Option<f64>) -> MotionSettings {
        MotionSettings { start_m, heading_deg, ..MotionSettings::from_clip("a.bvh") }
    }

    fn placed(settings: &MotionSettings) -> Motion {
        let mut motion = walk(20);
        place(&person(), &mut motion, settings).unwrap();
        motion
    }

    #[test]
    fn the_first_frame_has_the_place_and_heading_of_the_settings_and_the_rest_follows() {
        let motion = placed(&settings(Some([2.0, -1.5]), Some(120.0)));
        let first = &motion.poses[0];
        assert!((first.world_from_root.translation.vector.xy() - nalgebra::Vector2::new(2.0, -1.5)).norm() < 1e-12);
        assert!((first.heading().unwrap().to_degrees() - 120.0).abs() < 1e-9);
        for (pose, was) in motion.poses.iter().zip(&walk(20).poses) {
            let relative = |p: &skiagraph_core::body::Pose, q: &skiagraph_core::body::Pose| {
                q.world_from_root.inv_mul(&p.world_from_root)
            };
            let (now, before) = (relative(pose, first), relative(was, &walk(20).poses[0]));
            assert!((now.translation.vector - before.translation.vector).norm() < 1e-12);
            assert!((pose.world_from_root.translation.z - was.world_from_root.translation.z).abs() < 1e-12);
            assert_eq!(pose.joint_angles, was.joint_angles);
        }
    }

    #[test]
    fn each_setting_alone_keeps_the_other_as_recorded() {
        let was = walk(20).poses[0].clone();
        let moved = placed(&settings(Some([0.5, 0.25]), None));
        assert!((moved.poses[0].heading().unwrap() - was.heading().unwrap()).abs() < 1e-12);
        let turned = placed(&settings(None, Some(-90.0)));
        let at = |p: &skiagraph_core::body::Pose| p.world_from_root.translation.vector;
        assert!((at(&turned.poses[0]) - at(&was)).norm() < 1e-12);
    }
}
