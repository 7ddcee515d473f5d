//! Finding the recording that a scenario names, and the part of it that is used.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use super::retargeting::{frames_in_view, refusal_of};
use crate::common::{ExperimentError, key_error};
use crate::scenario::{KeyError, MotionSettings, ScenarioFile, did_you_mean, similar_file};
use skiagraph_core::body::gltf_contents;
use skiagraph_core::input::{self, excerpt, hex_sha256, limits};
use skiagraph_set::SourceRecording;
use skiagraph_truth::mocap::{self, Clip, ReadOptions};
use skiagraph_truth::retarget::{Ground, MotionFingerprint, plausibility};

/// The clips that are built in, by the name behind `embedded:`.
pub const EMBEDDED_CLIPS: [(&str, &str); 3] = [
    ("walk", include_str!("../../scenarios/motions/humanoid3d_walk.txt")),
    ("run", include_str!("../../scenarios/motions/humanoid3d_run.txt")),
    ("jump", include_str!("../../scenarios/motions/humanoid3d_jump.txt")),
];

const LONGEST_MOTION_S: f64 = 3600.0;

/// Folders of recordings are searched to this depth, because links may form a circle.
const GREATEST_DEPTH: usize = 12;

/// Accepted statures of a body whose unit is given by the format or the user, metres. The range for guessed units is
/// narrower (`mocap`).
const STATURES: std::ops::RangeInclusive<f64> = 0.5..=3.0;

pub(crate) struct UsedRecording {
    /// The clip, cut, repeated and resampled.
    pub(crate) clip: Clip,
    pub(crate) source: SourceRecording,
    /// Whether it is one cycle of a cyclic motion, and so already repeated to `loop_to_s`.
    pub(crate) was_cyclic: bool,
    pub(crate) ground: Ground,
}

/// Reads the recording of `[motion]` or `[[training.clips]]` (`table`), then cuts, repeats and resamples it.
pub(crate) fn load(
    places: Folders<'_>,
    table: &str,
    settings: &MotionSettings,
) -> Result<UsedRecording, ExperimentError> {
    read_part(places, Path::new(&settings.clip), settings).map_err(|error| error.within(table))
}

/// Errors for recordings and skeletons of a motion and its takes that do not exist. Their content is not checked.
pub(crate) fn missing(places: Folders<'_>, table: &str, settings: &MotionSettings) -> Vec<ExperimentError> {
    let mut errors = Vec::new();
    for (table, take) in settings.takes(table) {
        let mut found = Vec::new();
        match built_in(Path::new(&take.clip)) {
            Some(name) => found.extend(embedded(name).err()),
            None => {
                found.extend(places.find(Path::new(&take.clip), take.sha256.as_deref(), &take, "clip").err());
                let skeleton = take.skeleton.as_ref();
                found.extend(skeleton.and_then(|name| places.find(Path::new(name), None, &take, "skeleton").err()));
            }
        }
        errors.extend(found.into_iter().map(|error| error.within(&table).into()));
    }
    errors
}

/// As [`load`], for a `recording` in these places: the path of the settings' clip, which need not be UTF-8. Errors have
/// keys of the settings.
pub(crate) fn read_part(
    places: Folders<'_>,
    recording: &Path,
    settings: &MotionSettings,
) -> Result<UsedRecording, ExperimentError> {
    let used = settings.first_frame.unwrap_or(1).saturating_sub(1)..settings.last_frame.unwrap_or(usize::MAX);
    let mut options = ReadOptions {
        frames_per_second: settings.source_hz,
        metres_per_unit: settings.metres_per_unit,
        up: settings.up,
        sides: settings.sides,
        skeleton: None,
        // frame numbers are those of the file, so a rest pose is removed only after cutting
        keep_rest_pose: true,
        markers: settings.marker_map.clone(),
        subject: settings.subject.clone(),
        used_frames: Some(used),
        stature_m: settings.stature_m,
    };
    let (clip, sha256) = if let Some(name) = built_in(recording) {
        let text = embedded(name)?;
        (mocap::parse_deepmimic(text, &settings.clip, &options)?, hex_sha256(text.as_bytes()))
    } else {
        let path = places.find(recording, settings.sha256.as_deref(), settings, "clip")?;
        if let Some(name) = &settings.skeleton {
            options.skeleton = Some(places.find(Path::new(name), None, settings, "skeleton")?);
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
    check_stature(&clip).map_err(|message| key_error("metres_per_unit", message))?;
    let length = clip.frames.len();
    let (first, last) = (settings.first_frame.unwrap_or(1), settings.last_frame.unwrap_or(length));
    for (key, frame) in [("first_frame", first), ("last_frame", last)] {
        if frame > length {
            return Err(key_error(key, format!("expected a frame of the clip (1 to {length}), found {frame}")));
        }
    }
    let clip = plausibility::upright(clip, &settings.joint_map);
    let used = first - 1..last;
    let judgement = plausibility::judge(&clip, used.clone(), &settings.joint_map, settings.ground);
    let judgement = judgement.map_err(|e| key_error("joint_map", frames_in_view(&clip.notes) + &e.to_string()))?;
    if let Some(refusal) = judgement.refusal().filter(|_| !settings.accept_implausible) {
        return Err(key_error("clip", refusal_of(&settings.clip, refusal, &clip.notes)));
    }
    let mut clip = clip.crop(used).map_err(|e| key_error("last_frame", e.to_string()))?;
    if settings.first_frame.is_none() {
        clip = clip.without_inserted_rest_pose();
    }
    let fingerprint =
        MotionFingerprint::from_clip(&clip, &settings.joint_map).map_err(|e| key_error("joint_map", e.to_string()))?;
    let source = SourceRecording {
        clip: settings.clip.clone(),
        sha256: Some(sha256),
        first_frame: last + 1 - clip.frames.len(),
        last_frame: last,
        fingerprint: Some(fingerprint),
    };
    let was_cyclic = clip.cyclic;
    if settings.mirror {
        clip = clip.mirrored().map_err(|e| key_error("mirror", e.to_string()))?;
    }
    clip = clip.at_speed(settings.speed.unwrap_or(1.0));
    // motions that are not cyclic are repeated later, on the body, with a transition
    if let Some(duration) = settings.loop_to_s.filter(|_| was_cyclic) {
        clip = clip.looped(duration).map_err(|e| key_error("loop_to_s", e.to_string()))?;
    }
    if clip.duration() > LONGEST_MOTION_S {
        let found = clip.duration();
        return Err(key_error(
            "last_frame",
            format!("expected a part of at most {LONGEST_MOTION_S} s, found {found} s"),
        ));
    }
    let mut clip =
        clip.resampled(settings.frames_per_second).map_err(|e| key_error("frames_per_second", e.to_string()))?;
    clip.notes.extend(judgement.notes());
    Ok(UsedRecording { clip, source, was_cyclic, ground: judgement.ground })
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

/// A whole recording at its own frame rate. `path` is a file or `embedded:NAME`.
pub(crate) fn read_whole(path: &Path, options: &ReadOptions) -> Result<Clip, ExperimentError> {
    let clip = match built_in(path) {
        None => mocap::read(path, options)?,
        Some(name) => {
            let malformed = |e: KeyError| ExperimentError::Malformed { path: path.to_owned(), detail: e.message() };
            mocap::parse_deepmimic(embedded(name).map_err(malformed)?, &path.display().to_string(), options)?
        }
    };
    let argument = |detail| ExperimentError::Argument { argument: "--metres-per-unit", detail };
    check_stature(&clip).map_err(argument)?;
    Ok(plausibility::upright(clip, &BTreeMap::new()))
}

/// NAME of `embedded:NAME`.
fn built_in(path: &Path) -> Option<&str> {
    path.to_str()?.strip_prefix("embedded:")
}

/// The text of a built-in clip, or an error that lists the known names.
fn embedded(name: &str) -> Result<&'static str, KeyError> {
    let known = EMBEDDED_CLIPS.map(|(name, _)| name);
    EMBEDDED_CLIPS.iter().find(|(n, _)| *n == name).map(|(_, text)| *text).ok_or_else(|| {
        let guess = did_you_mean(name, known).map(|g| format!(", did you mean `embedded:{g}`?"));
        let guess = guess.unwrap_or_default();
        let known = known.join(", ");
        KeyError::new("clip", format!("no such built-in clip: `{}`{guess} (known: {known})", excerpt(name)))
    })
}

/// The files that [`load`] reads for a `recording`, the settings' clip: none for built-in clips and missing files.
pub(crate) fn paths_of(places: Folders<'_>, recording: &Path, settings: &MotionSettings) -> Vec<PathBuf> {
    if built_in(recording).is_some() {
        return Vec::new();
    }
    let Ok(clip) = places.find(recording, settings.sha256.as_deref(), settings, "clip") else { return Vec::new() };
    let has = |path: &Path, wanted: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    let skeletons: Vec<PathBuf> = match &settings.skeleton {
        Some(name) => places.find(Path::new(name), None, settings, "skeleton").into_iter().collect(),
        None if has(&clip, "amc") => {
            let beside = clip.parent().and_then(|folder| fs::read_dir(folder).ok());
            let beside = beside.into_iter().flatten().flatten().map(|entry| entry.path());
            beside.filter(|path| has(path, "asf")).collect()
        }
        None => Vec::new(),
    };
    let buffers = buffers_of(&clip);
    [vec![clip], skeletons, buffers].concat()
}

/// The files beside a `.gltf` that hold its numbers.
pub(crate) fn buffers_of(path: &Path) -> Vec<PathBuf> {
    if !path.extension().is_some_and(|own| own.eq_ignore_ascii_case("gltf")) {
        return Vec::new();
    }
    let files = input::read(path, limits::RECORDING).map_or(Vec::new(), |bytes| gltf_contents(&bytes).files);
    files.iter().map(|name| path.with_file_name(name)).collect()
}

/// Where the files of a scenario are: relative to its folder; clips are also searched below the recordings' folder.
#[derive(Clone, Copy)]
pub(crate) struct Folders<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) mocap_directory: Option<&'a Path>,
}

impl<'a> Folders<'a> {
    pub(crate) fn of(file: &'a ScenarioFile, mocap_directory: Option<&'a Path>) -> Self {
        Self { folder: &file.folder, mocap_directory }
    }

    /// The file of that path or name, the value of `key`. If several below the recordings' folder match, the one with
    /// the right hash, else the first in alphabetical order.
    fn find(
        &self,
        name: &Path,
        sha256: Option<&str>,
        settings: &MotionSettings,
        key: &str,
    ) -> Result<PathBuf, KeyError> {
        let beside = self.folder.join(name);
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
        found.ok_or_else(|| KeyError::new(key, self.missing(&name.to_string_lossy(), settings)))
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
        load(Folders::of(&file, None), "motion", &file.scenario.motion).unwrap().clip
    }

    /// Only the `.gltf` itself was an input, so that another motion in its buffer went unnoticed.
    #[test]
    fn buffers_of_a_gltf_are_inputs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.gltf");
        let buffers = r#"[{"uri": "my%20walk.bin", "byteLength": 4}, {"uri": "data:,", "byteLength": 0}]"#;
        fs::write(&path, format!(r#"{{"asset": {{"version": "2.0"}}, "buffers": {buffers}}}"#)).unwrap();
        let places = Folders { folder: folder.path(), mocap_directory: None };
        let found = paths_of(places, Path::new("walk.gltf"), &MotionSettings::from_clip("walk.gltf"));
        assert_eq!(found, [path, folder.path().join("my walk.bin")]);
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
