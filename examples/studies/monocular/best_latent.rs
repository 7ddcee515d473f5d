//! A lower bound for particles on the manifold.

use faer::Mat;
use rayon::prelude::*;
use skiagraph::body::{Markers, Pose};
use skiagraph::evaluation::Sequence;
use skiagraph::motion_model::gpdm_graph::GpdmGraph;
use skiagraph::motion_model::pose_chart::PlanarRoot;
use skiagraph::prepare::PreparedScene;

/// Mean over frames of the least error of a latent point of `models` at the true root: a pattern search from the three
/// best training latents of every model, with steps from a tenth of the latents' spread to a thousandth.
pub(crate) fn best_latent(prepared: &PreparedScene, models: &GpdmGraph) -> f64 {
    let body = &prepared.start.body;
    let frames: Vec<usize> = (1..prepared.frames()).collect();
    let of_frame = |&frame: &usize| {
        let (truth, root) =
            (&prepared.ground_truth.frames[frame].markers, prepared.refitted.poses[frame].world_from_root);
        let error = |segment: usize, latent: &[f64]| {
            let point = Mat::from_fn(1, latent.len(), |_, c| latent[c]);
            let row = models.segments[segment].gpdm.map_mean(point.as_ref());
            let observation: Vec<f64> = row.row(0).iter().copied().collect();
            let pose = models.chart.place(&observation, &PlanarRoot { x: 0.0, y: 0.0, yaw: 0.0 });
            let mut pose = Pose { world_from_root: root, ..pose };
            body.clamp_to_limits(&mut pose);
            mean_error(truth, &body.markers(&body.link_frames(&pose)))
        };
        let of_model = |segment: usize| {
            let gpdm = &models.segments[segment].gpdm;
            let latents =
                (0..gpdm.latents().nrows()).map(|i| gpdm.latents().row(i).iter().copied().collect::<Vec<f64>>());
            let mut starts: Vec<(f64, Vec<f64>)> = latents.map(|z| (error(segment, &z), z)).collect();
            starts.sort_by(|a, b| a.0.total_cmp(&b.0));
            let spread = gpdm.latent_spread();
            let descend = |(start, z): (f64, Vec<f64>)| descended(&|z| error(segment, z), start, z, spread);
            starts.into_iter().take(3).map(descend).fold(f64::INFINITY, f64::min)
        };
        (0..models.segments.len()).map(of_model).fold(f64::INFINITY, f64::min)
    };
    let errors: Vec<f64> = frames.par_iter().map(of_frame).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Least error found by a pattern search from `z`, where the error is `least`.
fn descended(error: &dyn Fn(&[f64]) -> f64, mut least: f64, mut z: Vec<f64>, spread: f64) -> f64 {
    let mut step = 0.1 * spread;
    while step > 1e-3 * spread {
        let before = least;
        for (axis, sign) in (0..z.len()).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let mut near = z.clone();
            near[axis] += sign * step;
            let found = error(&near);
            if found < least {
                (least, z) = (found, near);
            }
        }
        if least == before {
            step *= 0.5;
        }
    }
    least
}

/// HumanEva error, mm.
fn mean_error(truth: &Markers, estimate: &Markers) -> f64 {
    let pair = Sequence::from_markers(60.0, std::slice::from_ref(truth), std::slice::from_ref(estimate));
    let distances: Vec<f64> = pair.distances_mm(0).collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}
