//! Corrections of cameras whose poses are slightly wrong: bundle adjustment, `[Triggs 2000]`, on outlines.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Parameters of one camera's correction: a translation, metres, and a rotation vector, radians.
pub(super) const NUMBERS_PER_CAMERA: usize = 6;

/// Standard deviations of the prior. A camera that is 4 m away and turned by half a degree sees the scene 35 mm off.
const TRANSLATION_DEVIATION_M: f64 = 0.05;
const ROTATION_DEVIATION_RAD: f64 = 0.015;

/// The corrections of all cameras. A camera's correction moves the scene that it sees about a point in the scene, so
/// that translation and rotation are nearly independent. Moving all cameras alike moves the world; only the prior and
/// the tracked poses determine that.
#[derive(Debug)]
pub(super) struct CameraModel {
    cameras: usize,
    /// The point about which the scene is turned.
    pub(super) about: Point3<f64>,
}

impl CameraModel {
    pub(super) fn new(cameras: usize, about: Point3<f64>) -> Self {
        Self { cameras, about }
    }

    /// Number of parameters.
    pub(super) fn numbers(&self) -> usize {
        self.cameras * NUMBERS_PER_CAMERA
    }

    /// Standard deviation of the prior of a parameter.
    pub(super) fn deviation(number: usize) -> f64 {
        if number % NUMBERS_PER_CAMERA < 3 { TRANSLATION_DEVIATION_M } else { ROTATION_DEVIATION_RAD }
    }

    /// The corrections of the cameras with these names, from the parameters of all cameras.
    pub(super) fn corrections<'a>(
        &'a self,
        names: impl Iterator<Item = &'a str> + 'a,
        values: &'a [f64],
    ) -> impl Iterator<Item = CameraCorrection> + 'a {
        names.zip(values.chunks_exact(NUMBERS_PER_CAMERA)).map(|(name, values)| CameraCorrection {
            camera: name.to_owned(),
            about_m: self.about.coords.into(),
            moved_m: [values[0], values[1], values[2]],
            turned_rad: [values[3], values[4], values[5]],
        })
    }
}

/// The correction of a camera's pose: a motion of the scene as this camera sees it, in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraCorrection {
    /// The camera's name.
    pub camera: String,
    /// The point about which the scene is turned, metres.
    pub about_m: [f64; 3],
    /// Translation of the scene, metres.
    pub moved_m: [f64; 3],
    /// Rotation vector of the scene, radians.
    pub turned_rad: [f64; 3],
}

impl CameraCorrection {
    /// The motion of the scene, which is applied to world coordinates before the camera's given pose.
    pub fn motion(&self) -> Isometry3<f64> {
        let about = Translation3::from(self.about_m);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(self.turned_rad));
        Translation3::from(self.moved_m) * about * turn * about.inverse()
    }

    /// How far the scene is moved, millimetres.
    pub(super) fn moved_mm(&self) -> f64 {
        1000.0 * Vector3::from(self.moved_m).norm()
    }

    /// How far the scene is turned, degrees.
    pub(super) fn turned_deg(&self) -> f64 {
        Vector3::from(self.turned_rad).norm().to_degrees()
    }
}
