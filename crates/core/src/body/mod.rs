//! The humanoid: links, joints and geometry from URDF, its pose, kinematics and silhouette.
//!
//! A [`Humanoid`] is a tree of links, parents before children. A [`Pose`] is the root's frame and one number per
//! degree of freedom; [`Humanoid::link_frames`] gives the frame of every link.
//!
//! ```
//! use skiagraph_core::body::shipped;
//! let body = shipped("tracker25")?;
//! let mut pose = body.zero_pose();
//! let elbow = body.find_degree_of_freedom("left_elbow_flexion").ok_or("no such joint")?;
//! pose.joint_angles[elbow] = 0.5;
//! let frames = body.link_frames(&pose);
//! let forearm = frames[body.find_link("left_forearm").ok_or("no such link")?].translation;
//! assert!(forearm.y > 0.0, "left is +Y of a body that faces +X");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bodily_links;
mod bounding_ball;
mod bounds;
mod calibrated;
mod drawn;
mod from_joints;
#[doc(hidden)]
pub mod human_tree;
mod humanoid;
#[doc(hidden)]
pub mod inverse_kinematics;
mod jacobian;
mod keypoint;
mod kinematics;
mod landmark;
mod limits;
mod lowest;
mod marker_positions;
mod mass;
mod mismatch;
mod motion;
mod population;
mod pose;
mod proposal;
mod ray;
mod region;
mod shape;
mod shipped;
mod silhouette;
mod skin;
mod solid;
mod surface;
mod tangent;
mod upright;
mod urdf;

pub use bounding_ball::BoundingBall;
pub use humanoid::{DegreeOfFreedom, Humanoid, Joint, JointKind, Link};
pub use keypoint::{Keypoint, KeypointLayout};
pub use kinematics::LinkFrames;
pub use landmark::{LANDMARKS, Landmark, MarkerCovariances, Markers};
pub use pose::{Motion, Pose};
pub use proposal::{Prediction, ProposalScales};
pub use shape::BodyShape;
pub use shipped::{SHIPPED_ROBOTS, shipped};
pub use silhouette::draw_silhouette;
pub use solid::{Prop, Solid};
pub use urdf::UrdfError;

// Parts of bodies, for the other crates, their tests and the studies: how bodies are read and drawn may change.
#[doc(hidden)]
pub use self::{
    calibrated::Calibrated,
    drawn::{DrawnShares, LEAST_DRAWN_HEIGHT, LEAST_DRAWN_LINKS, LEAST_DRAWN_REACH},
    humanoid::{Drive, Inertia},
    keypoint::{KeypointPlace, PairedLimb},
    kinematics::{rotation_about, rotation_from_vector},
    landmark::LinkPoint,
    mismatch::without_side,
    population::{Person, Sex, VARIED_GIRTHS, VARIED_LENGTHS, girth_segment},
    proposal::TooFewFrames,
    ray::Ray,
    region::{BODY_REGIONS, BodyRegion},
    shape::LinkShape,
    silhouette::{DepthImage, SilhouettePainter, SkinPoint, SurfacePixel, capsules_in_camera},
    skin::{
        Blending, FBX_TO_GLB, GltfMotion, MotionChoice, SHIPPED_SKINS, Skin, SkinError, SkinMesh, SkinParts,
        gltf_contents, gltf_motion, read_skin, shipped_skin, skin_from_gltf,
    },
    tangent::{ROOT_STEP, rotation_vector},
    upright::from_axes,
    urdf::{MeshParts, mesh_from_bytes},
};
