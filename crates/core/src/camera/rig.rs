//! Several cameras that observe the same scene.

use nalgebra::{Point3, Vector3};

use super::{Camera, CameraError, DEFAULT_NEAR, FieldOfView};

/// Cameras that observe the same scene at the same times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraRig {
    /// In the order of an observation's silhouettes.
    pub cameras: Vec<Camera>,
}

/// Cameras on a horizontal circle, all looking at one point. Metres and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingParameters {
    /// Number of cameras, `1..=999`, evenly spaced.
    pub count: u32,
    /// Radius of the circle, > 0; its centre is directly above or below `look_at`.
    pub radius: f64,
    /// World z of the circle.
    pub height: f64,
    /// Point in the middle of every image, in the world.
    pub look_at: Point3<f64>,
    /// Direction from the circle's centre to the first camera, from the world's +X towards +Y.
    pub first_azimuth: f64,
    /// Horizontal field of view.
    pub field_of_view: f64,
    /// Width and height of every image, pixels.
    pub image_size: [u32; 2],
    /// Distance of the near plane.
    pub near: f64,
}

/// Four cameras that see a standing body, almost those of a scenario without a rig.
impl Default for RingParameters {
    fn default() -> Self {
        Self {
            count: 4,
            radius: 4.5,
            height: 1.6,
            look_at: Point3::new(0.0, 0.0, 0.95),
            first_azimuth: 0.8,
            field_of_view: 1.05,
            image_size: [640, 480],
            near: DEFAULT_NEAR,
        }
    }
}

/// Greatest number of pixels of all images of a rig together: 64 cameras of 1920 x 1080, four of 8192 x 4320.
const MOST_PIXELS: u64 = 150_000_000;
const MOST_CAMERAS: usize = 999;

impl CameraRig {
    /// Refuses more or larger images than fit in memory.
    ///
    /// # Errors
    /// [`CameraError::Refused`] for more than 999 cameras or 150 million pixels.
    pub fn check_size(&self) -> Result<(), CameraError> {
        let pixels = |camera: &Camera| u64::from(camera.pinhole.width) * u64::from(camera.pinhole.height);
        let cameras = self.cameras.len();
        let pixels: u64 = self.cameras.iter().map(pixels).sum();
        if cameras <= MOST_CAMERAS && pixels <= MOST_PIXELS {
            return Ok(());
        }
        Err(CameraError::Refused(format!(
            "the rig has {cameras} cameras with {pixels} pixels; expected at most {MOST_CAMERAS} cameras and \
             {MOST_PIXELS} pixels in total"
        )))
    }

    /// The cameras of a ring, named `cam00`, `cam01` ..., in order of azimuth.
    ///
    /// # Errors
    /// [`CameraError`] for a count outside `1..=999` and for cameras refused by [`Camera::look_at`].
    pub fn ring(ring: &RingParameters) -> Result<Self, CameraError> {
        Self::turned(ring, |index| f64::from(index) / f64::from(ring.count) * std::f64::consts::TAU)
    }

    /// The cameras of a ring, restricted to an arc: spread evenly over `arc` radians, with the first and last camera
    /// at its ends.
    ///
    /// # Errors
    /// As [`Self::ring`].
    pub fn arc(ring: &RingParameters, arc: f64) -> Result<Self, CameraError> {
        let gaps = f64::from(ring.count.saturating_sub(1).max(1));
        Self::turned(ring, |index| f64::from(index) / gaps * arc)
    }

    /// Cameras at these angles from the first camera's azimuth.
    fn turned(ring: &RingParameters, turn: impl Fn(u32) -> f64) -> Result<Self, CameraError> {
        if !(1..=999).contains(&ring.count) {
            let problem = format!("a ring of {} cameras is not possible; expected 1 to 999 cameras", ring.count);
            return Err(CameraError::Refused(problem));
        }
        let [width, height] = ring.image_size;
        let camera = |index| {
            let turn = turn(index);
            let (sin, cos) = libm::sincos(ring.first_azimuth + turn);
            let centre = ring.look_at;
            let eye = Point3::new(centre.x + ring.radius * cos, centre.y + ring.radius * sin, ring.height);
            let view = FieldOfView::Horizontal(ring.field_of_view);
            let name = format!("cam{index:02}");
            let mut camera = Camera::look_at(&name, eye, centre, Vector3::z(), view, width, height)?;
            camera.pinhole.near = ring.near;
            camera.validate().map(|()| camera)
        };
        Ok(Self { cameras: (0..ring.count).map(camera).collect::<Result<_, _>>()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    const RING: RingParameters = RingParameters {
        count: 4,
        radius: 4.5,
        height: 1.5,
        look_at: Point3::new(0.5, -0.5, 1.0),
        first_azimuth: 0.3,
        field_of_view: 0.8,
        image_size: [640, 480],
        near: 0.1,
    };

    #[test]
    fn cameras_of_an_arc_are_on_the_circle_from_one_end_to_the_other() {
        let azimuths = |rig: CameraRig| -> Vec<f64> {
            rig.cameras.iter().map(|c| c.centre() - RING.look_at).map(|p| p.y.atan2(p.x)).collect()
        };
        let found = azimuths(CameraRig::arc(&RING, 1.5).unwrap());
        assert!(found.iter().zip([0.3, 0.8, 1.3, 1.8]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        // three quarters of a turn over four cameras are the ring of four
        let whole = CameraRig::arc(&RING, 0.75 * std::f64::consts::TAU).unwrap();
        let ring = CameraRig::ring(&RING).unwrap();
        assert!(whole.cameras.iter().zip(&ring.cameras).all(|(a, b)| (a.centre() - b.centre()).norm() < 1e-12));
        let one = CameraRig::arc(&RingParameters { count: 1, ..RING }, 1.5).unwrap();
        assert!((azimuths(one)[0] - 0.3).abs() < 1e-12);
    }

    #[test]
    fn every_camera_of_a_ring_is_on_the_circle_and_looks_at_the_point() {
        let rig = CameraRig::ring(&RING).unwrap();
        let names: Vec<&str> = rig.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["cam00", "cam01", "cam02", "cam03"]);
        for camera in &rig.cameras {
            let offset = camera.centre() - RING.look_at;
            assert!((offset.xy().norm() - 4.5).abs() < 1e-12 && (offset.z - 0.5).abs() < 1e-12);
            let middle = camera.project(&RING.look_at).unwrap();
            assert!((middle - Point2::new(320.0, 240.0)).norm() < 1e-9);
            assert_eq!(camera.pinhole.near, 0.1);
        }
        let first = rig.cameras[0].centre() - RING.look_at;
        assert!((first.y.atan2(first.x) - 0.3).abs() < 1e-12);
        let second = rig.cameras[1].centre() - RING.look_at;
        assert!((second.y.atan2(second.x) - 0.3 - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn impossible_rings_are_refused() {
        let none = CameraRig::ring(&RingParameters { count: 0, ..RING }).unwrap_err().to_string();
        assert_eq!(none, "a ring of 0 cameras is not possible; expected 1 to 999 cameras");
        assert!(CameraRig::ring(&RingParameters { radius: 0.0, ..RING }).is_err());
        assert!(CameraRig::ring(&RingParameters { near: -1.0, ..RING }).is_err());
    }
}
