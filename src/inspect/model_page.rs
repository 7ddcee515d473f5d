//! The page of a model.

use std::path::Path;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::common::ExperimentError;
use crate::motion_model::gpdm_graph::{GraphSegment, ModelKind};
use crate::motion_model::pose_chart::distance;
use crate::parallel;
use crate::report::{
    CandidateFrame, FactGroup, FrameDistances, LatentPath, ModelPageInput, OneModel, OtherModel, model_page,
};
use crate::train::{LearnedFrom, LearnedModel};

/// Greatest number of training frames whose distances are shown, because the picture has no more pixels.
const MOST_FRAMES: usize = 400;

/// The page of the model in `path`, compared with the model `against`, if one is given.
///
/// # Errors
/// [`ExperimentError::Report`] if a plot cannot be drawn.
pub(super) fn html(
    path: &Path,
    model: &LearnedModel,
    against: Option<(&Path, &LearnedModel)>,
) -> Result<String, ExperimentError> {
    let (facts, graph) = (&model.facts, &model.graph);
    let title = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let starts = starts(model);
    let (settings, joints) = (&facts.settings, graph.chart.groups().len() as f64);
    let one = |(segment, start): (&GraphSegment, &usize)| one_model(model, segment, *start);
    let at = |c: &crate::motion_model::gpdm_graph::Candidate| CandidateFrame {
        frame: starts[c.segment] + c.row,
        model: c.segment,
    };
    let errors_of = |other: &LearnedModel| other.graph.segments.iter().flat_map(|s| s.errors.clone()).collect();
    let name = |p: &Path| p.file_name().unwrap_or(p.as_os_str()).to_string_lossy().into_owned();
    Ok(model_page(&ModelPageInput {
        title: &title,
        frames_per_second: facts.frames_per_second,
        chips: vec![
            facts.kind().to_owned(),
            facts.robot.name.clone(),
            format!("{} Hz", facts.frames_per_second),
            format!("{} latent dimensions", settings.training.latent_dimensions),
        ],
        models: graph.segments.iter().zip(&starts).map(one).collect(),
        threshold: (settings.kind() == ModelKind::GpdmGraph).then_some(settings.threshold_per_joint * joints),
        against: against.map(|(p, other)| OtherModel { name: name(p), errors: errors_of(other) }),
        distances: frame_distances(model),
        candidates: graph.candidates.iter().map(at).collect(),
        facts: describe_model(model),
    })?)
}

/// The first frame of every segment, counted over all recordings.
fn starts(model: &LearnedModel) -> Vec<usize> {
    let lengths = model.graph.segments.iter().map(|s| s.errors.len());
    lengths.scan(0, |next, length| Some(std::mem::replace(next, *next + length))).collect()
}

fn one_model(model: &LearnedModel, segment: &GraphSegment, start: usize) -> OneModel {
    let rows = |m: &dyn Fn(usize, usize) -> f64, count: usize, d: usize| -> LatentPath {
        (0..count).map(|i| (0..d).map(|c| m(i, c)).collect()).collect()
    };
    let z = segment.gpdm.latents();
    let learned = rows(&|i, c| z[(i, c)], z.nrows(), z.ncols());
    let predicted = segment.gpdm.simulate(0).map_or(Vec::new(), |p| rows(&|i, c| p[(i, c)], p.nrows(), p.ncols()));
    let axes = PrincipalAxes::new(&learned);
    let recording = model.facts.learned_from.get(segment.range.motion);
    OneModel {
        start,
        recording: recording.map_or_else(String::new, |from| from.clip.clone()),
        first: segment.range.first,
        learned: axes.along(&learned),
        predicted: axes.along(&predicted),
        errors: segment.errors.clone(),
    }
}

/// The axes along which points vary most, because the axes of a latent space are arbitrary.
struct PrincipalAxes {
    mean: DVector<f64>,
    axes: Vec<DVector<f64>>,
}

impl PrincipalAxes {
    fn new(points: &LatentPath) -> Self {
        let d = points.first().map_or(0, Vec::len);
        let matrix = DMatrix::from_fn(points.len(), d, |i, c| points[i][c]);
        let mean = DVector::from_fn(d, |c, _| matrix.column(c).sum() / points.len().max(1) as f64);
        let centred = DMatrix::from_fn(points.len(), d, |i, c| matrix[(i, c)] - mean[c]);
        let eigen = SymmetricEigen::new(centred.transpose() * &centred);
        let mut order: Vec<usize> = (0..d).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let axes = order.into_iter().map(|c| eigen.eigenvectors.column(c).into_owned()).collect();
        Self { mean, axes }
    }

    fn along(&self, points: &LatentPath) -> LatentPath {
        let one = |point: &Vec<f64>| {
            let centred = DVector::from_column_slice(point) - &self.mean;
            self.axes.iter().map(|axis| axis.dot(&centred)).collect()
        };
        points.iter().map(one).collect()
    }
}

/// Distances between training frames, of which at most [`MOST_FRAMES`] are sampled.
fn frame_distances(model: &LearnedModel) -> FrameDistances {
    let all: Vec<_> = model.graph.segments.iter().flat_map(|s| &s.rotations).collect();
    let step = all.len().div_ceil(MOST_FRAMES).max(1);
    let shown: Vec<_> = all.into_iter().step_by(step).collect();
    let row = |a: usize| shown.iter().map(|b| distance(shown[a], b) as f32).collect::<Vec<f32>>();
    let values = parallel::map(shown.len(), row).concat();
    FrameDistances { step, frames: shown.len(), values }
}

fn describe_model(model: &LearnedModel) -> Vec<FactGroup> {
    let (facts, settings) = (&model.facts, &model.facts.settings);
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let training = &settings.training;
    let balance = training.balance.map_or_else(|| "D/d (balanced GPDM)".to_owned(), |b| b.to_string());
    let mut learning = vec![
        fact("dynamics", format!("{:?} order", training.order).to_lowercase()),
        fact("predicts differences", if training.delta { "yes" } else { "no" }.to_owned()),
        fact("weight of the dynamics", balance),
        fact("rounds, iterations", format!("{}, {}", training.rounds, training.iterations)),
    ];
    if settings.kind() == ModelKind::GpdmGraph {
        learning.push(fact("clip", format!("{:.3} s", settings.clip_s)));
        learning.push(fact("TH", format!("{:.4} rad\u{b2} per joint", settings.threshold_per_joint)));
        learning.push(fact("candidates found by", settings.detector.describe().to_owned()));
    }
    learning.push(fact("program", facts.program.clone()));
    let recording = |from: &LearnedFrom| {
        let of = match (from.first_frame, from.last_frame) {
            (None, None) => String::new(),
            (first, last) => {
                let last = last.map_or("the last".to_owned(), |n| n.to_string());
                format!(" (file's frames {} to {last})", first.unwrap_or(1))
            }
        };
        (from.clip.clone(), format!("{} frames{of}", from.frames))
    };
    vec![
        FactGroup { title: "Recordings".to_owned(), facts: facts.learned_from.iter().map(recording).collect() },
        FactGroup { title: "Learning".to_owned(), facts: learning },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_axes_keep_distances_and_put_the_widest_first() {
        let points: LatentPath = (0..40).map(|i| vec![0.1 * (i as f64).sin(), 0.0, 0.5 * i as f64]).collect();
        let turned = PrincipalAxes::new(&points).along(&points);
        let apart = |p: &LatentPath, i: usize, j: usize| -> f64 {
            p[i].iter().zip(&p[j]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        };
        assert!((apart(&points, 3, 17) - apart(&turned, 3, 17)).abs() < 1e-9);
        let spread = |c: usize| turned.iter().map(|z| z[c] * z[c]).sum::<f64>();
        assert!(spread(0) > spread(1) && spread(1) > spread(2));
    }
}
