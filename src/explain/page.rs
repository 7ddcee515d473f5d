//! The page of an explanation.

use super::explanation::{CauseParts, Explanation, Landscape, WorstSecond};
use super::player::Player;
use crate::body::{LANDMARKS, Landmark};
use crate::common::ExperimentError;
use crate::report::{ExplainPage, ExplainedPart, LandscapePlot, WorstOnPage};

/// The page of an explanation.
///
/// # Errors
/// [`ExperimentError::Report`] if a plot cannot be drawn.
pub(super) fn page(of: &Explanation) -> Result<String, ExperimentError> {
    let causes = of.causes.iter().map(|cause| ExplainedPart {
        fault: cause.fault.clone(),
        interval: cause.interval.map(|interval| [interval.low, interval.high]),
        alone_mm: Some(cause.alone_mm),
        ..part(cause.name, cause.error_mm, &cause.parts)
    });
    let interaction = of.interaction_mm.zip(of.interaction.as_ref());
    let interaction = interaction.map(|(total, parts)| part("interaction", total, parts));
    let rest = part("what remains", of.rest_mm, &of.rest);
    let name = |player: &Player| of.causes.iter().find(|cause| cause.player == *player).map_or("", |cause| cause.name);
    let cells = of.cells.iter().map(|cell| {
        let names: Vec<&str> = cell.replaced.iter().map(name).collect();
        let words = if names.is_empty() { "nothing: the run".to_owned() } else { names.join(", ") };
        (words, cell.error_mm.iter().sum::<f64>() / cell.error_mm.len().max(1) as f64)
    });
    let page = ExplainPage {
        title: of.scenario.clone(),
        sentence: of.sentence.clone(),
        chips: vec![of.tracker.replace('_', " "), of.run.clone(), seeds(of.seeds.len())],
        error_mm: of.error_mm,
        parts: causes.chain(interaction).chain([rest]).collect(),
        joints: LANDMARKS.iter().map(|landmark| landmark.name().replace('_', " ")).collect(),
        frames_per_second: of.frames_per_second,
        cells: cells.collect(),
        notes: notes(of),
        worst: of.worst.iter().map(worst).collect(),
    };
    Ok(page.html()?)
}

fn part(name: &str, error_mm: f64, parts: &CauseParts) -> ExplainedPart {
    let joint = |landmark: &Landmark| parts.joints.get(landmark.name()).copied().unwrap_or(f64::NAN);
    ExplainedPart {
        name: name.to_owned(),
        fault: String::new(),
        error_mm,
        interval: None,
        alone_mm: None,
        joints: LANDMARKS.iter().map(joint).collect(),
        frames: parts.frames.clone(),
    }
}

fn worst(of: &WorstSecond) -> WorstOnPage {
    let WorstSecond { folder, seed, first_frame, last_frame, error_mm, .. } = of;
    WorstOnPage {
        folder: folder.clone(),
        about: format!("seed {seed}, frames {first_frame} to {last_frame}: {error_mm:.1} mm"),
        again: again(of),
        landscape: of.landscape.as_ref().map(|landscape| (plot(landscape), words(landscape))),
    }
}

/// How a worst second ends when it is tracked again.
pub(crate) fn again(of: &WorstSecond) -> String {
    let WorstSecond { again_mm, is_identical, set_begins_at, .. } = of;
    match (is_identical, set_begins_at) {
        (true, _) => "repeats to the bit".to_owned(),
        (false, 0) => format!("{again_mm:.1} mm, not to the bit"),
        (false, begin) => format!("{again_mm:.1} mm from the run's estimate of frame {begin}, not to the bit"),
    }
}

fn plot(of: &Landscape) -> LandscapePlot {
    LandscapePlot {
        label: format!("Energy around the truth in frame {}", of.frame),
        directions: of.directions.clone(),
        reach_mm: of.reach_mm,
        points: of.points,
        energies: of.energies.clone(),
        minimum_mm: of.minimum_mm,
        estimate_mm: of.estimate_mm,
    }
}

/// The landscape in words: bias, width, rival minima, and what they say about search and model.
fn words(of: &Landscape) -> String {
    let rivals = match of.rivals_mm.as_slice() {
        [] => "no rival minimum".to_owned(),
        all => {
            let away: Vec<String> = all.iter().map(|[a, b]| format!("{:.0} mm", a.hypot(*b))).collect();
            let several = if all.len() > 1 { "rival minima" } else { "a rival minimum" };
            format!("{several} {} from the truth", away.join(", "))
        }
    };
    let verdict = if of.energy_of_estimate > of.energy_of_truth {
        "the truth has the lower energy, so the search missed it"
    } else {
        "the estimate has the lower energy, so the model prefers it to the truth"
    };
    let is_at_edge = of.minimum_mm.iter().any(|place| place.abs() >= of.reach_mm);
    let minimum = if is_at_edge { "lowest point, at the edge," } else { "minimum" };
    format!(
        "Frame {}: the {minimum} is {:.0} mm from the truth, the valley {:.0} mm wide, {rivals}. The estimate is {:.0} mm \
         away, with an energy of {:.4} against {:.4} at the truth: {verdict}.",
        of.frame, of.bias_mm, of.width_mm, of.estimate_away_mm, of.energy_of_estimate, of.energy_of_truth
    )
}

/// How the parts were found, and what was left out.
pub(crate) fn notes(of: &Explanation) -> Vec<String> {
    let repetition = of.repetition;
    let way = match of.interaction_mm {
        Some(_) => {
            "Quick: each part is what the error falls by if only this is true; the interaction is what their sum \
                    lacks of all together."
        }
        None => {
            "Each part is a Shapley value: the mean over all orders of correction of how much its correction \
                 reduces the error. The search comes last, with all inputs true."
        }
    };
    let repeated = match repetition.is_identical {
        true => format!(
            "With nothing replaced, seed {} gives the run's estimates to the bit, so differences are effects and not \
             chance.",
            repetition.seed
        ),
        false => format!(
            "The tracker is not deterministic: with nothing replaced, seed {} gives {:.2} mm, in the run {:.2} mm. \
             This is one repetition, and others may differ by much more: it sets no limit below which parts are \
             chance.",
            repetition.seed, repetition.error_mm, repetition.error_in_run_mm
        ),
    };
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for left in &of.left_out {
        match reasons.iter_mut().find(|(reason, _)| *reason == left.reason) {
            Some((_, names)) => names.push(left.name),
            None => reasons.push((left.reason, vec![left.name])),
        }
    }
    let left = reasons.iter().map(|(reason, names)| format!("Left out, because {reason}: {}.", names.join(", ")));
    [way.to_owned(), repeated].into_iter().chain(left).collect()
}

/// `1 seed`, `5 seeds`.
fn seeds(count: usize) -> String {
    format!("{count} seed{}", if count == 1 { "" } else { "s" })
}
