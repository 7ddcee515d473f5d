//! The energy of a pose from silhouettes: `[Skinned APF]` Eq. 3.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::calibration::OutlineImportance;
use super::descent::{
    self, Accumulator, BodyOutline, DescentScratch, ObservedOutline, OutlineAgreement, OutlineResidual, OutlineSample,
};
use super::limbs::{LimbInsides, LimbSides};
use super::observed_view::{ComparisonStrategy, ObservedView, ViewScratch};
use super::placed_body::PlacedBody;
use super::plausibility::{Plausibility, PlausibilitySettings};
use super::rectification::Rectification;
use super::{Likelihood, SilhouetteSettings, SilhouetteTerm, TrackError};
use crate::body::{Humanoid, LinkFrames, Pose, capsules_in_camera};
use crate::camera::{Camera, CameraRig, Distortion};
use crate::contact::InterpenetrationScratch;
use crate::motion_model::{Evidence, NormalEquations, SettingError};
use crate::observation::Observation;
use crate::parallel;
use crate::raster::{Mask, Overlap, TaperedCapsule};

/// Factors on the weight of the prior where one camera sees an outline, and where two do: one cannot tell depth, and
/// two leave limbs hidden, which a free descent then fits to whatever is there. Found on one walk: with one camera 30
/// is as good and 100 worse, with two 10 to 60 are as good.
const PRIOR_OF_ONE_VIEW: f64 = 40.0;
const PRIOR_OF_TWO_VIEWS: f64 = 20.0;

/// `E = 1/N_v sum_v (D_s + alpha D_c)`: `[Skinned APF]` Eq. 3, alpha inside the sum; to each view's part a third term
/// may be added, for the sides of limbs ([`SilhouetteSettings::limb_side_weight`]).
///
/// Cameras are where the observation says that they were, and a camera without a new image has no say. Views in which
/// neither the model nor the observation has a pixel are left out of N_v; without any view left the
/// energy is 0, for nothing seen is then nothing missed. A view in which only one of them has pixels counts in full, so
/// that a particle cannot win by leaving the picture.
///
/// Lenses are taken out of the observed masks once a frame (nearest neighbour), and all comparing is done in the ideal
/// pinhole's image. Bodies of nothing but tapered capsules, and bodies with a skin, are compared
/// by [`crate::raster::SilhouetteComparer`]; other solids, and two-sided contours, are drawn into masks.
#[derive(Debug)]
pub struct SilhouetteLikelihood {
    body: Humanoid,
    settings: SilhouetteSettings,
    views: Vec<ObservedCamera>,
    /// How the body is compared with what was seen.
    road: ComparisonStrategy,
    /// What a descent needs; `None` unless descent is used.
    outline: Option<BodyOutline>,
    /// What each place of the body counts in a descent.
    importance: OutlineImportance,
    /// What poses that could not be cost; `None` where that is not asked.
    plausibility: Option<Plausibility>,
}

/// One camera and what it saw.
#[derive(Debug)]
struct ObservedCamera {
    /// Its ideal pinhole, where it was when it took the image.
    camera: Camera,
    /// Whether it took an image; without one it has no say.
    has_image: bool,
    rectification: Option<Rectification>,
    /// Which pixels of the pinhole's image the camera shows; `None` where it shows them all.
    shown: Option<Mask>,
    observed: ObservedView,
    /// The insides of limbs; `None` where they are not sampled.
    insides: Option<LimbInsides>,
    /// The sides of limbs; `None` where they weigh nothing.
    sides: Option<LimbSides>,
    /// The outline that a descent brings the model's to; `None` where none was seen, and without descent.
    outline: Option<ObservedOutline>,
}

/// Buffers of one thread.
pub struct LikelihoodScratch {
    /// One for every pose of those that are judged at once.
    bodies: Vec<PlacedBody>,
    compare: CompareBuffers,
    solids: InterpenetrationScratch,
    descent: Option<DescentScratch>,
}

/// What comparing a body with all views takes.
struct CompareBuffers {
    views: ViewScratch,
    limbs: Vec<TaperedCapsule>,
}

impl SilhouetteLikelihood {
    /// A likelihood of poses of `body` in what the cameras of `rig` see.
    ///
    /// # Errors
    /// [`SettingError`] where a setting is out of its range or the rig has no camera.
    pub fn new(body: Humanoid, rig: &CameraRig, settings: SilhouetteSettings) -> Result<Self, SettingError> {
        settings.validate()?;
        if rig.cameras.is_empty() {
            return Err(SettingError::new("cameras", "at least 1", 0));
        }
        let road = ComparisonStrategy::of(&body, &settings);
        let views =
            parallel::map(rig.cameras.len(), |camera| ObservedCamera::new(&rig.cameras[camera], road, &settings));
        let (outline, importance, plausibility) = (None, OutlineImportance::default(), None);
        Ok(Self { body, settings, views, road, outline, importance, plausibility })
    }

    /// The same likelihood, to which the plausibility of poses is added: what lies in the ground, in itself or beyond
    /// its limits costs, or is rejected.
    ///
    /// # Errors
    /// [`SettingError`] where a setting is out of its range.
    pub fn with_plausibility(self, settings: PlausibilitySettings) -> Result<Self, SettingError> {
        Ok(Self { plausibility: Some(Plausibility::new(&self.body, settings)?), ..self })
    }

    /// The same likelihood, which can be descended too ([`Likelihood::linearise`]).
    pub fn with_descent(self) -> Self {
        Self { outline: Some(BodyOutline::new(&self.body)), ..self }
    }
}

impl SilhouetteLikelihood {
    /// What one view adds to the sum of Eq. 3, without the sides of limbs; `None` where neither side has a pixel.
    fn view_energy(
        &self,
        index: usize,
        view: &ObservedCamera,
        placed: &mut PlacedBody,
        buffers: &mut ViewScratch,
    ) -> Option<f64> {
        let is_drawn = view.insides.is_none() || self.settings.contour_weight > 0.0;
        let drawn = is_drawn.then(|| view.observed.compare(&self.body, placed, &view.camera, index, buffers));
        let silhouette = match &view.insides {
            None => drawn.and_then(|drawn| self.settings.silhouette.value(&drawn.overlap)),
            Some(insides) => {
                capsules_in_camera(&self.body, &placed.frames, &view.camera, &mut placed.capsules);
                insides.share_missed(&placed.capsules)
            }
        };
        let contour = drawn.and_then(|drawn| drawn.contour).unwrap_or(0.0);
        Some(silhouette? + self.settings.contour_weight * contour)
    }

    /// What the sides of the limbs of a body with its links at `frames` add to a view's energy.
    fn sides_energy(&self, view: &ObservedCamera, frames: &LinkFrames, limbs: &mut Vec<TaperedCapsule>) -> f64 {
        let Some(sides) = &view.sides else { return 0.0 };
        capsules_in_camera(&self.body, frames, &view.camera, limbs);
        self.settings.limb_side_weight * sides.mean_distance(limbs)
    }
}

impl Likelihood for SilhouetteLikelihood {
    type Scratch = LikelihoodScratch;

    fn scratch(&self) -> LikelihoodScratch {
        let painted = if self.road == ComparisonStrategy::Masks { self.views.iter() } else { [].iter() };
        let views = ViewScratch::new(painted.map(|view| &view.camera));
        let compare = CompareBuffers { views, limbs: Vec::new() };
        let (bodies, solids) = (vec![PlacedBody::default()], InterpenetrationScratch::default());
        LikelihoodScratch { bodies, compare, solids, descent: None }
    }

    fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError> {
        check_fit(&self.views, observation)?;
        let (road, descends, settings) = (self.road, self.outline.is_some(), self.settings);
        for (index, view) in self.views.iter_mut().enumerate() {
            view.has_image = observation.has_image(index);
            if let Some(moment) = &observation.moment {
                view.camera.camera_from_world = moment.camera_from_world[index];
            }
        }
        let views = self.views.par_iter_mut().zip(&observation.silhouettes);
        views.filter(|(view, _)| view.has_image).for_each(|(view, mask)| view.observe(mask, road, descends, &settings));
        Ok(())
    }

    fn energy(&self, pose: &Pose, scratch: &mut LikelihoodScratch) -> f64 {
        let mut energy = 0.0;
        self.judge(&[pose], std::slice::from_mut(&mut energy), scratch, true);
        energy
    }

    fn energies(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut LikelihoodScratch) {
        self.judge(poses, energies, scratch, true);
    }

    fn energy_unrejected(&self, pose: &Pose, scratch: &mut LikelihoodScratch) -> f64 {
        let mut energy = 0.0;
        self.judge(&[pose], std::slice::from_mut(&mut energy), scratch, false);
        energy
    }

    fn descends(&self) -> bool {
        self.outline.is_some()
    }

    fn linearise(&self, pose: &Pose, width: f64, scratch: &mut LikelihoodScratch) -> Option<NormalEquations> {
        let mut equations = Accumulator::new(self.body.links.len(), pose.world_from_root.translation.vector.into());
        let (frames, _) = self.residuals(pose, scratch, |_, camera, length, sample, residual, importance| {
            equations.add(camera, sample, residual, length, width, importance);
        })?;
        Some(NormalEquations { prior_weight: self.prior_weight(), ..equations.finish(&self.body, frames) })
    }

    fn evidence(&self, pose: &Pose, width: f64, scratch: &mut LikelihoodScratch) -> Option<Evidence> {
        let nothing = || Accumulator::new(self.body.links.len(), pose.world_from_root.translation.vector.into());
        let (mut all, mut views) = (nothing(), Vec::new());
        views.resize_with(self.views.len() * SIDES, nothing);
        let (frames, agreement) =
            self.residuals(pose, scratch, |view, camera, length, sample, residual, importance| {
                all.add(camera, sample, residual, length, width, importance);
                views[view * SIDES + side(sample)].add(camera, sample, residual, length, width, importance);
            })?;
        let mut scatter = DMatrix::zeros(self.body.step_len(), self.body.step_len());
        views.iter().for_each(|view| scatter += view.scatter(&self.body, frames));
        Some(Evidence { equations: all.finish(&self.body, frames), scatter, agreement: agreement.share() })
    }
}

impl SilhouetteLikelihood {
    /// Calls `add` with every residual at a pose: view, its camera and length, sample, residual, and what it counts.
    /// Where the links are, and how far the outlines agree; `None` of a likelihood that cannot be descended, and for a
    /// pose that is not finite.
    fn residuals<'s>(
        &self,
        pose: &Pose,
        scratch: &'s mut LikelihoodScratch,
        mut add: impl FnMut(usize, &Camera, f64, &OutlineSample, OutlineResidual, f64),
    ) -> Option<(&'s LinkFrames, OutlineAgreement)> {
        let outline = self.outline.as_ref()?;
        let LikelihoodScratch { bodies, descent, .. } = scratch;
        let frames = bodies.first_mut()?.place(&self.body, pose)?;
        let mut agreement = OutlineAgreement::default();
        let buffers = descent.get_or_insert_with(|| self.descent_scratch());
        for (index, view) in self.views.iter().enumerate() {
            let Some(observed) = view.outline.as_ref().filter(|_| view.has_image) else { continue };
            let length = descent::length_px(&view.camera);
            let add = |sample: &OutlineSample, residual| {
                add(index, &view.camera, length, sample, residual, self.importance.of(sample));
            };
            let found =
                descent::each_residual(&self.body, frames, outline, &view.camera, index, observed, buffers, add);
            agreement.add(found);
        }
        Some((frames, agreement))
    }
}

impl SilhouetteLikelihood {
    /// The same likelihood, in whose descent hands and feet without joints of their own count a tenth: for bodies that
    /// were calibrated, whose hands and feet still differ from the actor's in kind.
    pub fn with_light_extremities(self) -> Self {
        Self { importance: OutlineImportance::new(&self.body), ..self }
    }

    /// Factor on the weight of the prior for the number of cameras that took an image with an outline.
    fn prior_weight(&self) -> f64 {
        match self.views.iter().filter(|view| view.has_image && view.outline.is_some()).count() {
            0 | 1 => PRIOR_OF_ONE_VIEW,
            2 => PRIOR_OF_TWO_VIEWS,
            _ => 1.0,
        }
    }

    /// Buffers for residuals in all views.
    pub(super) fn descent_scratch(&self) -> DescentScratch {
        DescentScratch::new(self.views.iter().map(|view| &view.camera))
    }

    /// The ideal cameras whose images are compared.
    pub(super) fn cameras(&self) -> impl Iterator<Item = &Camera> + Clone {
        self.views.iter().map(|view| &view.camera)
    }

    /// The outlines in what the cameras saw, one a view; `None` in views without any. Of a likelihood that can be
    /// descended.
    pub(super) fn into_outlines(
        mut self,
        observation: &Observation,
    ) -> Result<Vec<Option<ObservedOutline>>, TrackError> {
        self.prepare(observation)?;
        Ok(self.views.into_iter().map(|view| view.outline.filter(|_| view.has_image)).collect())
    }
}

impl SilhouetteLikelihood {
    /// Energies of several poses. With plausibility, silhouettes of all poses come first: what looks for depths is
    /// small, and stays in the processor's nearest memory for as long as nothing else is done.
    fn judge(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut LikelihoodScratch, may_reject: bool) {
        let LikelihoodScratch { bodies, compare, solids, .. } = scratch;
        let Some(plausibility) = &self.plausibility else {
            for (pose, energy) in poses.iter().zip(energies) {
                *energy = self.silhouette_energy(pose, &mut bodies[0], compare, |_| false);
            }
            return;
        };
        bodies.resize_with(bodies.len().max(poses.len()), PlacedBody::default);
        for ((pose, energy), placed) in poses.iter().zip(energies.iter_mut()).zip(bodies.iter_mut()) {
            let rejects = |frames: &LinkFrames| may_reject && plausibility.rejects(frames, solids);
            *energy = self.silhouette_energy(pose, placed, compare, rejects);
        }
        let camera = self.capsules_camera();
        for ((pose, energy), placed) in poses.iter().zip(energies).zip(bodies) {
            if energy.is_finite() {
                *energy += plausibility.penalty(pose, placed, camera, solids);
            }
        }
    }

    /// The energy by silhouettes; NaN for a pose that is not finite, infinite for one that is rejected.
    fn silhouette_energy(
        &self,
        pose: &Pose,
        placed: &mut PlacedBody,
        compare: &mut CompareBuffers,
        rejects: impl FnOnce(&LinkFrames) -> bool,
    ) -> f64 {
        match placed.place(&self.body, pose).map(rejects) {
            None => f64::NAN,
            Some(true) => f64::INFINITY,
            Some(false) => self.energy_of(placed, compare),
        }
    }

    /// The energy of a body that was put into a pose. Where [`Self::capsules_camera`] is a camera, the body's capsules
    /// are afterwards those in its frame.
    fn energy_of(&self, placed: &mut PlacedBody, buffers: &mut CompareBuffers) -> f64 {
        if self.road == ComparisonStrategy::Skin {
            placed.deform(&self.body);
        }
        let (mut sum, mut count) = (0.0, 0.0);
        for (index, view) in self.views.iter().enumerate().filter(|(_, view)| view.has_image) {
            if let Some(energy) = self.view_energy(index, view, placed, &mut buffers.views) {
                sum += energy + self.sides_energy(view, &placed.frames, &mut buffers.limbs);
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }

    /// The camera in whose frame [`Self::energy_of`] leaves capsules; `None` where not all solids are tapered capsules
    /// or silhouettes are drawn in another way.
    fn capsules_camera(&self) -> Option<&Camera> {
        let last = self.views.iter().rfind(|view| view.has_image);
        last.filter(|_| self.road == ComparisonStrategy::Capsules).map(|view| &view.camera)
    }
}

impl ObservedCamera {
    fn new(camera: &Camera, road: ComparisonStrategy, settings: &SilhouetteSettings) -> Self {
        let rectification = Rectification::new(camera);
        let camera = Camera { distortion: Distortion::default(), ..camera.clone() };
        let nothing = Mask::new(camera.pinhole.width, camera.pinhole.height);
        let observed = ObservedView::new(&camera, nothing, road, settings);
        let shown = rectification.as_ref().and_then(Rectification::shown);
        Self { camera, has_image: true, rectification, shown, observed, insides: None, sides: None, outline: None }
    }

    fn observe(&mut self, mask: &Mask, road: ComparisonStrategy, descends: bool, settings: &SilhouetteSettings) {
        let ideal = self.rectification.as_ref().map_or_else(|| mask.clone(), |lens| lens.rectify(mask));
        let (pinhole, tau) = (&self.camera.pinhole, settings.contour_reach * f64::from(self.camera.pinhole.height));
        self.insides = (settings.silhouette == SilhouetteTerm::Sampled).then(|| LimbInsides::new(pinhole, &ideal));
        self.sides = (settings.limb_side_weight > 0.0).then(|| LimbSides::new(pinhole, &ideal, tau));
        self.outline = descends
            .then(|| ObservedOutline::new(&ideal, self.shown.as_ref(), descent::length_px(&self.camera)))
            .flatten();
        self.observed = ObservedView::new(&self.camera, ideal, road, settings);
    }
}

impl SilhouetteTerm {
    /// The term's value by areas; `None` where neither mask has a pixel, and of samples, which know no areas.
    fn value(self, overlap: &Overlap) -> Option<f64> {
        if overlap.union() == 0 {
            return None;
        }
        let share = |part: u64| {
            let whole = part + overlap.both;
            if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
        };
        Some(match self {
            Self::Bidirectional => 0.5 * (share(overlap.only_model) + share(overlap.only_observed)),
            Self::Overlap => 1.0 - overlap.iou(),
            Self::Sampled => return None,
        })
    }
}

/// Into how many groups the outline of a link in a view falls by the way it faces.
const SIDES: usize = 4;

/// Which way a sample faces. Residuals of one side of a limb go wrong together: of the wrong girth, the sides part.
fn side(sample: &OutlineSample) -> usize {
    usize::from(sample.normal[0] > sample.normal[1]) + 2 * usize::from(sample.normal[0] > -sample.normal[1])
}

fn check_fit(views: &[ObservedCamera], observation: &Observation) -> Result<(), TrackError> {
    let mismatch = |detail| Err(TrackError::ObservationMismatch { frame: observation.frame, detail });
    if views.len() != observation.silhouettes.len() {
        let found = observation.silhouettes.len();
        return mismatch(format!("expected {} silhouettes, one per camera, found {found}", views.len()));
    }
    if let Some(moment) = &observation.moment {
        let found = [moment.camera_from_world.len(), moment.exposed_s.len()];
        if found != [views.len(); 2] {
            return mismatch(format!("expected the places and times of {} cameras, found {found:?}", views.len()));
        }
    }
    for (view, mask) in views.iter().zip(&observation.silhouettes) {
        let (expected, found) = (view.camera.pinhole, (mask.width(), mask.height()));
        if (expected.width, expected.height) != found {
            let name = &view.camera.name;
            let (width, height) = (expected.width, expected.height);
            return mismatch(format!("camera {name} is {width} x {height} pixels, its mask {} x {}", found.0, found.1));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
