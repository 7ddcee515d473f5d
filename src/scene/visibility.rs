//! Which markers a camera sees.

use nalgebra::Isometry3;

use crate::body::{Humanoid, LANDMARKS, LinkFrames, Markers, Prop, Ray, Solid};
use crate::camera::Camera;

/// Clears every hidden marker of `visible`. A marker is hidden if the segment from the camera's centre to it meets a
/// solid of another link that does not contain the marker, or any prop, even one that contains the marker.
pub(super) fn clear_hidden(
    body: &Humanoid,
    frames: &LinkFrames,
    props: &[Prop],
    markers: &Markers,
    camera: &Camera,
    visible: &mut [bool; LANDMARKS.len()],
) {
    let centre = camera.centre();
    let links_from_world: Vec<Isometry3<f64>> = frames.0.iter().map(Isometry3::inverse).collect();
    for (index, marker) in markers.iter().enumerate() {
        let own_link = body.markers[index].map(|m| m.link);
        let Some(marker) = marker.filter(|_| visible[index]) else { continue };
        let sight = Ray { origin: marker, direction: centre - marker };
        let by_solids = body.links.iter().enumerate().any(|(link, part)| {
            let sight = sight.transformed(&links_from_world[link]);
            own_link != Some(link) && part.solids.iter().any(|solid| meets(solid, &sight))
        });
        let by_prop = props.iter().any(|prop| prop.solid.ray_entry(&sight).is_some_and(|s| s <= 1.0));
        visible[index] = !by_solids && !by_prop;
    }
}

/// From the marker outwards: an entry at 0 is a solid that holds the marker, one beyond 1 lies behind the camera.
fn meets(solid: &Solid, sight: &Ray) -> bool {
    solid.ray_entry(sight).is_some_and(|s| s > 0.0 && s <= 1.0)
}

#[cfg(test)]
mod tests {
    use crate::body::fixture::{person, walk};
    use crate::body::{Landmark, Prop, Solid};
    use crate::camera::CameraRig;
    use crate::scene::GroundTruth;
    use crate::scene::fixture::camera_at;
    use nalgebra::{Isometry3, Point3};

    fn visible(from: Point3<f64>, landmark: Landmark) -> bool {
        let rig = CameraRig { cameras: vec![camera_at("only", from)] };
        let truth = GroundTruth::from_motion(person(), &walk(1), &rig).unwrap();
        truth.frames[0].visible[0][landmark as usize]
    }

    #[test]
    fn the_torso_hides_the_far_hand_and_nothing_hides_the_near_one() {
        let (left, right) = (Point3::new(0.0, 4.0, 1.0), Point3::new(0.0, -4.0, 1.0));
        assert!(visible(left, Landmark::LeftWrist) && !visible(left, Landmark::RightWrist));
        assert!(visible(right, Landmark::RightWrist) && !visible(right, Landmark::LeftWrist));
        let front = Point3::new(4.0, 0.0, 1.0);
        assert!(visible(front, Landmark::LeftWrist) && visible(front, Landmark::RightWrist));
    }

    #[test]
    fn a_solid_around_a_marker_does_not_hide_it() {
        // the elbow lies inside upper arm and forearm alike
        assert!(visible(Point3::new(4.0, 0.0, 1.0), Landmark::LeftElbow));
        assert!(visible(Point3::new(-4.0, 0.0, 1.0), Landmark::LeftElbow));
    }

    #[test]
    fn a_prop_around_a_marker_hides_it_and_one_behind_it_does_not() {
        let rig = CameraRig { cameras: vec![camera_at("only", Point3::new(4.0, 0.0, 1.0))] };
        let among = |x: f64| {
            let solid =
                Solid::Box { link_from_box: Isometry3::translation(x, 0.0, 1.0), half_extents: [1.0, 1.0, 1.5] };
            let props = vec![Prop { name: "box".into(), solid }];
            let truth = GroundTruth::among_props(person(), &walk(1), &rig, props).unwrap();
            truth.frames[0].visible[0][Landmark::LeftElbow as usize]
        };
        assert!(visible(Point3::new(4.0, 0.0, 1.0), Landmark::LeftElbow));
        assert!(!among(0.0) && among(-3.0));
    }

    #[test]
    fn a_marker_outside_the_image_is_not_visible() {
        assert!(!visible(Point3::new(0.6, 0.0, 1.0), Landmark::LeftAnkle));
    }
}
