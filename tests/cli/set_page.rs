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

#[test]
fn set_has_the_page_of_runs() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("last_frame = 3", "last_frame = 9"));
    room.succeed("render tiny.toml --out set");
    let facts = room.succeed("inspect set").stdout;
    let said = room.succeed("inspect set --out set.html").stdout;
    assert!(said.starts_with(facts.trim_end()) && said.contains("picture: set.html"), "{said}");
    let html = room.text("set.html");
    let playback = data_of(&html, "playback-data");
    let frames = playback["frames"].as_u64().unwrap() as usize;
    assert!(frames > 3 && playback["scored"] == Value::Bool(false), "{}", playback["frames"]);
    assert_eq!(playback["cameras"].as_array().unwrap().len(), 2);
    assert!(html.contains("set hash") && html.contains("field of view") && !html.contains("id=\"metrics\""));
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http:") && !outside.contains("https:"), "no network");
    let Some(pages) = browse(&room, &["set.html"]) else { return };
    assert_eq!(pages[0]["wrong"], serde_json::json!([]), "{}", pages[0]);
    for size in ["playback_broad", "playback_phone"] {
        assert_eq!(pages[0][size]["frames"], frames, "{}", pages[0]);
    }
}

#[test]
fn set_without_truth_has_no_skeleton() {
    let room = Sandbox::new();
    room.write("film.toml", filmed(MOVING));
    room.succeed("render film.toml --out public --truth kept");
    for (set, has_truth) in [("public", false), ("kept", true)] {
        room.succeed(&format!("inspect {set} --out {set}.html"));
        let html = room.text(&format!("{set}.html"));
        assert_eq!(html.contains("This set has no ground truth"), !has_truth, "{set}");
        assert_eq!(html.contains("true skeleton</li>"), has_truth, "{set}");
    }
    if let Some(pages) = browse(&room, &["public.html"]) {
        assert_eq!(pages[0]["wrong"], serde_json::json!([]), "{}", pages[0]);
    }
}

/// As visible, hidden or exchanged; without truth, all alike.
#[test]
fn keypoints_are_marked() {
    let room = Sandbox::tiny();
    let keypoints = "observation.keypoints={layout=\"coco17\",inversion=0.4,missing=0.1}";
    room.ask(&format!("render tiny.toml {keypoints} --out set --truth secret"));
    room.ask(&format!("render tiny.toml {keypoints} --key default --out whole"));
    let marks = |name: &str| {
        room.succeed(&format!("inspect {name} --out {name}.html"));
        let html = room.text(&format!("{name}.html"));
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
