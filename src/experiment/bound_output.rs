//! The folder of `skiagraph bound`: `bound.json` and a page.

use super::bound::{BoundReport, SourceBound};
use crate::artefacts::{Artefact, ArtefactKind, BOUND_FILE, Destination};
use crate::common::{ExperimentError, to_json};
use crate::report::{BoundChart, BoundCourse};

/// The page.
const BOUND_PAGE: &str = "bound.html";

/// Writes the folder of a bound.
///
/// # Errors
/// [`ExperimentError`]; nothing is written then.
pub fn write_bound(report: &BoundReport, to: Destination<'_>) -> Result<(), ExperimentError> {
    let folder = Artefact::begin(to, ArtefactKind::Bound)?;
    folder.write(BOUND_FILE, &to_json(report)?)?;
    folder.write(BOUND_PAGE, chart(report).page()?.as_bytes())?;
    folder.finish()?;
    Ok(())
}

fn chart(report: &BoundReport) -> BoundChart {
    let mut summary = vec![format!("{} cameras: {}", report.cameras.len(), report.cameras.join(", "))];
    summary.push(
        "All means leave out frame 0: its pose is given to trackers, and their errors leave it out too.".to_owned(),
    );
    summary.extend(report.sources.iter().map(|source| {
        format!(
            "From {} ({}) no unbiased tracker has a mean error below {:.1} mm in a frame alone, or below {:.1} mm as a \
             filter that knows the start and the spread of the motion.",
            source.source, source.noise, source.mean.alone_mm, source.mean.filtered_mm
        )
    }));
    if let Some(run) = &report.run {
        let times = run.times_the_bound.first().copied().unwrap_or_default();
        summary.push(format!(
            "{}: {:.1} mm, {:.1} times the bound of the frame alone, {:.1} times that of a filter.",
            run.tracker, run.error_mm, times[0], times[1]
        ));
    }
    summary.extend(report.notes.iter().cloned());
    let mut heads = vec!["marker".to_owned()];
    for source in &report.sources {
        heads.extend(["frame alone", "filter"].map(|what| format!("{}, {what}, mm", source.source)));
    }
    let markers = report.sources.first().map(|source| source.joints.as_slice()).unwrap_or_default();
    let row = |(index, joint): (usize, &super::bound::JointBound)| {
        let values = report.sources.iter().filter_map(|source| source.joints.get(index));
        let cells = values.flat_map(|joint| [joint.bound.alone_mm, joint.bound.filtered_mm]);
        std::iter::once(joint.joint.replace('_', " ")).chain(cells.map(|value| format!("{value:.2}"))).collect()
    };
    BoundChart {
        title: report.name.clone(),
        frames_per_second: report.frames_per_second,
        frames: report.frames,
        sources: report.sources.iter().map(course).collect(),
        summary,
        table: (heads, markers.iter().enumerate().map(row).collect()),
    }
}

fn course(source: &SourceBound) -> BoundCourse {
    let values = source
        .per_frame
        .iter()
        .map(|frame| (frame.frame, [frame.mean.alone_mm, frame.mean.filtered_mm, frame.worst_alone_mm]));
    let unseen = source.unseen.iter().map(|direction| {
        (direction.name.clone(), direction.frames.iter().map(|[first, last]| [*first, last + 1]).collect())
    });
    BoundCourse { name: source.source.to_owned(), values: values.collect(), unseen: unseen.collect() }
}
