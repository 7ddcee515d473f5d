//! `inspect SET --out set.html`.

use serde_json::Value;

use super::browser::browse;
use super::filming::{MOVING, scenario as filmed};
use crate::sandbox::{Sandbox, TINY};

/// The JSON of a script element.
fn data_of(page: &str, id: &str) -> Value {
    let start = page.find(&format!("id=\"{id}\">")).unwrap_or_else(|| panic!("no {id}"));
    let text = &page[start..];
    let text = &text[text.find('>').unwrap() + 1..text.find("</script>").unwrap()];
    serde_json::from_str(text).unwrap()
}

fn page(room: &Sandbox, name: &str) -> String {
    String::from_utf8(room.read(name)).unwrap()
}

#[test]
fn the_page_of_a_set_has_frames_layers_and_the_rig_from_above() {
    let room = Sandbox::new();
    let prop = "[[prop]]\nname = \"pillar\"\nshape = { cylinder = { radius_m = 0.1, length_m = 2.0 } }\nplace_m = [1.5, 1.5, 1.0]\n";
    let scenario = TINY.replace("last_frame = 3", "last_frame = 9");
    room.write(
        "tiny.toml",
        format!("layers = [\"depth\", \"parts\", \"normals\", \"flow\", \"coverage\"]\n{scenario}{prop}"),
    );
    room.succeed("render tiny.toml --out set");
    let facts = room.succeed("inspect set").stdout;
    let said = room.succeed("inspect set --out set.html").stdout;
    assert!(said.starts_with(facts.trim_end()) && said.contains("pictures: set.html"), "{said}");
    let html = page(&room, "set.html");
    let playback = data_of(&html, "playback-data");
    let frames = playback["frames"].as_u64().unwrap() as usize;
    assert!(frames > 3 && playback["scored"] == Value::Bool(false), "{}", playback["frames"]);
    assert_eq!(playback["cameras"].as_array().unwrap().len(), 2);
    let layers = data_of(&html, "layers-data");
    let pictures = layers["pictures"].as_array().unwrap();
    assert_eq!(pictures.len(), frames);
    assert!(pictures.iter().all(|frame| frame[1].as_array().unwrap().len() == 5), "five layers in every camera");
    for name in ["depth", "parts", "normals", "flow", "coverage"] {
        assert!(html.contains(&format!(">{name}</option>")), "{name}");
    }
    let map = data_of(&html, "map-data");
    assert_eq!(map["roots"].as_array().unwrap().len(), frames);
    for mark in ["class=\"field\"", "class=\"prop\"", "class=\"walked\"", "data-camera=\"1\"", "set hash"] {
        assert!(html.contains(mark), "{mark}");
    }
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http:") && !outside.contains("https:"), "no network");
    let refused = room.skiagraph(["inspect", "set", "--out", "set.png"]);
    assert!(refused.code == 2 && refused.stderr.contains(".html"), "{}", refused.stderr);
    let refused = room.skiagraph(["inspect", "set", "--out", "set/inside.html"]);
    assert_eq!(refused.code, 2, "never into the set: {}", refused.stderr);
    let Some(pages) = browse(&room, &["set.html"]) else { return };
    assert_eq!(pages[0]["wrong"], serde_json::json!([]), "{}", pages[0]);
    for size in ["playback_broad", "playback_phone"] {
        assert_eq!((&pages[0][size]["frames"], &pages[0][size]["layers"]), (&frames.into(), &5.into()), "{}", pages[0]);
    }
}

#[test]
fn a_set_in_shards_has_the_same_page_as_one_in_single_files() {
    let room = Sandbox::new();
    room.write("tiny.toml", format!("layers = [\"depth\"]\n{TINY}"));
    room.succeed("render tiny.toml --out loose");
    room.succeed("render tiny.toml --shards 2 --out packed");
    room.succeed("inspect loose --out loose.html");
    room.succeed("inspect packed --out packed.html");
    for id in ["playback-data", "layers-data", "map-data"] {
        assert_eq!(data_of(&page(&room, "loose.html"), id), data_of(&page(&room, "packed.html"), id), "{id}");
    }
}

#[test]
fn moving_cameras_are_drawn_at_their_position_in_every_frame() {
    let room = Sandbox::new();
    room.write("film.toml", format!("layers = [\"depth\"]\n{}", filmed(MOVING)));
    room.succeed("render film.toml --out public --truth kept");
    for set in ["public", "kept"] {
        room.succeed(&format!("inspect {set} --out {set}.html"));
        let html = page(&room, &format!("{set}.html"));
        let map = data_of(&html, "map-data");
        let fields = map["fields"].as_array().unwrap();
        assert!(fields.len() > 3 && fields[0][0] != fields[3][0], "one camera moves: {map}");
        assert!(html.contains("Moving cameras are drawn at their position"));
        // a camera with every second frame has no layers in between
        if set == "kept" {
            let pictures = data_of(&html, "layers-data")["pictures"].clone();
            assert!(pictures[0][0][0].is_object() && pictures[1][1][0].is_null(), "{}", pictures[1]);
        }
    }
}

#[test]
fn a_public_set_has_a_page_without_skeleton_path_and_layers() {
    let room = Sandbox::new();
    room.write("tiny.toml", format!("layers = [\"depth\"]\n{TINY}"));
    room.succeed("render tiny.toml --out public --truth kept");
    room.succeed("inspect public --out public.html");
    let html = page(&room, "public.html");
    assert!(
        html.contains("This set has no ground truth")
            && !html.contains("id=\"layers-data\"")
            && !html.contains("class=\"walked\"")
    );
    let map = data_of(&html, "map-data");
    let places: Vec<bool> = map["roots"].as_array().unwrap().iter().map(Value::is_null).collect();
    assert!(places.len() > 1 && !places[0] && places[1..].iter().all(|none| *none), "only the start is told");
    if let Some(pages) = browse(&room, &["public.html"]) {
        assert_eq!(pages[0]["wrong"], serde_json::json!([]), "{}", pages[0]);
    }
}

#[test]
fn keypoints_are_marked_as_visible_hidden_or_exchanged_and_without_truth_all_alike() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let keypoints = "observation.keypoints={layout=\"coco17\",inversion=0.4,missing=0.1}";
    room.skiagraph(["render", "tiny.toml", keypoints, "--out", "set", "--truth", "secret"]);
    room.skiagraph(["render", "tiny.toml", keypoints, "--key", "default", "--out", "whole"]);
    let marks = |name: &str| {
        room.succeed(&format!("inspect {name} --out {name}.html"));
        let html = page(&room, &format!("{name}.html"));
        let views: Vec<Vec<Vec<(f64, f64, u8)>>> = serde_json::from_value(data_of(&html, "keypoints-data")).unwrap();
        assert!(views.len() > 3 && views.iter().all(|frame| frame.len() == 2), "{}", views.len());
        let found = views.concat().concat();
        assert!(found.len() < 17 * 2 * views.len(), "missing points have no mark");
        let kinds = [0, 1, 2].map(|kind| found.iter().filter(|point| point.2 == kind).count() > 0);
        (kinds, html.contains("of the other side"))
    };
    assert_eq!(marks("whole"), ([true; 3], true));
    assert_eq!(marks("set"), ([true, false, false], false));
}
