//! Checks that a bound skin matches the skeleton: left limbs at left bones, feet pointing forward, parts close to their
//! bones.

use nalgebra::{Point3, Vector3};

use skiagraph_core::body::{Humanoid, Landmark, LinkFrames, Markers, Skin, SkinError};

/// Maximum distance of the centre of a limb's or the head's skin from its bone, as a share of the length from ankle to
/// crown.
const MAX_DISTANCE: f64 = 0.1;

/// Feet reach farther in front of the ankles than behind; a skin faces backwards if they reach this many times as far
/// behind.
const BACKWARDS_RATIO: f64 = 1.5;

/// Least reach behind the ankles for which the direction is judged, metres.
const MIN_FOOT_M: f64 = 0.05;

/// The lower halves of limbs, left and right: landmarks at both ends.
const HALVES: [(&str, [[Landmark; 2]; 2]); 2] = [
    ("lower leg", [[Landmark::LeftKnee, Landmark::LeftAnkle], [Landmark::RightKnee, Landmark::RightAnkle]]),
    ("forearm", [[Landmark::LeftElbow, Landmark::LeftWrist], [Landmark::RightElbow, Landmark::RightWrist]]),
];

/// Rejects a skin bound to `body` with link frames `bind` whose limbs match those of the other side, whose feet point
/// backwards, or whose parts are far from their bones.
pub(super) fn check_placement(skin: &Skin, body: &Humanoid, bind: &LinkFrames) -> Result<(), SkinError> {
    let placed = PlacedSkin { skin, body, markers: body.markers(bind) };
    let refuse = |detail: String| SkinError::Landmarks { skin: skin.name.clone(), detail };
    for (what, [left, right]) in HALVES {
        let parts = [left, right].map(|[from, _]| placed.carried_from(from));
        let [Some(of_left), Some(of_right)] = parts else { continue };
        let bones = [left, right].map(|ends| placed.bone(ends));
        let [Some(left_bone), Some(right_bone)] = bones else { continue };
        for (side, own, bone, other) in
            [("left", of_left, &left_bone, &right_bone), ("right", of_right, &right_bone, &left_bone)]
        {
            let swapped = own.iter().filter(|vertex| other.distance(vertex) < bone.distance(vertex)).count();
            if 2 * swapped > own.len() {
                return Err(refuse(format!(
                    "{swapped} of the {} vertices of the {side} {what} are nearer to the {what} of the other side of `{}`: left \
                     and right are swapped in its weights, joints or landmarks",
                    own.len(),
                    body.name
                )));
            }
            placed.check_near(&own, bone, &format!("{side} {what}")).map_err(refuse)?;
        }
    }
    if let (Some(own), Some(bone)) =
        (placed.carried_from(Landmark::HeadTop), placed.bone([Landmark::Thorax, Landmark::HeadTop]))
    {
        placed.check_near(&own, &bone, "head").map_err(refuse)?;
    }
    placed.check_feet_forward().map_err(refuse)
}

/// A skin and the landmarks of its body in the bind pose.
struct PlacedSkin<'a> {
    skin: &'a Skin,
    body: &'a Humanoid,
    markers: Markers,
}

/// A straight line between two landmarks.
struct StraightBone([Point3<f64>; 2]);

impl StraightBone {
    fn distance(&self, point: &Point3<f64>) -> f64 {
        let [a, b] = &self.0;
        let (axis, from) = (b - a, point - a);
        let along = (from.dot(&axis) / axis.norm_squared().max(1e-18)).clamp(0.0, 1.0);
        (from - axis * along).norm()
    }
}

impl PlacedSkin<'_> {
    fn bone(&self, [from, to]: [Landmark; 2]) -> Option<StraightBone> {
        Some(StraightBone([self.markers[from as usize]?, self.markers[to as usize]?]))
    }

    /// The vertices mostly carried by the link of a landmark and its descendants; `None` if these include the trunk, or
    /// carry no vertices.
    fn carried_from(&self, landmark: Landmark) -> Option<Vec<Point3<f64>>> {
        let top = self.body.markers[landmark as usize]?.link;
        let trunk = [Landmark::Pelvis, Landmark::Thorax].map(|l| self.body.markers[l as usize].map(|own| own.link));
        let mut below = vec![false; self.body.links.len()];
        for link in 0..self.body.links.len() {
            below[link] = link == top || self.body.parent(link).is_some_and(|parent| below[parent]);
        }
        if trunk.into_iter().flatten().any(|link| below[link]) {
            return None;
        }
        let pairs = self.skin.vertices().iter().zip(self.skin.parts());
        let own: Vec<Point3<f64>> = pairs.filter(|(_, part)| below[**part as usize]).map(|(v, _)| *v).collect();
        (!own.is_empty()).then_some(own)
    }

    /// Length from the ankle along the bones to the crown, metres.
    fn height(&self) -> Option<f64> {
        let place = |landmark: Landmark| self.markers[landmark as usize];
        let bones = [
            (Landmark::LeftAnkle, Landmark::LeftKnee),
            (Landmark::LeftKnee, Landmark::LeftHip),
            (Landmark::Pelvis, Landmark::Thorax),
            (Landmark::Thorax, Landmark::HeadTop),
        ];
        bones.into_iter().map(|(a, b)| Some((place(a)? - place(b)?).norm())).sum()
    }

    fn check_near(&self, own: &[Point3<f64>], bone: &StraightBone, what: &str) -> Result<(), String> {
        let Some(height) = self.height() else { return Ok(()) };
        let sum = own.iter().fold(Vector3::zeros(), |sum, vertex| sum + vertex.coords);
        let away = bone.distance(&Point3::from(sum / own.len() as f64));
        if away <= MAX_DISTANCE * height {
            return Ok(());
        }
        Err(format!(
            "the centre of its {what} is {:.0} mm from the {what} of `{}` in the bind pose, expected at most {:.0} mm: the \
             mesh leans, or was modelled in another pose; rotate it upright, or give its landmarks",
            1000.0 * away,
            self.body.name,
            1000.0 * MAX_DISTANCE * height
        ))
    }

    /// Rejects feet that point backwards.
    fn check_feet_forward(&self) -> Result<(), String> {
        let place = |landmark: Landmark| self.markers[landmark as usize];
        let (Some(left), Some(right)) = (place(Landmark::LeftHip), place(Landmark::RightHip)) else { return Ok(()) };
        let Some(ahead) = (left - right).cross(&Vector3::z()).try_normalize(1e-6) else { return Ok(()) };
        let (mut most, mut least) = (0.0_f64, 0.0_f64);
        for (knee, ankle) in [(Landmark::LeftKnee, Landmark::LeftAnkle), (Landmark::RightKnee, Landmark::RightAnkle)] {
            let (Some(own), Some(ankle)) = (self.carried_from(knee), place(ankle)) else { return Ok(()) };
            for vertex in own.iter().filter(|vertex| vertex.z < ankle.z) {
                let along = (vertex - ankle).dot(&ahead);
                (most, least) = (most.max(along), least.min(along));
            }
        }
        if -least <= MIN_FOOT_M || -least <= BACKWARDS_RATIO * most {
            return Ok(());
        }
        Err(format!(
            "its feet reach {:.0} mm behind the ankles and {:.0} mm in front of them on `{}`: left and right are swapped in \
             its weights, joints or landmarks, or the mesh faces backwards",
            -1000.0 * least,
            1000.0 * most,
            self.body.name
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retarget::with_skin;
    use skiagraph_core::body::{SkinMesh, shipped, shipped_skin};

    fn refused(change: impl Fn(&mut SkinMesh)) -> String {
        let mut mesh = shipped_skin("person_coarse").unwrap();
        change(&mut mesh);
        with_skin(&shipped("actor").unwrap(), &mesh).unwrap_err().to_string()
    }

    fn other_side(name: &str) -> String {
        match name.split_once('_') {
            Some(("left", rest)) => format!("right_{rest}"),
            Some(("right", rest)) => format!("left_{rest}"),
            _ => name.to_owned(),
        }
    }

    fn swap_weights(mesh: &mut SkinMesh) {
        let weights = mesh.weights.take().unwrap();
        mesh.weights = Some(weights.into_iter().map(|(name, own)| (other_side(&name), own)).collect());
    }

    fn swap_landmarks(mesh: &mut SkinMesh) {
        let landmarks = std::mem::take(&mut mesh.landmarks);
        mesh.landmarks = landmarks.into_iter().map(|(name, place)| (other_side(&name), place)).collect();
    }

    #[test]
    fn skins_with_swapped_sides_are_refused() {
        for change in [swap_weights, swap_landmarks] {
            let message = refused(change);
            // the body may be unable to reach swapped landmarks
            let is_named = message.contains("left and right are swapped") || message.contains("right not swapped");
            assert!(is_named, "{message}");
        }
        let message = refused(|mesh| {
            swap_weights(mesh);
            swap_landmarks(mesh);
        });
        assert!(message.contains("behind the ankles") || message.contains("right not swapped"), "{message}");
    }

    #[test]
    fn a_skin_that_leans_away_from_the_skeleton_is_refused() {
        // the skin at the actor's zero pose, rotated about its soles
        let actor = shipped("actor").unwrap();
        let dressed = with_skin(&actor, &shipped_skin("person_coarse").unwrap()).unwrap();
        let frames = dressed.link_frames(&dressed.zero_pose());
        let skin = dressed.skin.as_ref().unwrap();
        let mut standing = Vec::new();
        skin.deform_into(&frames, &mut standing);
        let soles = standing.iter().map(|vertex| vertex.z).fold(f64::INFINITY, f64::min);
        let at = |lean: f64| {
            let mut mesh = shipped_skin("person_coarse").unwrap();
            mesh.landmarks.clear();
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), lean);
            let pivot = Vector3::new(0.0, 0.0, soles);
            mesh.vertices = standing.iter().map(|v| Point3::from(turn * (v.coords - pivot) + pivot)).collect();
            with_skin(&actor, &mesh)
        };
        assert!(at(0.0).is_ok());
        let message = at(0.25).unwrap_err().to_string();
        assert!(message.contains("the mesh leans"), "{message}");
    }
}
