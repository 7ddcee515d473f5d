//! A camera defined by its position and target.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::error::all_within;
use super::{Camera, CameraError, DEFAULT_NEAR, Distortion, Pinhole};

/// The field of view from edge to edge of the image; radians, between 0 and pi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldOfView {
    /// From the left edge to the right.
    Horizontal(f64),
    /// From the upper edge to the lower.
    Vertical(f64),
}

impl FieldOfView {
    /// The focal length in pixels of an ideal lens with square pixels.
    fn focal_length(self, camera: &str, width: u32, height: u32) -> Result<f64, CameraError> {
        let (radians, pixels) = match self {
            Self::Horizontal(radians) => (radians, width),
            Self::Vertical(radians) => (radians, height),
        };
        if radians > 0.0 && radians < std::f64::consts::PI {
            Ok(0.5 * f64::from(pixels) / libm::tan(0.5 * radians))
        } else {
            let problem = format!("the field of view is {radians} rad; expected more than 0 and less than 3.14159");
            Err(CameraError::of(camera, problem))
        }
    }
}

impl Camera {
    /// An ideal camera at `eye` whose optical axis passes through `target` and whose image has `up` upwards. World
    /// metres; the principal point is the image centre, pixels are square, the near plane is [`DEFAULT_NEAR`].
    ///
    /// # Errors
    /// [`CameraError`] for a field of view outside (0, pi), an image size outside `1..=16384`, a target at the eye, or
    /// an up direction along the view.
    pub fn look_at(
        name: &str,
        eye: Point3<f64>,
        target: Point3<f64>,
        up: Vector3<f64>,
        field_of_view: FieldOfView,
        width: u32,
        height: u32,
    ) -> Result<Self, CameraError> {
        let camera_from_world = placement(name, eye, target, up)?;
        let focal = field_of_view.focal_length(name, width, height)?;
        let camera = Self {
            name: name.into(),
            pinhole: Pinhole {
                focal: [focal; 2],
                principal_point: [0.5 * f64::from(width), 0.5 * f64::from(height)],
                width,
                height,
                near: DEFAULT_NEAR,
            },
            distortion: Distortion::default(),
            camera_from_world,
        };
        camera.validate().map(|()| camera)
    }
}

/// World-to-camera transform of a camera at `eye` whose optical axis passes through `target` and whose image has `up`
/// upwards.
pub(super) fn placement(
    name: &str,
    eye: Point3<f64>,
    target: Point3<f64>,
    up: Vector3<f64>,
) -> Result<Isometry3<f64>, CameraError> {
    all_within(f64::MAX, name, "eye, target or up", &[eye.coords, target.coords, up].map(|v| v.sum()))?;
    let degenerate = |why: &str| CameraError::of(name, format!("cannot look at its target: {why}"));
    let forward = (target - eye).try_normalize(1e-9).ok_or_else(|| degenerate("the target is at the eye"))?;
    let right = forward.cross(&up).try_normalize(1e-9 * up.norm());
    let right = right.ok_or_else(|| degenerate("the up direction is zero or along the view"))?;
    let down = forward.cross(&right);
    let rows = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
    Ok(Isometry3::from_parts(Translation3::from(-(rotation * eye.coords)), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn look(eye: [f64; 3], target: [f64; 3], up: [f64; 3], view: FieldOfView) -> Result<Camera, CameraError> {
        Camera::look_at("c", eye.into(), target.into(), up.into(), view, 640, 480)
    }

    #[test]
    fn the_target_is_in_the_middle_and_up_and_left_are_not_mirrored() {
        let camera = look([5.0, 1.0, 2.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], FieldOfView::Horizontal(1.0)).unwrap();
        let middle = camera.project(&Point3::new(0.0, 0.0, 1.0)).unwrap();
        assert!((middle - Point2::new(320.0, 240.0)).norm() < 1e-9);
        assert!(camera.project(&Point3::new(0.0, 0.0, 1.5)).unwrap().y < 239.0);
        // Seen from +x the world's +y lies to the right.
        assert!(camera.project(&Point3::new(0.0, 0.5, 1.0)).unwrap().x > 321.0);
        assert!((camera.centre() - Point3::new(5.0, 1.0, 2.0)).norm() < 1e-12);
    }

    #[test]
    fn the_field_of_view_reaches_from_edge_to_edge() {
        let half: f64 = 0.4;
        let wide = look([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], FieldOfView::Horizontal(2.0 * half)).unwrap();
        let edge = wide.project(&Point3::new(1.0, -half.tan(), 0.0)).unwrap();
        assert!((edge - Point2::new(640.0, 240.0)).norm() < 1e-9);
        let tall = look([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], FieldOfView::Vertical(2.0 * half)).unwrap();
        let edge = tall.project(&Point3::new(1.0, 0.0, half.tan())).unwrap();
        assert!((edge - Point2::new(320.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn impossible_views_are_refused() {
        let view = FieldOfView::Horizontal(1.0);
        let why = |result: Result<Camera, CameraError>| result.unwrap_err().to_string();
        assert!(why(look([1.0; 3], [1.0; 3], [0.0, 0.0, 1.0], view)).contains("at the eye"));
        assert!(why(look([0.0; 3], [0.0, 0.0, 2.0], [0.0, 0.0, 1.0], view)).contains("along the view"));
        assert!(why(look([0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], view)).contains("zero"));
        assert!(why(look([f64::NAN; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], view)).contains("finite"));
        let flat = FieldOfView::Vertical(std::f64::consts::PI);
        assert!(why(look([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], flat)).contains("field of view"));
    }
}
