//! Finding the recording that a scenario names, and the part of it that is used.

use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::benchmark_set::SourceRecording;
use crate::common::{ExperimentError, scenario_error};
use crate::input::{self, AllowedFolders, excerpt, hex_sha256, limits};
use crate::mocap::{self, Clip, ReadOptions};
use crate::retarget::MotionFingerprint;
use crate::scenario::{MotionSettings, ScenarioFile, did_you_mean, similar_file};

/// The clips that are built in, by the name behind `embedded:`.
pub const EMBEDDED_CLIPS: [(&str, &str); 3] = [
    ("walk", include_str!("../../scenarios/motions/humanoid3d_walk.txt")),
    ("run", include_str!("../../scenarios/motions/humanoid3d_run.txt")),
    ("jump", include_str!("../../scenarios/motions/humanoid3d_jump.txt")),
];

/// The longest motion that is accepted, seconds.
const LONGEST_MOTION_S: f64 = 3600.0;

/// Folders of recordings are searched to this depth, because links may form a circle.
const GREATEST_DEPTH: usize = 12;

/// Accepted statures of a body whose unit is given by the format or the user, metres. The range for guessed units is
/// narrower (`mocap`).
const STATURES: std::ops::RangeInclusive<f64> = 0.5..=3.0;

/// The part of a recording that is used.
pub(crate) struct UsedRecording {
    /// The clip, cut, repeated and resampled.
    pub(crate) clip: Clip,
    /// Its frames in the recorded file.
    pub(crate) source: SourceRecording,
    /// Whether it is one cycle of a cyclic motion, and so already repeated to `loop_to_s`.
    pub(crate) was_cyclic: bool,
}

/// Reads the recording of `[motion]` or `[[training.clips]]` (`table`), then cuts, repeats and resamples it.
pub(crate) fn load(
    file: &ScenarioFile,
    table: &str,
    settings: &MotionSettings,
    mocap_directory: Option<&Path>,
) -> Result<UsedRecording, ExperimentError> {
    read_part(ClipFolders::of(file, mocap_directory), Path::new(&settings.clip), settings, &|key, message| {
        scenario_error(file, &format!("{table}.{key}"), message)
    })
}

/// Errors for recordings and skeletons of a motion and its takes that do not exist. Their content is not checked.
pub(crate) fn missing(
    file: &ScenarioFile,
    table: &str,
    settings: &MotionSettings,
    mocap_directory: Option<&Path>,
) -> Vec<ExperimentError> {
    let takes = settings.takes(table);
    takes.iter().flat_map(|(table, take)| missing_of_one(file, table, take, mocap_directory)).collect()
}

fn missing_of_one(
    file: &ScenarioFile,
    table: &str,
    settings: &MotionSettings,
    mocap_directory: Option<&Path>,
) -> Vec<ExperimentError> {
    let scenario_error_at = |key: &str, message| scenario_error(file, &format!("{table}.{key}"), message);
    if let Some(name) = built_in(Path::new(&settings.clip)) {
        return embedded(name).err().map(|message| scenario_error_at("clip", message)).into_iter().collect();
    }
    let places = ClipFolders::of(file, mocap_directory);
    let clip = places.find(Path::new(&settings.clip), settings.sha256.as_deref(), settings).err();
    let skeleton = settings.skeleton.as_ref().and_then(|name| places.find(Path::new(name), None, settings).err());
    let missing =
        clip.map(|message| ("clip", message)).into_iter().chain(skeleton.map(|message| ("skeleton", message)));
    missing.map(|(key, message)| scenario_error_at(key, message)).collect()
}

/// As [`load`], for a `recording` in these places: the path of the settings' clip, which need not be UTF-8.
/// `scenario_error_at` makes the error for a key of the settings.
pub(crate) fn read_part(
    places: ClipFolders<'_>,
    recording: &Path,
    settings: &MotionSettings,
    scenario_error_at: &dyn Fn(&'static str, String) -> ExperimentError,
) -> Result<UsedRecording, ExperimentError> {
    let mut options = ReadOptions {
        frames_per_second: settings.source_hz,
        metres_per_unit: settings.metres_per_unit,
        up: settings.up,
        skeleton: None,
        // frame numbers are those of the file, so a rest pose is removed only after cutting
        keep_rest_pose: true,
        markers: settings.marker_map.clone(),
    };
    let (clip, sha256) = if let Some(name) = built_in(recording) {
        let text = embedded(name).map_err(|message| scenario_error_at("clip", message))?;
        (mocap::parse_deepmimic(text, &settings.clip, &options)?, hex_sha256(text.as_bytes()))
    } else {
        let path = places.find(recording, settings.sha256.as_deref(), settings);
        let path = path.map_err(|message| scenario_error_at("clip", message))?;
        if let Some(name) = &settings.skeleton {
            let skeleton = places.find(Path::new(name), None, settings);
            options.skeleton = Some(skeleton.map_err(|message| scenario_error_at("skeleton", message))?);
        }
        let mut clip = mocap::read(&path, &options)?;
        let found = sha256_of(&path).map_err(|source| mocap::MocapError::Unreadable { path: path.clone(), source })?;
        if let Some(expected) = settings.sha256.as_ref().filter(|expected| !found.eq_ignore_ascii_case(expected)) {
            clip.notes.push(format!(
                "{} is not the file that the scenario was written for: its SHA-256 is {found}, expected {expected}",
                path.display()
            ));
        }
        (clip, found)
    };
    check_stature(&clip).map_err(|message| scenario_error_at("metres_per_unit", message))?;
    let length = clip.frames.len();
    let (first, last) = (settings.first_frame.unwrap_or(1), settings.last_frame.unwrap_or(length));
    for (key, frame) in [("first_frame", first), ("last_frame", last)] {
        if frame > length {
            return Err(scenario_error_at(key, format!("expected a frame of the clip (1 to {length}), found {frame}")));
        }
    }
    let mut clip = clip.crop(first - 1..last).map_err(|e| scenario_error_at("last_frame", e.to_string()))?;
    if settings.first_frame.is_none() {
        clip = clip.without_inserted_rest_pose();
    }
    let fingerprint = MotionFingerprint::from_clip(&clip, &settings.joint_map)
        .map_err(|e| scenario_error_at("joint_map", e.to_string()))?;
    let source = SourceRecording {
        clip: settings.clip.clone(),
        sha256: Some(sha256),
        first_frame: last + 1 - clip.frames.len(),
        last_frame: last,
        fingerprint: Some(fingerprint),
    };
    let was_cyclic = clip.cyclic;
    if settings.mirror {
        clip = clip.mirrored().map_err(|e| scenario_error_at("mirror", e.to_string()))?;
    }
    clip = clip.at_speed(settings.speed.unwrap_or(1.0));
    // motions that are not cyclic are repeated later, on the body, with a transition
    if let Some(duration) = settings.loop_to_s.filter(|_| was_cyclic) {
        clip = clip.looped(duration).map_err(|e| scenario_error_at("loop_to_s", e.to_string()))?;
    }
    if clip.duration() > LONGEST_MOTION_S {
        let found = clip.duration();
        return Err(scenario_error_at(
            "last_frame",
            format!("expected a part of at most {LONGEST_MOTION_S} s, found {found} s"),
        ));
    }
    let clip = clip
        .resampled(settings.frames_per_second)
        .map_err(|e| scenario_error_at("frames_per_second", e.to_string()))?;
    Ok(UsedRecording { clip, source, was_cyclic })
}

/// Refuses a body of an implausible size: the unit is wrong.
fn check_stature(clip: &Clip) -> Result<(), String> {
    let stature = clip.stature();
    let (least, most) = (STATURES.start(), STATURES.end());
    if STATURES.contains(&stature) {
        return Ok(());
    }
    Err(format!(
        "expected a unit that makes the body of `{}` {least} to {most} m tall, found a body of {stature:.3} m; give the \
         length of the file's unit",
        clip.name
    ))
}

/// A whole recording at its own frame rate. `path` is a file or `embedded:NAME`; `metres_per_unit` overrides the file's
/// unit.
///
/// # Errors
/// [`ExperimentError`] that names the file.
pub(crate) fn read_whole(path: &Path, metres_per_unit: Option<f64>) -> Result<Clip, ExperimentError> {
    let options = ReadOptions { metres_per_unit, ..ReadOptions::default() };
    let clip = match built_in(path) {
        None => mocap::read(path, &options)?,
        Some(name) => {
            let malformed = |detail| ExperimentError::Malformed { path: path.to_owned(), detail };
            mocap::parse_deepmimic(embedded(name).map_err(malformed)?, &path.display().to_string(), &options)?
        }
    };
    let argument = |detail| ExperimentError::Argument { argument: "--metres-per-unit", detail };
    check_stature(&clip).map_err(argument)?;
    Ok(clip)
}

/// NAME of `embedded:NAME`.
fn built_in(path: &Path) -> Option<&str> {
    path.to_str()?.strip_prefix("embedded:")
}

/// The text of a built-in clip, or an error message that lists the known names.
fn embedded(name: &str) -> Result<&'static str, String> {
    let known = EMBEDDED_CLIPS.map(|(name, _)| name);
    EMBEDDED_CLIPS.iter().find(|(n, _)| *n == name).map(|(_, text)| *text).ok_or_else(|| {
        let guess = did_you_mean(name, known).map(|g| format!(", did you mean `embedded:{g}`?"));
        let guess = guess.unwrap_or_default();
        format!("no such built-in clip: `{}`{guess} (known: {})", excerpt(name), known.join(", "))
    })
}

/// The files that [`load`] reads for a `recording`, the settings' clip: none for built-in clips and missing files.
pub(crate) fn paths_of(places: ClipFolders<'_>, recording: &Path, settings: &MotionSettings) -> Vec<PathBuf> {
    if built_in(recording).is_some() {
        return Vec::new();
    }
    let Ok(clip) = places.find(recording, settings.sha256.as_deref(), settings) else { return Vec::new() };
    let has = |path: &Path, wanted: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    let skeletons: Vec<PathBuf> = match &settings.skeleton {
        Some(name) => places.find(Path::new(name), None, settings).into_iter().collect(),
        None if has(&clip, "amc") => {
            let beside = clip.parent().and_then(|folder| fs::read_dir(folder).ok());
            let beside = beside.into_iter().flatten().flatten().map(|entry| entry.path());
            beside.filter(|path| has(path, "asf")).collect()
        }
        None => Vec::new(),
    };
    [vec![clip], skeletons].concat()
}

/// Where clips are searched.
#[derive(Clone, Copy)]
pub(crate) struct ClipFolders<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) mocap_directory: Option<&'a Path>,
    /// Folders in which paths may point.
    pub(crate) allowed: &'a AllowedFolders,
}

impl<'a> ClipFolders<'a> {
    /// The folders of a scenario.
    pub(crate) fn of(file: &'a ScenarioFile, mocap_directory: Option<&'a Path>) -> Self {
        Self { folder: &file.folder, mocap_directory, allowed: &file.allowed }
    }

    /// The file of that path or name. If several below the recordings' folder match, the one with the right hash, else
    /// the first in alphabetical order.
    ///
    /// # Errors
    /// A message if there is no such file or the path may not be named.
    fn find(&self, name: &Path, sha256: Option<&str>, settings: &MotionSettings) -> Result<PathBuf, String> {
        let beside = self.folder.join(name);
        if let Err(outside) = self.check(&beside) {
            return Err(format!("`{}` {outside}", excerpt(&name.to_string_lossy())));
        }
        if beside.exists() && !beside.is_dir() {
            return Ok(beside);
        }
        let mut found = Vec::new();
        if let Some(directory) = self.mocap_directory {
            search(directory, name, 0, &mut found);
        }
        let right =
            |path: &&PathBuf| sha256.is_some_and(|hash| sha256_of(path).is_ok_and(|h| h.eq_ignore_ascii_case(hash)));
        let found = found.iter().find(right).or(found.first()).cloned();
        found.ok_or_else(|| self.missing(&name.to_string_lossy(), settings))
    }

    fn check(&self, path: &Path) -> std::io::Result<()> {
        let mut of_recordings = AllowedFolders::default();
        self.mocap_directory.into_iter().for_each(|directory| of_recordings.allow(directory));
        of_recordings.check(path).or_else(|_| self.allowed.check(path))
    }

    fn missing(&self, name: &str, settings: &MotionSettings) -> String {
        // such paths are not searched below the recordings' folder
        let is_path =
            Path::new(name).is_absolute() || Path::new(name).components().any(|part| part == Component::ParentDir);
        if is_path {
            return format!("there is no file `{}`", excerpt(name)) + &self.guess(name);
        }
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { self.folder };
        let searched = match self.mocap_directory {
            Some(directory) if directory.is_dir() => format!("nor below {}", directory.display()),
            Some(directory) => format!("and {} is not a directory", directory.display()),
            None => "and neither --mocap-dir nor SKIAGRAPH_MOCAP names a directory of recordings".to_owned(),
        };
        let source = match settings.source.as_str() {
            "" => String::new(),
            source => format!("; source: {}", excerpt(source)),
        };
        let hash = settings.sha256.as_ref().map(|hash| format!(" (SHA-256 {hash})")).unwrap_or_default();
        let guess = self.guess(name);
        format!("`{}` is not in {}, {searched}{guess}{source}{hash}", excerpt(name), folder.display())
    }

    /// The suggestion of a similar file name, for the end of a message.
    fn guess(&self, name: &str) -> String {
        let guess = similar_file(&self.folder.join(name));
        guess.map(|guess| format!("; did you mean `{}`?", excerpt(&guess))).unwrap_or_default()
    }
}

/// Collects the files whose path ends in `name`, in alphabetical order of directories.
fn search(directory: &Path, name: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(directory).into_iter().flatten().flatten().map(|e| e.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            if depth < GREATEST_DEPTH {
                search(&path, name, depth + 1, found);
            }
        } else if path.ends_with(name) {
            found.push(path);
        }
    }
}

fn sha256_of(path: &Path) -> std::io::Result<String> {
    Ok(hex_sha256(&input::read(path, limits::RECORDING)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shipped recording of CMU 01_01, whose first frame is an inserted rest pose.
    fn shipped_bvh(frames: &str) -> Clip {
        let text = format!(
            "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"01_01.bvh\"\n\
             frames_per_second = 120.0\n{frames}"
        );
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions");
        let file = ScenarioFile::parse(&text, "a.toml", folder, &[]).unwrap();
        load(&file, "motion", &file.scenario.motion, None).unwrap().clip
    }

    #[test]
    fn an_inserted_rest_pose_is_used_only_if_the_first_frame_is_requested() {
        let with_rest_pose = shipped_bvh("first_frame = 1\nlast_frame = 30");
        let (from_second, to_30) = (shipped_bvh("first_frame = 2\nlast_frame = 30"), shipped_bvh("last_frame = 30"));
        assert!(with_rest_pose.has_inserted_rest_pose() && !to_30.has_inserted_rest_pose());
        assert_eq!(with_rest_pose.frames.len(), to_30.frames.len() + 1);
        assert_eq!(to_30.frames, from_second.frames);
        assert_eq!(shipped_bvh("").frames[..to_30.frames.len()], to_30.frames);
    }
}
