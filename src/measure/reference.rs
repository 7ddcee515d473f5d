//! A run beside a reference: the same motion as another system recorded it, whose errors are not known.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::tracked::Tracked;
use crate::common::ExperimentError;
use crate::prepare::clip_file::{Folders, load, paths_of, read_part};
use crate::scenario::{MotionSettings, ScenarioFile};
use skiagraph_core::body::Markers;
use skiagraph_eval::AgainstReference;
use skiagraph_report::FactGroup;
use skiagraph_set::EstimatedSequence;
use skiagraph_truth::retarget::subject_markers;

/// Correlation of the motions below which a reference is probably that of another motion.
const DOUBTFUL: f64 = 0.8;

/// The reference of `skiagraph evaluate`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReferenceChoice {
    /// A recording, or a scenario whose `[motion]` is the recording.
    pub file: PathBuf,
    /// Its time at the set's first frame, seconds; `None` to estimate it.
    pub offset_s: Option<f64>,
    /// Where clips that the scenario names are also searched.
    pub mocap_directory: Option<PathBuf>,
}

pub(crate) struct Reference {
    choice: ReferenceChoice,
    frames_per_second: f64,
    markers: Vec<Markers>,
    notes: Vec<String>,
    pub(crate) files: Vec<PathBuf>,
}

/// A run beside a reference, in `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunAgainstReference {
    /// The recording, as it was named.
    pub file: String,
    /// What was guessed in reading it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    pub seeds: Vec<AgainstReference>,
}

impl Reference {
    /// Reads the recording at the rate of a set.
    pub(crate) fn read(choice: &ReferenceChoice, frames_per_second: f64) -> Result<Self, ExperimentError> {
        let path = &choice.file;
        let refuse = |detail| ExperimentError::Argument { argument: "--reference", detail };
        let mut files = vec![path.clone()];
        let (clip, joint_map) = if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            let file = ScenarioFile::open(path, &[])?;
            let motion = MotionSettings { frames_per_second, ..file.scenario.motion.clone() };
            if !motion.then.is_empty() || !motion.path_m.is_empty() || motion.variation.is_some() {
                let expected = "expected one clip in [motion], found `then`, `path_m` or `variation`";
                return Err(refuse(format!("{expected}: {}", path.display())));
            }
            let places = Folders::of(&file, choice.mocap_directory.as_deref());
            let read = load(places, "motion", &motion).map_err(|error| error.located(&file))?;
            files.extend(paths_of(places, Path::new(&motion.clip), &motion));
            (read.clip, motion.joint_map)
        } else {
            if !path.is_file() && !path.to_string_lossy().starts_with("embedded:") {
                return Err(refuse(format!("there is no such file: {}", path.display())));
            }
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let motion = MotionSettings { frames_per_second, ..MotionSettings::from_clip(&name) };
            let places = Folders { folder: Path::new(""), mocap_directory: None };
            let read = read_part(places, path, &motion).map_err(|error| {
                let hint =
                    "keys such as `up` go in [motion] of a scenario, which --reference takes in place of the recording";
                refuse(format!("{error}; {hint}"))
            })?;
            (read.clip, motion.joint_map)
        };
        let (markers, notes) = subject_markers(&clip, &joint_map)?;
        let notes = clip.notes.into_iter().chain(notes).collect();
        Ok(Self { choice: choice.clone(), frames_per_second, markers, notes, files })
    }
}

impl RunAgainstReference {
    /// Compares every seed with the reference.
    pub(crate) fn new(tracked: &Tracked, reference: &Reference) -> Result<Self, ExperimentError> {
        let path = reference.choice.file.display().to_string();
        let of_seed = |sequence: &EstimatedSequence| {
            let (rate, offset_s) = (reference.frames_per_second, reference.choice.offset_s);
            AgainstReference::new(&sequence.markers, &reference.markers, rate, offset_s).map_err(|detail| {
                ExperimentError::Argument { argument: "--reference", detail: format!("{path}: {detail}") }
            })
        };
        let seeds = tracked.estimates.sequences.iter().map(of_seed).collect::<Result<_, _>>()?;
        Ok(Self { file: path, notes: reference.notes.clone(), seeds })
    }

    pub(crate) fn facts(&self) -> FactGroup {
        let mut facts = vec![("reference".to_owned(), self.file.clone())];
        let mut say = |name: &str, words: String| facts.push((name.to_owned(), words));
        let several = self.seeds.len() > 1;
        let mean = |value: fn(&AgainstReference) -> f64| {
            self.seeds.iter().map(value).sum::<f64>() / self.seeds.len().max(1) as f64
        };
        let Some(first) = self.seeds.first() else { return FactGroup { title: "Reference".to_owned(), facts } };
        say(
            "distance from the reference",
            format!(
                "{:.1} mm in the mean of {} markers{}, {:.1} mm without what is constant for each marker",
                mean(|seed| seed.mean_mm),
                first.markers.len(),
                if several { " and the seeds" } else { "" },
                mean(|seed| seed.without_constant_mm)
            ),
        );
        let farthest = first.markers.iter().max_by(|a, b| a.1.mean_mm.total_cmp(&b.1.mean_mm));
        if let Some((name, own)) = farthest {
            let (all, rest) = (own.mean_mm, own.without_constant_mm);
            say("farthest marker", format!("{name}, {all:.1} mm, {rest:.1} mm without what is constant"));
        }
        say(
            "the reference's own error",
            match first.own_mm {
                None => "not known: no limb has both ends".to_owned(),
                Some(own) if own < 0.1 => "hidden: its limbs have fixed lengths".to_owned(),
                Some(own) => format!("the lengths of its limbs vary by {own:.1} mm"),
            },
        );
        let rival = first.rival_s.map_or_else(String::new, |rival| {
            format!("; the motion repeats itself, and {rival:.3} s fits nearly as well (--reference-offset takes one)")
        });
        let doubt = if first.correlation < DOUBTFUL { ", which two recordings of one motion hardly have" } else { "" };
        let of_first = if several { ", of the first seed" } else { "" };
        say(
            "the reference's clock",
            format!(
                "the first frame is at {:.3} s of it, by {} frames{of_first} (correlation of the motions {:.3}{doubt}){rival}",
                first.offset_s, first.frames, first.correlation
            ),
        );
        let ([heading, tilt], [x, y, z]) = (first.turned_deg, first.moved_m);
        say(
            "the reference's place",
            format!("turned by {heading:.1} degrees, tilted by {tilt:.1}, then moved by {x:.3}, {y:.3}, {z:.3} m"),
        );
        say("size of the estimate's body", format!("{:.3} of the reference's", first.scale));
        facts.extend(self.notes.iter().map(|note| ("reading the reference".to_owned(), note.clone())));
        FactGroup { title: "Reference".to_owned(), facts }
    }
}
