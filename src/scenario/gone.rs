//! Keys and values of earlier versions: each is refused with what to use instead.

struct GoneKey {
    place: &'static str,
    word: &'static str,
    instead: &'static str,
}

const GONE: [GoneKey; 3] = [
    GoneKey {
        place: "actor.shape",
        word: "age_years",
        instead: "populations are of adults; stature_m and mass_kg remain",
    },
    GoneKey { place: "actor.shape", word: "children", instead: "populations are \"adults\", \"women\" and \"men\"" },
    GoneKey {
        place: "layers",
        word: "layers",
        instead: "images of the truth are `truth_images`; annealing layers are `layers` of the tracker",
    },
];

/// The message about a word at a key that is unknown, if an earlier version knew it.
pub(super) fn message(key: &str, word: &str) -> Option<String> {
    let gone = GONE.iter().find(|gone| gone.word == word && key.starts_with(gone.place))?;
    Some(format!("`{word}` is gone; {}", gone.instead))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::ScenarioFile;

    #[test]
    fn keys_that_are_gone_are_refused() {
        let of_truth = "schema = \"skiagraph.scenario/1\"\nname = \"a\"\nlayers = [\"depth\"]\n[motion]\nclip = \"embedded:walk\"\n";
        let error = ScenarioFile::parse(of_truth, "a.toml", "".into(), &[]).unwrap_err().to_string();
        assert!(
            error.starts_with("a.toml:3: layers: `layers` is gone; images of the truth are `truth_images`"),
            "{error}"
        );
        for (shape, expected) in [("age_years = 9.0", &GONE[0]), ("population = \"children\"", &GONE[1])] {
            let text = format!(
                "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"embedded:walk\"\n[actor]\nshape = {{ {shape} }}\n"
            );
            let error = ScenarioFile::parse(&text, "a.toml", "".into(), &[]).unwrap_err().to_string();
            assert!(error.starts_with("a.toml:6: actor.shape"), "{error}");
            assert!(error.contains(&format!("`{}` is gone; {}", expected.word, expected.instead)), "{error}");
        }
    }
}
