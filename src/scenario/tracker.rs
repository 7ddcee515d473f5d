//! `[tracker.*]`: the tracker and its settings.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::diagnostic::{Diagnostic, did_you_mean};
use super::latent::{GpdmGraphSettings, GpdmSettings, LatentTrackerSettings, SwitchingGpdmSettings};
use super::program::ProgramTrackerSettings;
use super::tracker_kind::{SearchSettings, TrackerKind, TrainingUse};
use skiagraph_core::body::Prediction;
use skiagraph_track::tracker::{
    ContourTerm, Estimator, FilterSettings, Kernel, KeypointEvidenceSettings, KeypointTrackerSettings,
    PlausibilitySettings, RefinementSettings, SilhouetteSettings, SilhouetteTerm,
};

/// The tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TrackerSettings {
    /// The annealed particle filter of [Skinned APF], with refinement.
    AnnealedParticleFilter(AnnealedParticleFilterSettings),
    /// Triangulates the keypoints of `[observation.keypoints]` and fits the body to the points.
    Keypoints(KeypointTrackerSettings),
    /// Never moves: the baseline that every tracker must beat.
    Frozen(NoSettings),
    /// Particles in the latent space of one GPDM, learned from `[[training.clips]]` or read from `model_file`.
    Gpdm(LatentTrackerSettings<GpdmSettings>),
    /// The same in several latent spaces, which particles leave with a constant probability.
    SwitchingGpdm(LatentTrackerSettings<SwitchingGpdmSettings>),
    /// The same on a GPDM graph.
    GpdmGraph(LatentTrackerSettings<GpdmGraphSettings>),
    /// A reference that uses ground truth: the training pose nearest to the truth, at the true root.
    NearestTrainingPose(NoSettings),
    /// The truth plus an added error, to check the metrics.
    Oracle(OracleSettings),
    /// Another program (`docs/protocol.md`). Only `--exec` can set it: a file that has it is refused.
    Program(ProgramTrackerSettings),
}

/// What a particle filter compares poses with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EvidenceSource {
    /// Silhouettes.
    #[default]
    Silhouettes,
    /// The keypoints of `[observation.keypoints]`. The body is not calibrated, because the calibration needs
    /// silhouettes.
    Keypoints,
    /// Silhouettes and keypoints. Where the detector places its points on the body is learned from frame to frame.
    Both,
}

/// The annealed particle filter. One frame costs `particles` x `layers` likelihood evaluations, plus the refinement;
/// with the refinement, frames that need no search cost none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AnnealedParticleFilterSettings {
    /// The algorithm as printed in [Skinned APF], without refinement.
    pub paper: bool,
    /// What poses are compared with. Keypoints add to the energy the mean of a robust error of their distances from the
    /// body's points in the images, weighted by confidence. They add rows to the descents. Default: `"silhouettes"`.
    #[serde(skip_serializing_if = "super::is_default")]
    pub evidence: EvidenceSource,
    /// How keypoints count, with `evidence = "keypoints"` or `"both"`.
    #[serde(skip_serializing_if = "super::is_default")]
    pub keypoints: KeypointEvidenceSettings,
    /// Number of particles. Default: 60; 200 with `paper = true`, which takes about as long.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub particles: Option<usize>,
    /// Annealing layers.
    pub layers: usize,
    /// Share of the particles that survive a layer: effective sample size over particles. The covariance shrinks by the
    /// same factor.
    pub survival_rate: f64,
    /// How areas of silhouettes are compared: [Skinned APF]'s D_s, in [0, 1]. B pixels are in the model only, R in the
    /// observation only, Y in both.
    pub silhouette: SilhouetteTerm,
    /// How contours are compared: [Skinned APF]'s D_c, in [0, 1]. It is the mean over contour pixels of min(d, reach) /
    /// reach, with d the distance to the other contour.
    pub contour: ContourTerm,
    /// Weight of the contour term relative to the area term; 0 disables it.
    pub contour_weight: f64,
    /// Distance at which the contour term and the limb side term saturate, image heights. Default: 1/24.
    pub contour_reach: f64,
    /// Weight of the distance between the sides of limbs (the two outlines of every capsule) and the observed contour;
    /// 0 disables it. A side inside the observed silhouette has no contour near it and counts as missed.
    pub limb_side_weight: f64,
    /// Factor on the standard deviations of the initial covariance, which are those of the training motion's
    /// inter-frame differences. Default: 1.5, chosen from 0.5, 1, 1.5 and 2 on CMU 16_15 and 35_02, matched and
    /// mismatched.
    pub proposal_scale: f64,
    /// Where the particles of a new frame start.
    pub prediction: Prediction,
    /// How surviving particles are perturbed.
    pub kernel: Kernel,
    /// How the estimate is computed from the particles.
    pub estimator: Estimator,
    /// Whether layers search the trunk, arms and legs one after another instead of the whole body. Requires five layers
    /// or more, `prediction = "none"` and no shrinking kernel. Default: false.
    #[serde(skip_serializing_if = "super::is_default")]
    pub partitioned: bool,
    /// Penalty for poses that penetrate the ground or themselves or exceed joint limits; 1 rad beyond a limit counts as
    /// 0.1 m. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plausibility: Option<PlausibilitySettings>,
    /// After the last layer, Gauss-Newton descents fit the body's outline to the observed ones, and lost limbs are
    /// searched (`results/search.md`). Descents start from the last estimate, this frame's, the pose that continues the
    /// motion and the heaviest particle. Only lower energy is accepted. With two cameras or more, masks that only lack
    /// parts of the body, or only show more, are doubted. Frames whose outlines agree without particles are not
    /// searched (`sure`); the report says in how many frames particles and limbs were searched, and in how many they
    /// found the pose. Not with `paper = true`.
    pub refinement: RefinementSettings,
}

/// Default particles of the algorithm as printed, and of the refined one, which then takes the same time
/// (`results/search.md`).
const PAPER_PARTICLES: usize = 200;
const REFINED_PARTICLES: usize = 60;

/// A tracker's table without keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoSettings {}

/// The truth plus this error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OracleSettings {
    /// Constant displacement of the root, world axes, metres.
    pub root_offset_m: [f64; 3],
    /// Standard deviation of independent noise on every coordinate of the root, metres.
    pub root_noise_m: f64,
    /// Standard deviation of independent noise on every joint angle, degrees.
    pub angle_noise_deg: f64,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self::AnnealedParticleFilter(AnnealedParticleFilterSettings::default())
    }
}

impl TrackerSettings {
    /// All built-in trackers, with their default settings.
    pub fn all() -> [Self; 8] {
        [
            Self::default(),
            Self::Gpdm(LatentTrackerSettings::default()),
            Self::SwitchingGpdm(LatentTrackerSettings::default()),
            Self::GpdmGraph(LatentTrackerSettings::default()),
            Self::Keypoints(KeypointTrackerSettings::default()),
            Self::Frozen(NoSettings::default()),
            Self::NearestTrainingPose(NoSettings::default()),
            Self::Oracle(OracleSettings::default()),
        ]
    }

    /// The tracker with this name and its default settings.
    ///
    /// # Errors
    /// [`Diagnostic`] with the known names for an unknown name.
    pub fn named(name: &str) -> Result<Self, Diagnostic> {
        Self::all().into_iter().find(|t| t.name() == name).ok_or_else(|| {
            let known = Self::all().map(|t| t.name());
            let guess = did_you_mean(name, known).map(|g| format!(", did you mean `{g}`?")).unwrap_or_default();
            Diagnostic {
                origin: format!("tracker {name}"),
                message: format!("no such tracker{guess} (known: {})", known.join(", ")),
                ..Diagnostic::default()
            }
        })
    }

    /// The kind of tracker, with all settings that follow.
    pub fn kind(&self) -> TrackerKind<'_> {
        match self {
            Self::AnnealedParticleFilter(settings) => TrackerKind {
                training: TrainingUse::Optional,
                search: Some(settings.search()),
                ..TrackerKind::named("annealed_particle_filter")
            },
            Self::Gpdm(settings) => settings.kind(),
            Self::SwitchingGpdm(settings) => settings.kind(),
            Self::GpdmGraph(settings) => settings.kind(),
            Self::Keypoints(_) => TrackerKind {
                explanation: Some("keypoints: triangulation and inverse kinematics"),
                ..TrackerKind::named("keypoints")
            },
            Self::Frozen(_) => TrackerKind { explanation: Some("frozen: never moves"), ..TrackerKind::named("frozen") },
            Self::NearestTrainingPose(_) => TrackerKind {
                explanation: Some("oracle: the training pose nearest to the truth, at the true root"),
                training: TrainingUse::Required,
                needs_truth: true,
                ..TrackerKind::named("nearest_training_pose")
            },
            Self::Oracle(_) => TrackerKind {
                explanation: Some("oracle: the truth plus a planted error"),
                needs_truth: true,
                ..TrackerKind::named("oracle")
            },
            Self::Program(_) => TrackerKind::named("program"),
        }
    }

    /// Whether it uses keypoints.
    pub fn needs_keypoints(&self) -> bool {
        match self {
            Self::Keypoints(_) => true,
            Self::AnnealedParticleFilter(settings) => settings.evidence != EvidenceSource::Silhouettes,
            _ => false,
        }
    }

    /// The tracker's name on the command line and in scenarios.
    pub fn name(&self) -> &'static str {
        self.kind().name
    }
}

impl AnnealedParticleFilterSettings {
    /// Settings with this search and defaults for everything else; the inverse of [`Self::search`].
    pub fn from_search(search: &SearchSettings) -> Self {
        let FilterSettings { particles, layers, survival_rate, kernel, estimator } = search.filter;
        let SilhouetteSettings { silhouette, contour, contour_weight, contour_reach, limb_side_weight } =
            search.likelihood;
        Self {
            paper: search.refinement.is_none(),
            evidence: EvidenceSource::Silhouettes,
            keypoints: KeypointEvidenceSettings::default(),
            particles: Some(particles),
            layers,
            survival_rate,
            silhouette,
            contour,
            contour_weight,
            contour_reach,
            limb_side_weight,
            proposal_scale: 1.5,
            prediction: Prediction::None,
            kernel,
            estimator,
            partitioned: false,
            plausibility: search.plausibility,
            refinement: search.refinement.unwrap_or_default(),
        }
    }

    /// Its search; the algorithm as printed has no refinement.
    pub fn search(&self) -> SearchSettings {
        SearchSettings {
            filter: FilterSettings {
                particles: self.particles.unwrap_or(if self.paper { PAPER_PARTICLES } else { REFINED_PARTICLES }),
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
            plausibility: self.plausibility,
            refinement: (!self.paper).then_some(self.refinement),
        }
    }
}

impl Default for AnnealedParticleFilterSettings {
    fn default() -> Self {
        let mut settings = Self::from_search(&SearchSettings::default());
        (settings.paper, settings.particles) = (false, None);
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::super::{GpdmGraphSettings, RootMode};
    use super::*;

    #[test]
    fn a_trackers_name_is_the_key_of_its_settings() {
        for settings in TrackerSettings::all() {
            let written = serde_json::to_value(&settings).unwrap();
            assert_eq!(written.as_object().unwrap().keys().collect::<Vec<_>>(), [settings.name()]);
        }
    }

    #[test]
    fn given_roots_need_the_truth_and_a_model_file_needs_no_learning() {
        let settings = LatentTrackerSettings::<GpdmGraphSettings>::default();
        let of = |settings: &LatentTrackerSettings<GpdmGraphSettings>| {
            let kind = settings.kind();
            (kind.learns(), kind.training, kind.needs_truth)
        };
        assert_eq!(of(&settings), (true, TrainingUse::Required, false));
        let read = LatentTrackerSettings { model_file: Some("walk.model".to_owned()), ..settings.clone() };
        assert_eq!(of(&read), (false, TrainingUse::Unused, false));
        let oracle = LatentTrackerSettings { root: RootMode::Oracle, ..settings };
        assert_eq!(of(&oracle), (true, TrainingUse::Required, true));
    }
}
