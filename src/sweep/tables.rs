//! Progress of a sweep, and its results in tables: `runs.csv` and `runs.jsonl`, with the same bytes wherever the cells
//! were run, and `timing.csv`.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use super::parts::to_ranges;
use super::plan::PlannedSweep;
use super::plan_file::{SweepCell, table_text};
use super::results::{CellRecord, Status, SweepResults};
use crate::artefacts::{Unfinished, of_this_process, output, sync_parent};
use crate::common::ExperimentError;
use skiagraph_core::input::table_cell;
use skiagraph_eval::METRICS;

/// The table of all cells.
pub const RUNS_TABLE: &str = "runs.csv";
/// The same with one JSON object per line.
pub const RUNS_LINES: &str = "runs.jsonl";
/// The cost of every cell, which differs from run to run.
pub const TIMING_TABLE: &str = "timing.csv";

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepStatus {
    /// `skiagraph.sweep_status/1`.
    pub schema: &'static str,
    pub name: String,
    pub cells: usize,
    /// Number of cells with a result.
    pub done: usize,
    /// Number of cells that are graded lost.
    pub diverged: usize,
    /// Number of cells that cannot be run.
    pub failed: usize,
    /// Indices of cells that cannot be run: `3,7-8`.
    pub failed_cells: String,
    /// Indices of cells without a result: `3,7-8`.
    pub missing: String,
}

/// The progress of a sweep, from its result files alone.
pub fn sweep_status(sweep: &PlannedSweep) -> Result<SweepStatus, ExperimentError> {
    Ok(SweepStatus::new(sweep, &SweepResults::new(sweep).statuses(&sweep.cells()?)))
}

impl SweepStatus {
    /// Counts the outcomes of all cells, in order.
    fn new(sweep: &PlannedSweep, statuses: &[Option<Status>]) -> Self {
        let indices = |wanted: Option<Status>| -> Vec<usize> {
            (0..statuses.len()).filter(|index| statuses[*index] == wanted).collect()
        };
        let (missing, failed) = (indices(None), indices(Some(Status::Failed)));
        Self {
            schema: "skiagraph.sweep_status/1",
            name: sweep.plan.name.clone(),
            cells: statuses.len(),
            done: statuses.len() - missing.len(),
            diverged: indices(Some(Status::Diverged)).len(),
            failed: failed.len(),
            failed_cells: to_ranges(&failed),
            missing: to_ranges(&missing),
        }
    }
}

/// Writes the tables of a sweep into its folder, unless cells are missing.
///
/// # Errors
/// [`ExperimentError`] of writing; no table is changed then.
pub fn gather(sweep: &PlannedSweep) -> Result<SweepStatus, ExperimentError> {
    let cells = sweep.cells()?;
    let begin = |name: &str| WholeFile::begin(&sweep.root.join(name));
    let (mut runs, mut lines, mut timing) = (begin(RUNS_TABLE)?, begin(RUNS_LINES)?, begin(TIMING_TABLE)?);
    let columns = SweepColumns { axes: &sweep.plan.axes, noise_from: first_noise(sweep, &cells)? };
    runs.write(&csv_line(&columns.header(), RUNS_TABLE)?)?;
    let of_time = ["index", "cell", "track_s", "track_processor_s", "processor_s", "host"];
    timing.write(&csv_line(&of_time, TIMING_TABLE)?)?;
    let mut statuses = Vec::with_capacity(cells.len());
    let in_text = |cell: &SweepCell, record: Option<CellRecord>| record.map(|record| columns.in_text(cell, &record));
    SweepResults::new(sweep).for_each(&cells, in_text, |_, text| {
        let text = text.transpose()?;
        statuses.push(text.as_ref().map(|text| text.status));
        let Some(text) = text else { return Ok(()) };
        runs.write(&text.run)?;
        lines.write(&text.line)?;
        timing.write(&text.timing)
    })?;
    let status = SweepStatus::new(sweep, &statuses);
    if status.done < status.cells {
        return Ok(status);
    }
    [runs, lines, timing].into_iter().try_for_each(WholeFile::finish)?;
    sync_parent(&sweep.root.join(RUNS_TABLE));
    Ok(status)
}

/// The column with the seed of the noise, in sweeps that draw new noise for every seed.
const NOISE_SEED: &str = "observation.seed";

struct SweepColumns<'a> {
    axes: &'a [String],
    /// The seed of the noise of seed 0, if every seed draws its own noise.
    noise_from: Option<u64>,
}

/// The seed of the noise of seed 0; `None` if all seeds have the same noise, or its seed is an axis.
fn first_noise(sweep: &PlannedSweep, cells: &[SweepCell]) -> Result<Option<u64>, ExperimentError> {
    let Some(first) = cells.first().filter(|_| sweep.plan.draws && !sweep.plan.axes.iter().any(|a| a == NOISE_SEED))
    else {
        return Ok(None);
    };
    let of_first = u64::from(sweep.scenario(first)?.scenario.observation.seed);
    Ok(Some(of_first.saturating_sub(first.seed)))
}

struct CellText {
    status: Status,
    run: Vec<u8>,
    line: Vec<u8>,
    timing: Vec<u8>,
}

impl SweepColumns<'_> {
    fn in_text(&self, cell: &SweepCell, record: &CellRecord) -> Result<CellText, ExperimentError> {
        Ok(CellText {
            status: record.status,
            run: csv_line(&self.row(cell, record), RUNS_TABLE)?,
            line: format!("{}\n", of_line(cell, record)?).into_bytes(),
            timing: csv_line(&of_timing(cell, record), TIMING_TABLE)?,
        })
    }

    fn header(&self) -> Vec<String> {
        let before = ["index", "cell", "setting", "seed"].map(str::to_owned);
        let between = ["status", "grade", "frames", "cameras", "likelihood_evaluations"].map(str::to_owned);
        let metrics: Vec<String> = METRICS.iter().map(|metric| metric.name.to_owned()).collect();
        let last = ["set_hash", "error"].map(str::to_owned);
        let others: Vec<&String> = before.iter().chain(&between).chain(&metrics).collect();
        // an axis may have the name of another column
        let axis = |axis: &String| if others.contains(&axis) { format!("axis.{axis}") } else { axis.clone() };
        let noise = self.noise_from.map(|_| NOISE_SEED.to_owned());
        let axes: Vec<String> = self.axes.iter().map(axis).chain(noise).collect();
        before.into_iter().chain(axes).chain(between).chain(metrics).chain(last).collect()
    }

    fn row(&self, cell: &SweepCell, record: &CellRecord) -> Vec<String> {
        let mut row = vec![cell.index.to_string(), cell.cell.clone(), cell.setting.to_string(), cell.seed.to_string()];
        row.extend(self.axes.iter().map(|axis| cell.axes.get(axis).map(table_text).unwrap_or_default()));
        row.extend(self.noise_from.map(|first| (first + cell.seed).to_string()));
        row.extend([
            record.status.name().to_owned(),
            record.grade.clone().unwrap_or_default(),
            record.frames.to_string(),
            record.cameras.to_string(),
            record.likelihood_evaluations.to_string(),
        ]);
        let value = |name: &str| record.metrics.get(name).map(ToString::to_string).unwrap_or_default();
        row.extend(METRICS.iter().map(|metric| value(metric.name)));
        row.extend([record.set_hash.clone().unwrap_or_default(), record.error.clone().unwrap_or_default()]);
        row
    }
}

/// A line of CSV, with its line end.
pub(super) fn csv_line<S: AsRef<str>>(fields: &[S], table: &str) -> Result<Vec<u8>, ExperimentError> {
    let failed = |detail: String| ExperimentError::Malformed { path: table.into(), detail };
    // the default buffer of 8 kB would be zeroed for every line
    let mut text = csv::WriterBuilder::new().buffer_capacity(2048).from_writer(Vec::new());
    text.write_record(fields.iter().map(|field| table_cell(field.as_ref()))).map_err(|e| failed(e.to_string()))?;
    text.into_inner().map_err(|e| failed(e.to_string()))
}

fn of_line(cell: &SweepCell, record: &CellRecord) -> Result<Value, ExperimentError> {
    let mut line = serde_json::Map::new();
    line.insert("index".to_owned(), cell.index.into());
    line.insert("setting".to_owned(), cell.setting.into());
    line.insert("axes".to_owned(), Value::Object(cell.axes.clone()));
    line.extend(record.reproducible_fields()?);
    Ok(Value::Object(line))
}

fn of_timing(cell: &SweepCell, record: &CellRecord) -> [String; 6] {
    let env = &record.env;
    [
        cell.index.to_string(),
        cell.cell.clone(),
        env.track_s.to_string(),
        env.track_processor_s.to_string(),
        env.processor_s.to_string(),
        env.host.clone(),
    ]
}

/// A file in the sweep's folder that is written under a temporary name and renamed when complete.
struct WholeFile {
    path: PathBuf,
    temporary: Unfinished,
    file: BufWriter<File>,
}

impl WholeFile {
    fn begin(path: &Path) -> Result<Self, ExperimentError> {
        let temporary = Unfinished::begin(of_this_process(path, "writing"));
        let file = File::create(temporary.path()).map_err(output(path, "write"))?;
        Ok(Self { path: path.to_owned(), temporary, file: BufWriter::new(file) })
    }

    fn write(&mut self, text: &[u8]) -> Result<(), ExperimentError> {
        Ok(self.file.write_all(text).map_err(output(&self.path, "write"))?)
    }

    fn finish(mut self) -> Result<(), ExperimentError> {
        let written = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        let moved = written.and_then(|()| std::fs::rename(self.temporary.path(), &self.path));
        moved.map_err(output(&self.path, "write"))?;
        sync_parent(&self.path);
        Ok(())
    }
}
