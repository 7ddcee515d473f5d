//! Corrections of cameras whose poses are slightly wrong: bundle adjustment, `[Triggs 2000]`, on outlines.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use skiagraph_core::camera::CameraRig;

/// Parameters of one camera's correction: a translation, metres, and a rotation vector, radians.
pub(super) const NUMBERS_PER_CAMERA: usize = 6;

/// Standard deviations of the prior. A camera that is 4 m away and turned by half a degree sees the scene 35 mm off.
const TRANSLATION_DEVIATION_M: f64 = 0.05;
const ROTATION_DEVIATION_RAD: f64 = 0.015;

/// The corrections of all cameras. A camera's correction moves the scene that it sees about a point in the scene, so
/// that translation and rotation are nearly independent. Moving, turning or scaling all cameras alike does the same to
/// the world, which no outline shows: [`Self::common_motion`] is what must stay 0.
#[derive(Debug)]
pub(super) struct CameraModel {
    /// The centres of the cameras as given, world, metres; `None` for those that see nothing, which keep their pose.
    centres: Vec<Option<Point3<f64>>>,
    /// The point about which the scene is turned.
    pub(super) about: Point3<f64>,
}

impl CameraModel {
    /// The cameras of a rig, and which of them see something.
    pub(super) fn new(rig: &CameraRig, sees: &[bool], about: Point3<f64>) -> Self {
        let centres = rig.cameras.iter().zip(sees).map(|(camera, sees)| sees.then(|| camera.centre())).collect();
        Self { centres, about }
    }

    pub(super) fn numbers(&self) -> usize {
        self.centres.len() * NUMBERS_PER_CAMERA
    }

    /// The similarity from the given cameras to the corrected ones, as seven numbers that are 0 if it is the identity:
    /// how far the mean of their centres moved, metres; their mean rotation, as twice the antisymmetric part of the
    /// mean rotation matrix, which vanishes if the rotation nearest to that mean is none; and by
    /// how much the mean square of the centres' distances from their mean grew, relative to what it was.
    pub(super) fn common_motion(&self, values: &[f64]) -> [f64; 7] {
        let (mut centres, mut turn) = ([Vec::new(), Vec::new()], Vector3::zeros());
        for (centre, values) in self.centres.iter().zip(values.chunks_exact(NUMBERS_PER_CAMERA)) {
            let Some(centre) = centre else { continue };
            let motion = self.correction("", values).motion();
            let matrix = motion.rotation.to_rotation_matrix();
            turn += Vector3::from_fn(|axis, _| {
                let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
                matrix[(last, next)] - matrix[(next, last)]
            });
            centres[0].push(centre.coords);
            centres[1].push(motion.inverse_transform_point(centre).coords);
        }
        let count = centres[0].len() as f64;
        let means = [0, 1].map(|of| centres[of].iter().sum::<Vector3<f64>>() / count);
        let spreads = [0, 1].map(|of| centres[of].iter().map(|c| (c - means[of]).norm_squared()).sum::<f64>());
        let (shift, turn) = (means[1] - means[0], turn / count);
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, spreads[1] / spreads[0] - 1.0]
    }

    pub(super) fn deviation(number: usize) -> f64 {
        if number % NUMBERS_PER_CAMERA < 3 { TRANSLATION_DEVIATION_M } else { ROTATION_DEVIATION_RAD }
    }

    /// The corrections of the cameras with these names, from the parameters of all cameras.
    pub(super) fn corrections<'a>(
        &'a self,
        names: impl Iterator<Item = &'a str> + 'a,
        values: &'a [f64],
    ) -> impl Iterator<Item = CameraCorrection> + 'a {
        names.zip(values.chunks_exact(NUMBERS_PER_CAMERA)).map(|(name, values)| self.correction(name, values))
    }

    fn correction(&self, name: &str, values: &[f64]) -> CameraCorrection {
        CameraCorrection {
            camera: name.to_owned(),
            about_m: self.about.coords.into(),
            moved_m: [values[0], values[1], values[2]],
            turned_rad: [values[3], values[4], values[5]],
        }
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

    pub(super) fn moved_mm(&self) -> f64 {
        1000.0 * Vector3::from(self.moved_m).norm()
    }

    pub(super) fn turned_deg(&self) -> f64 {
        Vector3::from(self.turned_rad).norm().to_degrees()
    }
}
