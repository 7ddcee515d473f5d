//! Errors in the images: distances of projected markers, in total and per camera.

use serde::{Deserialize, Serialize};

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::mpjpe::pooled;
use super::over_time::over_time;
use super::statistics::mean_of;

pub(super) const ERROR: Metric = Metric {
    name: "error_2d_px",
    title: "2-D error in the images",
    meaning: "How far the markers are off in the cameras' images",
    unit: Unit::Pixel,
    direction: Direction::LowerIsBetter,
    needs: "the set's cameras, and a marker in truth and estimate that is in view",
    protocol: "distance between the projections of the true and the estimated marker through the true camera, lens included, \
               for the 15 virtual markers that are inside the image, hidden or not; estimates behind a camera are \
               skipped; depends on the images' size; pooled over all markers of all cameras and frames",
    measure: error,
};

/// Errors in one camera, of one sequence or of several runs: means over clips of each clip's mean over seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerCameraError {
    /// Name of the camera.
    pub camera: String,
    /// Mean 2-D error, pixels; `None` if no marker is in view.
    pub error_px: Option<f64>,
    /// Mean overlap of the estimate's silhouette with the observed one; `None` without poses.
    pub overlap: Option<f64>,
    /// Mean agreement of the outlines of both; `None` without poses.
    pub boundary_f: Option<f64>,
    /// Share of the actor's markers that are inside the image and not hidden, over all scored frames.
    pub visible: Option<f64>,
    /// Mean 2-D error in equal parts of the sequence, as for markers, pixels; of one sequence only, and not in files.
    #[serde(skip)]
    pub over_time: Vec<Option<f64>>,
}

fn error(sequence: &Sequence<'_>) -> Option<Measurement> {
    let views = sequence.views?;
    pooled(sequence, |frame| (0..views.cameras.len()).flat_map(|camera| in_camera(sequence, camera, frame)).collect())
}

/// Error of every marker in view of a camera, pixels.
fn in_camera(sequence: &Sequence<'_>, camera: usize, frame: usize) -> Vec<f64> {
    let Some(views) = sequence.views else { return vec![] };
    let (lens, in_view) = (views.camera(camera, frame), &views.in_view[frame][camera]);
    let of_marker =
        |(_, truth, estimate): (usize, _, _)| Some((lens.project(&estimate)? - lens.project(&truth)?).norm());
    let all = sequence.pairs(frame).filter(|(landmark, ..)| in_view[*landmark]).filter_map(of_marker);
    all.filter(|pixels: &f64| pixels.is_finite()).collect()
}

/// One entry per camera; empty if the cameras are unknown.
pub(super) fn per_camera(sequence: &Sequence<'_>) -> Vec<PerCameraError> {
    let Some(views) = sequence.views else { return vec![] };
    let of = |scores: Option<&[Vec<Option<f64>>]>, camera: usize| {
        let scores = scores?;
        mean_of(sequence.scored().filter_map(|frame| scores[frame].get(camera).copied().flatten()))
    };
    let camera = |(index, camera): (usize, &skiagraph_core::camera::Camera)| {
        let seen = sequence.scored().flat_map(|frame| {
            let truth = sequence.truth_markers.frame(frame);
            truth
                .into_iter()
                .zip(views.visible[frame][index])
                .filter_map(|(marker, seen)| marker.map(|_| f64::from(u8::from(seen))))
        });
        PerCameraError {
            camera: camera.name.clone(),
            error_px: mean_of(sequence.scored().flat_map(|frame| in_camera(sequence, index, frame))),
            overlap: of(sequence.view_overlaps, index),
            boundary_f: of(sequence.view_boundaries, index),
            visible: mean_of(seen),
            over_time: over_time(sequence, |frame| in_camera(sequence, index, frame)),
        }
    };
    views.cameras.iter().enumerate().map(camera).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate;
    use crate::sequence::Views;
    use crate::test_figure::{standing, translated};
    use nalgebra::{Point3, Vector3};
    use skiagraph_core::camera::{Camera, FieldOfView};

    fn camera(name: &str, x: f64) -> Camera {
        let (eye, target) = (Point3::new(x, 0.0, 1.0), Point3::new(0.0, 0.0, 1.0));
        Camera::look_at(name, eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 640, 480).unwrap()
    }

    #[test]
    fn an_error_across_the_view_scales_with_focal_length_over_distance() {
        let cameras = [camera("near", 4.0), camera("far", 8.0)];
        let truth = vec![[Some(Point3::new(0.0, 0.1, 1.2)); 15]; 3];
        let estimate: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.0, 0.02, 0.0))).collect();
        let seen = [[true; 15], [true; 15]];
        let all: Vec<&[[bool; 15]]> = vec![&seen; 3];
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.views = Some(Views { cameras: &cameras, moved: &[], in_view: &all, visible: &all });
        let evaluation = evaluate(&sequence).unwrap();
        let focal = cameras[0].pinhole.focal[0];
        let (near, far) = (focal * 0.02 / 4.0, focal * 0.02 / 8.0);
        let found: Vec<f64> = evaluation.per_camera.iter().map(|camera| camera.error_px.unwrap()).collect();
        assert!((found[0] - near).abs() < 1e-9 && (found[1] - far).abs() < 1e-9, "{found:?} {near} {far}");
        assert!((evaluation.metrics["error_2d_px"].mean - 0.5 * (near + far)).abs() < 1e-9);
    }

    #[test]
    fn markers_outside_the_image_do_not_count_and_an_error_along_the_view_is_small() {
        let cameras = [camera("only", 4.0)];
        let truth = vec![standing(); 3];
        let estimate: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.05, 0.0, 0.0))).collect();
        let mut seen = [[true; 15]];
        seen[0][..5].fill(false);
        let all: Vec<&[[bool; 15]]> = vec![&seen; 3];
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.views = Some(Views { cameras: &cameras, moved: &[], in_view: &all, visible: &all });
        let of_ten = evaluate(&sequence).unwrap();
        assert!(of_ten.metrics["error_2d_px"].mean < 2.5 && of_ten.metrics["humaneva_mm"].mean > 49.0);
        assert!((of_ten.per_camera[0].visible.unwrap() - 10.0 / 15.0).abs() < 1e-12);
    }
}
