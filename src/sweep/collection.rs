//! The sets of a sweep, made without tracking them: data to learn from and to test on.
//!
//! | file | content |
//! |---|---|
//! | `plan.json` and so on | the plan, as `skiagraph sweep plan` writes it; `skiagraph sweep run` tracks these sets |
//! | `sets/ID/` | a set for every different scene |
//! | `sets.csv`, `croissant.json` | a row per set, for readers of tables and of Croissant 1.0 |
//! | `sets.txt`, `SPLIT.txt` | the folders of all sets, and of those of a split, one on every line |
//!
//! The last two rows appear when all sets are there. If the truth is kept apart, the plan is with the complete sets, and the
//! tables of the others do not say what was varied.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::cell::{POLL_INTERVAL, SETS, is_transient};
use super::parts::part_of;
use super::plan::{Draft, Planned};
use super::plan_file::{SweepCell, describe_axes, table_text};
use super::splits::Splits;
use super::tables::csv_line;
use super::workers::one_per_core;
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination, write_whole};
use crate::common::{ExperimentError, Progress, Stage, to_json};
use crate::rendering::{KeySource, RenderOptions, render_with};
use skiagraph_set::{BlindSet, CroissantTable, is_set};

/// The table of all sets.
const TABLE: &str = "sets.csv";
/// The list of all sets.
const LIST: &str = "sets.txt";

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
    /// Sets of the sweep.
    pub sets: usize,
    /// Sets that this call made.
    pub made: usize,
    /// The values of the axes of scenes that cannot be rendered, and why.
    pub failed: Vec<(String, String)>,
    /// Sets that are not there.
    pub left: usize,
    /// Whether the tables were written, because only scenes that cannot be rendered are missing.
    pub are_done: bool,
    /// Sets in each split.
    pub splits: BTreeMap<String, usize>,
    /// Notes for the user.
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
    let root = options.whole.unwrap_or(out);
    plan(draft, root)?;
    let scenes = Scenes::of(draft);
    let range = options.part.map_or(0..scenes.cells.len(), |[part, parts]| part_of(&scenes.cells, part, parts));
    let maker = Maker { draft, out, options, made: Mutex::default() };
    let missing: Vec<&SweepCell> = scenes.cells[range].iter().filter(|cell| !maker.is_there(cell)).collect();
    progress.begin(Stage::Collect, missing.len());
    let make = |(): &mut (), index: usize, stop: &dyn Progress| maker.make(missing[index], stop, progress);
    one_per_core(options.jobs, missing.len(), progress, || (), make)?;
    let Made { made, failed, notes } = std::mem::take(&mut *maker.made.lock().unwrap_or_else(PoisonError::into_inner));
    let idle = scenes.idle_axes(draft);
    let there = Scenes { cells: scenes.cells.iter().filter(|cell| maker.is_there(cell)).cloned().collect() };
    let left = scenes.cells.len() - there.cells.len();
    let splits = draft.record.splits.as_ref();
    let counted = |name: &str| (name.to_owned(), splits.map_or(0, |splits| there.in_split(splits, name).count()));
    let are_done = left == failed.len();
    if are_done {
        there.write_tables(draft, &idle, out, options.whole.is_none())?;
        options.whole.map_or(Ok(()), |whole| there.write_tables(draft, &idle, whole, true))?;
    }
    let idle = idle.into_iter().map(|axis| format!("the axis {axis} changes no set: only a tracker reads it"));
    let several = |(note, count): (String, usize)| if count > 1 { format!("{count} sets: {note}") } else { note };
    Ok(Collected {
        sets: scenes.cells.len(),
        made,
        failed,
        left,
        are_done,
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

/// What was made so far.
#[derive(Default)]
struct Made {
    made: usize,
    failed: Vec<(String, String)>,
    /// Notes, and the number of sets that have them.
    notes: BTreeMap<String, usize>,
}

struct Maker<'a> {
    draft: &'a Draft,
    out: &'a Path,
    options: CollectionOptions<'a>,
    made: Mutex<Made>,
}

impl Maker<'_> {
    fn is_there(&self, cell: &SweepCell) -> bool {
        [Some(self.out), self.options.whole].into_iter().flatten().all(|root| is_set(&place(root, cell)))
    }

    fn make(&self, cell: &SweepCell, stop: &dyn Progress, progress: &dyn Progress) -> Result<(), ExperimentError> {
        let rendered = self.render(cell, stop);
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        match rendered {
            Ok(notes) => {
                made.made += 1;
                notes.into_iter().for_each(|note| *made.notes.entry(note).or_default() += 1);
            }
            // rendering can be resumed, and so can the collection
            Err(ExperimentError::Artefact(ArtefactError::ProgressSaved { .. })) => {
                return Err(ExperimentError::Interrupted);
            }
            Err(error) if is_transient(&error) => return Err(error),
            Err(error) => {
                let axes = describe_axes(&cell.axes);
                if made.failed.len() < 3 {
                    progress.note(&format!("{axes}: {error}"));
                }
                made.failed.push((axes, error.to_string()));
            }
        }
        Ok(())
    }

    /// Renders a set. Returns notes that do not name it, so that equal ones can be counted.
    fn render(&self, cell: &SweepCell, stop: &dyn Progress) -> Result<Vec<String>, ExperimentError> {
        let to = place(self.out, cell);
        let whole = self.options.whole.map(|root| place(root, cell));
        if let Some(whole) = whole.as_deref().filter(|whole| is_set(whole)) {
            // a call was killed between the two
            let public = Artefact::begin(Destination { path: &to, force: false }, ArtefactKind::Set)?;
            BlindSet::read(whole)?.write_without_truth(public.folder())?;
            public.finish()?;
            return Ok(Vec::new());
        }
        let options = RenderOptions { whole: whole.as_deref(), key: self.options.key };
        let mocap_directory = self.draft.record.mocap_directory.as_deref();
        let to = Destination { path: &to, force: false };
        let rendered = render_with(&self.draft.scene(cell)?, mocap_directory, to, &options, stop);
        match rendered {
            Ok((_, notes)) => {
                let named = place(self.options.whole.unwrap_or(self.out), cell).display().to_string();
                Ok(notes.into_iter().map(|note| note.replace(&named, "SET")).collect())
            }
            // another part is making it, or has just finished
            Err(ExperimentError::SetThere { .. }) => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }
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

    /// The axes of trackers, and others with several values for one set.
    fn idle_axes<'a>(&self, draft: &'a Draft) -> Vec<&'a String> {
        let first: BTreeMap<&String, &SweepCell> = self.cells.iter().map(|cell| (&cell.set, cell)).collect();
        let is_idle = |axis: &&String| {
            let key = draft.full_key(axis);
            let differs = |cell: &SweepCell| cell.axes.get(*axis) != first[&cell.set].axes.get(*axis);
            ["tracker.", "methods."].iter().any(|table| key.starts_with(table)) || draft.cells.iter().any(differs)
        };
        draft.record.axes.iter().filter(is_idle).collect()
    }

    fn in_split<'a>(&'a self, splits: &'a Splits, name: &'a str) -> impl Iterator<Item = &'a SweepCell> {
        self.cells.iter().filter(move |cell| splits.of(&cell.axes) == name)
    }

    /// Writes the tables and lists; `with_axes` if they may say what was varied.
    fn write_tables(
        &self,
        draft: &Draft,
        idle: &[&String],
        root: &Path,
        with_axes: bool,
    ) -> Result<(), ExperimentError> {
        let (record, splits) = (&draft.record, draft.record.splits.as_ref());
        let list = |cells: &mut dyn Iterator<Item = &SweepCell>| {
            cells.map(|cell| format!("{SETS}/{}\n", cell.set)).collect::<String>()
        };
        let write = |name: &str, bytes: &[u8]| write_whole(&root.join(name), bytes);
        write(LIST, list(&mut self.cells.iter()).as_bytes())?;
        if let Some(splits) = splits {
            for name in splits.names() {
                write(&format!("{name}.txt"), list(&mut self.in_split(splits, name)).as_bytes())?;
            }
        }
        let axes: Vec<&String> = record.axes.iter().filter(|axis| with_axes && !idle.contains(axis)).collect();
        let mut columns = vec![("set", "sc:Text", "folder of the set")];
        columns.extend(splits.map(|_| ("split", "sc:Text", "the split that it is in")));
        columns.extend(record.draws.then_some(("seed", "sc:Integer", "number of the draw of its noise")));
        columns.extend([
            ("frames", "sc:Integer", "number of frames"),
            ("frames_per_second", "sc:Float", "frame rate, Hz"),
            ("cameras", "sc:Integer", "number of cameras"),
            ("set_hash", "sc:Text", "hash of everything that a tracker gets"),
        ]);
        let is_column = |axis: &str| columns.iter().any(|(name, ..)| *name == axis);
        let axis_names: Vec<String> =
            axes.iter().map(|axis| if is_column(axis) { format!("axis.{axis}") } else { (*axis).clone() }).collect();
        columns.extend(axis_names.iter().map(|name| (name.as_str(), "sc:Text", "what was varied")));
        let names: Vec<&str> = columns.iter().map(|(name, ..)| *name).collect();
        let mut table = csv_line(&names, TABLE)?;
        let rows = skiagraph_core::parallel::map(self.cells.len(), |index| -> Result<Vec<u8>, ExperimentError> {
            let cell = &self.cells[index];
            let set = BlindSet::read(&place(root, cell))?;
            let mut row = vec![format!("{SETS}/{}", cell.set)];
            row.extend(splits.map(|splits| splits.of(&cell.axes).to_owned()));
            row.extend(record.draws.then(|| cell.seed.to_string()));
            row.extend([set.frame_count.to_string(), set.frames_per_second.to_string()]);
            row.extend([set.rig.cameras.len().to_string(), set.set_hash.clone()]);
            row.extend(axes.iter().map(|axis| cell.axes.get(*axis).map(table_text).unwrap_or_default()));
            csv_line(&row, TABLE)
        });
        for row in rows {
            table.extend(row?);
        }
        let content = CroissantTable { name: SETS, content: &table, rows: "every set", columns: &columns };
        let words = format!("Sets of silhouettes with exact ground truth. {}", record.description);
        write("croissant.json", &to_json(&content.describe(&record.name, words.trim(), &record.digest))?)?;
        Ok(write(TABLE, &table)?)
    }
}
