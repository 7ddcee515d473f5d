//! One camera and its image, as a likelihood compares bodies with it.

use nalgebra::Isometry3;

use super::descent::{self, ObservedOutline};
use super::limbs::{LimbInsides, LimbSides};
use super::mask_trust::{MaskErrors, MaskTrust};
use super::observed_view::{ComparisonStrategy, ObservedView};
use super::rectification::Rectification;
use super::{SilhouetteSettings, SilhouetteTerm};
use skiagraph_core::camera::{Camera, Distortion};
use skiagraph_core::raster::Mask;

#[derive(Debug)]
pub(super) struct ObservedCamera {
    /// Its ideal pinhole, placed where the camera was when the image was taken.
    pub(super) camera: Camera,
    /// Motion of the scene as this camera sees it, which corrects its given pose.
    pub(super) correction: Isometry3<f64>,
    /// Whether it took an image; without one the view is ignored.
    pub(super) has_image: bool,
    rectification: Option<Rectification>,
    /// The pixels of the pinhole's image that the camera shows; `None` if it shows all.
    shown: Option<Mask>,
    pub(super) observed: ObservedView,
    /// Data for sampling points inside limbs; `None` if they are not sampled.
    pub(super) insides: Option<LimbInsides>,
    /// Data of the limb side term; `None` if its weight is 0.
    pub(super) sides: Option<LimbSides>,
    /// The observed outline for descent; `None` if there is none or descent is disabled.
    pub(super) outline: Option<ObservedOutline>,
    /// How the masks differed from the last estimates.
    pub(super) errors: MaskErrors,
    pub(super) trust: MaskTrust,
}

impl ObservedCamera {
    pub(super) fn new(camera: &Camera, strategy: ComparisonStrategy, settings: &SilhouetteSettings) -> Self {
        let rectification = Rectification::new(camera);
        let camera = Camera { distortion: Distortion::default(), ..camera.clone() };
        let nothing = Mask::new(camera.pinhole.width, camera.pinhole.height);
        let observed = ObservedView::new(&camera, nothing, strategy, settings);
        let shown = rectification.as_ref().and_then(Rectification::shown);
        let correction = Isometry3::identity();
        Self {
            camera,
            correction,
            has_image: true,
            rectification,
            shown,
            observed,
            insides: None,
            sides: None,
            outline: None,
            errors: MaskErrors::default(),
            trust: MaskTrust::FULL,
        }
    }

    pub(super) fn observe(
        &mut self,
        mask: &Mask,
        strategy: ComparisonStrategy,
        descends: bool,
        settings: &SilhouetteSettings,
    ) {
        let ideal = self.rectification.as_ref().map_or_else(|| mask.clone(), |lens| lens.rectify(mask));
        let (pinhole, tau) = (&self.camera.pinhole, settings.contour_reach * f64::from(self.camera.pinhole.height));
        self.insides = (settings.silhouette == SilhouetteTerm::Sampled).then(|| LimbInsides::new(pinhole, &ideal));
        self.sides = (settings.limb_side_weight > 0.0).then(|| LimbSides::new(pinhole, &ideal, tau));
        self.outline = descends
            .then(|| ObservedOutline::new(&ideal, self.shown.as_ref(), descent::length_px(&self.camera)))
            .flatten();
        self.observed = ObservedView::new(&self.camera, ideal, strategy, settings);
    }
    /// Takes what another body's likelihood has prepared of the same image, and gives it what was here.
    pub(super) fn exchange_images(&mut self, other: &mut Self) {
        std::mem::swap(&mut self.observed, &mut other.observed);
        std::mem::swap(&mut self.insides, &mut other.insides);
        std::mem::swap(&mut self.sides, &mut other.sides);
    }
}
