//! A point from its images: weighted direct linear transform, with the views that agree with most others.

use nalgebra::{Matrix4, Point3, RowVector4, SymmetricEigen};

use skiagraph_core::camera::Camera;
use skiagraph_core::observation::FoundKeypoint;

/// A homogeneous coordinate below this is a point at infinity.
const AT_INFINITY: f64 = 1e-9;

/// A keypoint in one view, without lens distortion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting<'a> {
    camera: &'a Camera,
    /// Ideal image coordinates x / z and y / z.
    ideal: [f64; 2],
    /// Confidence, from 0 to 1.
    weight: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TriangulatedPoint {
    pub(super) place: Point3<f64>,
    /// Sum of the confidences of the views that agree with it.
    pub(super) support: f64,
}

impl<'a> Sighting<'a> {
    /// `None` for a pixel that the lens maps no ray to.
    pub(super) fn new(camera: &'a Camera, found: &FoundKeypoint) -> Option<Self> {
        let (x, y) = camera.pinhole.normalised(&found.pixel.into());
        let (x, y) = camera.distortion.undistort(x, y)?;
        Some(Self { camera, ideal: [x, y], weight: found.confidence })
    }

    /// The two equations of the transform, weighted.
    fn equations(&self) -> [RowVector4<f64>; 2] {
        let rows = self.camera.camera_from_world.to_homogeneous();
        let equation = |axis: usize| self.weight * (self.ideal[axis] * rows.row(2) - rows.row(axis));
        [equation(0), equation(1)]
    }

    /// Distance of a point's image from the keypoint, pixels; infinite behind the camera.
    fn error_px(&self, place: &Point3<f64>) -> f64 {
        let seen = self.camera.camera_from_world * place;
        if seen.z <= 0.0 {
            return f64::INFINITY;
        }
        let [fx, fy] = self.camera.pinhole.focal;
        (fx * (seen.x / seen.z - self.ideal[0])).hypot(fy * (seen.y / seen.z - self.ideal[1]))
    }
}

/// The point whose images agree with the views of the greatest total confidence, to within `inlier_px`: every pair of
/// views proposes one (exhaustive RANSAC, `[Fischler 1981]`), and all views that agree with the best determine it.
/// `None` if no two views agree.
pub(super) fn triangulate(seen: &[Sighting<'_>], inlier_px: f64) -> Option<TriangulatedPoint> {
    let agreeing = |place: &Point3<f64>| -> Vec<Sighting<'_>> {
        seen.iter().filter(|sighting| sighting.error_px(place) <= inlier_px).copied().collect()
    };
    let support = |seen: &[Sighting<'_>]| seen.iter().map(|sighting| sighting.weight).sum::<f64>();
    let pairs = (0..seen.len()).flat_map(|second| (0..second).map(move |first| [seen[first], seen[second]]));
    let proposals = pairs.filter_map(|pair| linear_transform(&pair)).map(|place| agreeing(&place));
    let best = proposals.filter(|own| own.len() >= 2).max_by(|a, b| support(a).total_cmp(&support(b)))?;
    Some(TriangulatedPoint { place: linear_transform(&best)?, support: support(&best) })
}

/// The direct linear transform (`[Hartley 2003]`, section 12.2).
fn linear_transform(seen: &[Sighting<'_>]) -> Option<Point3<f64>> {
    let rows = seen.iter().flat_map(Sighting::equations);
    let normal = rows.fold(Matrix4::zeros(), |sum, row| sum + row.transpose() * row);
    let eigen = SymmetricEigen::new(normal);
    let found = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    (found.w.abs() > AT_INFINITY).then(|| Point3::from(found.xyz() / found.w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::fixture::ring;
    use skiagraph_core::camera::{CameraRig, Distortion};

    fn rig() -> CameraRig {
        let mut rig = ring(5, 4.0, [640, 480]);
        rig.cameras[1].distortion = Distortion { k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.001, k3: 0.0 };
        rig
    }

    fn found(rig: &CameraRig, place: &Point3<f64>) -> Vec<FoundKeypoint> {
        let pixel = |camera: &Camera| camera.project(place).unwrap().into();
        rig.cameras.iter().map(|camera| FoundKeypoint { pixel: pixel(camera), confidence: 0.9 }).collect()
    }

    fn point(rig: &CameraRig, found: &[FoundKeypoint]) -> Option<TriangulatedPoint> {
        let pairs = rig.cameras.iter().zip(found);
        let seen: Vec<_> = pairs.map(|(camera, found)| Sighting::new(camera, found).unwrap()).collect();
        triangulate(&seen, 10.0)
    }

    #[test]
    fn exact_images_give_the_point_through_a_lens_and_outliers_do_not_move_it() {
        let (rig, place) = (rig(), Point3::new(0.3, -0.2, 1.1));
        let mut found = found(&rig, &place);
        assert!((point(&rig, &found).unwrap().place - place).norm() < 1e-6);
        found[0].pixel[0] += 150.0;
        found[3].pixel[1] -= 90.0;
        let robust = point(&rig, &found).unwrap();
        assert!((robust.place - place).norm() < 1e-6 && (robust.support - 2.7).abs() < 1e-12, "{robust:?}");
    }

    #[test]
    fn views_count_by_their_confidence() {
        let (rig, place) = (rig(), Point3::new(0.0, 0.1, 0.8));
        let mut found = found(&rig, &place);
        found[2].pixel[0] += 8.0;
        let off = |confidence: f64| {
            let mut found = found.clone();
            found[2].confidence = confidence;
            (point(&rig, &found).unwrap().place - place).norm()
        };
        assert!(off(0.05) < 0.1 * off(0.9), "{} {}", off(0.05), off(0.9));
    }

    #[test]
    fn one_view_or_views_that_disagree_give_no_point() {
        let (rig, place) = (rig(), Point3::new(0.0, 0.0, 1.0));
        let mut found = found(&rig, &place);
        assert_eq!(point(&rig, &found[..1]), None);
        assert_eq!(point(&rig, &[]), None);
        found[1].pixel[1] += 60.0;
        assert_eq!(point(&rig, &found[..2]), None);
    }
}
