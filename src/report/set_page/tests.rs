use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::*;
use crate::body::{LANDMARKS, Prop, Solid};
use crate::raster::Mask;
use crate::report::PlaybackPlan;
use crate::report::fixture::rig;

const FRAMES: usize = 4;

fn playback(rig: &CameraRig, plan: PlaybackPlan) -> Playback {
    let view = |camera: &Camera| {
        let mask = Mask::from_fn(camera.pinhole.width, camera.pinhole.height, |x, y| x < 20 && y < 30);
        plan.pack(&mask, None)
    };
    let kept = plan.kept().len();
    let somebody = [Some(Point3::new(0.0, 0.0, 1.0)); LANDMARKS.len()];
    Playback {
        seed: 0,
        plan,
        views: (0..kept).map(|_| rig.cameras.iter().map(view).collect()).collect(),
        props: Vec::new(),
        moved: Vec::new(),
        truth: vec![somebody; kept],
        estimate: vec![[None; LANDMARKS.len()]; kept],
    }
}

fn html(rig: &CameraRig, playback: &Playback, map: &SetMap, layers: Option<&SetLayers>) -> String {
    let pills = ["4 frames".to_owned()];
    let page = SetPage {
        title: "Walk <& talk>",
        pills: &pills,
        rig,
        frames_per_second: 60.0,
        playback,
        map,
        layers,
        keypoints: None,
        films: &[],
        facts: &[],
    };
    page.html().unwrap()
}

fn walked() -> SetMap {
    SetMap { roots: (0..FRAMES).map(|f| Some(Point3::new(0.1 * f as f64, 0.0, 1.0))).collect(), props: Vec::new() }
}

const WHOLE: PlaybackPlan = PlaybackPlan { reduction: 1, stride: 1, frames: FRAMES };

#[test]
fn the_page_has_every_camera_and_the_frequency_of_frames_and_needs_no_network() {
    let rig = rig(3);
    let text = html(&rig, &playback(&rig, WHOLE), &walked(), None);
    assert!(text.contains("Walk &lt;&amp; talk&gt;") && text.contains("What every camera observed, every frame."));
    assert_eq!((text.matches("data-camera=").count() - 1, text.matches("class=\"walked\"").count()), (3, 1));
    let outside = text.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http:") && !outside.contains("https:") && !outside.contains("src=\"/"));
    let coarse = PlaybackPlan { reduction: 2, stride: 3, frames: 12 };
    let text = html(&rig, &playback(&rig, coarse), &walked(), None);
    assert!(text.contains("one frame in 3 of 12, one pixel for 2 x 2 of the image"));
}

#[test]
fn the_map_contains_cameras_props_and_path() {
    let rig = rig(4);
    let link_from_box = Isometry3::translation(6.0, -2.0, 0.5);
    let props = vec![Prop { name: "box".into(), solid: Solid::Box { link_from_box, half_extents: [0.5, 0.25, 0.5] } }];
    let map = SetMap { props, ..walked() };
    let svg = map.svg(&rig, &playback(&rig, WHOLE));
    let numbers: Vec<f64> = svg
        .split("viewBox=\"")
        .nth(1)
        .unwrap()
        .split('"')
        .next()
        .unwrap()
        .split(' ')
        .map(|n| n.parse().unwrap())
        .collect();
    let inside = |x: f64, y: f64| {
        (numbers[0]..numbers[0] + numbers[2]).contains(&x) && (numbers[1]..numbers[1] + numbers[3]).contains(&y)
    };
    for camera in &rig.cameras {
        assert!(inside(camera.centre().x, -camera.centre().y), "{svg}");
    }
    // the outline of the box
    let outline =
        svg.split("class=\"prop\"").nth(1).unwrap().split("points=\"").nth(1).unwrap().split('"').next().unwrap();
    let corners: Vec<Point2<f64>> = outline
        .split(' ')
        .map(|pair| {
            pair.split_once(',').map(|(x, y)| Point2::new(x.parse().unwrap(), -y.parse::<f64>().unwrap())).unwrap()
        })
        .collect();
    let (low, high) =
        corners.iter().fold((corners[0], corners[0]), |(low, high), corner| (low.inf(corner), high.sup(corner)));
    assert!(
        (low - Point2::new(5.5, -2.25)).norm() < 0.05 && (high - Point2::new(6.5, -1.75)).norm() < 0.05,
        "{corners:?}"
    );
}

#[test]
fn a_camera_that_looks_down_is_a_dot_and_one_that_moves_is_moved() {
    let mut rig = rig(2);
    let down = crate::camera::FieldOfView::Vertical(0.8);
    let eye = Point3::new(0.0, 0.0, 4.0);
    rig.cameras[0] = Camera::look_at("above", eye, Point3::origin(), Vector3::x(), down, 64, 48).unwrap();
    let mut playback = playback(&rig, WHOLE);
    playback.moved = (0..FRAMES)
        .map(|frame| {
            let mut moved = rig.clone();
            moved.cameras[1].camera_from_world *= Isometry3::translation(0.1 * frame as f64, 0.0, 0.0);
            moved
        })
        .collect();
    let text = html(&rig, &playback, &walked(), None);
    assert!(text.contains("Moving cameras are drawn at their position in that frame"));
    let data = text.split("id=\"map-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert!(data["fields"][1][0].is_null() && data["fields"][1][1] != data["fields"][2][1], "{data}");
    assert!(text.contains("points=\"0.000,-0.000\"") || text.contains("points=\"0.000,0.000\""), "the camera alone");
}

#[test]
fn layers_are_pictures_of_some_frames_with_their_place_in_the_image() {
    let rig = rig(1);
    let picture = LayerPicture { corner: [3, 4], extent: [8, 4], size: [4, 2], rgba: vec![200; 32] };
    let layers = SetLayers {
        names: vec!["depth".into()],
        meanings: vec!["near is light".into()],
        stride: 2,
        pictures: vec![vec![vec![Some(picture.clone())]], vec![vec![None]]],
    };
    let text = html(&rig, &playback(&rig, WHOLE), &walked(), Some(&layers));
    assert!(text.contains("Layers exist for 2 frames") && text.contains("<option value=\"0\">depth</option>"));
    let data = text.split("id=\"layers-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["frames"], serde_json::json!([0, 2]));
    let entry = &data["pictures"][0][0][0];
    assert_eq!([&entry["x"], &entry["y"], &entry["width"], &entry["height"]], [3, 4, 8, 4]);
    assert!(data["pictures"][1][0][0].is_null());
    let decoded = tiny_skia::Pixmap::decode_png(&picture.png().unwrap()).unwrap();
    assert_eq!((decoded.width(), decoded.height()), (4, 2));
}
