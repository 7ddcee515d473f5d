//! Draws what the cameras see and spoils it.

use rand::RngExt;

use super::{Corruption, Draw, discs, draws, limbs, noise, outline, timing};
use crate::body::{Humanoid, LinkFrames, Motion};
use crate::camera::{Camera, CameraRig};
use crate::observation::light::{GroundPixels, Sun};
use crate::observation::{Observation, Observer};
use crate::parallel;
use crate::raster::Mask;
use crate::scene::GroundTruth;

/// Sees any frame of the truth with corrupted masks, from any thread; the same bits in any order.
pub struct CorruptedObserver<'a> {
    truth: &'a GroundTruth,
    observer: Observer<'a>,
    corruption: Corruption,
    seed: u64,
    /// Motions between frames of the actor and then of every distractor; empty where all is seen at once.
    motions: Vec<Motion>,
    /// A camera for every row of every camera's image, where rows are seen one after another.
    rows: Vec<Observer<'a>>,
    /// The actor without one limb each, where limbs go missing.
    limbless: Vec<Humanoid>,
    shadow: Option<Shadow>,
}

/// The sun, and the ground as every camera sees it.
struct Shadow {
    sun: Sun,
    ground: Vec<GroundPixels>,
}

impl<'a> CorruptedObserver<'a> {
    /// An observer of `truth` through the cameras of `rig`, which are the true ones.
    pub fn new(truth: &'a GroundTruth, rig: &CameraRig, corruption: Corruption, seed: u64) -> Self {
        let observer = Observer::new(truth, rig);
        let shadow = (corruption.shadow_m != 0.0).then(|| {
            let azimuth = std::f64::consts::TAU * draws(seed, 0, Draw::Shadow, 0).random::<f64>();
            let ground = |camera| GroundPixels::new(&rig.cameras[camera], observer.screen(camera));
            Shadow { sun: Sun::new(azimuth), ground: parallel::map(rig.cameras.len(), ground) }
        });
        let rolling = corruption.line_delay_us != 0.0;
        let motions = match rolling || corruption.desynchronisation_ms != 0.0 {
            true => std::iter::once(truth.motion().made_continuous(&truth.actor))
                .chain(truth.distractors.iter().map(|other| other.continuous_motion(truth.frames_per_second)))
                .collect(),
            false => Vec::new(),
        };
        let rolled = if rolling { &rig.cameras[..] } else { &[] };
        Self {
            truth,
            corruption,
            seed,
            motions,
            rows: rolled.iter().map(|camera| Observer::new(truth, &rows_of(camera))).collect(),
            limbless: if corruption.missing_limb == 0.0 { Vec::new() } else { limbs::without_limbs(&truth.actor) },
            shadow,
            observer,
        }
    }

    /// The masks of one frame, which the truth must have.
    pub fn observe(&self, frame: usize) -> Observation {
        let shown: Vec<usize> = (0..self.observer.cameras())
            .map(|camera| timing::shown_frame(&self.corruption, self.seed, frame, camera))
            .collect();
        let scenes: Vec<(LinkFrames, &Humanoid)> =
            shown.iter().enumerate().map(|(camera, frame)| self.scene(*frame, camera)).collect();
        let mut exact = self.seen(0, &shown, |camera| scenes[camera].1);
        for (index, other) in (1..).zip(&self.truth.distractors) {
            let others = self.seen(index, &shown, |_| &other.body);
            exact.iter_mut().zip(&others).for_each(|(mask, other)| *mask |= other);
        }
        let spoil = |(camera, mask): (usize, Mask)| self.spoiled(mask, shown[camera], camera, &scenes[camera]);
        let silhouettes = exact.into_iter().enumerate().map(spoil).collect();
        Observation { frame, time_s: self.truth.frames[frame].time_s, silhouettes }
    }

    /// What every camera sees of a figure, shown as `body` says, in the frame that it shows.
    fn seen<'b>(&self, figure: usize, shown: &[usize], body: impl Fn(usize) -> &'b Humanoid) -> Vec<Mask> {
        if self.rows.is_empty() {
            let links = |(camera, frame): (usize, &usize)| self.links(figure, *frame, camera, 0);
            let links: Vec<LinkFrames> = shown.iter().enumerate().map(links).collect();
            return self.observer.silhouettes(|camera| (body(camera), &links[camera]));
        }
        let rolled = |(camera, rows): (usize, &Observer<'a>)| {
            let links: Vec<LinkFrames> =
                (0..rows.cameras()).map(|row| self.links(figure, shown[camera], camera, row)).collect();
            joined_rows(&rows.silhouettes(|row| (body(camera), &links[row])))
        };
        self.rows.iter().enumerate().map(rolled).collect()
    }

    /// What a camera looks at when it opens: links, and the body as far as it is seen.
    fn scene(&self, frame: usize, camera: usize) -> (LinkFrames, &Humanoid) {
        let truth = &self.truth.frames[frame];
        let limb = limbs::missing(&self.corruption, self.seed, truth.time_s, camera, self.limbless.len());
        (self.links(0, frame, camera, 0), limb.map_or(&self.truth.actor, |limb| &self.limbless[limb]))
    }

    /// Where the links of a figure (0 is the actor, then distractors) are when a camera sees a row.
    fn links(&self, figure: usize, frame: usize, camera: usize, row: usize) -> LinkFrames {
        let truth = &self.truth.frames[frame];
        let other = figure.checked_sub(1).map(|index| &self.truth.distractors[index]);
        let between_frames = self.motions.get(figure).and_then(|motion| {
            let offset_s = timing::offset_s(&self.corruption, self.seed, camera);
            let time_s = truth.time_s + offset_s + timing::row_delay_s(&self.corruption, row);
            let body = other.map_or(&self.truth.actor, |other| &other.body);
            motion.at_frame(body, time_s * motion.frames_per_second).map(|pose| body.link_frames(&pose))
        });
        between_frames.unwrap_or_else(|| match other {
            None => truth.link_frames.clone(),
            Some(other) => other.link_frames(frame).unwrap_or_default(),
        })
    }

    fn spoiled(&self, mut mask: Mask, frame: usize, camera: usize, (frames, body): &(LinkFrames, &Humanoid)) -> Mask {
        let Corruption { shadow_m, boundary_px, holes, blobs, salt_and_pepper, .. } = self.corruption;
        let random = |draw| draws(self.seed, frame, draw, camera);
        if let Some(Shadow { sun, ground }) = &self.shadow {
            mask |= &ground[camera].shadow(&sun.shadow_of(body, frames), shadow_m);
        }
        if boundary_px != 0.0 {
            mask = outline::jittered(&mask, boundary_px, &mut random(Draw::Boundary));
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
}

/// A camera for every row of an image.
fn rows_of(camera: &Camera) -> CameraRig {
    let row = |y: u32| {
        let mut row = camera.clone();
        row.pinhole.principal_point[1] -= f64::from(y);
        row.pinhole.height = 1;
        row
    };
    CameraRig { cameras: (0..camera.pinhole.height).map(row).collect() }
}

/// The image of which these are the rows.
fn joined_rows(rows: &[Mask]) -> Mask {
    let mut image = Mask::new(rows.first().map_or(0, Mask::width), rows.len() as u32);
    for (y, row) in (0..).zip(rows) {
        row.runs(0).flatten().for_each(|x| image.set(x, y, true));
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};
    use crate::observation::{AXES, observe};
    use crate::raster::overlap;
    use crate::scene::fixture::rig;

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
        let spoiled: Vec<_> = (0..8).map(|frame| observer.observe(frame)).collect();
        assert_eq!(spoiled, observe(&truth, &rig()));
    }

    #[test]
    fn every_axis_of_masks_changes_them_the_more_the_stronger_and_the_same_way_on_any_thread() {
        let (truth, exact) = (truth(), observe(&truth(), &rig()));
        for axis in AXES.iter().filter(|axis| axis.of_masks && axis.name != "missing_limb") {
            let changed = |level: f64| -> u64 {
                let observer = CorruptedObserver::new(&truth, &rig(), of_level(axis.name, level), 5);
                let spoiled: Vec<_> = (0..8).map(|frame| observer.observe(frame)).collect();
                assert_eq!(
                    parallel::map(8, |frame| observer.observe(7 - frame)).into_iter().rev().collect::<Vec<_>>(),
                    spoiled
                );
                let both = spoiled.iter().zip(&exact).flat_map(|(a, b)| a.silhouettes.iter().zip(&b.silhouettes));
                both.map(|(a, b)| overlap(a, b)).map(|counts| counts.only_model + counts.only_observed).sum()
            };
            let (mild, severe) = (changed(axis.levels[1]), changed(axis.levels[4]));
            assert!(
                severe > mild,
                "{}: {mild} pixels at {}, {severe} at {}",
                axis.name,
                axis.levels[1],
                axis.levels[4]
            );
        }
    }

    #[test]
    fn seeds_draw_different_masks() {
        let truth = truth();
        let of_seed = |seed| CorruptedObserver::new(&truth, &rig(), of_level("boundary_px", 2.0), seed).observe(3);
        assert_ne!(of_seed(1), of_seed(2));
        assert_eq!(of_seed(1), of_seed(1));
    }

    #[test]
    fn every_row_of_a_rolling_shutter_shows_the_scene_at_its_own_time() {
        let truth = truth();
        // a row takes a 240th of a frame: the image is read in the time to the next
        let corruption = of_level("line_delay_us", 1e6 / 60.0 / 240.0);
        let rolled = CorruptedObserver::new(&truth, &rig(), corruption, 5).observe(3);
        let motion = truth.motion().made_continuous(&truth.actor);
        let exact = observe(&truth, &rig());
        for (index, camera) in rig().cameras.iter().enumerate() {
            let mut painter = crate::body::SilhouettePainter::new(camera);
            let mut differing = 0;
            for row in (0..240).step_by(7) {
                let pose = motion.at_frame(&truth.actor, 3.0 + f64::from(row) / 240.0).unwrap();
                let whole = painter.silhouette(&truth.actor, &truth.actor.link_frames(&pose));
                differing += (0..320).filter(|x| whole.get(*x, row) != rolled.silhouettes[index].get(*x, row)).count();
            }
            assert!(differing <= 1, "{differing} pixels on outlines, up to rounding");
            let (rolled, first, last) =
                (&rolled.silhouettes[index], &exact[3].silhouettes[index], &exact[4].silhouettes[index]);
            assert!(rolled != first && rolled != last);
        }
    }

    #[test]
    fn a_camera_that_is_a_whole_frame_late_shows_the_next_frame() {
        let truth = truth();
        let mut observer = CorruptedObserver::new(&truth, &rig(), of_level("desynchronisation_ms", 1.0), 5);
        let offset = timing::offset_s(&observer.corruption, 5, 1);
        // a strength at which the second camera's offset is one frame
        observer.corruption.desynchronisation_ms = 1.0 / 60.0 / offset;
        let late = timing::offset_s(&observer.corruption, 5, 1);
        assert!((late.abs() - 1.0 / 60.0).abs() < 1e-12);
        let next = if late > 0.0 { 4 } else { 2 };
        assert_eq!(observer.observe(3).silhouettes[1], observe(&truth, &rig())[next].silhouettes[1]);
    }
}
