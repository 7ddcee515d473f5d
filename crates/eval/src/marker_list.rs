//! In-memory representations of the markers of every frame.

use nalgebra::Point3;

use skiagraph_core::body::{LANDMARKS, Markers};

/// Markers of every frame, as [`super::Sequence`] reads them: a slice, or [`PackedMarkers`].
///
/// ```
/// use nalgebra::Point3;
/// use skiagraph_eval::{PackedMarkers, Sequence, evaluate};
/// let at = |x: f64| [Some(Point3::new(x, 0.0, 1.0)); 15];
/// let truth: PackedMarkers = (0..20).map(|_| at(0.0)).collect();
/// let estimate: PackedMarkers = (0..20).map(|_| at(0.05)).collect();
/// let evaluation = evaluate(&Sequence::from_markers(60.0, &truth, &estimate))?;
/// assert!((evaluation.metrics["humaneva_mm"].mean - 50.0).abs() < 1e-3);
/// # Ok::<(), skiagraph_eval::EvaluationError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct MarkerList<'a> {
    held: MarkerStorage<'a>,
}

#[derive(Clone, Copy, Debug)]
enum MarkerStorage<'a> {
    Whole(&'a [Markers]),
    Packed(&'a PackedMarkers),
}

impl MarkerList<'_> {
    /// Number of frames.
    pub fn len(&self) -> usize {
        match self.held {
            MarkerStorage::Whole(frames) => frames.len(),
            MarkerStorage::Packed(packed) => packed.len(),
        }
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One marker, metres; `None` if it is missing, or after the last frame.
    pub fn get(&self, frame: usize, landmark: usize) -> Option<Point3<f64>> {
        match self.held {
            MarkerStorage::Whole(frames) => *frames.get(frame)?.get(landmark)?,
            MarkerStorage::Packed(packed) => packed.get(frame, landmark),
        }
    }

    /// All markers of a frame, metres; all `None` after the last frame.
    pub fn frame(&self, frame: usize) -> Markers {
        std::array::from_fn(|landmark| self.get(frame, landmark))
    }

    /// Number of markers that a frame has.
    pub fn count(&self, frame: usize) -> usize {
        (0..LANDMARKS.len()).filter(|landmark| self.get(frame, *landmark).is_some()).count()
    }
}

impl<'a> From<&'a [Markers]> for MarkerList<'a> {
    fn from(frames: &'a [Markers]) -> Self {
        Self { held: MarkerStorage::Whole(frames) }
    }
}

impl<'a> From<&'a Vec<Markers>> for MarkerList<'a> {
    fn from(frames: &'a Vec<Markers>) -> Self {
        Self::from(frames.as_slice())
    }
}

impl<'a, const FRAMES: usize> From<&'a [Markers; FRAMES]> for MarkerList<'a> {
    fn from(frames: &'a [Markers; FRAMES]) -> Self {
        Self::from(frames.as_slice())
    }
}

impl<'a> From<&'a PackedMarkers> for MarkerList<'a> {
    fn from(packed: &'a PackedMarkers) -> Self {
        Self { held: MarkerStorage::Packed(packed) }
    }
}

/// Markers in single precision: 180 bytes per frame instead of 480, for estimates of very many frames. Positions within
/// 16 m of the origin are precise to a micrometre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PackedMarkers {
    /// x, y, z of every marker of every frame, metres; NaN if it is missing.
    places: Vec<[[f32; 3]; LANDMARKS.len()]>,
}

impl PackedMarkers {
    /// An empty list with capacity for that many frames.
    pub fn with_capacity(frames: usize) -> Self {
        Self { places: Vec::with_capacity(frames) }
    }

    /// Adds the markers of the next frame, metres. A coordinate that is not finite, or too large for single precision,
    /// is stored as infinite, so that [`super::evaluate`] refuses it.
    pub fn push(&mut self, markers: &Markers) {
        let packed = |marker: &Option<Point3<f64>>| match marker {
            None => [f32::NAN; 3],
            Some(place) if place.iter().any(|x| x.is_nan()) => [f32::INFINITY; 3],
            Some(place) => [place.x as f32, place.y as f32, place.z as f32],
        };
        self.places.push(std::array::from_fn(|landmark| packed(&markers[landmark])));
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    fn get(&self, frame: usize, landmark: usize) -> Option<Point3<f64>> {
        let [x, y, z] = *self.places.get(frame)?.get(landmark)?;
        (!x.is_nan()).then(|| Point3::new(f64::from(x), f64::from(y), f64::from(z)))
    }
}

impl FromIterator<Markers> for PackedMarkers {
    fn from_iter<I: IntoIterator<Item = Markers>>(frames: I) -> Self {
        let frames = frames.into_iter();
        let mut packed = Self::with_capacity(frames.size_hint().0);
        frames.for_each(|markers| packed.push(&markers));
        packed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::{standing, translated};
    use crate::{Sequence, evaluate};
    use nalgebra::Vector3;

    fn wandering(frames: usize, error: f64) -> Vec<Markers> {
        let at = |frame: usize| {
            let time = frame as f64 / 60.0;
            let mut markers = translated(&standing(), Vector3::new(time, error * libm::sin(time), 0.0));
            markers[frame % 15] = markers[frame % 15].filter(|_| frame % 7 != 3 || error == 0.0);
            markers
        };
        (0..frames).map(at).collect()
    }

    #[test]
    fn packed_markers_give_every_metric_to_a_thousandth() {
        let (truth, estimate) = (wandering(300, 0.0), wandering(300, 0.05));
        let plain = evaluate(&Sequence::from_markers(60.0, &truth, &estimate)).unwrap();
        let packed: [PackedMarkers; 2] = [&truth, &estimate].map(|frames| frames.iter().copied().collect());
        let found = evaluate(&Sequence::from_markers(60.0, &packed[0], &packed[1])).unwrap();
        assert_eq!(plain.coverage, found.coverage);
        assert!(plain.coverage < 1.0);
        for (name, value) in &plain.metrics {
            let found = &found.metrics[name];
            assert_eq!(value.frames, found.frames, "{name}");
            // third differences amplify rounding by the cube of the rate
            let tolerance = if name.contains("_per_s") { 0.5 } else { 2e-3 };
            assert!((value.mean - found.mean).abs() <= tolerance, "{name}: {} and {}", value.mean, found.mean);
        }
    }

    #[test]
    fn a_packed_marker_that_is_not_finite_is_refused_and_a_missing_one_stays_missing() {
        let truth = vec![standing(); 3];
        let mut estimate = truth.clone();
        estimate[1][2] = None;
        estimate[2][1] = Some(Point3::new(0.0, f64::NAN, 0.0));
        let packed: PackedMarkers = estimate.into_iter().collect();
        let list = MarkerList::from(&packed);
        assert_eq!((list.count(1), list.get(1, 2), list.get(3, 0), list.len()), (14, None, None, 3));
        assert_eq!(list.frame(0)[4].map(|place| (place - standing()[4].unwrap()).norm() < 1e-6), Some(true));
        let refused = evaluate(&Sequence::from_markers(60.0, &truth, &packed)).unwrap_err();
        assert!(refused.to_string().starts_with("set frame 2 (from 0): "), "{refused}");
    }
}
