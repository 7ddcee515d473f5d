//! Lost frames, and cameras that are early or late.

use rand::RngExt;

use super::{Corruption, Draw, draws};
use skiagraph_core::camera::TimedRig;
use skiagraph_core::rng::{KeyedSeed, normal};

/// The frame shown by camera `camera` in `frame`: itself, or the last earlier one that was not lost. The camera takes
/// an image `every` frames; the first frame is never lost.
pub(in crate::observing) fn shown_frame(
    corruption: &Corruption,
    seed: KeyedSeed,
    frame: usize,
    camera: usize,
    every: usize,
) -> usize {
    if corruption.dropped_frames == 0.0 {
        return frame;
    }
    let lost = |frame: &usize| draws(seed, *frame, Draw::Dropped, camera).random::<f64>() < corruption.dropped_frames;
    (1..=frame / every).rev().map(|image| image * every).find(|frame| !lost(frame)).unwrap_or(0)
}

/// The cameras at the times at which they really take their images.
pub(in crate::observing) fn exposed(filming: &TimedRig, corruption: &Corruption, seed: KeyedSeed) -> TimedRig {
    let offsets: Vec<f64> = match corruption.desynchronisation_ms {
        0.0 => Vec::new(),
        _ => (0..filming.cameras()).map(|camera| offset_s(corruption, seed, camera)).collect(),
    };
    let late = filming.delayed(&offsets, 1e-6 * corruption.line_delay_us);
    match corruption.clock_drift_ms_per_min {
        0.0 => late,
        deviation => {
            let drift = |camera| 1e-3 / 60.0 * deviation * normal(&mut draws(seed, 0, Draw::Drift, camera));
            late.drifting((0..filming.cameras()).map(drift).collect())
        }
    }
}

fn offset_s(corruption: &Corruption, seed: KeyedSeed, camera: usize) -> f64 {
    1e-3 * corruption.desynchronisation_ms * normal(&mut draws(seed, 0, Draw::Offset, camera))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_given_share_of_frames_is_lost_and_the_last_image_is_held() {
        let corruption = Corruption { dropped_frames: 0.3, ..Corruption::default() };
        let shown: Vec<usize> = (0..4000).map(|frame| shown_frame(&corruption, 2.into(), frame, 1, 1)).collect();
        let lost = shown.iter().enumerate().filter(|(frame, shown)| frame != *shown).count();
        assert!(lost.abs_diff(1200) < 4 * 29, "{lost}");
        assert_eq!(shown[0], 0);
        assert!(shown.windows(2).enumerate().all(|(frame, pair)| pair[1] == pair[0] || pair[1] == frame + 1));
        assert!((0..4000).step_by(3).all(|frame| shown_frame(&corruption, 2.into(), frame, 1, 3).is_multiple_of(3)));
        let all_lost = Corruption { dropped_frames: 1.0, ..Corruption::default() };
        assert_eq!(shown_frame(&all_lost, 2.into(), 50, 0, 1), 0);
    }

    #[test]
    fn clocks_drift_with_the_given_deviation_and_start_together() {
        let camera = crate::test_cameras::camera_at("one", nalgebra::Point3::new(4.0, 0.0, 1.0));
        let rig = skiagraph_core::camera::CameraRig { cameras: vec![camera; 2000] };
        let corruption = Corruption { clock_drift_ms_per_min: 1.2, ..Corruption::default() };
        let exposed = exposed(&TimedRig::from(&rig), &corruption, 2.into());
        let late = |frame_s: f64| (0..2000).map(|c| exposed.row_s(c, frame_s, 0) - frame_s).collect::<Vec<f64>>();
        assert!(late(0.0).iter().all(|late| *late == 0.0));
        let deviation = (late(60.0).iter().map(|o| o * o).sum::<f64>() / 2000.0).sqrt();
        assert!((deviation - 0.0012).abs() < 0.00008, "{deviation}");
        assert!(late(120.0).iter().zip(late(60.0)).all(|(two, one)| (two - 2.0 * one).abs() < 1e-12));
    }

    #[test]
    fn offsets_differ_between_cameras_with_the_given_deviation() {
        let corruption = Corruption { desynchronisation_ms: 20.0, ..Corruption::default() };
        let offsets: Vec<f64> = (0..2000).map(|camera| offset_s(&corruption, 2.into(), camera)).collect();
        let deviation = (offsets.iter().map(|o| o * o).sum::<f64>() / 2000.0).sqrt();
        assert!((deviation - 0.020).abs() < 0.0013, "{deviation}");
    }
}
