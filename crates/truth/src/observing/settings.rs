//! `[observation]`: the source of silhouettes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BackgroundSettings, Corruption, ImageSettings, KeypointSettings};
use crate::rng::{KeyedSeed, ObservationKey};

/// The observations given to trackers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationSettings {
    /// Errors to expect in a place, which this sets together: `"studio"`, `"gym"` or `"outdoors"`. Other keys of
    /// `[observation]` that are given win. `docs/places.md` has the numbers and their sources. Replaced by these keys
    /// when a scenario is read. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<PlacePreset>,
    /// Source of silhouettes: `"exact"`; `"segmented"`, from simulated images (`[observation.images]`) by background
    /// subtraction (`[observation.background]`); or `"corrupted"`, exact ones corrupted along the axes of
    /// `[observation.corruption]`.
    pub silhouette: SilhouetteSource,
    /// Seed of all random draws for observations; all seeds of a run have the same observations.
    pub seed: u32,
    /// Secret key of all random draws for observations, besides the seed: 32 hexadecimal digits, in quotation marks.
    /// The errors of a set can be undone with the key, so a scenario with a key must be kept secret. Default: `render`
    /// draws a new key if random numbers are used; otherwise the public key, all zeros.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<ObservationKey>,
    /// Corruption by axis. Axes of masks require `silhouette = "corrupted"`; errors of cameras, body and start do not.
    /// Default: none.
    #[serde(skip_serializing_if = "Corruption::is_none")]
    pub corruption: Corruption,
    /// Appearance of the scene and sensor noise, for `silhouette = "segmented"`; appearance and seed also for the layer
    /// `colour`.
    #[serde(skip_serializing_if = "is_default")]
    pub images: ImageSettings,
    /// Segmentation of silhouettes, for `silhouette = "segmented"`.
    #[serde(skip_serializing_if = "is_default")]
    pub background: BackgroundSettings,
    /// Keypoints of a 2D detector, in addition to the silhouettes. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keypoints: Option<KeypointSettings>,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for ObservationSettings {
    fn default() -> Self {
        Self {
            preset: None,
            silhouette: SilhouetteSource::Exact,
            seed: 1,
            key: None,
            corruption: Corruption::default(),
            images: ImageSettings::default(),
            background: BackgroundSettings::default(),
            keypoints: None,
        }
    }
}

/// A place whose errors are known, roughly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlacePreset {
    /// Cameras with one clock, calibrated with care, in even light.
    Studio,
    /// Consumer cameras, synchronised to half a frame.
    Gym,
    /// Telephones, roughly synchronised and calibrated.
    Outdoors,
}

/// Source of silhouettes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SilhouetteSource {
    /// The exact foreground: the actor, and distractors if any.
    #[default]
    Exact,
    /// Segmented from simulated images.
    Segmented,
    /// Corrupted exact silhouettes.
    Corrupted,
}

/// Description of the observations of a set. The seed is not included, since a tracker could undo the errors with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationFacts {
    /// Source of silhouettes.
    pub silhouette: SilhouetteSource,
    /// Number of people besides the actor that silhouettes may show.
    #[serde(skip_serializing_if = "is_default")]
    pub distractors: usize,
    /// Corruption by axis.
    #[serde(skip_serializing_if = "Corruption::is_none")]
    pub corruption: Corruption,
    /// Appearance of the scene and sensor noise, if silhouettes are segmented.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageSettings>,
    /// Segmentation settings, if silhouettes are segmented.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundSettings>,
    /// Layout and errors of the keypoints, if the set has any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keypoints: Option<KeypointSettings>,
}

impl ObservationFacts {
    /// Whether the silhouettes are the exact ones of the actor alone.
    pub fn has_exact_silhouettes(&self) -> bool {
        self.silhouette == SilhouetteSource::Exact && self.corruption.is_none() && self.distractors == 0
    }
}

impl ObservationSettings {
    /// Whether trackers are given exact silhouettes and nothing else.
    pub fn is_exact(&self) -> bool {
        self.silhouette == SilhouetteSource::Exact && self.corruption.is_none() && self.keypoints.is_none()
    }

    /// Whether observations use random numbers, with which their errors could be undone.
    pub fn is_drawn(&self) -> bool {
        let draws_keypoints = self.keypoints.as_ref().is_some_and(KeypointSettings::is_drawn);
        self.silhouette == SilhouetteSource::Segmented || self.corruption.is_drawn() || draws_keypoints
    }

    /// The key and seed of random streams; the public key by default.
    pub fn keyed_seed(&self) -> KeyedSeed {
        KeyedSeed { key: self.key.unwrap_or_default(), seed: self.seed.into() }
    }

    /// Appearance of colour layers; `None` for the default, and if silhouettes are segmented, since [`Self::facts`]
    /// then includes it.
    pub fn images_of_truth(&self) -> Option<ImageSettings> {
        (self.silhouette != SilhouetteSource::Segmented && !is_default(&self.images)).then_some(self.images)
    }

    /// The seed, if it is used or differs from the default.
    pub fn seed_to_tell(&self, with_others: bool) -> Option<u32> {
        (!self.is_exact() || with_others || self.seed != Self::default().seed).then_some(self.seed)
    }

    /// The description stored in a set.
    pub fn facts(&self) -> ObservationFacts {
        let segmented = self.silhouette == SilhouetteSource::Segmented;
        ObservationFacts {
            silhouette: self.silhouette,
            distractors: 0,
            corruption: self.corruption,
            images: segmented.then_some(self.images),
            background: segmented.then_some(self.background),
            keypoints: self.keypoints,
        }
    }
}

impl ObservationFacts {
    /// Description for reports.
    pub fn describe(&self) -> String {
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
        let errors =
            if self.corruption.is_none() { String::new() } else { format!(": {}", self.corruption.describe()) };
        let keypoints = self.keypoints.map_or(String::new(), |keypoints| format!("; {}", keypoints.describe()));
        format!("{source}{others}{errors}{keypoints}")
    }
}
