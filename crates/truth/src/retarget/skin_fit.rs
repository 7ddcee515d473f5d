//! Fits a skin to a body: the body is scaled and posed like the skin's mesh, the mesh is bound to it, and both are
//! scaled back to the body's size.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::skin_check::check_placement;
use super::skin_landmarks::{ankle_to_crown_path, check_fit, check_sides, check_upright};
use super::{FitOptions, SegmentLengths, fit_shape, fit_to_markers};
use skiagraph_core::body::{
    BodyShape, Humanoid, LANDMARKS, Landmark, LinkFrames, LinkShape, Markers, Skin, SkinError, SkinMesh,
};
use skiagraph_core::input::excerpt;

/// Accepted heights of meshes, metres.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.3..=3.0;

/// Maximum height difference between the lowest vertex of a mesh without landmarks and the body's soles, metres.
const MAX_SOLE_OFFSET_M: f64 = 0.15;

/// A foot whose ankle marker is farther than this from its link's origin has no ankle joint, metres.
const AT_ORIGIN: f64 = 0.03;

/// Fits the skin `mesh` to `template` by its landmarks. A mesh without landmarks must be modelled on the template
/// itself at its zero pose. A poor fit adds notes to the body.
///
/// # Errors
/// [`SkinError`] for weights of another skeleton, missing landmarks or those of a lying body, a body that cannot take
/// the mesh's pose, and a mesh whose limbs do not match the body's.
pub fn with_skin(template: &Humanoid, mesh: &SkinMesh) -> Result<Humanoid, SkinError> {
    dressed(template, mesh).map_err(|error| match error {
        SkinError::Landmarks { skin, detail } if !mesh.joint_map.is_empty() => {
            let map: Vec<String> =
                mesh.joint_map.iter().map(|(name, joint)| format!("{name} = {:?}", excerpt(joint))).collect();
            let found = format!("joint_map = {{ {} }}", map.join(", "));
            let detail = format!("{detail}; these joints were found, correct them in `[actor]`: {found}");
            SkinError::Landmarks { skin, detail }
        }
        other => other,
    })
}

fn dressed(template: &Humanoid, mesh: &SkinMesh) -> Result<Humanoid, SkinError> {
    let bare = Humanoid { skin: None, ..template.clone() };
    let lowest = check_height(mesh)?;
    Skin::check_segments(mesh, &bare)?;
    if mesh.landmarks.is_empty() {
        let bind = bare.link_frames(&bare.zero_pose());
        check_soles(mesh, lowest, &bare, &bind)?;
        let skin = Skin::bound(mesh, &bare, &bind)?;
        check_placement(&skin, &bare, &bind)?;
        return Ok(Humanoid { skin: Some(Arc::new(skin)), ..bare });
    }
    let (targets, toes) = targets(mesh)?;
    let refused = |detail: String| SkinError::Landmarks { skin: mesh.name.clone(), detail };
    let path = ankle_to_crown_path(&targets);
    check_upright(&targets, path).map_err(refused)?;
    let of_sides = check_sides(&targets, path).map_err(refused)?;
    let shape = fit_shape(&bare, &SegmentLengths::from_places(&targets, toes));
    let sized = bare.reshaped(&shape);
    let mut start = sized.standing_pose();
    if let Some(pelvis) = targets[Landmark::Pelvis as usize] {
        start.world_from_root.translation.vector = pelvis.coords;
    }
    let fit = fit_to_markers(&sized, &targets, &start, &FitOptions::default());
    let note = check_fit(&template.name, &fit, path).map_err(refused)?;
    let mut bind = sized.link_frames(&fit.pose);
    flatten_feet(&sized, &targets, toes, &mut bind);
    let skin = Skin::bound(mesh, &sized, &bind)?;
    check_placement(&skin, &sized, &bind)?;
    let fitted = Humanoid { skin: Some(Arc::new(skin)), ..sized };
    let notes = bare.notes.iter().cloned().chain(of_sides).chain(note).collect();
    Ok(Humanoid { skin: fitted.reshaped(&inverse(&shape)).skin, notes, ..bare })
}

/// Rejects meshes without a human's size. Returns the height of the lowest vertex, metres.
fn check_height(mesh: &SkinMesh) -> Result<f64, SkinError> {
    let ends = mesh.vertices.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v.z), h.max(v.z)]);
    let height = ends[1] - ends[0];
    if HEIGHTS_M.contains(&height) {
        return Ok(ends[0]);
    }
    let expected = format!("expected {} to {} m", HEIGHTS_M.start(), HEIGHTS_M.end());
    let detail = format!("is {height:.3} m high, {expected}: check `metres_per_unit` and `up`");
    Err(SkinError::Landmarks { skin: mesh.name.clone(), detail })
}

/// Rejects meshes without landmarks whose soles are not at the body's.
fn check_soles(mesh: &SkinMesh, lowest: f64, body: &Humanoid, bind: &LinkFrames) -> Result<(), SkinError> {
    let links: Vec<usize> = (0..body.links.len()).collect();
    let Some(soles) = body.lowest_point(bind, &links) else { return Ok(()) };
    if (lowest - soles.z).abs() <= MAX_SOLE_OFFSET_M {
        return Ok(());
    }
    let detail = format!(
        "has its lowest vertex at {lowest:.3} m and no landmarks, expected the soles of `{}` at its zero pose, at {:.3} m: \
         move the mesh, or give its landmarks",
        body.name, soles.z
    );
    Err(SkinError::Landmarks { skin: mesh.name.clone(), detail })
}

/// Balls of the left and right foot.
type Toes = [Option<Point3<f64>>; 2];

/// The landmarks of a mesh, and the balls of its feet.
fn targets(mesh: &SkinMesh) -> Result<(Markers, Toes), SkinError> {
    let targets = LANDMARKS.map(|landmark| mesh.landmarks.get(landmark.name()).copied());
    let missing: Vec<&str> =
        LANDMARKS.iter().zip(&targets).filter(|(_, place)| place.is_none()).map(|(l, _)| l.name()).collect();
    if !missing.is_empty() {
        let missing = missing.join(", ");
        let detail = format!("lacks the landmarks {missing}; give all fifteen, or none for a mesh at the zero pose");
        return Err(SkinError::Landmarks { skin: mesh.name.clone(), detail });
    }
    Ok((targets, ["left_toes", "right_toes"].map(|name| mesh.landmarks.get(name).copied())))
}

/// Markers do not determine the orientation of feet: in the bind pose they are flat, as at the zero pose, and point to
/// the balls of the mesh's feet.
fn flatten_feet(body: &Humanoid, targets: &Markers, toes: Toes, bind: &mut LinkFrames) {
    let zero = body.link_frames(&body.standing_pose());
    let ankles = [Landmark::LeftAnkle, Landmark::RightAnkle];
    for ((ankle, toes), links) in ankles.into_iter().zip(toes).zip(body.foot_links()) {
        let (Some(marker), Some(place), Some(&foot)) =
            (body.markers[ankle as usize], targets[ankle as usize], links.first())
        else {
            continue;
        };
        if marker.point_in_link.coords.norm() > AT_ORIGIN {
            continue;
        }
        let heading = toes.map_or(0.0, |toes| libm::atan2(toes.y - place.y, toes.x - place.x));
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        let from_zero = Isometry3::from_parts(bind[foot].translation, turn)
            * Isometry3::translation(-zero[foot].translation.x, -zero[foot].translation.y, -zero[foot].translation.z);
        for link in links {
            bind.0[link] = from_zero * zero[link];
        }
    }
}

fn inverse(shape: &BodyShape) -> BodyShape {
    let inverted = |link: &LinkShape| LinkShape { length: link.length.map(|l| 1.0 / l), girth: 1.0 / link.girth };
    BodyShape { links: shape.links.iter().map(inverted).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::{shipped, shipped_skin};

    /// Vertices at the body's zero pose.
    fn standing(body: &Humanoid) -> Vec<Point3<f64>> {
        let mut vertices = Vec::new();
        body.skin.as_ref().unwrap().deform_into(&body.link_frames(&body.zero_pose()), &mut vertices);
        vertices
    }

    #[test]
    fn the_shipped_person_fits_both_robots_with_soles_at_those_of_their_solids() {
        for (robot, flat) in [("actor", true), ("tracker25", false)] {
            let bare = shipped(robot).unwrap();
            let body = with_skin(&bare, &shipped_skin("person").unwrap()).unwrap();
            let vertices = standing(&body);
            let (low, high) = vertices.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v.z), h.max(v.z)));
            let links: Vec<usize> = (0..bare.links.len()).collect();
            let lowest = bare.lowest_point(&bare.link_frames(&bare.zero_pose()), &links).unwrap().z;
            let tolerance = if flat { 0.02 } else { 0.04 };
            assert!((low - lowest).abs() < tolerance, "{robot}: soles at {low}, those of the solids at {lowest}");
            assert!((high - low - 1.75).abs() < 0.05, "{robot} is {} m tall", high - low);
            let head = bare.markers(&bare.link_frames(&bare.zero_pose()))[Landmark::HeadTop as usize].unwrap();
            assert!((high - head.z).abs() < 0.02, "{robot}");
        }
    }

    #[test]
    fn meshes_of_another_size_or_height_above_ground_are_refused() {
        let body = shipped("actor").unwrap();
        let refused = |mesh: &SkinMesh| with_skin(&body, mesh).unwrap_err().to_string();
        for factor in [0.001, 20.0] {
            let mut mesh = shipped_skin("person_coarse").unwrap();
            mesh.vertices.iter_mut().chain(mesh.landmarks.values_mut()).for_each(|place| place.coords *= factor);
            let message = refused(&mesh);
            assert!(message.contains("m high, expected 0.3 to 3 m"), "{message}");
        }
        let mut mesh = shipped_skin("person_coarse").unwrap();
        mesh.landmarks.clear();
        mesh.vertices.iter_mut().for_each(|vertex| vertex.z += 5.0);
        assert!(refused(&mesh).contains("has its lowest vertex at"), "{}", refused(&mesh));
    }

    #[test]
    fn a_mesh_with_lying_or_upside_down_landmarks_is_refused() {
        let body = shipped("actor").unwrap();
        let turned = |turn: fn(&Point3<f64>) -> Point3<f64>| {
            let mut mesh = shipped_skin("person_coarse").unwrap();
            mesh.vertices.iter_mut().chain(mesh.landmarks.values_mut()).for_each(|place| *place = turn(place));
            with_skin(&body, &mesh).unwrap_err().to_string()
        };
        for turn in [|p: &Point3<f64>| Point3::new(p.x, p.z, -p.y), |p: &Point3<f64>| Point3::new(p.x, -p.y, -p.z)] {
            let message = turned(turn);
            assert!(message.contains("is not upright: its landmark head_top is"), "{message}");
            assert!(message.contains("check `up`"), "{message}");
        }
    }

    #[test]
    fn shipped_skins_fit_shipped_robots_without_notes() {
        for robot in ["actor", "tracker25", "tracker40"] {
            let body = with_skin(&shipped(robot).unwrap(), &shipped_skin("person_coarse").unwrap()).unwrap();
            assert_eq!(body.notes, shipped(robot).unwrap().notes, "{robot}");
        }
    }

    #[test]
    fn a_mesh_with_missing_or_inhuman_landmarks_is_refused() {
        let body = shipped("actor").unwrap();
        let mut mesh = shipped_skin("person_coarse").unwrap();
        mesh.landmarks.remove("left_knee");
        assert!(with_skin(&body, &mesh).unwrap_err().to_string().contains("lacks the landmarks left_knee"));
        let mut mesh = shipped_skin("person_coarse").unwrap();
        mesh.landmarks.insert("left_knee".into(), Point3::new(0.0, 3.0, 4.0));
        assert!(with_skin(&body, &mesh).unwrap_err().to_string().contains("correct hip or knee on one side"));
        let mut mesh = shipped_skin("person_coarse").unwrap();
        mesh.landmarks.insert("pelvis".into(), Point3::new(0.0123, 0.0, 1.1154));
        assert!(with_skin(&body, &mesh).unwrap_err().to_string().contains("of its landmarks (root mean square)"));
        let mut mesh = shipped_skin("person_coarse").unwrap();
        if let Some(weights) = &mut mesh.weights {
            let tail = weights["head"].clone();
            weights.insert("tail".into(), tail);
        }
        let message = with_skin(&body, &mesh).unwrap_err().to_string();
        assert!(message.contains("has weights for tail, which `actor` does not have"), "{message}");
    }
}
