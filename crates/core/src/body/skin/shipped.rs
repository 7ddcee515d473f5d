//! The built-in skins: MakeHuman's base mesh and targets (CC0 1.0), `robots/skins/`.

use skiagraph_robots as robots;

use super::mesh::{SkinError, SkinMesh};
use super::skin_file;
use crate::input::excerpt;

/// Names of the built-in skins: sexless ones of 5,000 triangles for actors and 1,000 for trackers; a woman and a man
/// of 3,000.
pub const SHIPPED_SKINS: [&str; 4] = ["person", "person_coarse", "woman", "man"];

/// The built-in skin with this name.
pub fn shipped_skin(name: &str) -> Result<SkinMesh, SkinError> {
    let (settings, mesh, weights) = match name {
        "person" => (robots::PERSON_TOML, robots::PERSON_OBJ, robots::PERSON_WEIGHTS),
        "person_coarse" => (robots::PERSON_COARSE_TOML, robots::PERSON_COARSE_OBJ, robots::PERSON_COARSE_WEIGHTS),
        "woman" => (robots::WOMAN_TOML, robots::WOMAN_OBJ, robots::WOMAN_WEIGHTS),
        "man" => (robots::MAN_TOML, robots::MAN_OBJ, robots::MAN_WEIGHTS),
        _ => {
            let (name, known) = (excerpt(name), SHIPPED_SKINS.join(", "));
            return Err(SkinError::Unsuited(format!("`{name}` is neither a built-in skin ({known}) nor a file")));
        }
    };
    let read = |wanted: &str, _: u64| -> Result<Vec<u8>, SkinError> {
        Ok(if wanted.ends_with(".obj") { mesh.into() } else { weights.into() })
    };
    skin_file::parse(&format!("robots/skins/{name}.toml"), settings, &read)
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
