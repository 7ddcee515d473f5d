//! The energy of a pose from silhouettes: `[Skinned APF]` Eq. 3.

use rayon::prelude::*;

use super::calibration::{CameraCorrection, OutlineImportance};
use super::descent::{
    self, Accumulator, BodyOutline, Density, DescentScratch, ObservedOutline, OutlineAgreement, OutlineResidual,
    OutlineSample,
};
use super::mask_trust::{MaskErrors, MaskTrust};
use super::observed_camera::ObservedCamera;
use super::observed_view::{ComparisonStrategy, ViewScratch};
use super::placed_body::PlacedBody;
use super::plausibility::{Plausibility, PlausibilitySettings};
use super::{Likelihood, SilhouetteSettings, TrackError};
use crate::motion_model::{NormalEquations, SettingError};
use skiagraph_core::body::{Humanoid, LinkFrames, Pose, capsules_in_camera};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::contact::InterpenetrationScratch;
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_core::raster::TaperedCapsule;

/// Factors on the prior's weight if one camera sees an outline, and if two do: one view does not determine depth, and
/// with two some limbs stay hidden, which a free descent then fits to any nearby outline. Tuned on one walk: with one
/// camera 30 is as good and 100 worse, with two 10 to 60 are as good.
const PRIOR_OF_ONE_VIEW: f64 = 40.0;
const PRIOR_OF_TWO_VIEWS: f64 = 20.0;

/// `E = 1/N_v sum_v (D_s + alpha D_c)`: `[Skinned APF]` Eq. 3, with alpha inside the sum. Each view may have a third
/// term, for the sides of limbs ([`SilhouetteSettings::limb_side_weight`]).
///
/// Cameras are placed where the observation reports them, and a camera without a new image is ignored. Views in which
/// neither the model nor the observation has a pixel are not counted in N_v; without any view left the energy is 0,
/// because nothing was seen and nothing is missed. A view in which only one of them has pixels counts in full, so that
/// a particle cannot win by leaving the image.
///
/// Observed masks are rectified once per frame (nearest neighbour), and everything is compared in ideal pinhole images.
/// Bodies of tapered capsules only, and bodies with a skin, are compared by
/// [`skiagraph_core::raster::SilhouetteComparer`]; other solids, and two-sided contours, are rendered into masks.
#[derive(Debug)]
pub struct SilhouetteLikelihood {
    body: Humanoid,
    settings: SilhouetteSettings,
    views: Vec<ObservedCamera>,
    strategy: ComparisonStrategy,
    /// Surfaces for descent; `None` if descent is disabled.
    outline: Option<BodyOutline>,
    importance: OutlineImportance,
    plausibility: Option<Plausibility>,
}

/// Scratch buffers of one thread.
pub struct LikelihoodScratch {
    /// One for each of the poses evaluated together.
    bodies: Vec<PlacedBody>,
    compare: CompareBuffers,
    solids: InterpenetrationScratch,
    descent: Option<DescentScratch>,
}

struct CompareBuffers {
    views: ViewScratch,
    limbs: Vec<TaperedCapsule>,
}

impl SilhouetteLikelihood {
    /// The likelihood of poses of `body` for observations by the cameras of `rig`.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of its range or the rig has no camera.
    pub fn new(body: Humanoid, rig: &CameraRig, settings: SilhouetteSettings) -> Result<Self, SettingError> {
        settings.validate()?;
        if rig.cameras.is_empty() {
            return Err(SettingError::new("cameras", "at least 1", 0));
        }
        let strategy = ComparisonStrategy::of(&body, &settings);
        let views =
            parallel::map(rig.cameras.len(), |camera| ObservedCamera::new(&rig.cameras[camera], strategy, &settings));
        let (outline, importance, plausibility) = (None, OutlineImportance::default(), None);
        Ok(Self { body, settings, views, strategy, outline, importance, plausibility })
    }

    /// Adds the plausibility term, which penalises or rejects poses that penetrate the ground or themselves or exceed
    /// joint limits.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of its range.
    pub fn with_plausibility(self, settings: PlausibilitySettings) -> Result<Self, SettingError> {
        Ok(Self { plausibility: Some(Plausibility::new(&self.body, settings)?), ..self })
    }

    /// Corrects the given poses of the cameras: each camera sees the scene moved by its correction.
    pub fn with_corrected_cameras(mut self, corrections: &[CameraCorrection]) -> Self {
        for (view, correction) in self.views.iter_mut().zip(corrections) {
            view.correction = correction.motion();
            view.camera.camera_from_world *= view.correction;
        }
        self
    }

    /// Enables descent ([`Likelihood::linearise`]).
    pub fn with_descent(self) -> Self {
        Self { outline: Some(BodyOutline::new(&self.body)), ..self }
    }
}

impl SilhouetteLikelihood {
    /// One view's term of Eq. 3 without the limb sides; `None` if neither mask has a pixel.
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
            None => drawn.and_then(|drawn| self.settings.silhouette.value(&drawn.overlap, view.trust)),
            Some(insides) => {
                capsules_in_camera(&self.body, &placed.frames, &view.camera, &mut placed.capsules);
                insides.share_missed(&placed.capsules).map(|missed| view.trust.lacking * missed)
            }
        };
        let contour = drawn.and_then(|drawn| drawn.contour).unwrap_or(0.0);
        Some(silhouette? + self.settings.contour_weight * view.trust.of_contour() * contour)
    }

    /// The limb side term of one view for a body with links at `frames`.
    fn sides_energy(&self, view: &ObservedCamera, frames: &LinkFrames, limbs: &mut Vec<TaperedCapsule>) -> f64 {
        let Some(sides) = &view.sides else { return 0.0 };
        capsules_in_camera(&self.body, frames, &view.camera, limbs);
        self.settings.limb_side_weight * sides.mean_distance(limbs)
    }
}

impl Likelihood for SilhouetteLikelihood {
    type Scratch = LikelihoodScratch;

    fn scratch(&self) -> LikelihoodScratch {
        let painted = if self.strategy == ComparisonStrategy::Masks { self.views.iter() } else { [].iter() };
        let views = ViewScratch::new(painted.map(|view| &view.camera));
        let compare = CompareBuffers { views, limbs: Vec::new() };
        let (bodies, solids) = (vec![PlacedBody::default()], InterpenetrationScratch::default());
        LikelihoodScratch { bodies, compare, solids, descent: None }
    }

    fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError> {
        check_fit(&self.views, observation)?;
        let (strategy, descends, settings) = (self.strategy, self.outline.is_some(), self.settings);
        self.place_cameras(observation);
        let views = self.views.par_iter_mut().zip(&observation.silhouettes);
        views
            .filter(|(view, _)| view.has_image)
            .for_each(|(view, mask)| view.observe(mask, strategy, descends, &settings));
        self.doubt();
        Ok(())
    }

    fn start(&mut self, start: &Pose) {
        self.views.iter_mut().for_each(|view| view.errors = MaskErrors::default());
        self.learn(start);
        self.doubt();
    }

    fn learn(&mut self, estimate: &Pose) {
        if self.outline.is_none() {
            return;
        }
        let LikelihoodScratch { mut bodies, mut compare, .. } = self.scratch();
        let placed = &mut bodies[0];
        if placed.place(&self.body, estimate).is_none() {
            return;
        }
        if self.strategy == ComparisonStrategy::Skin {
            placed.deform(&self.body);
        }
        for (index, view) in self.views.iter_mut().enumerate().filter(|(_, view)| view.has_image) {
            let drawn = view.observed.compare(&self.body, placed, &view.camera, index, &mut compare.views);
            view.errors.add(&drawn.overlap);
        }
    }

    fn energy(&self, pose: &Pose, scratch: &mut LikelihoodScratch) -> f64 {
        let mut energy = 0.0;
        self.evaluate(&[pose], std::slice::from_mut(&mut energy), scratch, true);
        energy
    }

    fn energies(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut LikelihoodScratch) {
        self.evaluate(poses, energies, scratch, true);
    }

    fn energy_unrejected(&self, pose: &Pose, scratch: &mut LikelihoodScratch) -> f64 {
        let mut energy = 0.0;
        self.evaluate(&[pose], std::slice::from_mut(&mut energy), scratch, false);
        energy
    }

    fn believe(&mut self) -> bool {
        let was_doubted = self.views.iter().any(|view| view.has_image && view.trust != MaskTrust::FULL);
        self.views.iter_mut().for_each(|view| view.trust = MaskTrust::FULL);
        was_doubted
    }

    fn descends(&self) -> bool {
        self.outline.is_some()
    }

    fn linearise(&self, pose: &Pose, width: f64, scratch: &mut LikelihoodScratch) -> Option<NormalEquations> {
        let mut equations = Accumulator::new(self.body.links.len(), pose.world_from_root.translation.vector.into());
        let frames = self.residuals(
            pose,
            Density::of_width(width),
            scratch,
            None,
            |_, camera, length, sample, residual, importance| {
                equations.add(camera, sample, residual, length, width, importance);
            },
        )?;
        Some(NormalEquations {
            prior_weight: prior_weight_of_views(self.seeing()),
            ..equations.finish(&self.body, frames)
        })
    }

    fn agreement(&self, pose: &Pose, width: f64, scratch: &mut LikelihoodScratch) -> Option<f64> {
        let mut agreement = OutlineAgreement::default();
        self.residuals(pose, Density::of_width(width), scratch, Some(&mut agreement), |_, _, _, _, _, _| {})?;
        agreement.share()
    }

    fn views(&self) -> usize {
        self.seeing()
    }
}

impl SilhouetteLikelihood {
    /// Calls `add` with every residual at a pose: the view, its camera and length, the sample, the residual and its
    /// importance; adds to `agreement` how far the outlines agree. Returns the link frames; `None` if descent is
    /// disabled or the pose is not finite.
    fn residuals<'s>(
        &self,
        pose: &Pose,
        density: Density,
        scratch: &'s mut LikelihoodScratch,
        mut agreement: Option<&mut OutlineAgreement>,
        mut add: impl FnMut(usize, &Camera, f64, &OutlineSample, OutlineResidual, f64),
    ) -> Option<&'s LinkFrames> {
        let outline = self.outline.as_ref()?;
        let LikelihoodScratch { bodies, descent, .. } = scratch;
        let frames = bodies.first_mut()?.place(&self.body, pose)?;
        let buffers = descent.get_or_insert_with(|| self.descent_scratch());
        for (index, view) in self.views.iter().enumerate() {
            let Some(observed) = view.outline.as_ref().filter(|_| view.has_image) else { continue };
            let length = descent::length_px(&view.camera);
            let add = |sample: &OutlineSample, residual| {
                add(index, &view.camera, length, sample, residual, self.importance.of(sample));
            };
            let samples = descent::each_residual(
                &self.body,
                frames,
                outline,
                &view.camera,
                index,
                observed,
                density,
                view.trust,
                buffers,
                add,
            );
            if let Some(agreement) = &mut agreement {
                agreement.add(observed.agreement(samples, length));
            }
        }
        Some(frames)
    }
}

impl SilhouetteLikelihood {
    /// As [`Likelihood::prepare`] for an observation that `seen` is prepared for: a likelihood with the same cameras
    /// and settings, whose body or corrections are others. It gives away what it has prepared, and is to be prepared
    /// again before it is asked.
    ///
    /// # Errors
    /// As [`Likelihood::prepare`].
    #[doc(hidden)]
    pub fn prepare_from(&mut self, seen: &mut Self, observation: &Observation) -> Result<(), TrackError> {
        if self.strategy != seen.strategy || self.views.len() != seen.views.len() || self.outline.is_some() {
            return self.prepare(observation);
        }
        self.place_cameras(observation);
        for (own, seen) in self.views.iter_mut().zip(&mut seen.views) {
            own.exchange_images(seen);
        }
        self.doubt();
        Ok(())
    }

    fn place_cameras(&mut self, observation: &Observation) {
        for (index, view) in self.views.iter_mut().enumerate() {
            view.has_image = observation.has_image(index);
            if let Some(moment) = &observation.moment {
                view.camera.camera_from_world = moment.camera_from_world[index] * view.correction;
            }
        }
    }

    /// Gives hands and feet without their own joints a tenth of the weight in descent: for calibrated bodies, whose
    /// hands and feet still differ in kind from the actor's.
    pub fn with_light_extremities(self) -> Self {
        Self { importance: OutlineImportance::new(&self.body), ..self }
    }

    /// Ignores the images of the prepared observation that show nothing; returns whether any other is left.
    pub(super) fn leave_out_empty_images(&mut self, observation: &Observation) -> bool {
        for (view, mask) in self.views.iter_mut().zip(&observation.silhouettes) {
            view.has_image &= !mask.is_empty();
        }
        self.views.iter().any(|view| view.has_image)
    }

    /// Doubts masks by their errors in earlier frames. What a single camera lacks may also be too far away.
    fn doubt(&mut self) {
        let is_alone = self.seeing() < 2;
        for view in &mut self.views {
            view.trust = if is_alone { MaskTrust::FULL } else { view.errors.trust() };
        }
    }

    /// Number of cameras whose image has an outline.
    fn seeing(&self) -> usize {
        self.views.iter().filter(|view| view.has_image && view.outline.is_some()).count()
    }

    pub(super) fn descent_scratch(&self) -> DescentScratch {
        DescentScratch::new(self.views.iter().map(|view| &view.camera))
    }

    /// The ideal cameras whose images are compared.
    pub(super) fn cameras(&self) -> impl Iterator<Item = &Camera> + Clone {
        self.views.iter().map(|view| &view.camera)
    }

    /// The observed outlines, one per view; `None` for views without one. Requires descent.
    pub(super) fn into_outlines(
        mut self,
        observation: &Observation,
    ) -> Result<Vec<Option<ObservedOutline>>, TrackError> {
        self.prepare(observation)?;
        Ok(self.views.into_iter().map(|view| view.outline.filter(|_| view.has_image)).collect())
    }
}

impl SilhouetteLikelihood {
    /// Energies of several poses. With plausibility, the silhouettes of all poses come first: the data of the
    /// penetration tests are small and stay in the processor's first-level cache as long as nothing else runs.
    fn evaluate(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut LikelihoodScratch, may_reject: bool) {
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

    /// The silhouette energy; NaN for a pose that is not finite, infinite for one that is rejected.
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

    /// The energy of a placed body. If [`Self::capsules_camera`] is a camera, the body's capsules are left in its
    /// frame.
    fn energy_of(&self, placed: &mut PlacedBody, buffers: &mut CompareBuffers) -> f64 {
        if self.strategy == ComparisonStrategy::Skin {
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

    /// The camera in whose frame [`Self::energy_of`] leaves capsules; `None` if not all solids are tapered capsules or
    /// silhouettes are rendered in another way.
    fn capsules_camera(&self) -> Option<&Camera> {
        let last = self.views.iter().rfind(|view| view.has_image);
        last.filter(|_| self.strategy == ComparisonStrategy::Capsules).map(|view| &view.camera)
    }
}

/// Factor on the prior's weight for the number of cameras that see something of the body.
pub(super) fn prior_weight_of_views(seeing: usize) -> f64 {
    match seeing {
        0 | 1 => PRIOR_OF_ONE_VIEW,
        2 => PRIOR_OF_TWO_VIEWS,
        _ => 1.0,
    }
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
            return mismatch(format!("expected poses and times of {} cameras, found {found:?}", views.len()));
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
