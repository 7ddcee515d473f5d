//! `[observation]`: the source of silhouettes.

use schemars::JsonSchema;
use serde::de::IntoDeserializer;
use serde::{Deserialize, Deserializer, Serialize};

use super::{BackgroundSettings, Corruption, ImageSettings, KeypointSettings};
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::rng::{KeyedSeed, ObservationKey};

/// The observations given to trackers. The truth stays exact, and reports show the quality of the silhouettes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationSettings {
    /// Errors to expect in a place, set together: time offsets and drift, camera orientation, outline (`silhouette =
    /// "corrupted"`) and keypoints (`halpe26`). Other keys of `[observation]` that are given win. `docs/places.md` has
    /// each number and its source. A scenario that is written out has these keys instead. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<PlacePreset>,
    /// Source of the silhouettes.
    pub silhouette: SilhouetteSource,
    /// Seed of all random numbers of the observations; all seeds of a run have the same observations. A set has it in
    /// `truth/facts.toml`, and the strengths in `set.toml`.
    pub seed: u32,
    /// A secret that these random numbers depend on besides the seed: 32 hexadecimal digits in quotation marks
    /// (`docs/sets.md#keys-errors-that-nobody-can-subtract`). `render --key` overrides it. The errors of a set can be
    /// undone with it, so keep a scenario with a key secret. Default: `render` draws one if random numbers are used,
    /// and stores it in `truth/key.txt`; `run`, `sweep` and studies use the public one, all zeros.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<ObservationKey>,
    /// Images of the scene for trackers, in `observations/colour/`, with images without people in
    /// `observations/background/` (`docs/sets.md#images-of-the-scene`). They are not photorealistic. Cameras must not
    /// move. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour_images: Option<ColourFormat>,
    /// Errors of silhouettes, cameras, body and start, each with a strength. Default: none.
    #[serde(skip_serializing_if = "Corruption::is_none")]
    pub corruption: Corruption,
    /// Appearance of the scene and sensor noise, for `silhouette = "segmented"`, `colour_images` and, before the
    /// sensor, the truth image `colour`.
    #[serde(skip_serializing_if = "is_default")]
    pub images: ImageSettings,
    /// Background subtraction, for `silhouette = "segmented"`.
    #[serde(skip_serializing_if = "is_default")]
    pub background: BackgroundSettings,
    /// Keypoints of a 2D detector, in addition to the silhouettes. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keypoints: Option<KeypointSettings>,
}

pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for ObservationSettings {
    fn default() -> Self {
        Self {
            preset: None,
            silhouette: SilhouetteSource::Exact,
            seed: 1,
            key: None,
            colour_images: None,
            corruption: Corruption::default(),
            images: ImageSettings::default(),
            background: BackgroundSettings::default(),
            keypoints: None,
        }
    }
}

/// Format of the images that trackers are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColourFormat {
    /// Lossless.
    Png,
    /// Compressed with the quality `images.jpeg_quality`, 95 without.
    Jpeg,
}

impl ColourFormat {
    /// Extension of the files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
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
    /// Extracted from images of the scene (`[observation.images]`) by background subtraction
    /// (`[observation.background]`).
    Segmented,
    /// Exact ones with the errors of `[observation.corruption]`.
    Corrupted,
    /// Of a recording of a person, by `skiagraph import`; not valid in scenarios.
    #[schemars(skip)]
    #[serde(skip_deserializing)]
    Footage,
}

/// The source in a set, which may be a recording.
fn source_in_set<'de, D: Deserializer<'de>>(value: D) -> Result<SilhouetteSource, D::Error> {
    let name = String::deserialize(value)?;
    if name == "footage" {
        return Ok(SilhouetteSource::Footage);
    }
    SilhouetteSource::deserialize(IntoDeserializer::<D::Error>::into_deserializer(name))
}

/// Description of the observations of a set. The seed is not included, since a tracker could undo the errors with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationFacts {
    /// Source of silhouettes.
    #[serde(deserialize_with = "source_in_set")]
    pub silhouette: SilhouetteSource,
    /// Number of people besides the actor that silhouettes may show.
    #[serde(skip_serializing_if = "is_default")]
    pub distractors: usize,
    /// Format of the images that trackers are given, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour_images: Option<ColourFormat>,
    /// Corruption by axis.
    #[serde(skip_serializing_if = "Corruption::is_none")]
    pub corruption: Corruption,
    /// Appearance of the scene and sensor noise, if silhouettes are segmented or trackers are given images.
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
    /// Those of a recording of a person, with the layout of its keypoints if it has any.
    pub fn of_footage(keypoints: Option<KeypointLayout>) -> Self {
        let keypoints = keypoints.map(KeypointSettings::exact);
        Self { silhouette: SilhouetteSource::Footage, keypoints, ..Self::default() }
    }

    /// Whether they are of a recording of a person.
    pub fn is_footage(&self) -> bool {
        self.silhouette == SilhouetteSource::Footage
    }

    /// Whether the silhouettes are the exact ones of the actor alone.
    pub fn has_exact_silhouettes(&self) -> bool {
        self.silhouette == SilhouetteSource::Exact && self.corruption.is_none() && self.distractors == 0
    }

    /// Description for reports.
    pub fn describe(&self) -> String {
        let source = match self.silhouette {
            SilhouetteSource::Exact => "exact",
            SilhouetteSource::Corrupted => "corrupted",
            SilhouetteSource::Segmented => "segmented from images of the scene",
            SilhouetteSource::Footage => {
                let found = self.keypoints.map(|keypoints| format!("; keypoints ({})", keypoints.layout.name()));
                return format!("from a recording{}", found.unwrap_or_default());
            }
        };
        let others = match self.distractors {
            0 => String::new(),
            1 => ", with another person".to_owned(),
            count => format!(", with {count} other people"),
        };
        let errors =
            if self.corruption.is_none() { String::new() } else { format!(": {}", self.corruption.describe()) };
        let keypoints = self.keypoints.map_or(String::new(), |keypoints| format!("; {}", keypoints.describe()));
        let images = if self.colour_images.is_some() { "; images of the scene" } else { "" };
        format!("{source}{others}{errors}{keypoints}{images}")
    }
}

impl ObservationSettings {
    /// Whether trackers are given exact silhouettes and nothing else.
    pub fn is_exact(&self) -> bool {
        let gives_more = self.keypoints.is_some() || self.colour_images.is_some();
        self.silhouette == SilhouetteSource::Exact && self.corruption.is_none() && !gives_more
    }

    /// Whether images of the scene are taken.
    fn takes_images(&self) -> bool {
        self.silhouette == SilhouetteSource::Segmented || self.colour_images.is_some()
    }

    /// Whether observations use random numbers, with which their errors could be undone.
    pub fn is_drawn(&self) -> bool {
        let draws_keypoints = self.keypoints.as_ref().is_some_and(KeypointSettings::is_drawn);
        self.takes_images() || self.corruption.is_drawn() || draws_keypoints
    }

    /// The key and seed of random streams; the public key by default.
    pub fn keyed_seed(&self) -> KeyedSeed {
        KeyedSeed { key: self.key.unwrap_or_default(), seed: self.seed.into() }
    }

    /// Appearance of colour layers; `None` for the default, and if images are taken, since [`Self::facts`] then
    /// includes it.
    pub fn images_of_truth(&self) -> Option<ImageSettings> {
        (!self.takes_images() && !is_default(&self.images)).then_some(self.images)
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
            colour_images: self.colour_images,
            corruption: self.corruption,
            images: self.takes_images().then_some(self.images),
            background: segmented.then_some(self.background),
            keypoints: self.keypoints,
        }
    }
}
