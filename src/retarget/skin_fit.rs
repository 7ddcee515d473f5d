//! A skin on a body: the body takes the size and pose in which the skin's mesh was modelled, the mesh is bound to it,
//! and both are brought back to the body's own size.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::skin_check::check_placed;
use super::{Fit, FitOptions, SegmentLengths, fit_shape, fit_to_markers};
use crate::body::{
    BodyShape, Humanoid, LANDMARKS, Landmark, LinkFrames, LinkShape, Markers, Skin, SkinError, SkinMesh,
};

/// A body whose markers stay farther than this from the mesh's landmarks is another one, metres, root mean square.
const WORST_FIT: f64 = 0.06;

/// Farthest that any one landmark of the mesh may stay from the body's, as a share of the way from ankles to crown:
/// about 0.15 m of a person of 1.7 m.
const FARTHEST_LANDMARK: f64 = 0.09;

/// Landmarks that are farther than this share of the same way on average get a note: about 25 mm of 1.7 m.
const NOTED_MEAN: f64 = 0.0155;

/// The crown of a body that does not lie is above its ankles by at least this share of the way from ankles to crown.
const LEAST_RISE: f64 = 0.6;

/// Heights of meshes that may be human, metres.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.3..=3.0;

/// How far the lowest vertex of a mesh without landmarks may lie from the soles of the body that it was modelled on,
/// metres.
const FARTHEST_SOLES_M: f64 = 0.15;

/// Feet whose ankle is this far from their link's origin have no ankle joint, metres.
const AT_ORIGIN: f64 = 0.03;

/// `template` with the skin `mesh`, which is fitted by its landmarks. A mesh without landmarks is taken to be modelled
/// on the template itself at its zero pose. The last of the body's notes tells a fit that is poor.
///
/// # Errors
/// [`SkinError`] for weights of another skeleton, landmarks that are missing or of a body that lies, a body that cannot
/// take the mesh's pose, and a mesh whose limbs do not lie at the body's.
pub fn with_skin(template: &Humanoid, mesh: &SkinMesh) -> Result<Humanoid, SkinError> {
    let bare = Humanoid { skin: None, ..template.clone() };
    let lowest = check_height(mesh)?;
    Skin::check_segments(mesh, &bare)?;
    if mesh.landmarks.is_empty() {
        let bind = bare.link_frames(&bare.zero_pose());
        check_soles(mesh, lowest, &bare, &bind)?;
        let skin = Skin::bound(mesh, &bare, &bind)?;
        check_placed(&skin, &bare, &bind)?;
        return Ok(Humanoid { skin: Some(Arc::new(skin)), ..bare });
    }
    let (targets, toes) = targets(mesh)?;
    let refused = |detail: String| SkinError::Landmarks { skin: mesh.name.clone(), detail };
    let way = way_to_crown(&targets);
    check_upright(&targets, way).map_err(refused)?;
    let shape = fit_shape(&bare, &SegmentLengths::from_places(&targets, toes));
    let sized = bare.reshaped(&shape);
    let mut start = sized.standing_pose();
    if let Some(pelvis) = targets[Landmark::Pelvis as usize] {
        start.world_from_root.translation.vector = pelvis.coords;
    }
    let fit = fit_to_markers(&sized, &targets, &start, &FitOptions::default());
    let note = check_fit(&template.name, &fit, way).map_err(refused)?;
    let mut bind = sized.link_frames(&fit.pose);
    flatten_feet(&sized, &targets, toes, &mut bind);
    let skin = Skin::bound(mesh, &sized, &bind)?;
    check_placed(&skin, &sized, &bind)?;
    let fitted = Humanoid { skin: Some(Arc::new(skin)), ..sized };
    let notes = bare.notes.iter().cloned().chain(note).collect();
    Ok(Humanoid { skin: fitted.reshaped(&inverse(&shape)).skin, notes, ..bare })
}

/// From the ankle over knee, hip and neck to the crown, on the side of the shorter leg, metres.
fn way_to_crown(places: &Markers) -> f64 {
    use Landmark as L;
    let long = |[a, b]: [L; 2]| places[a as usize].zip(places[b as usize]).map_or(0.0, |(a, b)| (a - b).norm());
    let left = long([L::LeftAnkle, L::LeftKnee]) + long([L::LeftKnee, L::LeftHip]);
    let right = long([L::RightAnkle, L::RightKnee]) + long([L::RightKnee, L::RightHip]);
    left.min(right) + long([L::Pelvis, L::Thorax]) + long([L::Thorax, L::HeadTop])
}

/// Refuses landmarks of a body that lies or stands on its head.
fn check_upright(places: &Markers, way: f64) -> Result<(), String> {
    let [crown, left, right] =
        [Landmark::HeadTop, Landmark::LeftAnkle, Landmark::RightAnkle].map(|l| places[l as usize].map(|p| p.z));
    let (Some(crown), Some(left), Some(right)) = (crown, left, right) else { return Ok(()) };
    let rise = crown - 0.5 * (left + right);
    match rise >= LEAST_RISE * way {
        true => Ok(()),
        false => Err(format!(
            "lies: its landmark head_top is {rise:.2} m above its ankles along Z, expected at least {:.2} m, {LEAST_RISE} \
             of the way along its bones; check `up`",
            LEAST_RISE * way
        )),
    }
}

/// Refuses fits that are poor, at all landmarks together or at one; a note on one that is only not good.
fn check_fit(body: &str, fit: &Fit, way: f64) -> Result<Option<String>, String> {
    if fit.residual_rms_m > WORST_FIT {
        return Err(format!(
            "`{body}` comes within {:.0} mm of its landmarks (root mean square), expected {:.0}: the mesh must be metres, X \
             forward, Y left, Z up, and its landmarks those of a human in a pose that the body can take, left and right not \
             swapped",
            1000.0 * fit.residual_rms_m,
            1000.0 * WORST_FIT
        ));
    }
    let away: Vec<(&str, f64)> =
        LANDMARKS.iter().zip(fit.per_marker).filter_map(|(l, away)| Some((l.name(), away?))).collect();
    let Some((worst, farthest)) = away.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(None) };
    if farthest > FARTHEST_LANDMARK * way {
        return Err(format!(
            "`{body}` comes within {:.0} mm of its landmark {worst}, expected {:.0}: correct where that is, or that of its \
             neighbours",
            1000.0 * farthest,
            1000.0 * FARTHEST_LANDMARK * way
        ));
    }
    let mean = away.iter().map(|(_, away)| away).sum::<f64>() / away.len() as f64;
    Ok((mean > NOTED_MEAN * way).then(|| {
        format!(
            "the body `{body}` comes within {:.0} mm of its landmarks on average, at worst {worst} {:.0} mm: look at the \
             picture of `inspect`",
            1000.0 * mean,
            1000.0 * farthest
        )
    }))
}

/// Refuses meshes that are no human's size; how low the mesh reaches.
fn check_height(mesh: &SkinMesh) -> Result<f64, SkinError> {
    let ends = mesh.vertices.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v.z), h.max(v.z)]);
    let height = ends[1] - ends[0];
    if HEIGHTS_M.contains(&height) {
        return Ok(ends[0]);
    }
    let detail = format!(
        "is {height:.3} m high, expected {} to {} m: check `metres_per_unit` and `up`",
        HEIGHTS_M.start(),
        HEIGHTS_M.end()
    );
    Err(SkinError::Landmarks { skin: mesh.name.clone(), detail })
}

/// Refuses meshes without landmarks that do not stand where the body does.
fn check_soles(mesh: &SkinMesh, lowest: f64, body: &Humanoid, bind: &LinkFrames) -> Result<(), SkinError> {
    let links: Vec<usize> = (0..body.links.len()).collect();
    let Some(soles) = body.lowest_point(bind, &links) else { return Ok(()) };
    if (lowest - soles.z).abs() <= FARTHEST_SOLES_M {
        return Ok(());
    }
    let detail = format!(
        "has its lowest vertex at {lowest:.3} m and no landmarks; `{}`, on which such a mesh is modelled at the zero \
         pose, has its soles at {:.3} m: move the mesh, or give its landmarks",
        body.name, soles.z
    );
    Err(SkinError::Landmarks { skin: mesh.name.clone(), detail })
}

/// Balls of the left and of the right foot.
type Toes = [Option<Point3<f64>>; 2];

/// Landmarks of a mesh, and the balls of its feet.
fn targets(mesh: &SkinMesh) -> Result<(Markers, Toes), SkinError> {
    let targets = LANDMARKS.map(|landmark| mesh.landmarks.get(landmark.name()).copied());
    let missing: Vec<&str> =
        LANDMARKS.iter().zip(&targets).filter(|(_, place)| place.is_none()).map(|(l, _)| l.name()).collect();
    if !missing.is_empty() {
        let detail = format!(
            "lacks the landmarks {}; give all fifteen, or none for a mesh at the zero pose",
            missing.join(", ")
        );
        return Err(SkinError::Landmarks { skin: mesh.name.clone(), detail });
    }
    Ok((targets, ["left_toes", "right_toes"].map(|name| mesh.landmarks.get(name).copied())))
}

/// Markers do not tell how feet are turned: in the bind pose they lie as at the zero pose, flat, and point to the balls
/// of the mesh's feet.
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

/// The shape that undoes another.
fn inverse(shape: &BodyShape) -> BodyShape {
    let undone = |link: &LinkShape| LinkShape { length: link.length.map(|l| 1.0 / l), girth: 1.0 / link.girth };
    BodyShape { links: shape.links.iter().map(undone).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{shipped, shipped_skin};

    /// Vertices at the body's zero pose.
    fn standing(body: &Humanoid) -> Vec<Point3<f64>> {
        let mut vertices = Vec::new();
        body.skin.as_ref().unwrap().deform_into(&body.link_frames(&body.zero_pose()), &mut vertices);
        vertices
    }

    #[test]
    fn the_built_in_person_fits_both_robots_and_stands_on_its_soles_like_their_solids() {
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
    fn meshes_of_another_size_and_those_that_stand_elsewhere_are_refused() {
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

    /// A root mean square over fifteen landmarks hides one.
    #[test]
    fn one_landmark_that_is_far_from_the_bodys_is_refused_and_a_poor_mean_is_noted() {
        let body = shipped("actor").unwrap();
        let fit = |away: [f64; 15]| Fit {
            pose: body.zero_pose(),
            residual_rms_m: libm::sqrt(away.iter().map(|d| d * d).sum::<f64>() / 15.0),
            iterations: 1,
            per_marker: away.map(Some),
        };
        let mut away = [0.005; 15];
        assert_eq!(check_fit("actor", &fit(away), 1.6), Ok(None));
        away[Landmark::LeftKnee as usize] = 0.2;
        assert!(fit(away).residual_rms_m < WORST_FIT);
        let told = check_fit("actor", &fit(away), 1.6).unwrap_err();
        assert!(told.contains("within 200 mm of its landmark left_knee, expected 144"), "{told}");
        let noted = check_fit("actor", &fit([0.04; 15]), 1.6).unwrap().unwrap();
        assert!(noted.contains("within 40 mm of its landmarks on average"), "{noted}");
        assert!(check_fit("actor", &fit([0.02; 15]), 0.8).unwrap().is_some(), "a child's landmarks are nearer");
    }

    /// A mesh with another axis up was laid down and drawn.
    #[test]
    fn a_mesh_whose_landmarks_lie_or_stand_on_their_head_is_refused() {
        let body = shipped("actor").unwrap();
        let turned = |turn: fn(&Point3<f64>) -> Point3<f64>| {
            let mut mesh = shipped_skin("person_coarse").unwrap();
            mesh.vertices.iter_mut().chain(mesh.landmarks.values_mut()).for_each(|place| *place = turn(place));
            with_skin(&body, &mesh).unwrap_err().to_string()
        };
        for turn in [|p: &Point3<f64>| Point3::new(p.z, p.y, -p.x), |p: &Point3<f64>| Point3::new(p.x, -p.y, -p.z)] {
            let told = turned(turn);
            assert!(told.contains("lies: its landmark head_top is") && told.contains("check `up`"), "{told}");
        }
    }

    #[test]
    fn the_skins_that_ship_fit_the_robots_that_ship_without_a_note() {
        for robot in ["actor", "tracker25", "tracker40"] {
            let body = with_skin(&shipped(robot).unwrap(), &shipped_skin("person_coarse").unwrap()).unwrap();
            assert_eq!(body.notes, shipped(robot).unwrap().notes, "{robot}");
        }
    }

    #[test]
    fn a_mesh_without_some_landmarks_or_of_no_human_is_refused() {
        let body = shipped("actor").unwrap();
        let mut mesh = shipped_skin("person_coarse").unwrap();
        mesh.landmarks.remove("left_knee");
        assert!(with_skin(&body, &mesh).unwrap_err().to_string().contains("lacks the landmarks left_knee"));
        let mut mesh = shipped_skin("person_coarse").unwrap();
        mesh.landmarks.insert("left_knee".into(), Point3::new(0.0, 3.0, 4.0));
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
