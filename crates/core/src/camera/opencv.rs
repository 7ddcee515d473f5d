//! Cameras in OpenCV's form: K, R, t and five distortion coefficients.
//!
//! OpenCV puts pixel (0, 0) at the *centre* of the top-left pixel, this crate at its outer corner: OpenCV's `cx` and
//! `cy` are half a pixel smaller.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

use super::error::{about, all_within};
use super::{Camera, CameraError, DEFAULT_NEAR, Distortion, Pinhole};

/// Greatest deviation of `R^T R` from the identity: numbers of three digits give up to sqrt(3) 1e-3.
const ROTATION_TOLERANCE: f64 = 2e-3;
/// Deviation of `R^T R` from the identity that only the arithmetic of 64 bits explains.
const ROUNDING: f64 = 1e-12;

impl Camera {
    /// A camera from OpenCV's K (pixels), R and t (camera from world, metres) and `k1 k2 p1 p2 k3`. The nearest
    /// rotation is taken for an R with few digits; the near plane is [`DEFAULT_NEAR`].
    ///
    /// # Errors
    /// [`CameraError`] for a K of another form (including skew), an R that is not a rotation within 2e-3, and numbers
    /// out of the range of [`Self::validate`].
    pub fn from_opencv(
        name: &str,
        k: [[f64; 3]; 3],
        r: [[f64; 3]; 3],
        t: [f64; 3],
        distortion: [f64; 5],
        width: u32,
        height: u32,
    ) -> Result<Self, CameraError> {
        all_within(f64::MAX, name, "K", k.as_flattened())?;
        all_within(f64::MAX, name, "R", r.as_flattened())?;
        let [[fx, skew, cx], [zero, fy, cy], bottom] = k;
        if skew != 0.0 || zero != 0.0 || bottom != [0.0, 0.0, 1.0] {
            let problem = format!("K is {k:?}; expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] without skew");
            return Err(CameraError::Matrix(about(name, problem)));
        }
        let principal_point = [cx + 0.5, cy + 0.5];
        let camera = Self {
            name: name.into(),
            pinhole: Pinhole { focal: [fx, fy], principal_point, width, height, near: DEFAULT_NEAR },
            distortion: Distortion::from_coefficients(distortion),
            camera_from_world: Isometry3::from_parts(Translation3::from(t), rotation(name, r)?),
        };
        camera.validate().map(|()| camera)
    }

    /// OpenCV's camera matrix K, pixels.
    pub fn opencv_matrix(&self) -> [[f64; 3]; 3] {
        let ([fx, fy], [cx, cy]) = (self.pinhole.focal, self.pinhole.principal_point);
        [[fx, 0.0, cx - 0.5], [0.0, fy, cy - 0.5], [0.0, 0.0, 1.0]]
    }

    /// OpenCV's R: rows are the camera's axes in the world.
    pub fn opencv_rotation(&self) -> [[f64; 3]; 3] {
        self.camera_from_world.rotation.to_rotation_matrix().matrix().transpose().into()
    }

    /// OpenCV's t: the world's origin in the camera frame, metres.
    pub fn opencv_translation(&self) -> [f64; 3] {
        self.camera_from_world.translation.vector.into()
    }
}

fn rotation(camera: &str, rows: [[f64; 3]; 3]) -> Result<UnitQuaternion<f64>, CameraError> {
    let mut matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    let off = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    let error = if matrix.determinant() > 0.0 { off } else { off.max(2.0) };
    if error > ROTATION_TOLERANCE {
        let rule = format!("orthonormal within {ROTATION_TOLERANCE}, determinant +1");
        let problem = format!("R is not a rotation ({rule}); it is off by {error:.2e}");
        return Err(CameraError::Rotation(about(camera, problem)));
    }
    if error > ROUNDING {
        // Newton's iteration for the orthogonal factor of the polar decomposition squares the deviation at every step
        for _ in 0..3 {
            let inverse = matrix.try_inverse().unwrap_or_else(Matrix3::identity);
            matrix = 0.5 * (matrix + inverse.transpose());
        }
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: [[f64; 3]; 3] = [[600.0, 0.0, 319.5], [0.0, 610.0, 239.5], [0.0, 0.0, 1.0]];
    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn read(k: [[f64; 3]; 3], r: [[f64; 3]; 3], t: [f64; 3]) -> Result<Camera, CameraError> {
        Camera::from_opencv("c", k, r, t, [0.1, 0.02, 0.003, 0.004, 0.005], 640, 480)
    }

    #[test]
    fn values_of_opencv_are_read_and_returned_unchanged() {
        let r = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
        let camera = read(K, r, [0.1, 0.2, 3.0]).unwrap();
        for (row, expected) in camera.opencv_rotation().iter().zip(r) {
            for (entry, expected) in row.iter().zip(expected) {
                assert!((entry - expected).abs() < 1e-15);
            }
        }
        assert_eq!(camera.opencv_matrix(), K);
        assert_eq!(camera.opencv_translation(), [0.1, 0.2, 3.0]);
        assert_eq!(camera.distortion.coefficients(), [0.1, 0.02, 0.003, 0.004, 0.005]);
    }

    // "cameras.json: camera left: ... is not a rigid transform": the quaternion of a rounded R had not the length 1
    #[test]
    fn rotations_of_few_digits_become_the_nearest_rotation() {
        let exact = UnitQuaternion::from_euler_angles(0.7, -0.4, 2.2).to_rotation_matrix();
        for digits in 3..=7 {
            let unit = 10_f64.powi(digits);
            let r = std::array::from_fn(|i| std::array::from_fn(|j| (exact[(i, j)] * unit).round() / unit));
            let quaternion = read(K, r, [0.0; 3]).unwrap().camera_from_world.rotation;
            assert!((quaternion.norm() - 1.0).abs() < 1e-15, "{digits} digits: {}", quaternion.norm());
            assert!(quaternion.to_rotation_matrix().angle_to(&exact) < 1.0 / unit);
            // nearest: what is left of R is symmetric in the rotation's axes
            let stretch = quaternion.to_rotation_matrix().matrix().transpose() * Matrix3::from_fn(|i, j| r[i][j]);
            assert!((stretch - stretch.transpose()).amax() < 1e-14, "{digits} digits: {stretch}");
        }
    }

    #[test]
    fn skew_reflections_shears_and_nan_are_refused() {
        let why = |result: Result<Camera, CameraError>| result.unwrap_err().to_string();
        let mut skewed = K;
        skewed[0][1] = 0.5;
        assert!(why(read(skewed, IDENTITY, [0.0; 3])).contains("skew"));
        let mut mirrored = IDENTITY;
        mirrored[2][2] = -1.0;
        assert!(why(read(K, mirrored, [0.0; 3])).contains("rotation"));
        let mut sheared = IDENTITY;
        sheared[0][1] = 0.01;
        assert!(why(read(K, sheared, [0.0; 3])).contains("rotation"));
        assert!(why(read(K, IDENTITY, [f64::NAN, 0.0, 0.0])).contains("finite"));
        let mut blind = K;
        blind[0][0] = 0.0;
        assert!(why(read(blind, IDENTITY, [0.0; 3])).contains("focal length"));
    }
}
