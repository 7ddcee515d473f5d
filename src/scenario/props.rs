//! `[[prop]]`: fixed solids in the scene.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use skiagraph_core::body::{Prop, Solid};
use skiagraph_core::raster::TaperedCapsule;

/// A fixed solid in the world: it belongs to the background and hides what is behind it. Contacts with it are in the
/// ground truth. A simulated body collides with it; `contact = "fix"` considers only the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PropSettings {
    /// Unique name.
    pub name: String,
    /// Its shape, such as `{ box = { size_m = [0.4, 0.4, 0.2] } }`. Lengths are in metres.
    pub shape: PropShape,
    /// Its centre, world, metres.
    pub place_m: [f64; 3],
    /// Rotation about the world's X, then Y, then Z axis, degrees. Default: none; cylinders and capsules are upright.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
}

/// The shape of a prop; lengths are in metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PropShape {
    /// A box.
    Box {
        /// Its edges along X, Y and Z.
        size_m: [f64; 3],
    },
    /// A sphere.
    Sphere {
        /// Its radius.
        radius_m: f64,
    },
    /// A cylinder.
    Cylinder {
        /// Its radius.
        radius_m: f64,
        /// Length from end to end.
        length_m: f64,
    },
    /// A cylinder with spherical ends.
    Capsule {
        /// Its radius.
        radius_m: f64,
        /// Distance between the centres of the end spheres.
        length_m: f64,
    },
}

impl PropShape {
    pub(super) fn lengths(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Box { size_m: [x, y, z] } => vec![("box.size_m", x), ("box.size_m", y), ("box.size_m", z)],
            Self::Sphere { radius_m } => vec![("sphere.radius_m", radius_m)],
            Self::Cylinder { radius_m, length_m } => {
                vec![("cylinder.radius_m", radius_m), ("cylinder.length_m", length_m)]
            }
            Self::Capsule { radius_m, length_m } => {
                vec![("capsule.radius_m", radius_m), ("capsule.length_m", length_m)]
            }
        }
    }
}

impl PropSettings {
    pub(crate) fn prop(&self) -> Prop {
        let [roll, pitch, yaw] = self.rotation_deg.map(f64::to_radians);
        let turn = |axis: Vector3<f64>, angle: f64| {
            let (sin, cos) = libm::sincos(0.5 * angle);
            UnitQuaternion::new_normalize(nalgebra::Quaternion::from_parts(cos, axis * sin))
        };
        let rotation = turn(Vector3::z(), yaw) * turn(Vector3::y(), pitch) * turn(Vector3::x(), roll);
        let place = Isometry3::from_parts(Translation3::from(self.place_m), rotation);
        let capsule = |radius: f64, length: f64| {
            let end = |side: f64| place * Point3::new(0.0, 0.0, side * 0.5 * length);
            Solid::TaperedCapsule(TaperedCapsule { a: end(-1.0), b: end(1.0), radius_a: radius, radius_b: radius })
        };
        let solid = match self.shape {
            PropShape::Box { size_m } => {
                Solid::Box { link_from_box: place, half_extents: size_m.map(|size| 0.5 * size) }
            }
            PropShape::Sphere { radius_m } => capsule(radius_m, 0.0),
            PropShape::Cylinder { radius_m, length_m } => {
                Solid::Cylinder { link_from_cylinder: place, radius: radius_m, half_length: 0.5 * length_m }
            }
            PropShape::Capsule { radius_m, length_m } => capsule(radius_m, length_m),
        };
        Prop { name: self.name.clone(), solid }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn props_have_the_place_and_orientation_of_their_settings() {
        let text = "name = \"pole\"\nshape = { capsule = { radius_m = 0.1, length_m = 2.0 } }\nplace_m = [1.0, 2.0, 0.5]\n\
                    rotation_deg = [0.0, 90.0, 90.0]\n";
        let settings: PropSettings = toml::from_str(text).unwrap();
        let Solid::TaperedCapsule(pole) = settings.prop().solid else { panic!() };
        // upright, laid along X, then turned to Y
        assert!((pole.b - Point3::new(1.0, 3.0, 0.5)).norm() < 1e-12, "{pole:?}");
        assert!((pole.a - Point3::new(1.0, 1.0, 0.5)).norm() < 1e-12, "{pole:?}");
        let boxed = PropSettings { shape: PropShape::Box { size_m: [1.0, 2.0, 4.0] }, ..settings };
        let Solid::Box { half_extents, .. } = boxed.prop().solid else { panic!() };
        assert_eq!(half_extents, [0.5, 1.0, 2.0]);
    }
}
