//! The built-in skins: MakeHuman's base mesh and targets (CC0 1.0), `robots/skins/`.

use super::mesh::{SkinError, SkinMesh};
use super::skin_file;
use crate::input::excerpt;

struct SkinFiles {
    settings: &'static str,
    mesh: &'static str,
    weights: &'static str,
}

const PERSON: SkinFiles = SkinFiles {
    settings: skiagraph_robots::PERSON_TOML,
    mesh: skiagraph_robots::PERSON_OBJ,
    weights: skiagraph_robots::PERSON_WEIGHTS,
};

const PERSON_COARSE: SkinFiles = SkinFiles {
    settings: skiagraph_robots::PERSON_COARSE_TOML,
    mesh: skiagraph_robots::PERSON_COARSE_OBJ,
    weights: skiagraph_robots::PERSON_COARSE_WEIGHTS,
};

const WOMAN: SkinFiles = SkinFiles {
    settings: skiagraph_robots::WOMAN_TOML,
    mesh: skiagraph_robots::WOMAN_OBJ,
    weights: skiagraph_robots::WOMAN_WEIGHTS,
};

const MAN: SkinFiles = SkinFiles {
    settings: skiagraph_robots::MAN_TOML,
    mesh: skiagraph_robots::MAN_OBJ,
    weights: skiagraph_robots::MAN_WEIGHTS,
};

/// Names of the built-in skins: sexless ones of 5,000 triangles for actors and 1,000 for trackers; a woman and a man
/// of 3,000.
pub const SHIPPED_SKINS: [&str; 4] = ["person", "person_coarse", "woman", "man"];

/// The built-in skin with this name.
///
/// # Errors
/// [`SkinError::Unsuited`] for a name that is not in [`SHIPPED_SKINS`].
pub fn shipped_skin(name: &str) -> Result<SkinMesh, SkinError> {
    let files = match name {
        "person" => PERSON,
        "person_coarse" => PERSON_COARSE,
        "woman" => WOMAN,
        "man" => MAN,
        _ => {
            let (name, known) = (excerpt(name), SHIPPED_SKINS.join(", "));
            return Err(SkinError::Unsuited(format!("`{name}` is neither a built-in skin ({known}) nor a file")));
        }
    };
    let read = |wanted: &str, _: u64| -> Result<Vec<u8>, SkinError> {
        Ok(if wanted.ends_with(".obj") { files.mesh.into() } else { files.weights.into() })
    };
    skin_file::parse(&format!("robots/skins/{name}.toml"), files.settings, &read)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::LANDMARKS;

    #[test]
    fn built_in_skins_are_valid_and_of_the_documented_size() {
        for (name, triangles) in SHIPPED_SKINS.into_iter().zip([5000, 1000]) {
            let mesh = shipped_skin(name).unwrap();
            assert_eq!((mesh.name.as_str(), mesh.triangles.len()), (name, triangles));
            let tall = mesh.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
            assert!((1.6..1.75).contains(&tall), "{tall}");
            assert!(LANDMARKS.iter().all(|landmark| mesh.landmarks.contains_key(landmark.name())));
        }
        assert!(shipped_skin("dog").unwrap_err().to_string().contains("person, person_coarse"));
    }
}
