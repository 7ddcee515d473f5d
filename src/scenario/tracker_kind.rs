//! What the rest of the program needs to know of a tracker: data that follow from its settings.

use crate::motion_model::LatentSettings;
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

/// How a particle filter searches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SearchSettings {
    /// The settings of the filter.
    pub filter: FilterSettings,
    /// The settings of its likelihood.
    pub likelihood: SilhouetteSettings,
    /// The settings of its plausibility term, if any.
    pub plausibility: Option<PlausibilitySettings>,
    /// What refines its estimate, if anything does.
    pub refinement: Option<RefinementSettings>,
}

/// How a tracker moves on a learned motion model.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedMotion<'a> {
    /// How the model is learned.
    pub learning: GraphSettings,
    /// The model file that is read instead.
    pub model_file: Option<&'a str>,
    /// How particles move in the model.
    pub latent: LatentSettings,
    /// Whether the tracker is given the true root of every frame.
    pub is_given_roots: bool,
}

/// A kind of tracker with its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackerKind<'a> {
    /// The tracker's name, as the command line and the scenario spell it.
    pub name: &'static str,
    /// What it is, where its name does not say it all.
    pub explanation: Option<&'static str>,
    /// What it does with the recordings to learn from.
    pub training: TrainingUse,
    /// Whether it cannot be built without the truth.
    pub needs_truth: bool,
    /// How it searches; `None` for trackers without a filter.
    pub search: Option<SearchSettings>,
    /// Its motion model; `None` for trackers that learn none.
    pub learned: Option<LearnedMotion<'a>>,
}

impl<'a> TrackerKind<'a> {
    /// A tracker that uses neither training nor truth.
    pub(super) fn named(name: &'static str) -> Self {
        let training = TrainingUse::Unused;
        Self { name, explanation: None, training, needs_truth: false, search: None, learned: None }
    }

    /// The model file that it reads; `None` for trackers that read none.
    pub fn model_file(&self) -> Option<&'a str> {
        self.learned.as_ref()?.model_file
    }

    /// Whether it needs a motion model to be learned.
    pub fn learns(&self) -> bool {
        self.learned.as_ref().is_some_and(|learned| learned.model_file.is_none())
    }

    /// Whether it is given the true root of every frame.
    pub fn is_given_roots(&self) -> bool {
        self.learned.as_ref().is_some_and(|learned| learned.is_given_roots)
    }

    /// How many energies it evaluates in a frame, about.
    pub fn evaluations_per_frame(&self) -> u64 {
        let Some(SearchSettings { filter, refinement, .. }) = self.search else { return 0 };
        let refined = refinement.map_or(0, |refinement| refinement.evaluations_per_frame());
        filter.particles as u64 * filter.layers as u64 + refined
    }

    /// What it is and how it searches, for people.
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
