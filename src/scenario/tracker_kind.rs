//! What the rest of the program asks of a tracker's settings: one implementation a kind of tracker.

use super::latent::{LatentKind, LatentTrackerSettings, RootMode};
use super::range_checks::InvalidValue;
use super::tracker::{
    AnnealedParticleFilterSettings, FrozenSettings, NearestTrainingPoseSettings, OracleSettings, TrackerSettings,
};
use super::tracker_ranges::{first_of_filter, first_of_latent, first_of_oracle};
use crate::motion_model::gpdm_graph::GraphSettings;
use crate::tracker::{FilterSettings, PlausibilitySettings, RefinementSettings, SilhouetteSettings};

/// What a tracker does with the recordings to learn from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingUse {
    /// It does not look at them.
    Unused,
    /// It learns from them, or from the spread that every set has.
    Optional,
    /// It cannot be built without them.
    Required,
}

/// A kind of tracker, as its settings tell it.
pub trait TrackerKind {
    /// The tracker's name, as the command line and the scenario spell it.
    fn name(&self) -> &'static str;

    /// What it does with the recordings to learn from.
    fn training(&self) -> TrainingUse;

    /// Whether it cannot be built without the truth.
    fn needs_truth(&self) -> bool;

    /// What it is and how it searches, for people.
    fn in_words(&self) -> String {
        let name = self.name().replace('_', " ");
        let search = self.filter().map(|f| format!(", {} particles x {} layers", f.particles, f.layers));
        let roots = if self.is_given_roots() {
            ", ORACLE ROOTS: the tracker is given the true root of every frame"
        } else {
            ""
        };
        let refined = if self.refinement().is_some() { ", refined" } else { "" };
        format!("{name}{}{refined}{roots}", search.unwrap_or_default())
    }

    /// The settings of its filter; `None` for trackers without one.
    fn filter(&self) -> Option<FilterSettings> {
        None
    }

    /// The settings of its likelihood; `None` for trackers without one.
    fn likelihood(&self) -> Option<SilhouetteSettings> {
        None
    }

    /// The settings of its plausibility term, if any.
    fn plausibility(&self) -> Option<PlausibilitySettings> {
        None
    }

    /// What refines its estimate; `None` for trackers without refinement.
    fn refinement(&self) -> Option<RefinementSettings> {
        None
    }

    /// How many energies it evaluates in a frame, about.
    fn evaluations_per_frame(&self) -> u64 {
        let layers = self.filter().map_or(0, |filter| filter.particles as u64 * filter.layers as u64);
        layers + self.refinement().map_or(0, |refinement| refinement.evaluations_per_frame())
    }

    /// How its motion model is learned; `None` for trackers without one.
    fn learning(&self) -> Option<GraphSettings> {
        None
    }

    /// The model file that it reads; `None` for trackers that read none.
    fn model_file(&self) -> Option<&str> {
        None
    }

    /// Whether it needs a learned motion model.
    fn learns(&self) -> bool {
        self.learning().is_some() && self.model_file().is_none()
    }

    /// Whether it is given the true root of every frame.
    fn is_given_roots(&self) -> bool {
        false
    }

    /// The first value that makes no sense; `table` is the key of the settings.
    ///
    /// # Errors
    /// [`InvalidValue`] that names the key.
    fn first_problem(&self, _table: &str) -> Result<(), InvalidValue> {
        Ok(())
    }
}

impl TrackerSettings {
    /// What kind of tracker it is, and all that follows from it.
    pub fn kind(&self) -> &dyn TrackerKind {
        match self {
            Self::AnnealedParticleFilter(settings) => settings,
            Self::Frozen(settings) => settings,
            Self::Gpdm(settings) => settings,
            Self::SwitchingGpdm(settings) => settings,
            Self::GpdmGraph(settings) => settings,
            Self::NearestTrainingPose(settings) => settings,
            Self::Oracle(settings) => settings,
        }
    }

    /// The tracker's name, as the command line and the scenario spell it.
    pub fn name(&self) -> &'static str {
        self.kind().name()
    }
}

impl TrackerKind for AnnealedParticleFilterSettings {
    fn name(&self) -> &'static str {
        "annealed_particle_filter"
    }

    fn training(&self) -> TrainingUse {
        TrainingUse::Optional
    }

    fn needs_truth(&self) -> bool {
        false
    }

    fn filter(&self) -> Option<FilterSettings> {
        Some(self.filter())
    }

    fn likelihood(&self) -> Option<SilhouetteSettings> {
        Some(self.likelihood())
    }

    fn plausibility(&self) -> Option<PlausibilitySettings> {
        self.plausibility
    }

    fn refinement(&self) -> Option<RefinementSettings> {
        self.refinement()
    }

    fn first_problem(&self, table: &str) -> Result<(), InvalidValue> {
        first_of_filter(table, self)
    }
}

impl<T: LatentKind + Default> TrackerKind for LatentTrackerSettings<T> {
    fn name(&self) -> &'static str {
        T::NAME
    }

    fn training(&self) -> TrainingUse {
        if self.model_file.is_none() { TrainingUse::Required } else { TrainingUse::Unused }
    }

    fn needs_truth(&self) -> bool {
        self.is_given_roots()
    }

    fn filter(&self) -> Option<FilterSettings> {
        Some(self.filter())
    }

    fn likelihood(&self) -> Option<SilhouetteSettings> {
        Some(self.likelihood())
    }

    fn learning(&self) -> Option<GraphSettings> {
        Some(self.model.learning())
    }

    fn model_file(&self) -> Option<&str> {
        self.model_file.as_deref()
    }

    fn is_given_roots(&self) -> bool {
        self.root == RootMode::Oracle
    }

    fn first_problem(&self, table: &str) -> Result<(), InvalidValue> {
        first_of_latent(table, self)
    }
}

impl TrackerKind for FrozenSettings {
    fn name(&self) -> &'static str {
        "frozen"
    }

    fn training(&self) -> TrainingUse {
        TrainingUse::Unused
    }

    fn needs_truth(&self) -> bool {
        false
    }

    fn in_words(&self) -> String {
        "frozen: never moves".to_owned()
    }
}

impl TrackerKind for NearestTrainingPoseSettings {
    fn name(&self) -> &'static str {
        "nearest_training_pose"
    }

    fn training(&self) -> TrainingUse {
        TrainingUse::Required
    }

    fn needs_truth(&self) -> bool {
        true
    }

    fn in_words(&self) -> String {
        "oracle: the training pose nearest to the truth, at the true root".to_owned()
    }
}

impl TrackerKind for OracleSettings {
    fn name(&self) -> &'static str {
        "oracle"
    }

    fn training(&self) -> TrainingUse {
        TrainingUse::Unused
    }

    fn needs_truth(&self) -> bool {
        true
    }

    fn in_words(&self) -> String {
        "oracle: the truth plus a planted error".to_owned()
    }

    fn first_problem(&self, table: &str) -> Result<(), InvalidValue> {
        first_of_oracle(table, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trackers_name_is_the_one_that_its_settings_are_written_under() {
        for settings in TrackerSettings::all() {
            let written = serde_json::to_value(&settings).unwrap();
            assert_eq!(written.as_object().unwrap().keys().collect::<Vec<_>>(), [settings.name()]);
        }
    }

    #[test]
    fn what_is_given_roots_needs_the_truth_and_what_reads_a_model_learns_none() {
        let settings = LatentTrackerSettings::<super::super::GpdmGraphSettings>::default();
        let of = |settings: &dyn TrackerKind| (settings.learns(), settings.training(), settings.needs_truth());
        assert_eq!(of(&settings), (true, TrainingUse::Required, false));
        let read = LatentTrackerSettings { model_file: Some("walk.model".to_owned()), ..settings.clone() };
        assert_eq!(of(&read), (false, TrainingUse::Unused, false));
        assert_eq!(
            of(&LatentTrackerSettings { root: RootMode::Oracle, ..settings }),
            (true, TrainingUse::Required, true)
        );
    }
}
