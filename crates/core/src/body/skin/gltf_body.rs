//! Which nodes of a glTF file are the joints of a body: by VRM's map, the user's map, or [`human_tree`].

use std::collections::{BTreeMap, BTreeSet};

use super::gltf_document::GltfFile;
use super::gltf_figure::{BindPose, SkinNodes, forward};
use super::gltf_file::names_of;
use super::gltf_tree::NodeTree;
use crate::body::human_tree::{self, JointTree, Role, role_of};
use crate::body::landmark::{ARMS, LEGS};
use crate::body::{LANDMARKS, Landmark};
use crate::input::excerpt;

/// Nodes among which a body is looked for; the search takes the square of their number.
const MOST_SEARCHED: usize = 1_000;
/// Greatest number of joints that a message names.
const MOST_NAMED: usize = 300;
/// Joints up to this share of the distance from hips to neck move the abdomen.
const LOW_IN_TRUNK: f64 = 0.3;

/// Landmarks and VRM's bones that begin there, without their side.
const VRM_BONES: [(&str, &str); 6] = [
    ("hip", "UpperLeg"),
    ("knee", "LowerLeg"),
    ("ankle", "Foot"),
    ("shoulder", "UpperArm"),
    ("elbow", "LowerArm"),
    ("wrist", "Hand"),
];

/// Joints that the file or the user names.
#[derive(Default)]
pub(super) struct GivenNodes {
    /// By landmark, except for `head_top`: there, the joint that moves the head.
    landmarks: [Option<usize>; LANDMARKS.len()],
    toes: [Option<usize>; 2],
}

impl GivenNodes {
    pub(super) fn of(
        gltf: &GltfFile,
        tree: &NodeTree,
        skins: &BTreeMap<usize, SkinNodes>,
        joint_map: &BTreeMap<String, String>,
    ) -> Result<Self, String> {
        let mut given = Self::default();
        let bone = |name: &str| gltf.humanoid.get(name).copied().filter(|node| *node < tree.names.len());
        for (index, side) in ["left", "right"].into_iter().enumerate() {
            for (landmark, name) in VRM_BONES {
                given.put(&format!("{side}_{landmark}"), bone(&format!("{side}{name}")));
            }
            given.toes[index] = bone(&format!("{side}Toes"));
        }
        given.put("thorax", bone("neck"));
        given.put("head_top", bone("head"));
        let order: Vec<usize> = skins.values().flat_map(|skin| skin.nodes.iter().copied()).collect();
        let find = |name: &str| {
            let named = |node: &&usize| tree.names[**node] == name;
            order.iter().find(named).or_else(|| tree.order.iter().find(named)).copied()
        };
        for (landmark, site) in joint_map {
            if !LANDMARKS.iter().any(|known| known.name() == landmark) {
                return Err(format!("joint_map: `{}` is not a landmark", excerpt(landmark)));
            }
            // always between the hips
            if landmark == "pelvis" {
                continue;
            }
            let own = find(site).or_else(|| find(site.strip_suffix(":tip")?)).ok_or_else(|| {
                let names = order.iter().map(|node| tree.names[*node].as_str()).collect::<Vec<_>>().join(", ");
                format!("joint_map: `{}` is no joint; its joints are: {}", excerpt(site), excerpt(&names))
            })?;
            // an end of the head is moved by the joint below it
            let is_end = landmark == "head_top" && find(site).is_some() && !tree.parents.contains(&Some(own));
            given.put(landmark, if is_end { tree.parents[own] } else { Some(own) });
        }
        Ok(given)
    }

    fn put(&mut self, landmark: &str, node: Option<usize>) {
        if let (Some(index), Some(node)) = (LANDMARKS.iter().position(|known| known.name() == landmark), node) {
            self.landmarks[index] = Some(node);
        }
    }

    fn limb(&self, limb: [Landmark; 3]) -> [Option<usize>; 3] {
        limb.map(|landmark| self.landmarks[landmark as usize])
    }
}

/// The nodes that are the joints of a body. Pairs are left and right.
pub(super) struct BodyNodes {
    pub(super) legs: [[usize; 3]; 2],
    pub(super) arms: [[usize; 3]; 2],
    toes: [Option<usize>; 2],
    neck: Option<usize>,
    pub(super) head: usize,
    /// The nodes that move both hips, both shoulders, and all of them.
    pelvis: usize,
    chest: usize,
    root: usize,
    pub(super) are_sides_named: bool,
}

impl BodyNodes {
    pub(super) fn find(
        tree: &NodeTree,
        skins: &BTreeMap<usize, SkinNodes>,
        bind: &BindPose,
        given: &GivenNodes,
        notes: &mut Vec<String>,
    ) -> Result<Self, String> {
        let mut searched = Searched::new(tree, skins, bind);
        for (landmark, node) in LANDMARKS.iter().zip(given.landmarks) {
            let is_head = *landmark == Landmark::HeadTop;
            let role = if is_head { Some((Role::Head, None)) } else { role_of(*landmark) };
            let index = searched.nodes.iter().position(|own| Some(*own) == node);
            searched.tree.pins.extend(index.zip(role).map(|(index, (role, is_left))| (index, role, is_left)));
        }
        let found = if searched.nodes.len() <= MOST_SEARCHED {
            human_tree::find(&searched.tree)
        } else {
            Err(format!("it has {} joints, more than {MOST_SEARCHED}", searched.nodes.len()))
        };
        let found_node = |index: usize| searched.nodes[index];
        let limbs = |places: [[Landmark; 3]; 2], found: Option<[[usize; 3]; 2]>| -> Option<[[usize; 3]; 2]> {
            let mut limbs = [[0; 3]; 2];
            for side in 0..2 {
                let given = given.limb(places[side]);
                for joint in 0..3 {
                    limbs[side][joint] = given[joint].or_else(|| Some(found_node(found?[side][joint])))?;
                }
            }
            Some(limbs)
        };
        let body = found.as_ref().ok();
        let legs = limbs(LEGS, body.map(|body| body.legs));
        let arms = limbs(ARMS, body.map(|body| body.arms));
        let of_head =
            |landmark: Landmark, own: Option<usize>| given.landmarks[landmark as usize].or(own.map(found_node));
        let head = of_head(Landmark::HeadTop, body.and_then(|body| body.head.head));
        let (Some(legs), Some(arms), Some(head)) = (legs, arms, head) else {
            let why = found.err().unwrap_or_else(|| "no joint is its head".to_owned());
            let own = LANDMARKS.iter().filter(|landmark| **landmark != Landmark::Pelvis);
            let empty: Vec<String> = own.map(|landmark| format!("{} = \"\"", landmark.name())).collect();
            let names: Vec<String> = searched.tree.names.iter().take(MOST_NAMED).map(|name| excerpt(name)).collect();
            return Err(format!(
                "no human body is found in its joints: {why}; name them in `joint_map` of `[actor]`: joint_map = {{ {} }}; \
                 its joints are: {}",
                empty.join(", "),
                names.join(", ")
            ));
        };
        let toes = [0, 1].map(|side| given.toes[side].or(body.and_then(|body| body.toes[side]).map(found_node)));
        // not the toes of another foot
        let toes = [0, 1].map(|side| toes[side].filter(|toes| tree.is_below(*toes, legs[side][2])));
        let above = |a: usize, b: usize| tree.common_ancestor(a, b).ok_or("its limbs have no common joint".to_owned());
        let (pelvis, chest) = (above(legs[0][0], legs[1][0])?, above(arms[0][0], arms[1][0])?);
        let root = above(pelvis, chest)?;
        let neck = of_head(Landmark::Thorax, body.and_then(|body| body.head.neck));
        // 3ds Max's bipeds move their arms with the neck
        let neck = neck.or(Some(chest).filter(|chest| human_tree::key(tree.names[*chest].as_str()).contains("neck")));
        let is_given = given.landmarks.iter().flatten().count() > 0;
        if let Some(body) = body.filter(|_| !is_given) {
            if !body.unusual.is_empty() {
                notes.push(format!("unusual proportions: {}", body.unusual.join(", ")));
            }
            if !body.are_sides_named {
                notes.push("left and right are told by where the feet point, because no names say them".to_owned());
            }
        }
        let are_sides_named = is_given || body.is_some_and(|body| body.are_sides_named);
        Ok(Self { legs, arms, toes, neck, head, pelvis, chest, root, are_sides_named })
    }

    pub(super) fn exchange_sides(&mut self) {
        self.legs.swap(0, 1);
        self.arms.swap(0, 1);
        self.toes.swap(0, 1);
    }

    /// Refuses skins that the body does not move: those of another skeleton.
    pub(super) fn check_one_figure(
        &self,
        tree: &NodeTree,
        skins: &BTreeMap<usize, SkinNodes>,
        skinned: &[gltf::Node<'_>],
    ) -> Result<(), String> {
        let belongs = |node: &usize| tree.is_below(*node, self.root) || tree.is_below(self.root, *node);
        let others: BTreeSet<usize> =
            skins.iter().filter(|(_, skin)| !skin.nodes.iter().any(belongs)).map(|(index, _)| *index).collect();
        if others.is_empty() {
            return Ok(());
        }
        let is_other = |node: &&gltf::Node<'_>| node.skin().is_some_and(|skin| others.contains(&skin.index()));
        Err(format!(
            "meshes of several skeletons: {}, and separately {}; expected one figure: export one of them",
            names_of(skinned.iter().filter(|node| !is_other(node))),
            names_of(skinned.iter().filter(is_other))
        ))
    }

    /// Landmarks that are joints.
    pub(super) fn landmarks(&self) -> Vec<(String, usize)> {
        let mut landmarks = Vec::new();
        for (limbs, names) in [(&self.legs, LEGS), (&self.arms, ARMS)] {
            for (nodes, names) in limbs.iter().zip(names) {
                landmarks.extend(names.iter().map(|landmark| landmark.name().to_owned()).zip(*nodes));
            }
        }
        for (side, toes) in ["left", "right"].into_iter().zip(self.toes) {
            landmarks.extend(toes.map(|toes| (format!("{side}_toes"), toes)));
        }
        landmarks.extend(self.neck.map(|neck| ("thorax".to_owned(), neck)));
        landmarks
    }

    /// The landmarks as `joint_map` takes them.
    pub(super) fn joint_map(&self, tree: &NodeTree) -> BTreeMap<String, String> {
        let own = self.landmarks().into_iter().filter(|(landmark, _)| !landmark.ends_with("_toes"));
        let mut map: BTreeMap<String, String> =
            own.map(|(landmark, node)| (landmark, tree.names[node].clone())).collect();
        map.insert("head_top".to_owned(), format!("{}:tip", tree.names[self.head].as_str()));
        map.insert("pelvis".to_owned(), format!("{}+{}", map["left_hip"], map["right_hip"]));
        map
    }

    /// The nodes that begin a body segment.
    pub(super) fn segments(&self, tree: &NodeTree, bind: &BindPose) -> BTreeMap<usize, String> {
        let mut segments = BTreeMap::new();
        segments.insert(self.pelvis, "pelvis".to_owned());
        let [hips, shoulders] = [&self.legs, &self.arms].map(|l| (bind.origin(l[0][0]) + bind.origin(l[1][0])) * 0.5);
        let up = self.neck.map_or(shoulders, |neck| bind.origin(neck)) - hips;
        for node in tree.upwards(self.chest).take_while(|node| *node != self.root) {
            let is_low = (bind.origin(node) - hips).dot(&up) <= LOW_IN_TRUNK * up.norm_squared();
            let segment = if is_low && node != self.chest { "abdomen" } else { "thorax" };
            segments.insert(node, segment.to_owned());
        }
        if let Some(neck) = self.neck.filter(|neck| tree.is_below(self.head, *neck)) {
            for node in tree.upwards(self.head).take_while(|node| *node != neck).chain([neck]) {
                segments.insert(node, "neck".to_owned());
            }
        }
        segments.insert(self.head, "head".to_owned());
        for (side, (leg, arm)) in ["left", "right"].into_iter().zip(self.legs.iter().zip(&self.arms)) {
            for node in tree.upwards(arm[0]).skip(1).take_while(|node| *node != self.chest) {
                segments.insert(node, format!("{side}_clavicle"));
            }
            let names = ["thigh", "shank", "foot", "upper_arm", "forearm", "hand"];
            for (node, name) in leg.iter().chain(arm).zip(names) {
                segments.insert(*node, format!("{side}_{name}"));
            }
        }
        for (side, toes) in ["left", "right"].into_iter().zip(self.toes) {
            segments.extend(toes.map(|toes| (toes, format!("{side}_toes"))));
        }
        segments
    }
}

/// The nodes among which a body is looked for: joints and all other nodes without a mesh, because a skin need not have
/// the joints of the whole body.
struct Searched<'a> {
    tree: JointTree<'a>,
    /// The node of each joint of the tree.
    nodes: Vec<usize>,
}

impl<'a> Searched<'a> {
    fn new(tree: &'a NodeTree, skins: &BTreeMap<usize, SkinNodes>, bind: &BindPose) -> Self {
        let joints: BTreeSet<usize> = skins.values().flat_map(|skin| skin.nodes.iter().copied()).collect();
        let mut searched = Self { tree: JointTree::default(), nodes: Vec::new() };
        let mut index_of = BTreeMap::new();
        let mut pose = Vec::new();
        for &node in tree.order.iter().filter(|node| joints.contains(node) || !tree.has_mesh[**node]) {
            index_of.insert(node, searched.nodes.len());
            searched.nodes.push(node);
            searched.tree.names.push(tree.names[node].as_str());
            let parent = tree.upwards(node).skip(1).find_map(|above| index_of.get(&above).copied());
            searched.tree.parents.push(parent);
            pose.push(forward(bind.origin(node)));
        }
        searched.tree.poses.push(pose);
        searched
    }
}
