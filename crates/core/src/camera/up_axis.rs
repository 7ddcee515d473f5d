//! The axis of a file's world that points up.

use core::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};

/// The axis of a file's world that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// The first axis.
    X,
    /// The second axis, as in most recordings.
    Y,
    /// The third axis.
    #[default]
    Z,
    /// Against the first axis.
    #[serde(rename = "-x")]
    MinusX,
    /// Against the second axis: Y points down.
    #[serde(rename = "-y")]
    MinusY,
    /// Against the third axis: Z points down.
    #[serde(rename = "-z")]
    MinusZ,
}

/// For each axis: the value of the key `up`; and how Z becomes that axis, as the rotation about a coordinate axis by an
/// angle, and exactly, as the components of the file and their signs.
type UpRow = (&'static str, usize, f64, [usize; 3], [f64; 3]);
const UP_ROWS: [UpRow; 6] = [
    ("x", 1, -FRAC_PI_2, [2, 1, 0], [-1.0, 1.0, 1.0]),
    ("y", 0, FRAC_PI_2, [0, 2, 1], [1.0, -1.0, 1.0]),
    ("z", 2, 0.0, [0, 1, 2], [1.0, 1.0, 1.0]),
    ("-x", 1, FRAC_PI_2, [2, 1, 0], [1.0, 1.0, -1.0]),
    ("-y", 0, -FRAC_PI_2, [0, 2, 1], [1.0, 1.0, -1.0]),
    ("-z", 0, PI, [0, 1, 2], [1.0, -1.0, -1.0]),
];

impl UpAxis {
    /// All axes.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::MinusX, Self::MinusY, Self::MinusZ];

    /// The value of the key `up`.
    pub fn name(self) -> &'static str {
        UP_ROWS[self as usize].0
    }

    /// The rotation that makes this axis Z.
    pub fn turn(self) -> UnitQuaternion<f64> {
        let (_, axis, angle, ..) = UP_ROWS[self as usize];
        let (sin, cos) = libm::sincos(0.5 * angle);
        let mut imaginary = Vector3::zeros();
        imaginary[axis] = sin;
        Unit::new_unchecked(Quaternion::from_parts(cos, imaginary))
    }

    /// A vector of the file after [`Self::turn`], exactly.
    pub fn upright(self, v: &Vector3<f64>) -> Vector3<f64> {
        let (.., components, signs) = UP_ROWS[self as usize];
        Vector3::from_fn(|row, _| signs[row] * v[components[row]])
    }

    /// The component of a vector along this axis.
    pub fn along(self, v: &Vector3<f64>) -> f64 {
        self.upright(v).z
    }
}
