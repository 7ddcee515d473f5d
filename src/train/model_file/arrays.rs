//! Reads the graph from a model file's arrays.

use super::ModelFacts;
use skiagraph_core::body::Humanoid;
use skiagraph_core::npz::{Array, Npz, NpzError, Values};
use skiagraph_track::motion_model::gpdm::{DynamicsKernel, Gpdm, GpdmParts, MapKernel, PartsError, SequenceLayout};
use skiagraph_track::motion_model::gpdm_graph::{Candidate, GpdmGraph, GraphSegment, SegmentRange};
use skiagraph_track::motion_model::pose_chart::{PoseChart, ROOT_DIMENSIONS, unit_quaternion};

/// Largest sum of squared lengths of all models, which have two kernel matrices of this many entries.
const MOST_KERNEL_ENTRIES: usize = 1 << 26;

#[derive(Debug, thiserror::Error)]
pub(super) enum ArraysError {
    #[error(transparent)]
    Npz(#[from] NpzError),
    #[error(transparent)]
    Parts(#[from] PartsError),
}

pub(super) struct Arrays<'a> {
    pub(super) file: &'a str,
    pub(super) npz: &'a Npz,
}

impl<'a> Arrays<'a> {
    pub(super) fn graph(&self, facts: &ModelFacts, body: &Humanoid) -> Result<GpdmGraph, ArraysError> {
        let means = self.numbers("chart_means", &[None, Some(4)])?.as_chunks::<4>().0;
        let units = self.numbers("root_units", &[Some(ROOT_DIMENSIONS)])?.as_chunks::<ROOT_DIMENSIONS>().0[0];
        let chart = PoseChart::from_parts(body, means, units)?;
        let ranges = self.ranges()?;
        let segments = self.segments(facts, &chart, &ranges)?;
        let candidates = self.indices("candidates", 2)?;
        let candidates = candidates.chunks(2).map(|c| Candidate { segment: c[0], row: c[1] }).collect();
        let graph = GpdmGraph { chart, frames_per_second: facts.frames_per_second, segments, candidates };
        Ok(graph.checked()?)
    }

    fn ranges(&self) -> Result<Vec<SegmentRange>, ArraysError> {
        let indices = self.indices("segments", 3)?;
        let ranges: Vec<_> = indices.chunks(3).map(|r| SegmentRange { motion: r[0], first: r[1], end: r[2] }).collect();
        let square = |r: &SegmentRange| r.end.checked_sub(r.first).and_then(|n| n.checked_mul(n));
        let entries = ranges.iter().try_fold(0_usize, |sum, r| sum.checked_add(square(r)?));
        match entries {
            Some(entries) if entries <= MOST_KERNEL_ENTRIES => Ok(ranges),
            _ => Err(self.wrong("segments: expected ranges of frames of a size that can be learned").into()),
        }
    }

    fn segments(
        &self,
        facts: &ModelFacts,
        chart: &PoseChart,
        ranges: &[SegmentRange],
    ) -> Result<Vec<GraphSegment>, ArraysError> {
        let frames: usize = ranges.iter().map(|r| r.end - r.first).sum();
        let (models, dimensions, joints) = (Some(ranges.len()), chart.dimensions(), chart.groups().len());
        let mean = self.numbers("mean", &[models, Some(dimensions)])?;
        let scales = self.numbers("scales", &[models, Some(dimensions)])?;
        let map = self.numbers("map_kernel", &[models, Some(2)])?;
        let dynamics = self.numbers("dynamics_kernel", &[models, Some(4)])?;
        let centred = self.numbers("centred", &[Some(frames), Some(dimensions)])?;
        let options = &facts.settings.training;
        let d = options.latent_dimensions;
        let latents = self.numbers("latents", &[Some(frames), Some(d)])?;
        let errors = self.numbers("errors", &[Some(frames)])?;
        let rotations = self.numbers("rotations", &[Some(frames), Some(joints), Some(4)])?;
        let rotations = rotations.as_chunks::<4>().0.iter().map(|q| unit_quaternion(*q)).collect::<Option<Vec<_>>>();
        let rotations = rotations.ok_or_else(|| self.wrong("rotations: expected unit quaternions"))?;
        let mut start = 0;
        let mut segments = Vec::new();
        for (k, range) in ranges.iter().enumerate() {
            let (from, to) = (start, start + range.end - range.first);
            start = to;
            let gpdm = Gpdm::from_parts(GpdmParts {
                mean: mean[k * dimensions..(k + 1) * dimensions].to_vec(),
                scales: scales[k * dimensions..(k + 1) * dimensions].to_vec(),
                centred: centred[from * dimensions..to * dimensions].to_vec(),
                latents: latents[from * d..to * d].to_vec(),
                map: MapKernel { inverse_width: map[2 * k], noise_precision: map[2 * k + 1] },
                dynamics: DynamicsKernel {
                    amplitude: dynamics[4 * k],
                    inverse_width: dynamics[4 * k + 1],
                    linear: dynamics[4 * k + 2],
                    noise_precision: dynamics[4 * k + 3],
                },
                layout: SequenceLayout { order: options.order, delta: options.delta, lengths: vec![to - from] },
            })?;
            let rotations = (from..to).map(|t| rotations[t * joints..(t + 1) * joints].to_vec()).collect();
            segments.push(GraphSegment { range: *range, gpdm, errors: errors[from..to].to_vec(), rotations });
        }
        Ok(segments)
    }

    fn numbers(&self, name: &str, shape: &[Option<usize>]) -> Result<&'a [f64], NpzError> {
        self.npz.f64s(self.file, name, shape)
    }

    fn indices(&self, name: &str, columns: usize) -> Result<Vec<usize>, ArraysError> {
        let expected = || self.wrong(&format!("{name}: expected rows of {columns} whole numbers from 0"));
        match self.npz.get(name) {
            Some(Array { shape, values: Values::I64(values) }) if shape.len() == 2 && shape[1] == columns => {
                let indices = values.iter().map(|v| usize::try_from(*v)).collect::<Result<_, _>>();
                indices.map_err(|_| expected().into())
            }
            _ => Err(expected().into()),
        }
    }

    fn wrong(&self, detail: &str) -> NpzError {
        NpzError::new(self.file, detail)
    }
}
