//! Checks that an estimate begins near the set's start pose, so that its units, axes and names are the set's.

use skiagraph_core::body::Markers;
use skiagraph_set::BlindSet;

/// An estimate of frame 0 farther than this from the start pose, which every tracker is given, is suspicious; metres.
pub(crate) const FAR_M: f64 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StartDistance {
    /// Distance of the farthest marker, metres.
    pub(crate) farthest_m: f64,
    /// Number of markers that both have.
    pub(crate) markers: usize,
}

impl StartDistance {
    /// The distance of the markers of frame 0; `None` without markers.
    pub(crate) fn new(set: &BlindSet, frame_0: &Markers) -> Option<Self> {
        let body = &set.start.body;
        let start = body.markers(&body.link_frames(&set.start.pose));
        Self::between(&start, frame_0)
    }

    fn between(start: &Markers, estimate: &Markers) -> Option<Self> {
        let pairs = start.iter().zip(estimate).filter_map(|(a, b)| Some(((*a)? - (*b)?).norm()));
        let distances: Vec<f64> = pairs.collect();
        let farthest_m = distances.iter().copied().reduce(f64::max)?;
        Some(Self { farthest_m, markers: distances.len() })
    }

    /// Whether the estimate is near enough for the set's units, axes and names.
    pub(crate) fn is_near(&self) -> bool {
        self.farthest_m <= FAR_M
    }

    /// The note of `evaluate` if the estimate is not near.
    pub(crate) fn note(&self) -> Option<String> {
        (!self.is_near()).then(|| {
            format!(
                "the estimate of frame 0 is {:.2} m from the set's start pose (start/start.json), at the farthest of {} \
                 markers; expected at most {FAR_M} m, because trackers are given that pose: check its units \
                 (metres), its axes (Z up, unless declared) and its names (the set's)",
                self.farthest_m, self.markers
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn the_farthest_marker_counts_and_missing_markers_do_not() {
        let none: Markers = std::array::from_fn(|_| None);
        let mut start = none;
        for (index, marker) in start.iter_mut().enumerate().skip(1) {
            *marker = Some(Point3::new(0.0, 0.0, index as f64));
        }
        let moved = |by: f64| start.map(|marker| marker.map(|point| point + Vector3::new(by, 0.0, 0.0)));
        let mut near = moved(0.4);
        near[2] = None;
        let found = StartDistance::between(&start, &near).unwrap();
        assert!((found.farthest_m - 0.4).abs() < 1e-12 && found.markers == start.len() - 2);
        assert!(found.is_near() && found.note().is_none());
        near[3] = Some(Point3::new(3.0, 0.0, 3.0));
        let far = StartDistance::between(&start, &near).unwrap();
        assert!(far.note().unwrap().contains("is 3.00 m from the set's start pose"), "{far:?}");
        assert_eq!(StartDistance::between(&start, &none), None);
    }
}
