//! Range checks of the settings of trackers.

use super::latent::{LatentKind, LatentTrackerSettings};
use super::range_checks::{RangeCheck, only_valid_with, require, setting, within};
use super::tracker::{AnnealedParticleFilterSettings, EvidenceSource, OracleSettings, TrackerSettings};
use super::tracker_kind::SearchSettings;
use skiagraph_core::body::Prediction;
use skiagraph_track::tracker::{Kernel, KeypointEvidenceSettings, KeypointTrackerSettings, RefinementSettings};

impl TrackerSettings {
    /// The first invalid value; `table` is the key of the settings.
    pub(super) fn first_problem(&self, table: &str) -> RangeCheck {
        match self {
            Self::AnnealedParticleFilter(settings) => first_of_filter(table, settings),
            Self::Gpdm(settings) => first_of_latent(table, settings),
            Self::SwitchingGpdm(settings) => first_of_latent(table, settings),
            Self::GpdmGraph(settings) => first_of_latent(table, settings),
            Self::Oracle(settings) => first_of_oracle(table, settings),
            Self::Keypoints(settings) => first_of_keypoints(table, settings),
            Self::Program(settings) => settings.first_problem(table),
            Self::Frozen(_) | Self::NearestTrainingPose(_) => Ok(()),
        }
    }
}

fn first_of_filter(table: &str, s: &AnnealedParticleFilterSettings) -> RangeCheck {
    first_of_search(table, &s.search())?;
    s.plausibility.map_or(Ok(()), |plausibility| plausibility.validate()).map_err(|e| setting(table, &e))?;
    s.refinement.validate().map_err(|e| setting(table, &e))?;
    let set = s.paper && s.refinement != RefinementSettings::default();
    require(&format!("{table}.refinement"), !set, "no keys with `paper = true`, which has no refinement", "some")?;
    first_of_evidence(table, s)?;
    if s.partitioned {
        let at = format!("{table}.partitioned");
        only_valid_with(&at, s.layers >= 5, "5 or more `layers`, one per part of the body", s.layers)?;
        let is_still = s.prediction == Prediction::None && !matches!(s.kernel, Kernel::Shrink { .. });
        only_valid_with(&at, is_still, "`prediction = \"none\"` and no shrinking `kernel`", "others")?;
    }
    within(&format!("{table}.proposal_scale"), s.proposal_scale, 1e-6..=1e3)
}

fn first_of_evidence(table: &str, s: &AnnealedParticleFilterSettings) -> RangeCheck {
    s.keypoints.validate().map_err(|e| setting(table, &e))?;
    let (silhouettes, usual) = (s.evidence != EvidenceSource::Keypoints, KeypointEvidenceSettings::default());
    let is_unused = s.evidence == EvidenceSource::Silhouettes && s.keypoints != usual;
    require(&format!("{table}.keypoints"), !is_unused, "no keys unless `evidence` is `keypoints` or `both`", "some")?;
    let expected = "none with `evidence = \"keypoints\"`: the term is part of the silhouettes' energy";
    require(&format!("{table}.plausibility"), silhouettes || s.plausibility.is_none(), expected, "some")
}

fn first_of_search(table: &str, SearchSettings { filter, likelihood, .. }: &SearchSettings) -> RangeCheck {
    filter.validate().and_then(|()| likelihood.validate()).map_err(|e| setting(table, &e))?;
    within(&format!("{table}.particles"), filter.particles, 1..=1_000_000)?;
    within(&format!("{table}.layers"), filter.layers, 1..=1000)
}

fn first_of_latent<T: LatentKind + Default>(table: &str, s: &LatentTrackerSettings<T>) -> RangeCheck {
    let search = s.search();
    first_of_search(table, &search)?;
    s.latent().validate().map_err(|e| setting(table, &e))?;
    search.refinement.map_or(Ok(()), |refinement| refinement.validate()).map_err(|e| setting(table, &e))?;
    let learning = s.model.learning();
    let is_contradiction = s.model_file.is_some() && learning != T::default().learning();
    let expected = "no training keys of `model`, because the model is already trained; remove them";
    require(&format!("{table}.model_file"), !is_contradiction, expected, "some")?;
    within(&format!("{table}.model.clip_s"), learning.clip_s, 0.05..=60.0)?;
    within(&format!("{table}.model.threshold_per_joint"), learning.threshold_per_joint, 1e-9..=10.0)?;
    within(&format!("{table}.model.training.latent_dimensions"), learning.training.latent_dimensions, 1..=8)?;
    within(&format!("{table}.model.training.rounds"), learning.training.rounds, 1..=1000)?;
    within(&format!("{table}.model.training.iterations"), learning.training.iterations, 1..=1000)
}

fn first_of_keypoints(table: &str, s: &KeypointTrackerSettings) -> RangeCheck {
    within(&format!("{table}.least_confidence"), s.least_confidence, 0.0..=1.0)?;
    within(&format!("{table}.inlier_px"), s.inlier_px, 1e-3..=1e5)?;
    within(&format!("{table}.angle_weight_m"), s.angle_weight_m, 1e-6..=1e3)?;
    within(&format!("{table}.acceleration_m_s2"), s.acceleration_m_s2, 0.0..=1e6)?;
    within(&format!("{table}.point_mm"), s.point_mm, 1e-3..=1e5)?;
    let filters = !s.smooth || s.acceleration_m_s2 > 0.0;
    only_valid_with(&format!("{table}.smooth"), filters, "`acceleration_m_s2` above 0, such as 20", s.acceleration_m_s2)
}

fn first_of_oracle(table: &str, s: &OracleSettings) -> RangeCheck {
    for (i, offset) in s.root_offset_m.into_iter().enumerate() {
        within(&format!("{table}.root_offset_m[{i}]"), offset, -1e3..=1e3)?;
    }
    within(&format!("{table}.root_noise_m"), s.root_noise_m, 0.0..=1e3)?;
    within(&format!("{table}.angle_noise_deg"), s.angle_noise_deg, 0.0..=180.0)
}
