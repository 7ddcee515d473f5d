//! Corrections of how an estimate is read.

use nalgebra::{Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::AxisOrder;
use crate::body::{LANDMARKS, Landmark, Markers};

/// Changes to the positions of an estimate, applied in this order: names and sides, unit, axes, offset, frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// The axes of the positions.
    pub axes: AxisOrder,
    /// Factor of all positions; for an estimate of poses, of the root only.
    pub scale: f64,
    /// Whether left and right are exchanged.
    pub swapped: bool,
    /// Added to the positions, metres, in the axes of the set.
    pub offset: Vector3<f64>,
    /// Added to the frame numbers.
    pub shift: i64,
    /// For every marker, the index of the marker whose positions it has; its own index if the name is right.
    pub names: [usize; LANDMARKS.len()],
}

/// One kind of change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MisreadingKind {
    /// Other axes.
    Axes,
    /// Another unit of length.
    Units,
    /// Another origin.
    Offset,
    /// Left and right are exchanged.
    Sides,
    /// Other frame numbers.
    Shift,
    /// Names belong to other markers.
    Names,
}

const KINDS: [MisreadingKind; 6] = [
    MisreadingKind::Axes,
    MisreadingKind::Units,
    MisreadingKind::Offset,
    MisreadingKind::Sides,
    MisreadingKind::Shift,
    MisreadingKind::Names,
];

/// Positions of one repetition as they were read.
#[derive(Clone, Copy, Debug)]
pub struct GivenPositions<'a> {
    /// One entry per frame.
    pub markers: &'a [Markers],
    /// The same with left and right exchanged.
    pub swapped: &'a [Markers],
    /// The roots of an estimate of poses. Only these depend on the unit of length, because the body's size is known.
    pub roots: Option<&'a [Option<Point3<f64>>]>,
}

impl Correction {
    /// No change.
    pub fn none() -> Self {
        Self {
            axes: AxisOrder::SAME,
            scale: 1.0,
            swapped: false,
            offset: Vector3::zeros(),
            shift: 0,
            names: std::array::from_fn(|marker| marker),
        }
    }

    /// The kinds of change that it contains.
    pub fn kinds(&self) -> Vec<MisreadingKind> {
        KINDS.into_iter().filter(|kind| self.has(*kind)).collect()
    }

    pub(super) fn has(&self, kind: MisreadingKind) -> bool {
        let none = Self::none();
        match kind {
            MisreadingKind::Axes => self.axes != none.axes,
            MisreadingKind::Units => self.scale != none.scale,
            MisreadingKind::Offset => self.offset != none.offset,
            MisreadingKind::Sides => self.swapped,
            MisreadingKind::Shift => self.shift != 0,
            MisreadingKind::Names => self.names != none.names,
        }
    }

    /// This correction without one kind of change.
    pub(super) fn without(&self, kind: MisreadingKind) -> Self {
        let mut less = self.clone();
        let none = Self::none();
        match kind {
            MisreadingKind::Axes => less.axes = none.axes,
            MisreadingKind::Units => less.scale = none.scale,
            MisreadingKind::Offset => less.offset = none.offset,
            MisreadingKind::Sides => less.swapped = none.swapped,
            MisreadingKind::Shift => less.shift = none.shift,
            MisreadingKind::Names => less.names = none.names,
        }
        less
    }

    /// The corrected markers of the estimate in a frame of the set; `None` outside its frames.
    pub(super) fn markers(&self, given: &GivenPositions<'_>, frame: usize) -> Option<Markers> {
        let from = frame.checked_add_signed(-(self.shift as isize))?;
        let named = *if self.swapped { given.swapped } else { given.markers }.get(from)?;
        let root = given.roots.map(|roots| roots.get(from).copied().flatten());
        let matrix: Matrix3<f64> = self.axes.set_from_file();
        let place = |point: Point3<f64>| {
            let scaled = match root {
                None => self.scale * point.coords,
                Some(root) => point.coords + (self.scale - 1.0) * root.unwrap_or_else(Point3::origin).coords,
            };
            Point3::from(matrix * scaled + self.offset)
        };
        Some(self.names.map(|name| named[name].map(place)))
    }
}

/// Markers with the names of left and right exchanged.
pub fn with_sides_exchanged(markers: &Markers) -> Markers {
    std::array::from_fn(|marker| markers[marker_of_other_side(marker)])
}

/// The index in [`LANDMARKS`] of the marker on the other side; its own index for markers in the middle.
pub fn marker_of_other_side(marker: usize) -> usize {
    let name = LANDMARKS[marker].name();
    let other = match (name.strip_prefix("left_"), name.strip_prefix("right_")) {
        (Some(rest), _) => format!("right_{rest}"),
        (_, Some(rest)) => format!("left_{rest}"),
        _ => return marker,
    };
    LANDMARKS.iter().position(|landmark: &Landmark| landmark.name() == other).unwrap_or(marker)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::standing;

    #[test]
    fn a_correction_undoes_the_errors_of_a_file() {
        let truth: Vec<Markers> = (0..9)
            .map(|f| crate::test_figure::translated(&standing(), Vector3::new(0.1 * f as f64, 0.0, 0.0)))
            .collect();
        let axes: AxisOrder = "y,z,x".parse().unwrap();
        let wrong = |point: Point3<f64>| {
            Point3::from(1000.0 * (axes.set_from_file().transpose() * (point.coords - Vector3::new(1.0, 2.0, 0.0))))
        };
        // two frames late, in another unit, other axes, from another origin, left and right exchanged
        let given: Vec<Markers> = (0..9_usize)
            .map(|frame| with_sides_exchanged(&truth[frame.saturating_sub(2)].map(|marker| marker.map(wrong))))
            .collect();
        let swapped: Vec<Markers> = given.iter().map(with_sides_exchanged).collect();
        let given = GivenPositions { markers: &given, swapped: &swapped, roots: None };
        let correction = Correction {
            axes,
            scale: 0.001,
            swapped: true,
            offset: Vector3::new(1.0, 2.0, 0.0),
            shift: -2,
            ..Correction::none()
        };
        for frame in 0..7 {
            let found = correction.markers(&given, frame).unwrap();
            for (found, truth) in found.iter().zip(&truth[frame]) {
                assert!((found.unwrap() - truth.unwrap()).norm() < 1e-12);
            }
        }
        assert_eq!(correction.markers(&given, 7), None, "the file ends");
        assert_eq!(correction.kinds().len(), 5);
        let none = correction.kinds().iter().fold(correction, |less, kind| less.without(*kind));
        assert_eq!(none, Correction::none());
    }

    #[test]
    fn the_unit_of_poses_changes_only_their_roots() {
        let body = standing();
        let root = Point3::new(1000.0, 2000.0, 950.0);
        let far = crate::test_figure::translated(&body, root.coords);
        let given = GivenPositions { markers: &[far], swapped: &[far], roots: Some(&[Some(root)]) };
        let found = Correction { scale: 0.001, ..Correction::none() }.markers(&given, 0).unwrap();
        let right = crate::test_figure::translated(&body, 0.001 * root.coords);
        for (found, right) in found.iter().zip(&right) {
            assert!((found.unwrap() - right.unwrap()).norm() < 1e-9);
        }
    }
}
