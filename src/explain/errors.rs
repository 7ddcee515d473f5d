//! The error of a tracker by seed, joint and frame, as `humaneva_mm` defines it.

use skiagraph_core::body::{LANDMARKS, Markers};
use skiagraph_core::npz::{Array, Npz, NpzError};
use skiagraph_eval::Sequence;
use skiagraph_set::EstimatedSequence;
use skiagraph_truth::scene::GroundTruth;

/// The error of one seed, mm; NaN where nothing can be measured. All numbers are linear in the distances of the
/// markers, so that parts of an error add up in each of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ErrorProfile {
    /// Mean of the frames' means.
    pub(super) total: f64,
    /// Mean over the frames, by [`LANDMARKS`].
    pub(super) joints: Vec<f64>,
    /// Mean over the markers, by frame.
    pub(super) frames: Vec<f64>,
}

impl ErrorProfile {
    pub(super) fn new(truth: &GroundTruth, estimate: &EstimatedSequence) -> Self {
        let markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
        let sequence = Sequence::from_markers(truth.frames_per_second, &markers, &estimate.markers);
        let frames = sequence.per_scored_frame(|frame| mean(sequence.distances_mm(frame)));
        let of_joint = |joint: usize| {
            let distance = |frame| {
                let pair = sequence.pairs(frame).find(|(landmark, ..)| *landmark == joint);
                pair.map(|(_, truth, estimate)| 1000.0 * (truth - estimate).norm())
            };
            mean(sequence.scored().filter_map(distance)).unwrap_or(f64::NAN)
        };
        Self {
            total: mean(frames.iter().flatten().copied()).unwrap_or(f64::NAN),
            joints: (0..LANDMARKS.len()).map(of_joint).collect(),
            frames: frames.into_iter().map(|error| error.unwrap_or(f64::NAN)).collect(),
        }
    }

    /// As the bytes of a file, from which [`Self::from_npz`] reads the same numbers to the bit.
    pub(super) fn to_npz(&self, file: &str) -> Result<Vec<u8>, NpzError> {
        let array = |values: &[f64]| Array::new(&[values.len()], values.to_vec());
        let arrays =
            [("total", array(&[self.total])), ("joints", array(&self.joints)), ("frames", array(&self.frames))];
        Npz::from_iter(arrays).to_bytes(file)
    }

    /// Reads the bytes of [`Self::to_npz`].
    pub(super) fn from_npz(file: &str, bytes: &[u8]) -> Result<Self, NpzError> {
        let npz = Npz::from_bytes(file, bytes)?;
        let read = |name: &str, length| npz.f64s(file, name, &[length]).map(<[f64]>::to_vec);
        Ok(Self {
            total: read("total", Some(1))?.into_iter().sum(),
            joints: read("joints", Some(LANDMARKS.len()))?,
            frames: read("frames", None)?,
        })
    }

    pub(super) fn zero(frames: usize) -> Self {
        Self { total: 0.0, joints: vec![0.0; LANDMARKS.len()], frames: vec![0.0; frames] }
    }

    pub(super) fn add(&mut self, weight: f64, other: &Self) {
        self.total += weight * other.total;
        let pairs = self.joints.iter_mut().zip(&other.joints).chain(self.frames.iter_mut().zip(&other.frames));
        pairs.for_each(|(own, other)| *own += weight * other);
    }

    pub(super) fn minus(&self, other: &Self) -> Self {
        let mut difference = self.clone();
        difference.add(-1.0, other);
        difference
    }

    pub(super) fn mean(seeds: &[Self]) -> Self {
        let mut sum = Self::zero(seeds.first().map_or(0, |first| first.frames.len()));
        seeds.iter().for_each(|seed| sum.add(1.0 / seeds.len() as f64, seed));
        sum
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_error_is_read_to_the_bit_also_where_nothing_is_measured() {
        let error = ErrorProfile { total: 0.1 + 0.2, frames: vec![f64::NAN, -0.0, 1e-300], ..ErrorProfile::zero(3) };
        let read = ErrorProfile::from_npz("x", &error.to_npz("x").unwrap()).unwrap();
        let bits = |of: &ErrorProfile| {
            [&[of.total], of.joints.as_slice(), of.frames.as_slice()].concat().into_iter().map(f64::to_bits).collect()
        };
        let [before, after]: [Vec<u64>; 2] = [&error, &read].map(bits);
        assert_eq!(before, after);
        assert!(ErrorProfile::from_npz("x", b"not an archive").is_err());
    }
}
