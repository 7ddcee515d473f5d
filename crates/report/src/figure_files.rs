//! The figures of runs and comparisons as separate files.

use super::comparison::{ComparedMethod, error_bars, error_plot};
use super::figure_file::FigureFile;
use super::figures::figures;
use super::plots::Size;
use super::{ReportError, ReportInput, typical_run};
use skiagraph_eval::SeedRun;

/// The figures of a run's page, each half a page wide.
///
/// # Errors
/// [`ReportError`] without a run, or if a plot cannot be drawn.
pub fn run_figures(input: &ReportInput<'_>) -> Result<Vec<FigureFile>, ReportError> {
    let runs: Vec<SeedRun<'_>> = input.runs.iter().map(|run| run.run).collect();
    let typical = typical_run(&runs).map(|index| &input.runs[index]).ok_or(ReportError::NoRun)?;
    let all = figures(input, typical)?;
    Ok(all.iter().map(|figure| FigureFile::new(figure.id, figure.caption(), &figure.for_paper())).collect())
}

/// The figures of several runs of one set: errors with their intervals, and errors over time.
///
/// # Errors
/// [`ReportError`] without a run, or if a plot cannot be drawn.
pub fn comparison_figures(runs: &[ComparedMethod]) -> Result<Vec<FigureFile>, ReportError> {
    if runs.is_empty() {
        return Err(ReportError::NoRun);
    }
    Ok(vec![
        FigureFile::new(
            "methods",
            "Mean marker error with its 95 % interval over seeds.".to_owned(),
            &error_bars(runs).svg(560)?,
        ),
        FigureFile::new(
            "error",
            "Mean marker error over time: lines are medians over seeds, bands the range over seeds.".to_owned(),
            &error_plot(runs).svg(Size { width: 560, height: 320 })?,
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Story, with_input};

    #[test]
    fn a_runs_figures_are_those_of_its_page_for_white_paper() {
        let files = with_input(&Story { seeds: 3, ..Story::default() }, |input| run_figures(input).unwrap());
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        let maps = ["markers-over-time", "cameras-over-time"];
        assert_eq!(names[..3], ["error", maps[0], maps[1]]);
        assert_eq!(names[3..], ["stances", "joints", "pck", "energy", "survival", "annealing"]);
        for file in &files {
            assert!(file.svg.starts_with("<svg ") && file.svg.contains("><metadata>skiagraph "), "{}", file.name);
            assert!(!file.svg.contains("var(--") && !file.svg.contains("<style"), "{}", file.name);
            roxmltree::Document::parse(&file.svg).unwrap();
            assert!(!file.caption.is_empty());
        }
        assert!(with_input(&Story::default(), |input| run_figures(&ReportInput { runs: &[], ..*input }).is_err()));
    }
}
