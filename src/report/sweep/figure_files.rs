//! The plots of a sweep's page as files.

use super::analysis::{CostMeasure, effects};
use super::figures::{Map, MapCell, SIZES, curves, labelled, maps, scatter_plot};
use super::heat;
use super::input::SweepPageInput;
use crate::report::ReportError;
use crate::report::figure_file::FigureFile;
use crate::report::plots::{HeatCell, HeatPlot, Svg};

/// The figures of a sweep: the objective over either cost, heat maps, and the objective along every axis.
///
/// # Errors
/// [`ReportError`] without a setting, or where a plot cannot be drawn.
pub fn sweep_figures(input: &SweepPageInput) -> Result<Vec<FigureFile>, ReportError> {
    if input.settings.is_empty() {
        return Err(ReportError::NoRun);
    }
    let what = labelled(input);
    let mut files = Vec::new();
    for (cost, name, over) in [
        (CostMeasure::Evaluations, "cost-evaluations", "likelihood evaluations"),
        (CostMeasure::Processor, "cost-processor", "processor time"),
    ] {
        let plot = scatter_plot(input, cost);
        if plot.groups.is_empty() {
            continue;
        }
        let caption = format!(
            "{what} over {over}, a dot a setting with its 95 % interval over seeds; nothing on the dashed front is beaten by \
            something cheaper.{}",
            if plot.cuts_off() { " A bar with an arrow continues above the plot." } else { "" }
        );
        files.push(FigureFile::new(name, caption, &plot.svg(SIZES[0])?));
    }
    if let (Some(axes), maps, _) = maps(input) {
        let [down, across] = axes.map(|axis| input.axes[axis].clone());
        for (index, map) in maps.iter().enumerate() {
            let of = if map.title.is_empty() { String::new() } else { format!(" ({})", map.title) };
            let caption = format!("Mean {what}: {down} (down) by {across} (across){of}. Orange is worse.");
            files.push(FigureFile::new(&format!("map-{}", index + 1), caption, &map.plot(&down, &across).svg()?));
        }
    }
    let strongest = effects(&input.settings, input.axes.len()).map(|(single, _)| single);
    for curve in curves(input, strongest.as_deref())? {
        let name = format!("axis-{}", curve.axis.replace(|letter: char| !letter.is_ascii_alphanumeric(), "-"));
        let caption = format!("{what} over {}: means over all other axes.", curve.axis);
        files.push(FigureFile::new(&name, caption, &Svg(curve.plot.wide)));
    }
    Ok(files)
}

impl Map {
    fn plot(&self, down: &str, across: &str) -> HeatPlot {
        let cell = |cell: &MapCell| Some(HeatCell { text: cell.text.clone(), ground: heat::on_light(cell.place?) });
        HeatPlot {
            down: down.to_owned(),
            across: across.to_owned(),
            columns: self.columns.clone(),
            rows: self.rows.iter().map(|(name, cells)| (name.clone(), cells.iter().map(cell).collect())).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sweep::page::tests::grid;

    #[test]
    fn a_sweeps_figures_are_its_plots_and_its_heat_map() {
        let files = sweep_figures(&grid()).unwrap();
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        for name in ["cost-evaluations", "map-1", "axis-particles"] {
            assert!(names.contains(&name), "{name}: {names:?}");
        }
        for file in &files {
            roxmltree::Document::parse(&file.svg).unwrap();
            assert!(!file.svg.contains("var(--") && !file.caption.is_empty(), "{}", file.name);
        }
        let nothing = SweepPageInput { settings: vec![], ..grid() };
        assert!(matches!(sweep_figures(&nothing), Err(ReportError::NoRun)));
    }
}
