//! The sets of a sweep, made without tracking them: data to learn from and to test on.
//!
//! | file | content |
//! |---|---|
//! | `plan.json` and so on | the plan, as `skiagraph sweep plan` writes it; `skiagraph sweep run` tracks these sets |
//! | `sets/ID/` | a set for every different scene |
//! | `sets.csv`, `croissant.json` | a row per set, for readers of tables and of Croissant 1.0 |
//! | `sets.txt`, `SPLIT.txt` | the folders of all sets, and of those of a split, one on every line |
//! | `failed/ID.txt` | why a scene cannot be rendered |
//!
//! The tables and lists appear when every scene has a set or has failed. If the truth is kept apart, all of this is
//! with the complete sets. The public folder has sets of other names in another order, and tables without axes: names
//! that follow from the scene, or the order of a known sweep, would confirm a guess of the truth.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use super::cell::{POLL_INTERVAL, SETS, is_transient};
use super::identity::short;
use super::parts::part_of;
use super::plan::{Draft, Planned};
use super::plan_file::{SweepCell, describe_axes, table_text};
use super::splits::Splits;
use super::tables::csv_line;
use super::workers::one_per_core;
use crate::artefacts::{
    Artefact, ArtefactError, ArtefactKind, Destination, LockedPlace, output, parent_of, write_whole,
};
use crate::common::{ExperimentError, Progress, Stage, read_file, to_json};
use crate::rendering::{KeySource, RenderOptions, fresh_key, has_secrets, render};
use skiagraph_core::input::{hex_sha256, limits};
use skiagraph_core::rng::ObservationKey;
use skiagraph_set::{BlindSet, CroissantTable, KEY_FILE, is_set};

const TABLE: &str = "sets.csv";
const LIST: &str = "sets.txt";
const FAILED: &str = "failed";
/// The secret from which the names of public sets follow, with the complete sets.
const SEAL: &str = "public.key";
/// The file by which a public folder is known as that of its complete sets.
const MARK: &str = "collection.txt";
/// Name, type and description of the columns that every table of sets has.
const COLUMNS: [(&str, &str, &str); 7] = [
    ("set", "sc:Text", "folder of the set"),
    ("split", "sc:Text", "the split that it is in"),
    ("seed", "sc:Integer", "number of the draw of its noise"),
    ("frames", "sc:Integer", "number of frames"),
    ("frames_per_second", "sc:Float", "frame rate, Hz"),
    ("cameras", "sc:Integer", "number of cameras"),
    ("set_hash", "sc:Text", "hash of everything that a tracker gets"),
];

/// How the sets of a sweep are made.
#[derive(Clone, Copy, Debug)]
pub struct CollectionOptions<'a> {
    /// Place of the complete sets, if the collection's own place gets them without their truth.
    pub whole: Option<&'a Path>,
    /// The source of the keys of the observations' random numbers; a fresh one is drawn for every set by itself.
    pub key: KeySource,
    /// Parallel jobs, each on one thread.
    pub jobs: usize,
    /// Only part K of M, from 1; other parts may be made at the same time.
    pub part: Option<[usize; 2]>,
}

/// The outcome of making the sets of a sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collected {
    pub sets: usize,
    pub made: usize,
    /// The values of the axes of scenes that cannot be rendered, and why; of all parts.
    pub failed: Vec<(String, String)>,
    /// Scenes that have neither a set nor failed: other parts make them. The tables are written when there is none.
    pub left: usize,
    pub splits: BTreeMap<String, usize>,
    pub notes: Vec<String>,
}

/// Makes all sets of a sweep that are not there, one on each core, in `out/sets`. A killed call is resumed by the same
/// call.
///
/// # Errors
/// [`ExperimentError`] if the folder has another plan or other content, and for errors of the machine. A scene that
/// cannot be rendered is no error: it is in [`Collected::failed`].
pub fn make_sets(
    draft: &Draft,
    out: &Path,
    options: CollectionOptions<'_>,
    progress: &dyn Progress,
) -> Result<Collected, ExperimentError> {
    if options.whole.is_some() && options.key == KeySource::Given(ObservationKey::PUBLIC) {
        let detail =
            "expected a secret key for sets whose truth is kept apart, found the public key; leave it out".to_owned();
        return Err(ExperimentError::Argument { argument: "--key", detail });
    }
    if options.whole.is_some() && draft.is_named() {
        let detail =
            "expected a sweep without `named = true`: the names of its sets would say what was varied".to_owned();
        return Err(ExperimentError::Argument { argument: "--truth", detail });
    }
    let root = options.whole.unwrap_or(out);
    plan(draft, root)?;
    let public = options.whole.map(|whole| Public::of(whole, out)).transpose()?;
    let scenes = Scenes::of(draft);
    let range = options.part.map_or(0..scenes.cells.len(), |[part, parts]| part_of(&scenes.cells, part, parts));
    let maker = Maker { draft, root, public: public.as_ref(), options, made: Mutex::default() };
    let mut missing: Vec<&SweepCell> = Vec::new();
    for cell in &scenes.cells[range] {
        if maker.is_there(cell) {
            maker.check_key(cell)?;
        } else {
            missing.push(cell);
        }
    }
    progress.begin(Stage::Collect, missing.len());
    let make = |(): &mut (), index: usize, stop: &dyn Progress| maker.make(missing[index], stop, progress);
    one_per_core(options.jobs, missing.len(), progress, || (), make)?;
    let (there, others): (Vec<_>, Vec<_>) = scenes.cells.iter().cloned().partition(|cell| maker.is_there(cell));
    let failed: Vec<(String, String)> = others
        .iter()
        .filter_map(|cell| Some((describe_axes(&cell.axes), read_file(&maker.failure(cell), limits::SETTINGS).ok()?)))
        .map(|(axes, error)| (axes, String::from_utf8_lossy(&error).trim().to_owned()))
        .collect();
    let (left, idle) = (others.len() - failed.len(), scenes.idle_axes(draft));
    let there = Scenes { cells: there };
    if left == 0 {
        Tables { draft, idle: &idle, public: public.as_ref(), root }.write(&there)?;
    }
    let splits = draft.record.splits.as_ref();
    let counted = |name: &str| (name.to_owned(), splits.map_or(0, |splits| there.in_split(splits, name).count()));
    let idle = idle.into_iter().map(|axis| format!("the axis {axis} changes no set: only a tracker reads it"));
    let several = |(note, count): (String, usize)| if count > 1 { format!("{count} sets: {note}") } else { note };
    let Made { made, notes } = std::mem::take(&mut *maker.made.lock().unwrap_or_else(PoisonError::into_inner));
    Ok(Collected {
        sets: scenes.cells.len(),
        made,
        failed,
        left,
        splits: splits.iter().flat_map(|splits| splits.names()).map(counted).collect(),
        notes: idle.chain(notes.into_iter().map(several)).collect(),
    })
}

/// Writes the plan; waits while another part does.
fn plan(draft: &Draft, root: &Path) -> Result<Planned, ExperimentError> {
    loop {
        match draft.freeze(root, false) {
            Err(ExperimentError::Artefact(ArtefactError::Busy { .. })) => std::thread::sleep(POLL_INTERVAL),
            other => return other,
        }
    }
}

fn place(root: &Path, cell: &SweepCell) -> PathBuf {
    root.join(SETS).join(&cell.set)
}

/// The public side of a collection whose truth is kept apart.
struct Public<'a> {
    out: &'a Path,
    /// The secret from which the names of public sets follow.
    seal: String,
}

impl<'a> Public<'a> {
    /// Opens or begins the public folder `out` of the complete sets in `whole`.
    fn of(whole: &Path, out: &'a Path) -> Result<Self, ExperimentError> {
        let _place = loop {
            match LockedPlace::take(&whole.join("public")) {
                Err(ArtefactError::Busy { .. }) => std::thread::sleep(POLL_INTERVAL),
                other => break other?,
            }
        };
        let path = whole.join(SEAL);
        let seal = match read_file(&path, limits::SETTINGS) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).trim().to_owned(),
            Err(_) => fresh_key()?.to_hex(),
        };
        let public = Self { out, seal };
        let mark = format!("{}\n", public.sealed("public folder"));
        let marked = read_file(&out.join(MARK), limits::SETTINGS).is_ok_and(|found| found == mark.as_bytes());
        if !marked && (out.is_file() || fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some())) {
            let detail = format!(
                "{}: expected a new or empty folder, or the public folder of the sets in {}; give another folder",
                out.display(),
                whole.display()
            );
            return Err(ExperimentError::Argument { argument: "--out", detail });
        }
        fs::create_dir_all(out).map_err(output(out, "create the directory"))?;
        write_whole(&path, format!("{}\n", public.seal).as_bytes())?;
        write_whole(&out.join(MARK), mark.as_bytes())?;
        Ok(public)
    }

    fn sealed(&self, text: &str) -> String {
        short(&format!("name of a public set\n{}\n{text}\n", self.seal))
    }

    fn name(&self, cell: &SweepCell) -> String {
        self.sealed(&cell.set)
    }

    fn place(&self, cell: &SweepCell) -> PathBuf {
        self.out.join(SETS).join(self.name(cell))
    }
}

#[derive(Default)]
struct Made {
    made: usize,
    /// Notes, and the number of sets that have them.
    notes: BTreeMap<String, usize>,
}

struct Maker<'a> {
    draft: &'a Draft,
    root: &'a Path,
    public: Option<&'a Public<'a>>,
    options: CollectionOptions<'a>,
    made: Mutex<Made>,
}

impl Maker<'_> {
    fn is_there(&self, cell: &SweepCell) -> bool {
        is_set(&place(self.root, cell)) && self.public.is_none_or(|public| is_set(&public.place(cell)))
    }

    fn failure(&self, cell: &SweepCell) -> PathBuf {
        self.root.join(FAILED).join(format!("{}.txt", cell.set))
    }

    /// Refuses a set whose random numbers have another key than this call would give it.
    fn check_key(&self, cell: &SweepCell) -> Result<(), ExperimentError> {
        let place = place(self.root, cell);
        let found = read_file(&place.join(KEY_FILE), limits::SETTINGS).ok();
        let found = found.and_then(|text| String::from_utf8_lossy(&text).trim().parse::<ObservationKey>().ok());
        let scene = self.draft.scene(cell)?;
        let is_wrong = match self.options.key.stated(&scene.scenario.observation) {
            Some(stated) => found.unwrap_or_default() != stated,
            None => found.is_none() && (self.public.is_some() || has_secrets(&scene.scenario)),
        };
        if is_wrong {
            let kind =
                if found.is_some() { "another secret key" } else { "the public key, as skiagraph sweep run does" };
            let detail = format!("this set was made with {kind}; remove its folder, or give --key as then");
            return Err(ExperimentError::Malformed { path: place, detail });
        }
        Ok(())
    }

    fn make(&self, cell: &SweepCell, stop: &dyn Progress, progress: &dyn Progress) -> Result<(), ExperimentError> {
        let failure = self.failure(cell);
        match self.render(cell, stop) {
            Ok(notes) => {
                let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
                made.made += 1;
                notes.into_iter().for_each(|note| *made.notes.entry(note).or_default() += 1);
                // of an earlier call
                let _ = fs::remove_file(failure);
                Ok(())
            }
            // another process is making it, or has just finished
            Err(ExperimentError::Artefact(ArtefactError::Busy { .. }) | ExperimentError::SetThere { .. }) => Ok(()),
            // rendering can be resumed, and so can the collection
            Err(ExperimentError::Artefact(ArtefactError::ProgressSaved { .. })) => Err(ExperimentError::Interrupted),
            Err(error @ (ExperimentError::Argument { .. } | ExperimentError::Unfinished { .. })) => Err(error),
            Err(ExperimentError::Artefact(error)) => Err(error.into()),
            Err(error) if is_transient(&error) => Err(error),
            Err(error) => {
                progress.note(&format!("{}: {error}", describe_axes(&cell.axes)));
                fs::create_dir_all(parent_of(&failure)).map_err(output(&failure, "write"))?;
                Ok(write_whole(&failure, format!("{error}\n").as_bytes())?)
            }
        }
    }

    /// Renders a set. Returns notes that do not name it, so that equal ones can be counted.
    fn render(&self, cell: &SweepCell, stop: &dyn Progress) -> Result<Vec<String>, ExperimentError> {
        let own = place(self.root, cell);
        let to = self.public.map(|public| public.place(cell));
        if let Some(to) = to.as_deref().filter(|_| is_set(&own)) {
            // a call was killed between the two
            self.check_key(cell)?;
            let public = Artefact::begin(Destination { path: to, force: false }, ArtefactKind::Set)?;
            BlindSet::read(&own)?.write_without_truth(public.folder())?;
            public.finish()?;
            return Ok(Vec::new());
        }
        if let Some(to) = to.as_deref().filter(|to| is_set(to)) {
            let detail = format!("its truth is not in {}; remove this folder, and repeat the command", own.display());
            return Err(ExperimentError::Malformed { path: to.to_owned(), detail });
        }
        let options = RenderOptions { whole: to.as_ref().map(|_| own.as_path()), key: self.options.key };
        let mocap_directory = self.draft.record.mocap_directory.as_deref();
        let to = Destination { path: to.as_deref().unwrap_or(&own), force: false };
        let (_, notes) = render(&self.draft.scene(cell)?, mocap_directory, to, &options, stop)?;
        Ok(notes.into_iter().map(|note| note.replace(&own.display().to_string(), "SET")).collect())
    }
}

fn is_of_trackers(key: &str) -> bool {
    ["tracker", "methods"].contains(&key.split('.').next().unwrap_or_default())
}

/// The different scenes of a sweep: the first cell of each set.
struct Scenes {
    cells: Vec<SweepCell>,
}

impl Scenes {
    fn of(draft: &Draft) -> Self {
        let mut known = BTreeSet::new();
        Self { cells: draft.cells.iter().filter(|cell| known.insert(&cell.set)).cloned().collect() }
    }

    /// The axes that never change a set: those of which every value sets keys of trackers alone.
    fn idle_axes<'a>(&self, draft: &'a Draft) -> Vec<&'a String> {
        let all = draft.record.axes.iter();
        all.filter(|axis| draft.keys_of(axis).iter().all(|key| is_of_trackers(key))).collect()
    }

    fn in_split<'a>(&'a self, splits: &'a Splits, name: &'a str) -> impl Iterator<Item = &'a SweepCell> {
        self.cells.iter().filter(move |cell| splits.of(&cell.axes) == name)
    }
}

struct Tables<'a> {
    draft: &'a Draft,
    /// Axes that change no set.
    idle: &'a [&'a String],
    public: Option<&'a Public<'a>>,
    /// The folder of the complete sets.
    root: &'a Path,
}

/// A row of a table: the folder of a set, its cell, and the columns behind those that every table has.
type Row<'a> = (String, &'a SweepCell, Vec<String>);

impl Tables<'_> {
    fn write(&self, scenes: &Scenes) -> Result<(), ExperimentError> {
        let record = &self.draft.record;
        let mut columns: Vec<(String, bool)> = Vec::new();
        columns.extend(self.public.map(|_| ("public".to_owned(), false)));
        let axes: Vec<&String> = record.axes.iter().filter(|axis| !self.idle.contains(axis)).collect();
        for axis in &axes {
            let is_column = COLUMNS.iter().any(|(name, ..)| name == axis) || *axis == "public";
            let values = scenes.cells.iter().filter_map(|cell| cell.axes.get(*axis));
            columns.push((
                if is_column { format!("axis.{axis}") } else { (*axis).clone() },
                values.clone().all(Value::is_number),
            ));
        }
        let row = |cell| -> Row<'_> {
            let public = self.public.map(|public| format!("{SETS}/{}", public.name(cell)));
            let values = axes.iter().map(|axis| cell.axes.get(*axis).map(table_text).unwrap_or_default());
            (format!("{SETS}/{}", cell.set), cell, public.into_iter().chain(values).collect())
        };
        self.write_in(self.root, &columns, &scenes.cells.iter().map(row).collect::<Vec<_>>(), &record.description)?;
        let Some(public) = self.public else { return Ok(()) };
        let row = |cell| -> Row<'_> { (format!("{SETS}/{}", public.name(cell)), cell, Vec::new()) };
        let mut rows: Vec<Row<'_>> = scenes.cells.iter().map(row).collect();
        rows.sort_by(|a, b| a.0.cmp(&b.0));
        self.write_in(public.out, &[], &rows, "")
    }

    fn write_in(
        &self,
        folder: &Path,
        more: &[(String, bool)],
        rows: &[Row<'_>],
        description: &str,
    ) -> Result<(), ExperimentError> {
        let (record, splits) = (&self.draft.record, self.draft.record.splits.as_ref());
        let write = |name: &str, bytes: &[u8]| write_whole(&folder.join(name), bytes);
        let list = |is_in: &dyn Fn(&SweepCell) -> bool| -> String {
            rows.iter().filter(|(_, cell, _)| is_in(cell)).map(|(set, ..)| format!("{set}\n")).collect()
        };
        write(LIST, list(&|_| true).as_bytes())?;
        if let Some(splits) = splits {
            for name in splits.names() {
                write(&format!("{name}.txt"), list(&|cell| splits.of(&cell.axes) == name).as_bytes())?;
            }
        }
        let has = |column: &str| match column {
            "split" => splits.is_some(),
            // the seed of a draw is that of the noise, which a public set does not state
            "seed" => record.draws && !more.is_empty(),
            _ => true,
        };
        let mut columns: Vec<(&str, &str, &str)> = COLUMNS.into_iter().filter(|(name, ..)| has(name)).collect();
        let kind = |is_number: bool| if is_number { "sc:Float" } else { "sc:Text" };
        columns.extend(more.iter().map(|(name, is_number)| (name.as_str(), kind(*is_number), "what was varied")));
        let names: Vec<&str> = columns.iter().map(|(name, ..)| *name).collect();
        let lines = skiagraph_core::parallel::map(rows.len(), |index| -> Result<Vec<u8>, ExperimentError> {
            let (folder_of_set, cell, values) = &rows[index];
            let set = BlindSet::read(&folder.join(folder_of_set))?;
            let mut row = vec![folder_of_set.clone()];
            row.extend(splits.map(|splits| splits.of(&cell.axes).to_owned()));
            row.extend(has("seed").then(|| cell.seed.to_string()));
            row.extend([set.frame_count.to_string(), set.frames_per_second.to_string()]);
            row.extend([set.rig.cameras.len().to_string(), set.set_hash.clone()]);
            row.extend(values.iter().cloned());
            csv_line(&row, TABLE)
        });
        let mut table = csv_line(&names, TABLE)?;
        for line in lines {
            table.extend(line?);
        }
        let content = CroissantTable { name: SETS, content: &table, rows: "every set", columns: &columns };
        let words = format!("Sets of silhouettes of an animated humanoid. {description}");
        write("croissant.json", &to_json(&content.describe(&record.name, words.trim(), &hex_sha256(&table)))?)?;
        Ok(write(TABLE, &table)?)
    }
}
