//! `observations/keypoints.npz`: what a 2D detector found, and `truth/keypoints.npz`: where the points really are, and
//! what was drawn; for T frames, C cameras and the K points of a layout. Only in sets with keypoints.
//!
//! | array of observations | shape | meaning |
//! |---|---|---|
//! | `keypoint_names`, `cameras` | (K), (C) | names of points and cameras |
//! | `keypoints` | (T, C, K, 2), float32 | pixels, lens included, pixel centres at integers; NaN for a missing point |
//! | `confidence` | (T, C, K), float32 | from 0 to 1; 0 for a missing point |
//!
//! | array of the truth | shape | meaning |
//! |---|---|---|
//! | `keypoint_names`, `cameras`, `sight_names` | (K), (C), (4) | names |
//! | `keypoints_3d` | (T, K, 3) | position at the frame's time, m; NaN for a point that the actor's body lacks |
//! | `keypoints_2d` | (T, C, K, 2) | exact pixels at the time of exposure, as above; NaN before the near plane |
//! | `sight` | (T, C, K), uint8 | 0 in view, 1 occluded by the body, 2 occluded only by a prop or a distractor, 3 out of view |
//! | `missed`, `inverted`, `gross` | (T, C, K), bool | which points were missed, exchanged with the other side, and have a gross error |
//! | `other_person` | (T, C, K), bool | which points are another person's; only if the settings exchange people |

use std::path::Path;

use super::manifest::BlindManifest;
use super::views_file::NAMES as SIGHT_NAMES;
use crate::SetError;
use crate::files::SetFiles;
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::{CameraRig, TimedRig};
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_core::observation::{FoundKeypoint, FrameKeypoints};
use skiagraph_core::rng::KeyedSeed;
use skiagraph_truth::observing::{Corruption, KeypointDetector, KeypointSettings, KeypointView};
use skiagraph_truth::scene::GroundTruth;

pub(crate) const PATH: &str = "observations/keypoints.npz";
pub(crate) const TRUTH_PATH: &str = "truth/keypoints.npz";

/// Greatest distance of a keypoint from the image's corner, pixels.
const FARTHEST_PX: f32 = 1e7;

/// What a detector took for a keypoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeypointSource {
    /// The point, in view.
    Visible,
    /// The point, hidden by the body, a prop or another person, or outside the image.
    Hidden,
    /// The point of the other side or of another person.
    Exchanged,
}

/// The keypoints of a set as given to trackers.
#[derive(Clone, Debug)]
pub struct SetKeypoints {
    /// Which points, in which order.
    pub layout: KeypointLayout,
    cameras: usize,
    /// Pixels with pixel centres at integers (T, C, K); NaN for a missing point.
    pixels: Vec<[f32; 2]>,
    /// (T, C, K).
    confidence: Vec<f32>,
}

impl SetKeypoints {
    /// What was found in the images of a frame, which must exist.
    pub fn frame(&self, frame: usize) -> FrameKeypoints {
        let points = self.layout.keypoints().len();
        let view = |camera: usize| {
            let first = (frame * self.cameras + camera) * points;
            (first..first + points).map(|index| found(self.pixels[index], self.confidence[index])).collect()
        };
        FrameKeypoints { layout: self.layout, views: (0..self.cameras).map(view).collect() }
    }

    /// What was taken for each keypoint, by the truth of the set in `directory`, which it must have (T, C, K).
    ///
    /// # Errors
    /// [`SetError`] if the truth cannot be read or has another shape.
    pub fn sources(&self, directory: &Path) -> Result<Vec<KeypointSource>, SetError> {
        let files = SetFiles::open(directory)?;
        let npz = Npz::from_bytes(TRUTH_PATH, &files.read(TRUTH_PATH)?)?;
        let points = self.layout.keypoints().len();
        let shape = [self.confidence.len() / (self.cameras * points).max(1), self.cameras, points];
        let of_views = shape.map(Some);
        let inverted = npz.bools(TRUTH_PATH, "inverted", &of_views)?;
        let of_others = match npz.get("other_person") {
            Some(_) => npz.bools(TRUTH_PATH, "other_person", &of_views)?,
            None => &[],
        };
        let sights = match npz.get("sight") {
            Some(Array { shape: own, values: Values::U8(values) }) if *own == shape => values,
            _ => {
                let detail = format!("sight: expected an array of uint8 with the shape {shape:?}");
                return Err(SetError::malformed(TRUTH_PATH, detail));
            }
        };
        let source = |index: usize| match sights[index] {
            _ if inverted[index] || of_others.get(index) == Some(&true) => KeypointSource::Exchanged,
            0 => KeypointSource::Visible,
            _ => KeypointSource::Hidden,
        };
        Ok((0..sights.len()).map(source).collect())
    }
}

fn found(pixel: [f32; 2], confidence: f32) -> Option<FoundKeypoint> {
    let pixel = pixel.map(|x| f64::from(x) + 0.5);
    (!pixel[0].is_nan()).then_some(FoundKeypoint { pixel, confidence: confidence.into() })
}

/// Both files of a set with the true cameras, observations first.
pub(crate) fn to_npz(
    truth: &GroundTruth,
    rig: &TimedRig,
    settings: &KeypointSettings,
    corruption: &Corruption,
    seed: KeyedSeed,
) -> [Npz; 2] {
    let found = KeypointDetector::new(truth, rig, *settings, *corruption, seed).detect();
    let names = settings.layout.keypoints();
    let of_view = [truth.frames.len(), rig.cameras(), names.len()];
    let of_pixels = [&of_view[..], &[2]].concat();
    let keypoint_names = || Array::names(names.iter().map(|point| point.name()));
    let cameras = || Array::names(rig.rig().cameras.iter().map(|camera| camera.name.as_str()));
    let views = || found.views.iter();
    let pixels: Vec<f32> = views().flat_map(|view| view.found.map(|x| (x - 0.5) as f32)).collect();
    let confidence: Vec<f32> = views().map(|view| view.confidence as f32).collect();
    let blind = Npz::from_iter([
        ("keypoint_names", keypoint_names()),
        ("keypoints", Array::new(&of_pixels, pixels)),
        ("confidence", Array::new(&of_view, confidence)),
        ("cameras", cameras()),
    ]);
    let exact: Vec<f64> = views().flat_map(|view| view.exact.map(|x| x - 0.5)).collect();
    let places: Vec<f64> = found.places.as_flattened().to_vec();
    let sights: Vec<u8> = views().map(|view| view.sight as u8).collect();
    let flags = |flag: fn(&KeypointView) -> bool| Array::new(&of_view, views().map(flag).collect::<Vec<bool>>());
    let mut truth = Npz::from_iter([
        ("keypoint_names", keypoint_names()),
        ("keypoints_3d", Array::new(&[of_view[0], of_view[2], 3], places)),
        ("keypoints_2d", Array::new(&of_pixels, exact)),
        ("sight", Array::new(&of_view, sights)),
        ("missed", flags(|view| view.is_missed)),
        ("inverted", flags(|view| view.is_inverted)),
        ("gross", flags(|view| view.is_gross)),
        ("sight_names", Array::names(SIGHT_NAMES)),
        ("cameras", cameras()),
    ]);
    if settings.other_person > 0.0 {
        truth.push("other_person", flags(|view| view.is_others));
    }
    [blind, truth]
}

/// The file of given keypoints, by frame and camera.
pub(crate) fn found_to_npz(layout: KeypointLayout, rig: &CameraRig, views: &[Vec<Vec<Option<FoundKeypoint>>>]) -> Npz {
    let names = layout.keypoints();
    let of_view = [views.len(), rig.cameras.len(), names.len()];
    let points = || views.iter().flatten().flatten();
    let pixel = |point: &Option<FoundKeypoint>| point.map_or([f32::NAN; 2], |own| own.pixel.map(|x| (x - 0.5) as f32));
    let confidence = points().map(|point| point.map_or(0.0, |own| own.confidence as f32));
    Npz::from_iter([
        ("keypoint_names", Array::names(names.iter().map(|point| point.name()))),
        ("keypoints", Array::new(&[&of_view[..], &[2]].concat(), points().flat_map(pixel).collect::<Vec<f32>>())),
        ("confidence", Array::new(&of_view, confidence.collect::<Vec<f32>>())),
        ("cameras", Array::names(rig.cameras.iter().map(|camera| camera.name.as_str()))),
    ])
}

/// Reads the keypoints of a set with the cameras of `rig`; `None` if `set.toml` states none.
pub(crate) fn read(
    files: &SetFiles,
    manifest: &BlindManifest,
    rig: &CameraRig,
) -> Result<Option<SetKeypoints>, SetError> {
    let stated = manifest.observation.as_ref().and_then(|facts| facts.keypoints);
    match stated {
        Some(settings) => {
            let npz = Npz::from_bytes(PATH, &files.read(PATH)?)?;
            from_npz(&npz, settings.layout, manifest.sequence.frames, rig).map(Some)
        }
        None if files.has(PATH) => {
            let detail = "set.toml states no keypoints (observation.keypoints), expected their layout there";
            Err(SetError::malformed(PATH, detail.to_owned()))
        }
        None => Ok(None),
    }
}

fn from_npz(npz: &Npz, layout: KeypointLayout, frames: usize, rig: &CameraRig) -> Result<SetKeypoints, SetError> {
    let names: Vec<&str> = layout.keypoints().iter().map(|point| point.name()).collect();
    let of_layout = format!("those of the layout {} in its order", layout.name());
    check_names(npz, "keypoint_names", &names, &of_layout)?;
    let cameras: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    check_names(npz, "cameras", &cameras, "the names of cameras.json in the same order")?;
    let of_view = [frames, cameras.len(), names.len()];
    let pixels = floats(npz, "keypoints", &[&of_view[..], &[2]].concat())?.as_chunks::<2>().0.to_vec();
    let confidence = floats(npz, "confidence", &of_view)?.to_vec();
    let malformed = |detail: String| Err(SetError::malformed(PATH, detail));
    if let Some(pixel) = pixels.iter().find(|pixel| !is_pixel(pixel)) {
        return malformed(format!("keypoints: expected pixels, or NaN twice for a missing point, found {pixel:?}"));
    }
    if let Some(other) = confidence.iter().find(|confidence| !(0.0..=1.0).contains(*confidence)) {
        return malformed(format!("confidence: expected numbers from 0 to 1, found {other}"));
    }
    Ok(SetKeypoints { layout, cameras: cameras.len(), pixels, confidence })
}

fn is_pixel(pixel: &[f32; 2]) -> bool {
    pixel.iter().all(|x| x.abs() <= FARTHEST_PX) || pixel.iter().all(|x| x.is_nan())
}

fn check_names(npz: &Npz, array: &str, expected: &[&str], which: &str) -> Result<(), SetError> {
    match npz.names(PATH, array)? {
        Some(found) if found.iter().eq(expected) => Ok(()),
        _ => Err(SetError::malformed(PATH, format!("{array}: expected {which}"))),
    }
}

fn floats<'a>(npz: &'a Npz, array: &str, shape: &[usize]) -> Result<&'a [f32], SetError> {
    match npz.get(array) {
        Some(Array { shape: own, values: Values::F32(values) }) if own == shape => Ok(values),
        _ => Err(SetError::malformed(PATH, format!("{array}: expected an array of float32 with the shape {shape:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{observed_set, with_parts};
    use crate::test_bodies::walk;
    use crate::{BenchmarkSet, SetParts};
    use skiagraph_truth::observing::ObservationFacts;

    const FRAMES: usize = 5;

    fn set_with(settings: KeypointSettings) -> BenchmarkSet {
        observed_set(FRAMES, &ObservationFacts { keypoints: Some(settings), ..ObservationFacts::default() })
    }

    fn noisy() -> KeypointSettings {
        let exact = KeypointSettings::exact(KeypointLayout::Body25);
        KeypointSettings { slow_percent: 1.0, missing: 0.2, confidence_noise: 0.2, ..exact }
    }

    #[test]
    fn exact_keypoints_are_read_back_where_the_cameras_see_the_markers() {
        let set = set_with(KeypointSettings::exact(KeypointLayout::Coco17));
        let knee = 13;
        for frame in 0..FRAMES {
            let seen = set.blind.observation(frame).unwrap().keypoints.unwrap();
            assert_eq!((seen.layout, seen.views.len(), seen.views[0].len()), (KeypointLayout::Coco17, 3, 17));
            let truth = &set.truth.ground_truth.frames[frame];
            let place = truth.markers[skiagraph_core::body::Landmark::LeftKnee as usize].unwrap();
            for (camera, view) in set.truth.rig.rig().cameras.iter().zip(&seen.views) {
                let expected = camera.project(&place).unwrap();
                let found = view[knee].unwrap();
                assert!((found.pixel[0] - expected.x).abs() + (found.pixel[1] - expected.y).abs() < 1e-4);
                assert_eq!(found.confidence, 1.0);
            }
        }
    }

    #[test]
    fn keypoints_of_observations_are_kept_to_the_bit_and_not_drawn_again() {
        let given = set_with(noisy());
        let moved = |by: f64| {
            let observation = ObservationFacts { keypoints: Some(noisy()), ..ObservationFacts::default() };
            let observe = |frame: usize| {
                let mut seen = given.blind.observation(frame).unwrap();
                let views = seen.keypoints.iter_mut().flat_map(|own| &mut own.views);
                views.flatten().flatten().for_each(|point| point.pixel[0] += by);
                seen
            };
            with_parts(&walk(FRAMES), |parts, _| {
                BenchmarkSet::assemble(&SetParts { observation: Some(&observation), ..*parts }, observe).unwrap()
            })
        };
        assert_eq!(moved(0.0).blind.set_hash, given.blind.set_hash);
        let points = |set: &BenchmarkSet| set.blind.observation(2).unwrap().keypoints.unwrap().views.concat();
        let other = points(&moved(64.0));
        assert!(points(&given).iter().zip(&other).all(|(own, other)| own.is_some() == other.is_some()));
        let apart =
            points(&given).iter().zip(&other).find_map(|(own, other)| Some((*other)?.pixel[0] - (*own)?.pixel[0]));
        assert!((apart.unwrap() - 64.0).abs() < 1e-3, "{apart:?}");
    }

    #[test]
    fn files_of_another_layout_size_or_with_numbers_out_of_range_are_refused_by_array() {
        let (rig, coco17) = (crate::test_cameras::rig(), KeypointLayout::Coco17);
        let message = |pixel: [f64; 2], confidence: f64, layout: KeypointLayout, frames: usize| {
            let found = Some(FoundKeypoint { pixel, confidence });
            let npz = found_to_npz(coco17, &rig, &[vec![vec![found; 17]; 3]]);
            from_npz(&npz, layout, frames, &rig).err().map_or(String::new(), |error| error.to_string())
        };
        assert_eq!(message([9.0; 2], 1.0, coco17, 1), "");
        let layout = message([9.0; 2], 1.0, KeypointLayout::Halpe26, 1);
        assert!(layout.contains("keypoint_names: expected those of the layout halpe26"), "{layout}");
        let shape = message([9.0; 2], 1.0, coco17, 2);
        assert!(shape.contains("keypoints: expected an array of float32 with the shape [2, 3, 17, 2]"), "{shape}");
        for confidence in [-0.1, 1.5, f64::NAN] {
            assert!(message([9.0; 2], confidence, coco17, 1).contains("confidence: expected numbers from 0 to 1"));
        }
        assert!(message([f64::INFINITY, 9.0], 1.0, coco17, 1).contains("keypoints: expected pixels"));
        assert!(message([f64::NAN, 9.0], 1.0, coco17, 1).contains("NaN twice"));
    }
}
