//! The table of frames: one row per run and frame, one column per metric.

use std::collections::BTreeSet;
use std::io::Write;

use super::{EvaluationError, METRICS, SeedRun};

/// Writes CSV with the columns `clip,seed,frame,time_s` and one per metric that has a value per frame, in the order of
/// [`METRICS`]; the cell of a frame without a value is empty.
///
/// # Errors
/// [`EvaluationError::Write`] if writing fails.
pub fn write_per_frame(runs: &[SeedRun<'_>], output: impl Write) -> Result<(), EvaluationError> {
    let failed = |error: csv::Error| EvaluationError::Write(error.to_string());
    let with_frames =
        runs.iter().flat_map(|run| &run.evaluation.metrics).filter(|(_, value)| !value.per_frame.is_empty());
    let present: BTreeSet<&str> = with_frames.map(|(name, _)| name.as_str()).collect();
    let columns: Vec<&str> = METRICS.iter().map(|m| m.name).filter(|name| present.contains(name)).collect();
    let mut table = csv::Writer::from_writer(output);
    table.write_record(["clip", "seed", "frame", "time_s"].iter().chain(&columns)).map_err(failed)?;
    for run in runs {
        for frame in 0..run.evaluation.frames {
            let time = frame as f64 / run.evaluation.frames_per_second;
            let head = [run.clip.to_owned(), run.seed.to_string(), frame.to_string(), time.to_string()];
            let cells = columns.iter().map(|name| {
                let value = run.evaluation.metrics.get(*name).and_then(|value| *value.per_frame.get(frame)?);
                value.map_or_else(String::new, |value| value.to_string())
            });
            table.write_record(head.into_iter().chain(cells)).map_err(failed)?;
        }
    }
    table.flush().map_err(|error| EvaluationError::Write(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    #[test]
    fn the_table_has_a_row_per_frame_and_empty_cells_for_missing_values() {
        let truth = vec![standing(); 3];
        let moved: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.5, 0.0, 0.0))).collect();
        let evaluation = evaluate_markers(&truth, &moved);
        let mut bytes = vec![];
        write_per_frame(&[SeedRun { clip: "walk, slow", seed: 7, evaluation: &evaluation }], &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        let head = "clip,seed,frame,time_s,humaneva_mm,lost_limb,humaneva_relative_mm,humaneva_official_mm";
        assert!(lines[0].starts_with(head));
        assert!(lines[1].starts_with("\"walk, slow\",7,0,0,,,"));
        assert!(lines[2].starts_with("\"walk, slow\",7,1,0.016666666666666666,500,1,0,500,0,500"), "{}", lines[2]);
    }
}
