//! The files of a measured run: `run.json`, `per_frame.csv`, `poses.npz`, `report.html` and `contact_sheet.png`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::hints::Hint;
use super::measuring::{Measures, Painters};
use super::per_frame;
use super::playback::playbacks;
use super::poses_file::ReadAs;
use super::reference::RunAgainstReference;
use super::tracked::{POSES_FILE, Tracked};
use crate::common::{ExperimentError, NamedFiles, to_json};
use crate::external::{ExternalRecord, TrackTiming};
use crate::prepare::scene_hash::scene_hash;
use crate::scenario::TrackerSettings;
use skiagraph_core::input::hex_sha256;
use skiagraph_eval::{SegmentationQuality, Summary, changed_settings};
use skiagraph_report::{
    FactGroup, ReportInput, ReportRun, Sheet, SheetFrame, Shown, Verdict, contact_sheet, frames_to_show, render,
    verdict,
};
use skiagraph_set::{BenchmarkSet, BlindSet, ContactFacts};
use skiagraph_truth::observing::ObservationFacts;

/// The name of a run's summary.
pub const RUN_FILE: &str = "run.json";
pub(crate) const RUN_SCHEMA: &str = "skiagraph.run/1";
/// The name of a run's table of frames.
pub const PER_FRAME_FILE: &str = "per_frame.csv";
/// The name of a run's report.
pub const REPORT_FILE: &str = "report.html";
/// The name of a run's picture: cameras x frames.
pub const CONTACT_SHEET_FILE: &str = "contact_sheet.png";

/// Overlap of estimate and mask in a camera that the tracker did not see.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOutOverlap {
    /// Mean of all images.
    pub mean: f64,
    /// That of the worst image.
    pub worst: f64,
}

const SHEET_FRAMES: usize = 5;

/// A run in numbers: `run.json`. Everything except `timing` has the same bytes for the same set, tracker and seeds.
/// Files of earlier versions may lack fields that have a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// `skiagraph.run/1`.
    pub schema: String,
    /// Name of the scenario and the set.
    pub scenario: String,
    /// First seed.
    #[serde(default)]
    pub seed: u64,
    /// All seeds.
    pub seeds: Vec<u64>,
    /// The tracker's name; `external` for poses of another program.
    pub tracker: String,
    /// An explanation of most of the error by a misread estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<Hint>,
    /// How another program's file of poses was read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub read_as: Option<ReadAs>,
    /// The tracker and all its settings as in a scenario; absent for poses of another program.
    pub settings: Option<Value>,
    /// Descriptions of the tracker's training recordings; empty without any, and for poses of another program.
    #[serde(default)]
    pub learned_from: Vec<String>,
    /// Hash of the set's files.
    pub set_hash: String,
    /// Hash of everything that the set shares with other draws of its observation noise; absent in records of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_hash: Option<String>,
    /// Seed of the observations, if anything is drawn with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observation_seed: Option<u32>,
    /// Version of the program.
    pub version: String,
    /// Facts about bodies, motion, cameras, observations and settings.
    #[serde(default)]
    pub facts: Vec<FactGroup>,
    /// Whether actor and tracker share one body.
    #[serde(default)]
    pub matched: bool,
    /// Overlap in each camera that the tracker did not see, by its name, of a recording; empty without any.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub left_out: BTreeMap<String, LeftOutOverlap>,
    /// The run beside a reference, of a recording; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<RunAgainstReference>,
    /// Ground-contact processing of the truth; absent if contact was neither measured nor changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactFacts>,
    /// How the observations were made; absent if they are exact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observation: Option<ObservationFacts>,
    /// Quality of the observed silhouettes, means over cameras and frames; absent if they are exact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segmentation: Option<SegmentationQuality>,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub frames_per_second: f64,
    /// Every metric over all seeds, with its protocol, interval and values per seed and joint.
    #[serde(flatten)]
    pub summary: Summary,
    /// Mean of every metric for a tracker that never moves.
    #[serde(default)]
    pub frozen: BTreeMap<String, f64>,
    /// The verdict: how good the run is, and whether the search or the model causes the error.
    pub verdict: Verdict,
    /// File with one row per seed and frame.
    #[serde(default)]
    pub per_frame: String,
    /// File with estimates and truth.
    #[serde(default)]
    pub poses: String,
    /// File with the report.
    #[serde(default)]
    pub report: String,
    /// What differs between runs; absent for poses of another program.
    #[serde(default)]
    pub timing: Option<TrackTiming>,
    /// The external program that tracked, if one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<ExternalRecord>,
    /// The measured file or folder as named by the command, if the results are elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate: Option<String>,
}

/// The numbers and files of a measured run.
#[derive(Clone, Debug)]
pub struct RunResults {
    /// The numbers.
    pub record: RunRecord,
    /// The files, `run.json` last.
    pub files: NamedFiles,
}

impl RunResults {
    /// Makes the files of a measured run.
    ///
    /// # Errors
    /// [`ExperimentError`] if an observation cannot be read again or the report cannot be drawn.
    pub fn new(set: &BenchmarkSet, tracked: &Tracked, measures: &Measures) -> Result<Self, ExperimentError> {
        Self::of_command(set, tracked, measures, None)
    }

    /// As [`Self::new`]; the report names the `command`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_command(
        set: &BenchmarkSet,
        tracked: &Tracked,
        measures: &Measures,
        command: Option<String>,
    ) -> Result<Self, ExperimentError> {
        let (body, truth) = (&set.blind.start.body, &set.truth.ground_truth);
        let poses = tracked.estimates.to_bytes(POSES_FILE, body, Some(truth))?;
        let facts = facts(set, tracked, measures.segmentation.as_ref(), &poses);
        let runs = report_runs(tracked, measures);
        let sheet = sheet(set, tracked, measures)?;
        let picture = sheet.as_ref().map(contact_sheet).transpose()?;
        let playbacks = playbacks(set, tracked, measures)?;
        let this_run = this_run(tracked, command);
        let tracker = describe_tracker(tracked);
        let input = ReportInput {
            matched: set.truth.facts.matched,
            facts: &facts,
            own_likelihood: tracked.record.is_some(),
            frozen: Some(&measures.frozen),
            sheet: sheet.as_ref(),
            picture: picture.as_deref().unwrap_or_default(),
            playbacks: &playbacks,
            this_run: &this_run,
            hint: measures.hint.as_ref().map(|hint| hint.text.as_str()),
            ..ReportInput::of_runs(&set.blind.name, &tracker, &runs, &measures.summary)
        };
        let truth = &set.truth.facts;
        let record = RunRecord {
            scene_hash: Some(scene_hash(set)),
            observation_seed: truth.observation_seed,
            matched: truth.matched,
            contact: truth.contact.clone(),
            ..record(&set.blind, tracked, measures, facts.clone(), verdict(&input))
        };
        let report = render(&input)?.into_bytes();
        let mut files: NamedFiles = picture.into_iter().map(|png| (CONTACT_SHEET_FILE.into(), png)).collect();
        files.extend([
            (PER_FRAME_FILE.into(), per_frame::to_csv(tracked, measures)?),
            (POSES_FILE.into(), poses),
            (REPORT_FILE.into(), report),
            (RUN_FILE.into(), to_json(&record)?),
        ]);
        Ok(Self { record, files })
    }
}

pub(crate) fn verdict_on(set: &BenchmarkSet, tracked: &Tracked, measures: &Measures) -> Verdict {
    let runs = report_runs(tracked, measures);
    verdict(&ReportInput {
        matched: set.truth.facts.matched,
        own_likelihood: tracked.record.is_some(),
        frozen: Some(&measures.frozen),
        ..ReportInput::of_runs(&set.blind.name, "", &runs, &measures.summary)
    })
}

pub(super) fn report_runs<'a>(tracked: &'a Tracked, measures: &'a Measures) -> Vec<ReportRun<'a>> {
    let searched = |seed: usize| tracked.search.get(seed).into_iter().flatten();
    let runs = measures.runs().into_iter().zip(&measures.seeds).enumerate();
    runs.map(|(index, (run, seed))| ReportRun {
        run,
        truth_energy: &seed.truth_energy,
        estimate_energy: &seed.energy,
        layers: searched(index).map(|record| record.layers.as_slice()).collect(),
        occupancy: searched(index).map(|record| record.occupancy.as_slice()).collect(),
        stances: &seed.stances,
    })
    .collect()
}

/// The record of a measured run, without what only a truth tells.
pub(super) fn record(
    set: &BlindSet,
    tracked: &Tracked,
    measures: &Measures,
    facts: Vec<FactGroup>,
    verdict: Verdict,
) -> RunRecord {
    let track = tracked.record.as_ref();
    let seeds = tracked.estimates.seeds.clone();
    RunRecord {
        schema: RUN_SCHEMA.to_owned(),
        scenario: set.name.clone(),
        seed: seeds.first().copied().unwrap_or_default(),
        seeds,
        tracker: track.map_or("external", |t| t.tracker.name()).to_owned(),
        hint: measures.hint.clone(),
        read_as: tracked.read_as.clone(),
        settings: track.and_then(|t| serde_json::to_value(&t.tracker).ok()),
        learned_from: track.map(|t| t.learned_from.clone()).unwrap_or_default(),
        set_hash: set.set_hash.clone(),
        // a recording has one draw of its noise
        scene_hash: Some(set.set_hash.clone()),
        observation_seed: None,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        facts,
        matched: false,
        contact: None,
        left_out: BTreeMap::new(),
        reference: None,
        observation: set.observation.clone(),
        segmentation: measures.segmentation.clone(),
        frames: set.frame_count,
        frames_per_second: set.frames_per_second,
        summary: measures.summary.clone(),
        frozen: measures.frozen.metrics.iter().map(|(name, value)| (name.clone(), value.mean)).collect(),
        verdict,
        per_frame: PER_FRAME_FILE.to_owned(),
        poses: POSES_FILE.to_owned(),
        report: REPORT_FILE.to_owned(),
        timing: track.map(|t| t.timing).or(tracked.program.as_ref().map(|program| program.timing)),
        program: tracked.program.clone(),
        estimate: tracked.estimate.clone(),
    }
}

/// Frames of the run with the median error, and the worst frame of all runs.
fn sheet<'a>(
    set: &'a BenchmarkSet,
    tracked: &Tracked,
    measures: &Measures,
) -> Result<Option<Sheet<'a>>, ExperimentError> {
    let runs = measures.runs();
    if runs.is_empty() {
        return Ok(None);
    }
    let mut painters = Painters::new(&set.blind);
    let mut frames = Vec::new();
    for shown in frames_to_show(&runs, SHEET_FRAMES) {
        frames.push(sheet_frame(set, tracked, measures, &mut painters, shown)?);
    }
    let (rig, frames_per_second) = (&set.blind.rig, set.blind.frames_per_second);
    let props = painters.props(&set.truth.ground_truth.props);
    Ok(Some(Sheet { rig, frames_per_second, props, frames }))
}

fn sheet_frame(
    set: &BenchmarkSet,
    tracked: &Tracked,
    measures: &Measures,
    painters: &mut Painters,
    Shown { run, frame }: Shown,
) -> Result<SheetFrame, ExperimentError> {
    let observed = set.blind.observation(frame)?;
    let props = &set.truth.ground_truth.props;
    let mut images = Vec::new();
    if set.blind.has_colour() {
        for camera in 0..observed.silhouettes.len() {
            images.push(set.blind.colour(camera, frame)?);
        }
    }
    Ok(SheetFrame {
        seed: measures.seeds[run].seed,
        frame,
        moved: painters.place(&observed).then(|| (set.blind.rig_at(frame).into_owned(), painters.props(props))),
        estimated: tracked.estimates.sequences[run].pose(frame).map(|pose| {
            let body = tracked.estimates.body(run, &set.blind.start.body);
            painters.seen(&observed, body, pose)
        }),
        images,
        observed: observed.silhouettes,
        truth: set.truth.ground_truth.frames[frame].markers,
        estimate: measures.seeds[run].markers[frame],
    })
}

pub(crate) fn describe_tracker(tracked: &Tracked) -> String {
    match tracked.record.as_ref().map(|record| &record.tracker) {
        None => match &tracked.program {
            Some(program) => {
                let name = program.name.as_deref().unwrap_or("another program");
                let version = program.version.as_ref().map(|version| format!(" {version}")).unwrap_or_default();
                format!("{name}{version}: {}", program.command_and_settings())
            }
            None => "poses of another program".to_owned(),
        },
        Some(settings) => settings.kind().describe(),
    }
}

fn facts(
    set: &BenchmarkSet,
    tracked: &Tracked,
    segmentation: Option<&SegmentationQuality>,
    poses: &[u8],
) -> Vec<FactGroup> {
    let group = |title: &str, facts: Vec<(&str, String)>| FactGroup {
        title: title.to_owned(),
        facts: facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
    };
    let (truth, blind) = (&set.truth, &set.blind);
    let degrees = |body: &skiagraph_core::body::Humanoid| {
        format!("{}, {} degrees of freedom including the root", body.name, body.degrees_of_freedom.len() + 6)
    };
    let seconds = blind.frame_count as f64 / blind.frames_per_second;
    let motion_of = |camera: usize| blind.moments.as_ref()?.describe(camera, blind.frames_per_second);
    let describe = |index: usize| {
        let camera = describe_camera(&blind.rig.cameras[index]);
        motion_of(index).map_or(camera.clone(), |motion| format!("{camera}; {motion}"))
    };
    let cameras = blind.rig.cameras.iter().enumerate();
    let mut groups = vec![
        group(
            "Motion",
            vec![
                ("clip", truth.facts.motion.clone()),
                ("length", format!("{} frames at {} Hz, {seconds:.2} s", blind.frame_count, blind.frames_per_second)),
            ],
        ),
        group(
            "Bodies",
            vec![
                ("actor", degrees(&truth.ground_truth.actor)),
                ("tracker", degrees(&blind.start.body)),
                ("model", if truth.facts.matched { "matched".to_owned() } else { truth.facts.mismatch.clone() }),
            ],
        ),
        group("Cameras", cameras.map(|(index, camera)| (camera.name.as_str(), describe(index))).collect()),
        group("Observations", observations(set, segmentation)),
    ];
    if let Some(contact) = &truth.facts.contact {
        groups.insert(1, group("Contact of the truth with the ground", contact.describe()));
    }
    groups.extend(tracker_facts(tracked));
    let seeds: Vec<String> = tracked.estimates.seeds.iter().map(u64::to_string).collect();
    groups.push(group(
        "Provenance",
        vec![
            ("seeds", seeds.join(", ")),
            ("learned from", describe_training(tracked)),
            ("set", blind.set_hash.clone()),
            ("poses.npz, SHA-256", hex_sha256(poses)),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ],
    ));
    groups
}

/// The tracker's settings, its calibrations, and how the estimate was read.
pub(super) fn tracker_facts(tracked: &Tracked) -> Vec<FactGroup> {
    let mut groups = Vec::new();
    if let Some(record) = &tracked.record {
        let settings = serde_json::to_value(&record.tracker).unwrap_or_default();
        let table = settings.as_object().and_then(|tracker| tracker.values().next()).and_then(|t| t.as_object());
        let all = table.into_iter().flatten().map(|(key, value)| (key.clone(), plain(value)));
        let changed = ("changed from the defaults".to_owned(), changed_from_defaults(&record.tracker));
        let settings = std::iter::once(changed).chain(all).collect();
        groups.push(FactGroup { title: format!("Tracker: {}", record.tracker.name()), facts: settings });
    }
    for (report, seed) in tracked.record.iter().flat_map(|record| &record.calibration).zip(&tracked.estimates.seeds) {
        let decided = [("decision".to_owned(), report.describe())];
        let facts = decided.into_iter().chain(report.describe_numbers()).collect();
        groups.push(FactGroup { title: format!("Calibration of the tracker's body, seed {seed}"), facts });
    }
    groups.extend(search_facts(tracked));
    let read_as = tracked.read_as.iter().map(|read_as| ("read as", read_as.describe()));
    let notes = tracked.estimates.notes.iter().map(|note| ("note", note.clone()));
    let of_estimate: Vec<_> = read_as.chain(notes).collect();
    if !of_estimate.is_empty() {
        let facts = of_estimate.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        groups.push(FactGroup { title: "Estimate".to_owned(), facts });
    }
    groups
}

/// How often particles and limbs were searched, and decided, if they were not searched in all frames.
fn search_facts(tracked: &Tracked) -> Option<FactGroup> {
    let frames = || tracked.search.iter().flatten();
    let (all, searched) = (frames().count(), frames().filter(|record| !record.layers.is_empty()).count());
    let share = |count: usize, of: usize| format!("{:.1} % of {of} frames", 100.0 * count as f64 / of as f64);
    let decided = frames().filter(|record| !record.layers.is_empty() && record.by_search).count();
    let facts = vec![
        ("particles and limbs were searched in".to_owned(), share(searched, all)),
        ("they found a clearly better pose in".to_owned(), share(decided, searched)),
    ];
    (0 < searched && searched < all).then(|| FactGroup { title: "Search".to_owned(), facts })
}

/// What differs between runs: the command and how long tracking took.
pub(super) fn this_run(tracked: &Tracked, command: Option<String>) -> Vec<(String, String)> {
    let of_program = tracked.program.as_ref().map(|program| program.timing);
    let timing = tracked.record.as_ref().map(|record| record.timing).or(of_program);
    let took = timing.map(|timing| {
        let TrackTiming { seconds, frames_per_second, threads, .. } = timing;
        format!("{seconds:.1} s, {frames_per_second:.1} frames a second of all seeds together, {threads} threads")
    });
    let named = |name: &str, value: Option<String>| value.map(|value| (name.to_owned(), value));
    [named("command", command), named("tracking took", took)].into_iter().flatten().collect()
}

fn changed_from_defaults(settings: &TrackerSettings) -> String {
    let table = |settings: &TrackerSettings| {
        let tree = serde_json::to_value(settings).unwrap_or_default();
        tree.as_object().and_then(|tracker| tracker.values().next()).cloned()
    };
    let Ok(defaults) = TrackerSettings::named(settings.name()) else { return String::new() };
    let changed = changed_settings(table(&defaults).as_ref(), table(settings).as_ref());
    if changed.is_empty() { "none: all defaults".to_owned() } else { changed }
}

fn describe_training(tracked: &Tracked) -> String {
    match tracked.record.as_ref().map(|record| record.learned_from.as_slice()) {
        None => "unknown: poses of another program".to_owned(),
        Some([]) => "nothing".to_owned(),
        Some(all) => all.join("; "),
    }
}

fn observations(set: &BenchmarkSet, segmentation: Option<&SegmentationQuality>) -> Vec<(&'static str, String)> {
    let names: Vec<&str> = set.truth.ground_truth.props.iter().map(|prop| prop.name.as_str()).collect();
    let hidden = format!("hidden by props: {}", names.join(", "));
    let words = match (&set.blind.observation, names.is_empty()) {
        (None, true) => "clean: no noise, no occlusion".to_owned(),
        (None, false) => format!("clean: no noise; {hidden}"),
        (Some(facts), true) => facts.describe(),
        (Some(facts), false) => format!("{}; {hidden}", facts.describe()),
    };
    let quality = segmentation.map(SegmentationQuality::describe).unwrap_or_default();
    [vec![("silhouettes", words)], quality].concat()
}

pub(super) fn describe_camera(camera: &skiagraph_core::camera::Camera) -> String {
    let (centre, pinhole) = (camera.centre(), &camera.pinhole);
    let view = 2.0 * (0.5 * f64::from(pinhole.width) / pinhole.focal[0]).atan().to_degrees();
    let lens = if camera.distortion.is_none() { "no distortion" } else { "distorted" };
    format!(
        "at ({:.2}, {:.2}, {:.2}) m, {} x {} px, {view:.0} degrees wide, {lens}",
        centre.x, centre.y, centre.z, pinhole.width, pinhole.height
    )
}

fn plain(value: &serde_json::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
