//! `[observation]`: where the silhouettes come from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BackgroundSettings, Corruption, ImageSettings};
use crate::rng::{KeyedSeed, ObservationKey};

/// What trackers are given in place of perfect observations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationSettings {
    /// Where silhouettes come from: `"exact"`; `"segmented"`: cut out of images of the scene (`[observation.images]`)
    /// by background subtraction (`[observation.background]`); or `"corrupted"`: the exact ones spoiled by the axes of
    /// `[observation.corruption]`.
    pub silhouette: SilhouetteSource,
    /// Seed of all that is drawn for observations; every seed of a run sees the same observations.
    pub seed: u32,
    /// Secret that all that is drawn for observations depends on besides the seed: 32 hexadecimal digits, in quotation
    /// marks. Whoever knows a scenario that states it can undo the errors of its sets. Default: `render` draws a fresh
    /// one where it matters; everywhere else the public one, all zeros.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<ObservationKey>,
    /// Corruption, axis by axis. Axes of masks need `silhouette = "corrupted"`; errors of cameras, body and start do
    /// not. Default: none.
    #[serde(skip_serializing_if = "Corruption::is_none")]
    pub corruption: Corruption,
    /// Looks of the scene and noise of the sensor, for `silhouette = "segmented"`; looks and seed also for the layer
    /// `colour`.
    #[serde(skip_serializing_if = "is_default")]
    pub images: ImageSettings,
    /// How silhouettes are cut out of images, for `silhouette = "segmented"`.
    #[serde(skip_serializing_if = "is_default")]
    pub background: BackgroundSettings,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for ObservationSettings {
    fn default() -> Self {
        Self {
            silhouette: SilhouetteSource::Exact,
            seed: 1,
            key: None,
            corruption: Corruption::default(),
            images: ImageSettings::default(),
            background: BackgroundSettings::default(),
        }
    }
}

/// Where silhouettes come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SilhouetteSource {
    /// Exactly what stands before the background: the actor, and distractors where there are any.
    #[default]
    Exact,
    /// Cut out of images of the scene.
    Segmented,
    /// The exact silhouettes, spoiled.
    Corrupted,
}

/// What a set says about its observations. The seed is not part of it: with it, a tracker could undo what was drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationFacts {
    /// Where silhouettes come from.
    pub silhouette: SilhouetteSource,
    /// How many people besides the actor the silhouettes may show.
    #[serde(skip_serializing_if = "is_default")]
    pub distractors: usize,
    /// Corruption, axis by axis.
    #[serde(skip_serializing_if = "Corruption::is_none")]
    pub corruption: Corruption,
    /// Looks of the scene and noise of the sensor, where silhouettes are segmented.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageSettings>,
    /// How silhouettes were cut out, where they are segmented.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundSettings>,
}

impl ObservationSettings {
    /// Whether a tracker is given the truth as the cameras see it.
    pub fn is_exact(&self) -> bool {
        self.silhouette == SilhouetteSource::Exact && self.corruption.is_none()
    }

    /// Whether random numbers are drawn for what a tracker is given; whoever knew them could undo its errors.
    pub fn is_drawn(&self) -> bool {
        self.silhouette == SilhouetteSource::Segmented || self.corruption.is_drawn()
    }

    /// What streams are keyed by; with the public key where none is stated.
    pub fn keyed_seed(&self) -> KeyedSeed {
        KeyedSeed { key: self.key.unwrap_or_default(), seed: self.seed.into() }
    }

    /// Looks of colour images that are truth alone; `None` for the usual ones, and where silhouettes are cut out of
    /// such images, for then [`Self::facts`] has them.
    pub fn images_of_truth(&self) -> Option<ImageSettings> {
        (self.silhouette != SilhouetteSource::Segmented && !is_default(&self.images)).then_some(self.images)
    }

    /// The seed, where anything is drawn with it or it is not the usual one.
    pub fn seed_to_tell(&self, with_others: bool) -> Option<u32> {
        (!self.is_exact() || with_others || self.seed != Self::default().seed).then_some(self.seed)
    }

    /// What the set says.
    pub fn facts(&self) -> ObservationFacts {
        let segmented = self.silhouette == SilhouetteSource::Segmented;
        ObservationFacts {
            silhouette: self.silhouette,
            distractors: 0,
            corruption: self.corruption,
            images: segmented.then_some(self.images),
            background: segmented.then_some(self.background),
        }
    }
}

impl ObservationFacts {
    /// In words, for reports.
    pub fn in_words(&self) -> String {
        let source = match self.silhouette {
            SilhouetteSource::Exact => "exact",
            SilhouetteSource::Corrupted => "corrupted",
            SilhouetteSource::Segmented => "segmented from images of the scene",
        };
        let others = match self.distractors {
            0 => String::new(),
            1 => ", with another person".to_owned(),
            count => format!(", with {count} other people"),
        };
        if self.corruption.is_none() {
            format!("{source}{others}")
        } else {
            format!("{source}{others}: {}", self.corruption.in_words())
        }
    }
}
