//! `set.toml`: description and conventions of the set; `truth/facts.toml`: facts about the truth, including its source
//! recording.

use serde::{Deserialize, Serialize};

use std::path::Path;

use crate::files::SetFiles;
use crate::{ContactFacts, RetargetFacts, SetError};
use skiagraph_core::input;
use skiagraph_core::input::{excerpt, foreign_about, limits};
use skiagraph_core::rng::{KeyedSeed, ObservationKey};
use skiagraph_truth::observing::{ImageSettings, ObservationFacts};

pub(crate) const PATH: &str = "set.toml";
pub(crate) const FACTS_PATH: &str = "truth/facts.toml";
const SCHEMA: &str = "skiagraph.set/1";
/// Schema of sets with moving cameras or own exposure times: they have `cameras.npz`, and may lack images of frames.
const FILMED: &str = "skiagraph.set/2";

/// Greatest number of frames: four and a half hours at 60 Hz.
pub(crate) const MOST_FRAMES: usize = 1_000_000;
const MOST_CAMERAS: usize = 999;
/// Greatest length of a set's name, characters.
const LONGEST_NAME: usize = 200;
/// Range of frame rates, frames per second.
const LEAST_RATE: f64 = 1e-3;
const GREATEST_RATE: f64 = 1e5;

/// The facts that trackers may know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct BlindManifest {
    pub(crate) schema: String,
    pub(crate) name: String,
    /// Version of the program that made the set.
    pub(crate) version: String,
    pub(crate) sequence: SequenceFacts,
    /// How the observations were made; absent if they are exact, and in sets of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) observation: Option<ObservationFacts>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SequenceFacts {
    pub(crate) frames: usize,
    pub(crate) frames_per_second: f64,
    pub(crate) cameras: usize,
    /// Heading of the body in the start pose, a horizontal unit vector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) forward: Option<[f64; 3]>,
}

impl SequenceFacts {
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { frames, frames_per_second, cameras, forward } = *self;
        if forward.is_some_and(|forward| !forward.iter().all(|x| x.abs() <= 1.0)) {
            return Err("sequence.forward: expected a unit vector".to_owned());
        }
        if !(1..=MOST_FRAMES).contains(&frames) {
            return Err(format!("sequence.frames: expected 1 to {MOST_FRAMES}, found {frames}"));
        }
        check_rate(frames_per_second).map_err(|e| format!("sequence.frames_per_second: {e}"))?;
        if !(1..=MOST_CAMERAS).contains(&cameras) {
            return Err(format!("sequence.cameras: expected 1 to {MOST_CAMERAS}, found {cameras}"));
        }
        Ok(())
    }
}

/// Checks the frame rate of any file of a set.
pub(crate) fn check_rate(found: f64) -> Result<(), String> {
    if (LEAST_RATE..=GREATEST_RATE).contains(&found) {
        Ok(())
    } else {
        Err(format!("expected {LEAST_RATE} to {GREATEST_RATE} frames a second, found {found}"))
    }
}

/// Facts about the truth beyond its arrays, for reports.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthFacts {
    /// Source of the motion, with its licence.
    pub motion: String,
    /// Whether the tracker's body is the actor's own.
    pub matched: bool,
    /// Description of how the bodies differ; empty if matched.
    pub mismatch: String,
    /// Treatment of ground contact; absent if contact was neither measured nor changed, and in sets of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactFacts>,
    /// Seed of the observations and of colour images; absent if observations are exact and it is the default of 1, and
    /// in sets of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observation_seed: Option<u32>,
    /// Appearance of colour images of the truth; absent for the default, and if silhouettes are segmented from such
    /// images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageSettings>,
    /// How well the recording fits the actor; absent in sets of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retargeting: Option<RetargetFacts>,
}

impl TruthFacts {
    /// Appearance of images of the scene, and the seed of their random numbers: the images that silhouettes were
    /// segmented from, otherwise those of the truth. `key` is the set's.
    pub(crate) fn scene(
        &self,
        observation: Option<&ObservationFacts>,
        key: ObservationKey,
    ) -> (ImageSettings, KeyedSeed) {
        let images = observation.and_then(|facts| facts.images).or(self.images);
        (images.unwrap_or_default(), self.keyed_seed(key))
    }

    /// The key and seed of all random streams of the observation, for a set with this key.
    #[doc(hidden)]
    pub fn keyed_seed(&self, key: ObservationKey) -> KeyedSeed {
        KeyedSeed { key, seed: self.observation_seed.unwrap_or(DEFAULT_SEED).into() }
    }
}

const DEFAULT_SEED: u32 = 1;

#[derive(Serialize)]
struct Manifest<'a> {
    #[serde(flatten)]
    blind: &'a BlindManifest,
    convention: toml::Table,
}

const CONVENTIONS: [(&str, &str); 11] = [
    ("length", "metres"),
    ("angle", "radians; three angles of one spherical joint are a rotation vector"),
    ("world", "right-handed, Z up, ground at z = 0"),
    (
        "forward",
        "sequence.forward: the way the body faces in frame 0 (heading of its root), a unit vector on the ground",
    ),
    (
        "training",
        "start/training.npz: motions other than the test's; without any, start/spread.npz: root mean squares, no poses",
    ),
    ("camera", "OpenCV: x right, y down, z forward; x_camera = R x_world + t; distortion k1 k2 p1 p2 k3"),
    ("pixel_centres", "cameras.json: integers, as OpenCV has it; the centre of the top-left pixel is (0, 0)"),
    ("quaternion", "unit, w x y z, w >= 0"),
    ("transform", "a row of 7: position x y z, quaternion w x y z; world_from_link"),
    ("silhouette", "8-bit grey PNG: 255 body, 0 background"),
    ("missing", "NaN"),
];

impl BlindManifest {
    pub(crate) fn new(name: &str, sequence: SequenceFacts, observation: Option<ObservationFacts>) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_string();
        Self { schema: SCHEMA.to_string(), name: name.to_string(), version, sequence, observation }
    }

    /// With the schema of sets with moving cameras or own exposure times, if `is_filmed`.
    pub(crate) fn filmed(self, is_filmed: bool) -> Self {
        if is_filmed { Self { schema: FILMED.to_string(), ..self } } else { self }
    }

    /// Whether cameras move or have their own exposure times.
    pub(crate) fn is_filmed(&self) -> bool {
        self.schema == FILMED
    }

    pub(crate) fn from_toml(bytes: &[u8]) -> Result<Self, SetError> {
        // checked first, because another version may have other keys
        if let Some(detail) = another_format(bytes) {
            return Err(SetError::malformed(PATH, detail));
        }
        let manifest: Self = parse(PATH, bytes)?;
        if ![SCHEMA, FILMED].contains(&manifest.schema.as_str()) {
            let detail =
                format!("schema {:?}, this program reads {SCHEMA:?} and {FILMED:?}", excerpt(&manifest.schema));
            return Err(SetError::malformed(PATH, detail));
        }
        manifest.sequence.check().map_err(|detail| SetError::malformed(PATH, detail))?;
        if manifest.name.chars().count() > LONGEST_NAME {
            return Err(SetError::malformed(PATH, format!("name: expected at most {LONGEST_NAME} characters")));
        }
        Ok(manifest)
    }
}

/// Refuses a set of another version of the format, because this program cannot check it.
///
/// # Errors
/// [`SetError::Malformed`] naming both versions, [`SetError::NotASet`] if there is no `set.toml`.
pub(crate) fn refuse_other_formats(directory: &Path) -> Result<(), SetError> {
    let path = directory.join(PATH);
    let bytes = match input::read(&path, limits::SETTINGS) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let detail = format!("it has no {PATH}");
            return Err(SetError::NotASet { path: directory.to_path_buf(), detail });
        }
        Err(e) => return Err(SetError::io(&path, "read")(e)),
    };
    match another_format(&bytes) {
        Some(detail) => Err(SetError::malformed(PATH, detail).below(directory)),
        None => Ok(()),
    }
}

/// The error message for a `set.toml` of another version of the format.
fn another_format(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let found = text.lines().find_map(|line| line.strip_prefix("schema = \"")?.strip_suffix('"'))?;
    (found.starts_with("skiagraph.set/") && ![SCHEMA, FILMED].contains(&found)).then(|| {
        format!(
            "schema {:?}, this program reads {SCHEMA:?} and {FILMED:?}; use the version of skiagraph that made the set",
            excerpt(found)
        )
    })
}

pub(crate) fn to_toml(blind: &BlindManifest) -> Result<Vec<u8>, SetError> {
    let convention = CONVENTIONS.iter().map(|(key, meaning)| ((*key).to_string(), (*meaning).into())).collect();
    write(PATH, &Manifest { blind, convention })
}

pub(crate) fn facts_to_toml(truth: &TruthFacts) -> Result<Vec<u8>, SetError> {
    write(FACTS_PATH, &TruthPart { truth: truth.clone() })
}

/// The facts of a set; sets of older versions have them in `set.toml`.
pub(crate) fn truth_facts(files: &SetFiles) -> Result<TruthFacts, SetError> {
    let path = if files.has(FACTS_PATH) { FACTS_PATH } else { PATH };
    facts_from_toml(path, &files.read(path)?)
}

pub(crate) fn facts_from_toml(path: &str, bytes: &[u8]) -> Result<TruthFacts, SetError> {
    parse::<TruthPart>(path, bytes).map(|part| part.truth)
}

#[derive(Serialize, Deserialize)]
struct TruthPart {
    truth: TruthFacts,
}

fn write(path: &str, value: &impl Serialize) -> Result<Vec<u8>, SetError> {
    toml::to_string(value).map(String::into_bytes).map_err(|e| SetError::malformed(path, e.to_string()))
}

fn parse<T: serde::de::DeserializeOwned>(path: &str, bytes: &[u8]) -> Result<T, SetError> {
    let text =
        std::str::from_utf8(bytes).map_err(|e| SetError::malformed(path, format!("the text is not UTF-8 ({e})")))?;
    toml::from_str(text).map_err(|e| {
        let before = e.span().and_then(|span| text.as_bytes().get(..span.start));
        let line = before.map_or(1, |before| before.iter().filter(|byte| **byte == b'\n').count() + 1);
        SetError::malformed(path, format!("line {line}: {}", foreign_about(bytes, e.message())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PushFacts, SimulationFacts};

    fn pushed_over() -> ContactFacts {
        let push = PushFacts { at_s: 0.5, link: "thorax".into(), impulse_ns: 40.0, direction: [0.0, 1.0, 0.0] };
        ContactFacts {
            mode: "simulate".into(),
            outcome: "the body FELL after 0.80 s of 2.50 s".into(),
            skate_mm_per_s: 3.25,
            penetration_mm: 0.0,
            float_mm: 0.1,
            joints_moved_mm: Some([20.0, 300.0]),
            raised_mm: None,
            simulation: Some(SimulationFacts {
                friction: 0.8,
                root_wrench: 0.2,
                root_wrench_used: [0.05, 0.2],
                duration_s: 2.5,
                fell_at_s: Some(0.8),
                fell_at_frame: Some(48),
                pushes: vec![push],
            }),
        }
    }

    fn walk() -> BlindManifest {
        let forward = Some([0.6, -0.8, 0.0]);
        BlindManifest::new("walk", SequenceFacts { frames: 3, frames_per_second: 59.94, cameras: 4, forward }, None)
    }

    #[test]
    fn the_manifest_is_read_back_and_has_the_conventions() {
        let text = to_toml(&walk()).unwrap();
        assert_eq!(BlindManifest::from_toml(&text).unwrap(), walk());
        let text = String::from_utf8(text).unwrap();
        assert!(text.contains("world = \"right-handed, Z up") && text.contains("forward = [0.6, -0.8, 0.0]"), "{text}");
        let without: String =
            text.lines().filter(|line| !line.starts_with("forward = [")).map(|l| format!("{l}\n")).collect();
        assert_eq!(BlindManifest::from_toml(without.as_bytes()).unwrap().sequence.forward, None, "an older set");
    }

    #[test]
    fn facts_of_the_truth_are_read_from_their_file_and_from_older_sets() {
        let files =
            |path: &str, bytes: Vec<u8>| SetFiles::in_memory([(path.to_owned(), bytes)].into(), &|| false).unwrap();
        let without = TruthFacts { motion: "made up".into(), mismatch: "girths +10 %".into(), ..TruthFacts::default() };
        let text = facts_to_toml(&without).unwrap();
        let words = String::from_utf8(text.clone()).unwrap();
        assert!(!words.contains("contact"), "as it was before contact was written down");
        assert_eq!(truth_facts(&files(FACTS_PATH, text.clone())).unwrap(), without);
        let older = [to_toml(&walk()).unwrap(), b"\n".to_vec(), text].concat();
        assert_eq!(truth_facts(&files(PATH, older)).unwrap(), without);
        let facts = TruthFacts { contact: Some(pushed_over()), ..without };
        assert_eq!(truth_facts(&files(FACTS_PATH, facts_to_toml(&facts).unwrap())).unwrap(), facts);
    }
}
