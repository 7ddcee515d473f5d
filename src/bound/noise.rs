//! The noise of observations as `skiagraph bound` assumes it, and notes about what it leaves out.

use super::scene::BoundScene;
use skiagraph_core::body::KeypointPlace;
use skiagraph_track::tracker::OutlineNoise;
use skiagraph_truth::observing::{
    BOUNDARY_CORRELATION_PX, Corruption, KeypointSettings, ObservationFacts, SilhouetteSource,
};

/// Deviation and correlation length that are assumed for silhouettes of a segmenter, pixels.
const SEGMENTED_PX: [f64; 2] = [1.0, 8.0];

/// The noise of outlines: a deviation and a correlation length given by the user, or that of the observations.
pub(super) fn outline_noise(facts: &ObservationFacts, given: Option<[f64; 2]>) -> (OutlineNoise, String) {
    let pixels = OutlineNoise::PIXELS;
    let described = |[deviation, length]: [f64; 2], why: &str| {
        let text = format!("outlines off by {deviation} px, correlated over {length:.1} px{why}, and cut to pixels");
        (pixels.with(deviation, length), text)
    };
    let corrupted = facts.corruption.boundary_px;
    match given {
        Some(given) => described(given, ""),
        None if facts.silhouette == SilhouetteSource::Segmented => described(SEGMENTED_PX, " (assumed)"),
        None if corrupted > 0.0 => described([corrupted, BOUNDARY_CORRELATION_PX], ""),
        None => (pixels, "exact outlines, cut to pixels".to_owned()),
    }
}

/// The body's keypoints and their errors.
pub(super) struct DetectedPoints {
    pub(super) places: Vec<KeypointPlace>,
    /// Of each place, relative to the mean of COCO's points.
    pub(super) deviations: Vec<f64>,
    pub(super) settings: KeypointSettings,
}

/// The body's keypoints; `None` without keypoints, and if they have no error: they then bound nothing.
pub(super) fn keypoints(scene: &BoundScene) -> Option<DetectedPoints> {
    let settings =
        scene.observation.keypoints.filter(|settings| settings.white_percent + settings.slow_percent > 0.0)?;
    let named = settings.layout.keypoints().iter().zip(scene.body.keypoint_places(settings.layout));
    let on_body = named.filter_map(|(point, place)| Some((place?, point.relative_deviation())));
    let (places, deviations) = on_body.unzip();
    Some(DetectedPoints { places, deviations, settings })
}

pub(super) fn describe_keypoints(settings: &KeypointSettings) -> String {
    let percent = settings.white_percent.hypot(settings.slow_percent);
    format!(
        "{} points off by {percent:.2} % of the person's height in the image times the point's own deviation (COCO's, mean 1), \
         hidden ones too",
        settings.layout.name()
    )
}

pub(super) fn notes(scene: &BoundScene) -> Vec<String> {
    let mut notes = Vec::new();
    let left_out = Corruption { boundary_px: 0.0, boundary_s: 0.0, ..scene.observation.corruption };
    if !left_out.is_none() {
        notes.push(format!("left out, so that the bound is lower than these images allow: {}", left_out.describe()));
    }
    if scene.observation.keypoints.is_some() && keypoints(scene).is_none() {
        notes.push(
            "the keypoints have no error, so they bound nothing; set white_percent of observation.keypoints".to_owned(),
        );
    }
    notes.extend(scene.occlusion_note());
    if let Some(lasting) = lasting_errors(&scene.observation) {
        notes.push(format!(
            "{lasting} lasts over frames, but counts as new in each: a filter can learn such errors, and so can be below its bound"
        ));
    }
    if scene.rig.cameras() == 1 {
        notes.push("one camera sees depth only by the size of the body".to_owned());
    }
    notes
}

/// The settings by which errors of silhouettes or keypoints last over several frames.
fn lasting_errors(facts: &ObservationFacts) -> Option<String> {
    let outlines = facts.corruption.boundary_px > 0.0 && facts.corruption.boundary_s > 0.0;
    let points = facts.keypoints.is_some_and(|settings| settings.slow_percent > 0.0);
    let named = [(outlines, "boundary_px (boundary_s)"), (points, "slow_percent of keypoints (slow_s)")];
    let names: Vec<&str> = named.into_iter().filter(|(lasts, _)| *lasts).map(|(_, name)| name).collect();
    (!names.is_empty()).then(|| names.join(" and "))
}
