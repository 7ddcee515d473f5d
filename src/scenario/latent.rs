//! `[tracker.gpdm]`, `[tracker.switching_gpdm]` and `[tracker.gpdm_graph]`: particles in learned latent spaces
//! (`[GPDM graph]`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::tracker_kind::{LearnedMotion, SearchSettings, TrackerKind, TrainingUse};
use skiagraph_track::motion_model::gpdm::TrainingOptions;
use skiagraph_track::motion_model::gpdm_graph::{Detector, GraphSettings};
use skiagraph_track::motion_model::{Initialisation, InterTransition, JumpRule, LatentSettings, RootMotion};
use skiagraph_track::tracker::{
    ContourTerm, Estimator, FilterSettings, Kernel, RefinementSettings, SilhouetteSettings, SilhouetteTerm,
};

/// Properties of a kind of latent motion model: how it is learned, and how particles change models.
pub trait LatentKind {
    const NAME: &str;

    fn learning(&self) -> GraphSettings;

    /// How particles change from one model to another.
    fn transition(&self) -> InterTransition;
}

/// A particle filter in latent space ([GPDM graph], section 3.3). One frame costs `particles` x `layers` likelihood
/// evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, bound(deserialize = "T: Default + Deserialize<'de>"))]
#[schemars(rename = "{T}Tracker", bound = "T: Default + Serialize + JsonSchema")]
pub struct LatentTrackerSettings<T> {
    /// How the motion model is learned.
    pub model: T,
    /// A model of `skiagraph train` in place of one learned in the run: its path, relative to the scenario. It must
    /// match the tracker's robot, the frame rate and the tracker (`gpdm`, else `gpdm-graph`). It must not have been
    /// learned from frames of the test. Not with training keys of `model`. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model_file: Option<String>,
    /// Number of particles. Default: 1000, as in [GPDM graph].
    pub particles: usize,
    /// Annealing layers; 1 is the plain particle filter of [GPDM graph].
    pub layers: usize,
    /// Effective share of the particles after weighting.
    pub survival_rate: f64,
    /// Source of the root.
    pub root: RootMode,
    /// Least standard deviation of the process noise, as a share of the latents' spread.
    pub noise_floor: f64,
    /// Standard deviation of the initial latents around their training points, as a share of the latents' spread.
    pub start_jitter: f64,
    /// Spread of particles off the latent manifold, as a multiple of the distance between training frames and the most
    /// similar frames at other times; 0 keeps them on it, as in [GPDM graph].
    pub residual_scale: f64,
    /// Time constant with which such offsets decay, seconds.
    pub residual_s: f64,
    /// Factor on the noise of the root's steps (estimated from training, at least 2 mm and 0.3 degrees per frame).
    /// Default: 5, chosen on CMU takes other than those of `scenarios/monocular`.
    pub root_noise_scale: f64,
    /// Source of the root's motion, which [GPDM graph] does not specify.
    pub root_motion: RootMotion,
    /// Whether particles at the end of a model continue in the next model of the recording. At the recording's end they
    /// continue in the training frame most similar in pose and motion, within the distance of a jump. `gpdm` stays
    /// within its own model.
    pub natural_edges: bool,
    /// How particles are distributed among training poses similar to the start pose.
    pub initialisation: Initialisation,
    /// As in `[tracker.annealed_particle_filter]`.
    pub silhouette: SilhouetteTerm,
    /// As in `[tracker.annealed_particle_filter]`.
    pub contour: ContourTerm,
    /// As in `[tracker.annealed_particle_filter]`.
    pub contour_weight: f64,
    /// As in `[tracker.annealed_particle_filter]`. Default: 1/24.
    pub contour_reach: f64,
    /// As in `[tracker.annealed_particle_filter]`.
    pub limb_side_weight: f64,
    /// As in `[tracker.annealed_particle_filter]`.
    pub kernel: Kernel,
    /// As in `[tracker.annealed_particle_filter]`.
    pub estimator: Estimator,
    /// After the last layer, Gauss-Newton descents of the heaviest particle fit the silhouettes' outlines, over the
    /// latent point, the offset and the root. The model's prediction of them is the prior. `{}` for the defaults. [GPDM
    /// graph] does not have it. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refinement: Option<LatentRefinementSettings>,
}

/// Refinement of the estimate of a particle filter in latent space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LatentRefinementSettings {
    /// Gauss-Newton steps of every descent.
    pub iterations: usize,
    /// Share of the particles that continue from the refined state, in [0, 1].
    pub share: f64,
}

impl Default for LatentRefinementSettings {
    fn default() -> Self {
        let RefinementSettings { iterations, share, .. } = RefinementSettings::default();
        Self { iterations, share }
    }
}

/// Source of the root.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootMode {
    /// The tracker estimates it.
    #[default]
    Tracked,
    /// The tracker is given the true root of every frame, and every report says so.
    Oracle,
}

/// The original GPDM: one model per training clip, or one of all clips; particles never change models.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GpdmSettings {
    /// Whether one model with one latent space is learned from all training clips together. Not valid with
    /// `model_file`. Default: false.
    #[serde(skip_serializing_if = "super::is_default")]
    pub joint: bool,
    /// How the model is learned.
    pub training: TrainingOptions,
}

/// The switching GPDM, a method compared in [GPDM graph]: the graph's models, which particles leave with a constant
/// probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SwitchingGpdmSettings {
    /// Probability of leaving a model in one frame.
    pub probability: f64,
    /// Length of a clip while segments grow ([GPDM graph], Table 1), seconds.
    pub clip_s: f64,
    /// Greatest reconstruction error of a segment per anatomical joint (TH in [GPDM graph], Table 1), rad^2. Default:
    /// 1/13.
    pub threshold_per_joint: f64,
    /// How each model is learned.
    pub training: TrainingOptions,
}

/// The GPDM graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GpdmGraphSettings {
    /// Length of a clip while segments grow ([GPDM graph], Table 1), seconds.
    pub clip_s: f64,
    /// Greatest reconstruction error of a segment per anatomical joint (TH in [GPDM graph], Table 1), rad^2. Default:
    /// 1/13.
    pub threshold_per_joint: f64,
    /// Detector of frames at which particles may jump to another model.
    pub detector: Detector,
    /// Rule for jumps of particles near such frames.
    pub jump_rule: JumpRule,
    /// Greatest distance of a jump per anatomical joint, rad^2. Default: 1/13.
    pub jump_threshold_per_joint: f64,
    /// Distance at which the probability of a jump is 1/e, per anatomical joint, rad^2; not for `"literal"`. Default:
    /// 0.25/13.
    pub jump_width_per_joint: f64,
    /// Weight of the squared difference of joint velocities, s^2.
    pub velocity_weight: f64,
    /// How each model is learned.
    pub training: TrainingOptions,
}

impl<T: LatentKind> LatentTrackerSettings<T> {
    /// The kind of tracker, with all settings that follow.
    pub(super) fn kind(&self) -> TrackerKind<'_> {
        TrackerKind {
            training: if self.model_file.is_none() { TrainingUse::Required } else { TrainingUse::Unused },
            needs_truth: self.root == RootMode::Oracle,
            search: Some(self.search()),
            learned: Some(self.learned()),
            ..TrackerKind::named(T::NAME)
        }
    }

    pub(crate) fn learned(&self) -> LearnedMotion<'_> {
        LearnedMotion {
            learning: self.model.learning(),
            model_file: self.model_file.as_deref(),
            latent: self.latent(),
            is_given_roots: self.root == RootMode::Oracle,
        }
    }

    /// Its search. Refinement draws no limbs, because the model would not contain such poses.
    pub(crate) fn search(&self) -> SearchSettings {
        SearchSettings {
            filter: FilterSettings {
                particles: self.particles,
                layers: self.layers,
                survival_rate: self.survival_rate,
                kernel: self.kernel,
                estimator: self.estimator,
            },
            likelihood: SilhouetteSettings {
                silhouette: self.silhouette,
                contour: self.contour,
                contour_weight: self.contour_weight,
                contour_reach: self.contour_reach,
                limb_side_weight: self.limb_side_weight,
            },
            plausibility: None,
            refinement: self.refinement.map(|LatentRefinementSettings { iterations, share }| RefinementSettings {
                iterations,
                share,
                limb_every: 0,
                ..RefinementSettings::default()
            }),
        }
    }

    /// How particles move in the model.
    pub(super) fn latent(&self) -> LatentSettings {
        LatentSettings {
            transition: self.model.transition(),
            initialisation: self.initialisation,
            noise_floor: self.noise_floor,
            start_jitter: self.start_jitter,
            residual_scale: self.residual_scale,
            residual_s: self.residual_s,
            root_noise_scale: self.root_noise_scale,
            root_motion: self.root_motion,
            natural_edges: self.natural_edges,
        }
    }
}

impl LatentKind for GpdmSettings {
    const NAME: &str = "gpdm";

    fn learning(&self) -> GraphSettings {
        GraphSettings { single: true, joint: self.joint, training: self.training.clone(), ..GraphSettings::default() }
    }

    fn transition(&self) -> InterTransition {
        InterTransition::None
    }
}

impl LatentKind for SwitchingGpdmSettings {
    const NAME: &str = "switching_gpdm";

    fn learning(&self) -> GraphSettings {
        GraphSettings {
            clip_s: self.clip_s,
            threshold_per_joint: self.threshold_per_joint,
            training: self.training.clone(),
            ..GraphSettings::default()
        }
    }

    fn transition(&self) -> InterTransition {
        InterTransition::Switching { probability: self.probability }
    }
}

impl LatentKind for GpdmGraphSettings {
    const NAME: &str = "gpdm_graph";

    fn learning(&self) -> GraphSettings {
        GraphSettings {
            clip_s: self.clip_s,
            threshold_per_joint: self.threshold_per_joint,
            detector: self.detector,
            training: self.training.clone(),
            single: false,
            joint: false,
        }
    }

    fn transition(&self) -> InterTransition {
        InterTransition::Graph {
            rule: self.jump_rule,
            threshold: self.jump_threshold_per_joint,
            width: self.jump_width_per_joint,
            velocity_weight: self.velocity_weight,
        }
    }
}

impl<T: Default> Default for LatentTrackerSettings<T> {
    fn default() -> Self {
        let FilterSettings { particles, layers, survival_rate, kernel, estimator } =
            FilterSettings::particle_filter(1000);
        let SilhouetteSettings { silhouette, contour, contour_weight, contour_reach, limb_side_weight } =
            SilhouetteSettings::default();
        let latent = LatentSettings::default();
        Self {
            model: T::default(),
            model_file: None,
            particles,
            layers,
            survival_rate,
            root: RootMode::Tracked,
            noise_floor: latent.noise_floor,
            start_jitter: latent.start_jitter,
            residual_scale: latent.residual_scale,
            residual_s: latent.residual_s,
            root_noise_scale: latent.root_noise_scale,
            root_motion: latent.root_motion,
            natural_edges: latent.natural_edges,
            initialisation: latent.initialisation,
            silhouette,
            contour,
            contour_weight,
            contour_reach,
            limb_side_weight,
            kernel,
            estimator,
            refinement: None,
        }
    }
}

impl Default for SwitchingGpdmSettings {
    fn default() -> Self {
        let GraphSettings { clip_s, threshold_per_joint, training, .. } = GraphSettings::default();
        Self { probability: 0.05, clip_s, threshold_per_joint, training }
    }
}

impl Default for GpdmGraphSettings {
    fn default() -> Self {
        let GraphSettings { clip_s, threshold_per_joint, detector, training, .. } = GraphSettings::default();
        Self {
            clip_s,
            threshold_per_joint,
            detector,
            jump_rule: JumpRule::StayWeighted,
            jump_threshold_per_joint: 1.0 / 13.0,
            jump_width_per_joint: 0.25 / 13.0,
            velocity_weight: 0.02,
            training,
        }
    }
}
