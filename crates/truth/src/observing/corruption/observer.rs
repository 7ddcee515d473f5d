//! Renders masks and corrupts them.

use rand::RngExt;

use super::outline::Field;
use super::{Corruption, Draw, discs, draws, limbs, noise, outline, timing};
use crate::observing::Observer;
use crate::observing::light::{GroundPixels, Sun};
use crate::observing::observe::Look;
use crate::scene::{GroundTruth, SceneFigure};
use skiagraph_core::body::Humanoid;
use skiagraph_core::camera::TimedRig;
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;
use skiagraph_core::rng::KeyedSeed;

/// Observes any frame of the truth with corrupted masks, from any thread; bit-identical in any order.
pub struct CorruptedObserver<'a> {
    truth: &'a GroundTruth,
    /// Renders at the corrupted exposure times.
    observer: Observer<'a>,
    /// The nominal timed cameras.
    filming: TimedRig,
    corruption: Corruption,
    seed: KeyedSeed,
    /// Copies of the actor without one limb each, if limbs may be missing.
    bodies_without_limb: Vec<Humanoid>,
    shadow: Option<Shadow>,
}

/// The sun, and the ground points of every camera.
struct Shadow {
    sun: Sun,
    /// `None` for a moving camera.
    ground: Vec<Option<GroundPixels>>,
}

impl<'a> CorruptedObserver<'a> {
    /// An observer of `truth` with the true cameras. Time errors are added to the cameras' own timing.
    pub fn new(
        truth: &'a GroundTruth,
        rig: impl Into<TimedRig>,
        corruption: Corruption,
        seed: impl Into<KeyedSeed>,
    ) -> Self {
        let (filming, seed) = (rig.into(), seed.into());
        let observer = Observer::new(truth, timing::exposed(&filming, &corruption, seed));
        let shadow = (corruption.shadow_m != 0.0).then(|| {
            let azimuth = std::f64::consts::TAU * draws(seed, 0, Draw::Shadow, 0).random::<f64>();
            let ground = |camera: usize| {
                let is_static = filming.path(camera).is_none();
                is_static.then(|| GroundPixels::new(&filming.rig().cameras[camera], observer.screen(camera)))
            };
            Shadow { sun: Sun::new(azimuth), ground: parallel::map(filming.cameras(), ground) }
        });
        Self {
            truth,
            corruption,
            seed,
            filming,
            bodies_without_limb: if corruption.missing_limb == 0.0 {
                Vec::new()
            } else {
                limbs::without_limbs(&truth.actor)
            },
            shadow,
            observer,
        }
    }

    /// The masks of one frame, which must exist in the truth; empty for a camera that takes no image in that frame.
    pub fn observe(&self, frame: usize) -> Observation {
        let shown = |camera: usize| {
            if self.filming.has_image(camera, frame) {
                timing::shown_frame(&self.corruption, self.seed, frame, camera, self.filming.timing(camera).every)
            } else {
                frame
            }
        };
        let masks = self.observer.look_through_all(shown, |look| {
            let frame = shown(look.camera);
            self.corrupted_look(look, frame)
        });
        let time_s = self.truth.frames[frame].time_s;
        let silhouettes = self.observer.with_empty_masks(masks);
        Observation { frame, time_s, silhouettes, moment: self.filming.moment(frame, time_s), keypoints: None }
    }

    fn corrupted_look(&self, mut look: Look<'_, 'a>, frame: usize) -> Mask {
        let camera = look.camera;
        let time_s = self.truth.frames[frame].time_s;
        let limb = limbs::missing(&self.corruption, self.seed, time_s, camera, self.bodies_without_limb.len());
        let body = limb.map_or(&self.truth.actor, |limb| &self.bodies_without_limb[limb]);
        let links = look.links(SceneFigure::Actor);
        let mut mask = look.silhouette(body, &links, &[]);
        for (index, other) in self.truth.distractors.iter().enumerate() {
            mask |= &look.silhouette(&other.body, &look.links(SceneFigure::Distractor(index)), &[]);
        }
        if let (Some(Shadow { sun, ground }), Some(links)) = (&self.shadow, links.first()) {
            let shadow = sun.shadow_of(body, links);
            let seen = |ground: &GroundPixels| ground.shadow(&shadow, self.corruption.shadow_m);
            mask |= &match &ground[camera] {
                Some(ground) => seen(ground),
                None => {
                    let opened_s = self.observer.filming.row_s(camera, time_s, 0);
                    seen(&GroundPixels::new(&self.filming.camera_at(camera, opened_s), look.screen()))
                }
            };
        }
        self.corrupted(mask, frame, camera)
    }

    fn corrupted(&self, mut mask: Mask, frame: usize, camera: usize) -> Mask {
        let Corruption { boundary_px, boundary_s, holes, blobs, salt_and_pepper, .. } = self.corruption;
        let random = |draw| draws(self.seed, frame, draw, camera);
        if boundary_px != 0.0 {
            mask = outline::jittered(&mask, boundary_px, |window| match boundary_s {
                0.0 => Field::new(window, &mut random(Draw::Boundary)),
                _ => self.slow_field(&mask, frame, camera),
            });
        }
        if holes != 0.0 {
            discs::cut_holes(&mut mask, holes, &mut random(Draw::Holes));
        }
        if blobs != 0.0 {
            discs::add_blobs(&mut mask, blobs, &mut random(Draw::Blobs));
        }
        if salt_and_pepper != 0.0 {
            noise::flip_pixels(&mut mask, salt_and_pepper, &mut random(Draw::Pixels));
        }
        mask
    }

    /// The displacement of the outline, which changes slowly.
    fn slow_field(&self, mask: &Mask, frame: usize, camera: usize) -> Field {
        let moments = self.truth.frames[frame].time_s / self.corruption.boundary_s;
        let first = moments.floor().max(0.0);
        let moment = |index: f64| draws(self.seed, index as usize, Draw::BoundaryMoment, camera);
        Field::between(mask, [&mut moment(first), &mut moment(first + 1.0)], moments - first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observing::observe;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use skiagraph_core::raster::overlap;

    fn truth() -> GroundTruth {
        GroundTruth::from_motion(person(), &walk(8), &rig()).unwrap()
    }

    fn of_level(name: &str, level: f64) -> Corruption {
        toml::from_str(&format!("{name} = {level:?}")).unwrap()
    }

    #[test]
    fn zero_strength_changes_nothing() {
        let truth = truth();
        let observer = CorruptedObserver::new(&truth, &rig(), Corruption::default(), 5);
        let corrupted: Vec<_> = (0..8).map(|frame| observer.observe(frame)).collect();
        assert_eq!(corrupted, observe(&truth, &rig()));
    }

    #[test]
    fn stronger_axes_change_masks_more_and_reproducibly_on_any_thread() {
        let (truth, exact) = (truth(), observe(&truth(), &rig()));
        for (axis, mild, severe) in [
            ("desynchronisation_ms", 5.0, 50.0),
            ("clock_drift_ms_per_min", 2.0, 50.0),
            ("line_delay_us", 10.0, 100.0),
            ("dropped_frames", 0.1, 0.8),
            ("shadow_m", 0.2, 1.6),
            ("boundary_px", 1.0, 8.0),
            ("holes", 0.05, 0.4),
            ("blobs", 0.1, 1.0),
            ("salt_and_pepper", 0.003, 0.1),
        ] {
            let changed = |level: f64| -> u64 {
                let observer = CorruptedObserver::new(&truth, &rig(), of_level(axis, level), 5);
                let corrupted: Vec<_> = (0..8).map(|frame| observer.observe(frame)).collect();
                let backwards = parallel::map(8, |frame| observer.observe(7 - frame));
                assert!(backwards.iter().rev().eq(&corrupted), "{axis}");
                let both = corrupted.iter().zip(&exact).flat_map(|(a, b)| a.silhouettes.iter().zip(&b.silhouettes));
                both.map(|(a, b)| overlap(a, b)).map(|counts| counts.only_model + counts.only_observed).sum()
            };
            assert!(changed(severe) > changed(mild), "{axis}");
        }
    }

    #[test]
    fn seeds_give_different_masks() {
        let truth = truth();
        let of_seed = |seed| CorruptedObserver::new(&truth, &rig(), of_level("boundary_px", 2.0), seed).observe(3);
        assert_ne!(of_seed(1), of_seed(2));
        assert_eq!(of_seed(1), of_seed(1));
    }
}
