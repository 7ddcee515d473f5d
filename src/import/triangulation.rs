//! Points in space from points in images.

use nalgebra::{Matrix3, Point2, Point3, Vector3};

use skiagraph_core::camera::Camera;

/// The point nearest to the rays through the pixels, in the least squares sense; `None` with fewer than two rays, or if
/// they are nearly parallel.
pub(super) fn triangulated<'a>(seen: impl Iterator<Item = (&'a Camera, [f64; 2])>) -> Option<Point3<f64>> {
    let (mut normal, mut right, mut rays) = (Matrix3::zeros(), Vector3::zeros(), 0);
    for (camera, pixel) in seen {
        let Some(direction) = camera.ray_through(&Point2::from(pixel)) else { continue };
        let across = Matrix3::identity() - direction.into_inner() * direction.transpose();
        normal += across;
        right += across * camera.centre().coords;
        rays += 1;
    }
    let determinant = normal.determinant();
    if rays < 2 || determinant.abs() < 1e-6 {
        return None;
    }
    Some(Point3::from(normal.try_inverse()? * right)).filter(|point| point.iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_cameras;

    #[test]
    fn a_point_is_found_again_from_its_pixels() {
        let rig = test_cameras::rig();
        let point = Point3::new(0.2, -0.1, 1.1);
        let pixels = rig.cameras.iter().filter_map(|camera| Some((camera, camera.project(&point)?.into())));
        assert!((triangulated(pixels).unwrap() - point).norm() < 1e-6);
        let one = rig.cameras.iter().take(1).map(|camera| (camera, [10.0, 10.0]));
        assert_eq!(triangulated(one), None);
    }
}
