//! How a camera sees a joint or marker.

use nalgebra::{Isometry3, Point3};

use crate::body::{Humanoid, LinkFrames, Prop, Ray};
use crate::camera::Camera;

/// How a camera sees a point of the body. Points lie inside the body: the solids of a point's own links and solids that
/// hold the point do not hide it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Sight {
    /// In the image, and nothing between it and the camera.
    InView = 0,
    /// In the image, and hidden by the body, whatever else is there.
    SelfOccluded = 1,
    /// In the image, and hidden by a prop alone.
    Occluded = 2,
    /// Outside the image, or before the near plane.
    OutOfView = 3,
}

impl Sight {
    /// How `camera` sees `point`, which belongs to the links `own` of the body.
    pub fn new(
        point: &Point3<f64>,
        own: &[usize],
        (body, frames): (&Humanoid, &LinkFrames),
        props: &[Prop],
        camera: &Camera,
    ) -> Self {
        if !camera.sees(point) {
            return Self::OutOfView;
        }
        let sight = Ray { origin: *point, direction: camera.centre() - point };
        let others = body.links.iter().zip(&frames.0).enumerate().filter(|(link, _)| !own.contains(link));
        let by_body = others.into_iter().any(|(_, (link, frame)): (usize, (_, &Isometry3<f64>))| {
            let sight = sight.transformed(&frame.inverse());
            // an entry at 0 is a solid that holds the point, one beyond 1 lies behind the camera
            link.solids.iter().any(|solid| solid.ray_entry(&sight).is_some_and(|s| s > 0.0 && s <= 1.0))
        });
        let by_prop = || props.iter().any(|prop| prop.solid.ray_entry(&sight).is_some_and(|s| s <= 1.0));
        match by_body {
            true => Self::SelfOccluded,
            false if by_prop() => Self::Occluded,
            false => Self::InView,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::LANDMARKS;
    use crate::body::Solid;
    use crate::body::fixture::{person, walk};
    use crate::scene::GroundTruth;
    use crate::scene::fixture::rig;

    #[test]
    fn a_marker_is_in_view_iff_the_truth_calls_it_visible_and_the_other_reasons_are_told_apart() {
        let solid = Solid::Box { link_from_box: Isometry3::translation(1.5, 0.1, 0.6), half_extents: [0.05, 0.3, 0.6] };
        let props = vec![Prop { name: "box".into(), solid }];
        let truth = GroundTruth::among_props(person(), &walk(30), &rig(), props).unwrap();
        let mut counts = [0; 4];
        for frame in &truth.frames {
            for (index, camera) in rig().cameras.iter().enumerate() {
                for (marker, _) in LANDMARKS.iter().enumerate() {
                    let (Some(point), Some(own)) = (frame.markers[marker], truth.actor.markers[marker]) else {
                        continue;
                    };
                    let scene = (&truth.actor, &frame.link_frames);
                    let sight = Sight::new(&point, &[own.link], scene, &truth.props, camera);
                    assert_eq!(sight == Sight::InView, frame.visible[index][marker]);
                    assert_eq!(sight == Sight::OutOfView, !frame.in_view[index][marker]);
                    counts[sight as usize] += 1;
                    if sight == Sight::Occluded {
                        let without = Sight::new(&point, &[own.link], scene, &[], camera);
                        assert_eq!(without, Sight::InView, "it is the prop's fault");
                    }
                }
            }
        }
        assert!(counts[0] > 0 && counts[1] > 0 && counts[2] > 0, "{counts:?}");
    }
}
