//! The figures of runs and comparisons as separate files.

use super::comparison::{ComparisonInput, error_bars, error_plot, verdict};
use super::figure_file::FigureFile;
use super::figures::figures;
use super::plots::Size;
use super::{ReportError, ReportInput, typical_run};
use crate::evaluation::SeedRun;

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

/// The figures of several methods: errors with their intervals, and errors over time.
///
/// # Errors
/// [`ReportError`] without a method, or if a plot cannot be drawn.
pub fn comparison_figures(input: &ComparisonInput<'_>) -> Result<Vec<FigureFile>, ReportError> {
    if input.methods.is_empty() {
        return Err(ReportError::NoRun);
    }
    let (bars, lines) = (error_bars(input.methods), error_plot(input.methods));
    let methods: Vec<_> = input.methods.iter().collect();
    let found = verdict(&methods);
    let are_all = input.methods.iter().all(|method| method.summary.runs.len() == input.seeds);
    let seeds = match input.seeds {
        1 if are_all => "1 seed".to_owned(),
        several if are_all => format!("{several} seeds"),
        _ => "its seeds".to_owned(),
    };
    Ok(vec![
        FigureFile::new(
            "methods",
            format!("Mean marker error of every method with its 95 % interval over {seeds}. {found}"),
            &bars.svg(560)?,
        ),
        FigureFile::new(
            "error",
            "Mean marker error over time: lines are medians over seeds, bands the range over seeds.".to_owned(),
            &lines.svg(Size { width: 560, height: 320 })?,
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, with_input};

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
