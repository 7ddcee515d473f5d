//! Corrections of how an estimate is read.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::AxisOrder;
use skiagraph_core::body::{LANDMARKS, Landmark, Markers};

/// Changes to the positions of an estimate, applied in this order.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// Index of the reading of the file, 0 as it was read, and the rows to which it applies.
    pub reading: usize,
    /// The rows that are read so; the others are read as given.
    pub rows: Range<usize>,
    /// For every marker, the index of the marker whose positions it has; its own index if the name is right.
    pub names: [usize; LANDMARKS.len()],
    /// Factor of all positions; for an estimate of poses, of the root only.
    pub scale: f64,
    /// The turn to the axes of the set.
    pub turn: Turn,
    /// Added to the positions, metres, in the axes of the set.
    pub offset: Vector3<f64>,
    /// The point of the body to which positions are relative; `None` if they are positions in the world.
    pub root: Option<Root>,
    /// The frames of the set that the rows show.
    pub time: FileTime,
}

/// A turn from the axes of a file to those of the set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turn {
    /// Axes in another order.
    Axes(AxisOrder),
    /// About the vertical, radians.
    Vertical(f64),
    /// Any turn.
    Free(Rotation3<f64>),
    /// The axes and the place of a camera.
    Camera {
        /// Its index in the rig.
        index: usize,
        /// Whether y is up and z backwards, as in OpenGL.
        opengl: bool,
    },
}

/// A point of the body to which positions may be relative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Root {
    /// The pelvis.
    Pelvis,
    /// The middle of the hips.
    Hips,
    /// The thorax.
    Thorax,
    /// The mean of all markers.
    Middle,
}

/// Row r shows the set's frame `first + step r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileTime {
    /// The frame of row 0.
    pub first: f64,
    /// Frames per row.
    pub step: f64,
}

/// One kind of change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MisreadingKind {
    /// Other axes.
    Axes,
    /// The axes of a camera.
    Camera,
    /// Turned by another angle.
    Turn,
    /// Another unit of length.
    Units,
    /// Lengths that are too great or too small by a factor that is no unit.
    Scale,
    /// Another origin.
    Offset,
    /// Positions relative to a point of the body.
    Relative,
    /// Left and right are exchanged.
    Sides,
    /// Left and right are exchanged in a part of the frames.
    SidesInPart,
    /// Joint angles in another unit.
    Angles,
    /// The real part of the root's quaternions is last.
    Quaternions,
    /// Differences between frames.
    Differences,
    /// Other frame numbers.
    Shift,
    /// Another frame rate.
    Rate,
    /// Frames in the reverse order.
    Reversed,
    /// Names belong to other markers.
    Names,
}

impl FileTime {
    /// Row r is frame r.
    pub const SAME: Self = Self { first: 0.0, step: 1.0 };

    /// Row r is frame r + `frames`.
    pub fn shifted(frames: i64) -> Self {
        Self { first: frames as f64, step: 1.0 }
    }

    pub(super) fn at(self, row: usize) -> f64 {
        self.first + self.step * row as f64
    }

    pub(super) fn kind(self) -> Option<MisreadingKind> {
        match self {
            Self::SAME => None,
            Self { step: 1.0, .. } => Some(MisreadingKind::Shift),
            Self { step: -1.0, .. } => Some(MisreadingKind::Reversed),
            _ => Some(MisreadingKind::Rate),
        }
    }
}

impl Turn {
    /// The axes of the set.
    pub const NONE: Self = Self::Axes(AxisOrder::SAME);

    /// From the file's axes to the set's; `cameras` are world-from-camera.
    pub fn matrix(&self, cameras: &[Isometry3<f64>]) -> Matrix3<f64> {
        match self {
            Self::Axes(order) => order.set_from_file(),
            Self::Vertical(angle) => Rotation3::from_axis_angle(&Vector3::z_axis(), *angle).into_inner(),
            Self::Free(rotation) => rotation.into_inner(),
            Self::Camera { index, opengl } => {
                let world = cameras.get(*index).copied().unwrap_or_else(Isometry3::identity).rotation;
                let flip = if *opengl { Vector3::new(1.0, -1.0, -1.0) } else { Vector3::repeat(1.0) };
                world.to_rotation_matrix().into_inner() * Matrix3::from_diagonal(&flip)
            }
        }
    }

    /// The place of the file's origin in the set.
    pub(super) fn origin(&self, cameras: &[Isometry3<f64>]) -> Vector3<f64> {
        match self {
            Self::Camera { index, .. } => cameras.get(*index).map_or_else(Vector3::zeros, |c| c.translation.vector),
            _ => Vector3::zeros(),
        }
    }

    pub(super) fn is_mirrored(&self) -> bool {
        matches!(self, Self::Axes(order) if order.is_mirrored())
    }

    /// The kind of a turn that is not the declared one: no turn is one that a camera was declared for.
    pub(super) fn kind(&self) -> MisreadingKind {
        match self {
            Self::Axes(order) if *order != AxisOrder::SAME => MisreadingKind::Axes,
            Self::Vertical(_) | Self::Free(_) => MisreadingKind::Turn,
            Self::Axes(_) | Self::Camera { .. } => MisreadingKind::Camera,
        }
    }
}

impl Root {
    /// All points.
    pub const ALL: [Self; 4] = [Self::Pelvis, Self::Hips, Self::Thorax, Self::Middle];

    /// The place of the point; `counted` are the markers that the middle is of.
    pub fn of(self, markers: &Markers, counted: &Markers) -> Option<Vector3<f64>> {
        let of: Vec<usize> = match self {
            Self::Pelvis => vec![Landmark::Pelvis as usize],
            Self::Hips => vec![Landmark::LeftHip as usize, Landmark::RightHip as usize],
            Self::Thorax => vec![Landmark::Thorax as usize],
            Self::Middle => (0..LANDMARKS.len()).filter(|at| markers[*at].and(counted[*at]).is_some()).collect(),
        };
        let points = of.iter().map(|at| markers[*at]).collect::<Option<Vec<Point3<f64>>>>()?;
        let sum: Vector3<f64> = points.iter().map(|point| point.coords).sum();
        (!points.is_empty()).then(|| sum / points.len() as f64)
    }

    /// Its name in a message.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pelvis => "the pelvis",
            Self::Hips => "the middle of the hips",
            Self::Thorax => "the thorax",
            Self::Middle => "the middle of the body",
        }
    }
}

impl Correction {
    /// No change.
    pub fn none() -> Self {
        Self {
            reading: 0,
            rows: 0..usize::MAX,
            names: std::array::from_fn(|marker| marker),
            scale: 1.0,
            turn: Turn::NONE,
            offset: Vector3::zeros(),
            root: None,
            time: FileTime::SAME,
        }
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
