//! `per_frame.csv`: one row per seed and frame with the metrics and the facts of the search.

use super::measuring::Measures;
use super::tracked::Tracked;
use crate::common::ExperimentError;
use skiagraph_core::input::table_cell;
use skiagraph_eval::{EvaluationError, write_per_frame};

/// The bytes of the table. Frames without a value have empty cells.
pub(crate) fn to_csv(tracked: &Tracked, measures: &Measures) -> Result<Vec<u8>, ExperimentError> {
    let failed = |error: csv::Error| EvaluationError::Write(error.to_string());
    let mut metrics = Vec::new();
    write_per_frame(&measures.runs(), &mut metrics)?;
    let layers = tracked.search.iter().flatten().map(|r| r.layers.len()).max().unwrap_or(0);
    let mut reader = csv::Reader::from_reader(metrics.as_slice());
    let mut table = csv::Writer::from_writer(Vec::new());
    let mut header = reader.headers().map_err(failed)?.clone();
    ["energy_truth", "energy_estimate", "evaluations"].into_iter().for_each(|name| header.push_field(name));
    (0..layers).for_each(|layer| header.push_field(&format!("effective_sample_size_{layer}")));
    table.write_record(&header).map_err(failed)?;
    let frames =
        measures.seeds.iter().enumerate().flat_map(|(seed, s)| (0..s.evaluation.frames).map(move |f| (seed, f)));
    for (row, (seed, frame)) in reader.records().zip(frames) {
        let mut row: csv::StringRecord = row.map_err(failed)?.iter().map(table_cell).collect();
        let search = tracked.search.get(seed).and_then(|records| records.get(frame));
        row.push_field(&cell(measures.seeds[seed].truth_energy.get(frame).copied().flatten()));
        row.push_field(&cell(measures.seeds[seed].energy.get(frame).copied().flatten()));
        row.push_field(&search.map(|r| r.evaluations.to_string()).unwrap_or_default());
        for layer in 0..layers {
            let record = search.and_then(|r| r.layers.get(layer));
            row.push_field(&cell(record.map(|l| l.effective_sample_size)));
        }
        table.write_record(&row).map_err(failed)?;
    }
    Ok(table.into_inner().map_err(|e| EvaluationError::Write(e.to_string()))?)
}

fn cell(value: Option<f64>) -> String {
    value.map(|v| v.to_string()).unwrap_or_default()
}
