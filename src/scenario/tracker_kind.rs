//! Properties of a tracker that follow from its settings.

use skiagraph_track::motion_model::LatentSettings;
use skiagraph_track::motion_model::gpdm_graph::GraphSettings;
use skiagraph_track::tracker::{FilterSettings, PlausibilitySettings, RefinementSettings, SilhouetteSettings};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingUse {
    /// It does not use them.
    Unused,
    /// It learns from them, or from the spread of frame-to-frame changes that every set has.
    Optional,
    /// It requires them.
    Required,
}

/// How a particle filter searches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SearchSettings {
    pub filter: FilterSettings,
    pub likelihood: SilhouetteSettings,
    /// The settings of its plausibility term, if any.
    pub plausibility: Option<PlausibilitySettings>,
    pub refinement: Option<RefinementSettings>,
}

/// How a tracker moves on a learned motion model.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedMotion<'a> {
    pub learning: GraphSettings,
    /// The model file that is read instead.
    pub model_file: Option<&'a str>,
    /// How particles move in the model.
    pub latent: LatentSettings,
    /// Whether the tracker is given the true root of every frame.
    pub is_given_roots: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub struct TrackerKind<'a> {
    /// The tracker's name on the command line and in scenarios.
    pub name: &'static str,
    /// An explanation, if its name is not enough.
    pub explanation: Option<&'static str>,
    pub training: TrainingUse,
    pub needs_truth: bool,
    /// Its search; `None` for trackers without a filter.
    pub search: Option<SearchSettings>,
    /// Its motion model; `None` for trackers without a learned one.
    pub learned: Option<LearnedMotion<'a>>,
}

impl<'a> TrackerKind<'a> {
    /// A tracker that uses neither training nor truth.
    pub(super) fn named(name: &'static str) -> Self {
        let training = TrainingUse::Unused;
        Self { name, explanation: None, training, needs_truth: false, search: None, learned: None }
    }

    /// The model file that it reads, if any.
    pub fn model_file(&self) -> Option<&'a str> {
        self.learned.as_ref()?.model_file
    }

    /// Whether a motion model must be learned for it.
    pub fn learns(&self) -> bool {
        self.learned.as_ref().is_some_and(|learned| learned.model_file.is_none())
    }

    /// Whether it is given the true root of every frame.
    pub fn is_given_roots(&self) -> bool {
        self.learned.as_ref().is_some_and(|learned| learned.is_given_roots)
    }

    /// Approximate number of energies that it evaluates per frame.
    pub fn evaluations_per_frame(&self) -> u64 {
        let Some(SearchSettings { filter, refinement, .. }) = self.search else { return 0 };
        let refined = refinement.map_or(0, |refinement| refinement.evaluations_per_frame());
        filter.particles as u64 * filter.layers as u64 + refined
    }

    pub fn describe(&self) -> String {
        let mut words = self.explanation.map_or_else(|| self.name.replace('_', " "), str::to_owned);
        if let Some(SearchSettings { filter, refinement, .. }) = self.search {
            words += &format!(", {} particles x {} layers", filter.particles, filter.layers);
            if refinement.is_some() {
                words += ", refined";
            }
        }
        if self.is_given_roots() {
            words += ", ORACLE ROOTS: the tracker is given the true root of every frame";
        }
        words
    }
}
