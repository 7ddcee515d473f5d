//! Scene of the tracking benchmarks: a person standing amid four cameras, filling half the image's height.

use skiagraph_core::body::ProposalScales;
use skiagraph_core::body::{Humanoid, Pose, draw_silhouette};
use skiagraph_core::camera::{CameraRig, RingParameters};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_track::motion_model::{Diffusion, DiffusionSettings};
use skiagraph_track::tracker::{AnnealedParticleFilter, Estimator, FilterSettings, Kernel, Likelihood, Tracker};

pub(crate) fn tracker25() -> Humanoid {
    Humanoid::tracker25().expect("a shipped body")
}

pub(crate) fn standing(body: &Humanoid) -> Pose {
    let mut pose = body.zero_pose();
    pose.world_from_root.translation.z = 0.93;
    body.clamp_to_limits(&mut pose);
    pose
}

pub(crate) fn ring(image_size: [u32; 2]) -> CameraRig {
    CameraRig::ring(&RingParameters { image_size, ..RingParameters::default() }).expect("a valid ring")
}

pub(crate) fn seen(body: &Humanoid, rig: &CameraRig) -> Observation {
    let silhouettes = rig.cameras.iter().map(|camera| {
        let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
        draw_silhouette(body, &body.link_frames(&standing(body)), camera, &mut mask);
        mask
    });
    Observation { frame: 0, time_s: 0.0, silhouettes: silhouettes.collect(), moment: None, keypoints: None }
}

/// A filter of five layers, started at the standing pose.
pub(crate) fn filter<L: Likelihood>(
    particles: usize,
    body: &Humanoid,
    likelihood: L,
) -> AnnealedParticleFilter<Diffusion, L> {
    let settings = FilterSettings {
        particles,
        layers: 5,
        survival_rate: 0.5,
        kernel: Kernel::Geometric,
        estimator: Estimator::WeightedMean,
    };
    let scales = ProposalScales::for_human(body, 60.0);
    let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings::default()).expect("valid scales");
    let mut filter = AnnealedParticleFilter::new(settings, model, likelihood, 1).expect("valid settings");
    filter.start(&standing(body));
    filter
}
