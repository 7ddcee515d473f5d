//! Bodies and skins as files: the URDF of every built-in humanoid, and the meshes that dress them.
//!
//! Nothing is read here. `skiagraph-core` has the readers: its `body::shipped` and `body::shipped_skin`.
//!
//! ```
//! assert!(skiagraph_robots::TRACKER25_URDF.contains("<robot name=\"tracker25\">"));
//! ```

/// The tracker's body: 10 segments, 25 degrees of freedom with the root.
pub const TRACKER25_URDF: &str = include_str!("tracker25.urdf");
/// The detailed body: spine, neck, clavicles, wrists, ankles and toes.
pub const ACTOR_URDF: &str = include_str!("actor.urdf");
/// A tracker's body with feet, hands and a bending trunk.
pub const TRACKER40_URDF: &str = include_str!("tracker40.urdf");

// The files of skins, for `skiagraph-core`, which reads them.
/// Settings of the skin of no sex, for actors.
#[doc(hidden)]
pub const PERSON_TOML: &str = include_str!("skins/person.toml");
/// Its mesh.
#[doc(hidden)]
pub const PERSON_OBJ: &str = include_str!("skins/person.obj");
/// Its weights.
#[doc(hidden)]
pub const PERSON_WEIGHTS: &str = include_str!("skins/person.weights.json");

/// Settings of the skin of no sex with fewer triangles, for trackers.
#[doc(hidden)]
pub const PERSON_COARSE_TOML: &str = include_str!("skins/person_coarse.toml");
/// Its mesh.
#[doc(hidden)]
pub const PERSON_COARSE_OBJ: &str = include_str!("skins/person_coarse.obj");
/// Its weights.
#[doc(hidden)]
pub const PERSON_COARSE_WEIGHTS: &str = include_str!("skins/person_coarse.weights.json");

/// Settings of a woman's skin.
#[doc(hidden)]
pub const WOMAN_TOML: &str = include_str!("skins/woman.toml");
/// Its mesh.
#[doc(hidden)]
pub const WOMAN_OBJ: &str = include_str!("skins/woman.obj");
/// Its weights.
#[doc(hidden)]
pub const WOMAN_WEIGHTS: &str = include_str!("skins/woman.weights.json");

/// Settings of a man's skin.
#[doc(hidden)]
pub const MAN_TOML: &str = include_str!("skins/man.toml");
/// Its mesh.
#[doc(hidden)]
pub const MAN_OBJ: &str = include_str!("skins/man.obj");
/// Its weights.
#[doc(hidden)]
pub const MAN_WEIGHTS: &str = include_str!("skins/man.weights.json");
