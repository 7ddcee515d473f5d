//! Size limits of all kinds of files, bytes. `scenarios/README.md` lists them with all other limits.

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;

/// A recording: BVH, AMC, DeepMimic. Five hours of 20 joints at 60 Hz.
pub const RECORDING: u64 = 512 * MIB;
/// An Acclaim skeleton (`.asf`).
pub const SKELETON: u64 = MIB;
/// A robot description.
pub const ROBOT: u64 = 16 * MIB;
/// One mesh of a robot.
pub const MESH: u64 = 256 * MIB;
/// A scenario, and a set's `set.toml`.
pub const SETTINGS: u64 = MIB;
/// A file of cameras, with the images and points of COLMAP.
pub const CAMERAS: u64 = 64 * MIB;
/// `.npz` files, including models.
pub const ARRAYS: u64 = 2 * GIB;
/// A JSON file, such as a body with its meshes.
pub const JSON: u64 = GIB;
/// A JSON file with the settings of a run.
pub const RECORD: u64 = 16 * MIB;
/// A silhouette.
pub const PICTURE: u64 = 256 * MIB;
/// A depth image of a set.
pub const LAYER: u64 = 2 * GIB;
/// The list of a set's files.
pub const LISTING: u64 = 512 * MIB;

/// Formats a size in its largest whole unit: `512 MiB`.
pub fn describe_size(bytes: u64) -> String {
    match bytes {
        b if b >= GIB && b % GIB == 0 => format!("{} GiB", b / GIB),
        b if b >= MIB => format!("{} MiB", b / MIB),
        b if b >= KIB => format!("{} KiB", b / KIB),
        b => format!("{b} bytes"),
    }
}
