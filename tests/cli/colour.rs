//! Colour images as truth, independent of the source of silhouettes.

use skiagraph_set::{BlindSet, layer_channels};

use crate::sandbox::Sandbox;

/// Even without segmentation.
#[test]
fn colour_images_follow_their_settings() {
    let room = Sandbox::tiny();
    let image = |set: &str| room.read(&format!("{set}/truth/layers/cam01/000002-colour.exr"));
    let render = |set: &str, more: &str| {
        room.succeed(&format!("render tiny.toml truth_images=[\"colour\"] {more} --key default --out {set} -q"));
        room.says(&format!("verify {set}"), &["no fault"]);
    };
    render("usual", "");
    assert_eq!(layer_channels(&room.path("usual")).unwrap(), ["B", "G", "R"]);
    for (set, more) in [
        ("seeded", "observation.seed=7"),
        ("contrast", "observation.images.clothing_contrast=110"),
        ("shadeless", "observation.images.shadow=false"),
        (
            "corrupted",
            "observation.silhouette=corrupted observation.corruption.holes=0.1 observation.images.shadow=false",
        ),
    ] {
        render(set, more);
        assert_ne!(image(set), image("usual"), "{more} changes nothing");
    }
    assert_eq!(image("corrupted"), image("shadeless"), "silhouettes are none of its business");
    render("grey", "observation.images.grey=true");
    assert_eq!(layer_channels(&room.path("grey")).unwrap(), ["Y"]);
    // layers do not change the hash of a set
    room.succeed("render tiny.toml observation.images.grey=true --key default --out without -q");
    let hash = |set: &str| BlindSet::read(&room.path(set)).unwrap().set_hash;
    assert_eq!(hash("grey"), hash("without"));
}
