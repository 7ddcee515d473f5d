//! Recordings as their files say them: BVH, ASF/AMC and DeepMimic become one [`Clip`].
//!
//! Whatever the file's axes and units, a `Clip` is in metres, Z up, right-handed, radians as unit quaternions.

mod clip;

pub use clip::{Clip, Skeleton, SkeletonJoint};
