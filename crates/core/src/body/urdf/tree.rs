//! The order of links: one root, no cycle, every parent before its children.

use std::collections::HashMap;

use urdf_rs::JointType;

use super::UrdfError;
use super::document::{Document, child};
use crate::input::excerpt;

/// The links of a URDF, parents first.
pub(super) struct Tree {
    /// Indices into the file's links, depth first, children in the order of the file's joints.
    pub(super) links: Vec<usize>,
    /// For every link of the file, the index of its parent joint.
    pub(super) joint_above: Vec<Option<usize>>,
    /// For every joint of the file, the index of its parent link.
    pub(super) parent_link: Vec<usize>,
    /// For every link of the file, its child joints.
    pub(super) joints_below: Vec<Vec<usize>>,
}

/// Orders the links, or reports why they are not a tree. An empty root with a floating or planar joint to the body is
/// left out, with a note: a body's root moves freely anyway.
pub(super) fn order(
    document: &Document<'_>,
    robot: &urdf_rs::Robot,
    notes: &mut Vec<String>,
) -> Result<Tree, UrdfError> {
    let links = unique(robot.links.iter().map(|l| l.name.as_str()), |i, name| {
        document.refuse(document.link(i), format!("a second link named `{name}`; names must be unique"))
    })?;
    unique(robot.joints.iter().map(|j| j.name.as_str()), |i, name| {
        document.refuse(document.joint(i), format!("a second joint named `{name}`; names must be unique"))
    })?;

    let mut tree = Tree {
        links: Vec::with_capacity(robot.links.len()),
        joint_above: vec![None; robot.links.len()],
        parent_link: Vec::with_capacity(robot.joints.len()),
        joints_below: vec![Vec::new(); robot.links.len()],
    };
    for (index, joint) in robot.joints.iter().enumerate() {
        let node = document.joint(index);
        let find = |end: &str, name: &str| {
            links.get(name).copied().ok_or_else(|| {
                let place = child(node, end).unwrap_or(node);
                document.refuse(place, format!("{end} link `{name}` does not exist; add <link name=\"{name}\"/>"))
            })
        };
        let (parent, below) = (find("parent", &joint.parent.link)?, find("child", &joint.child.link)?);
        if let Some(other) = tree.joint_above[below].replace(index) {
            let (link, joint) = (&joint.child.link, &robot.joints[other].name);
            let problem = format!("link `{link}` is already the child of joint `{joint}`; a link has one parent");
            return Err(document.refuse(node, problem));
        }
        tree.parent_link.push(parent);
        tree.joints_below[parent].push(index);
    }
    let top = root(document, robot, &tree)?;
    let free = free_joint(robot, &tree, top);
    if let Some(joint) = free {
        let (name, link) = (&robot.joints[joint].name, &robot.links[top].name);
        notes.push(format!("link `{link}` and joint `{name}` are left out: the body's root moves freely anyway"));
    }
    let root = free.map_or(top, |joint| links[robot.joints[joint].child.link.as_str()]);
    tree.joint_above[root] = None;
    let mut waiting = vec![root];
    while let Some(link) = waiting.pop() {
        tree.links.push(link);
        waiting.extend(tree.joints_below[link].iter().rev().map(|&j| links[robot.joints[j].child.link.as_str()]));
    }
    if tree.links.len() + usize::from(free.is_some()) < robot.links.len() {
        let is_outside = |link: &usize| *link != top && !tree.links.contains(link);
        let outside = (0..robot.links.len()).find(is_outside).unwrap_or(root);
        return Err(cycle(document, robot, &tree, outside));
    }
    Ok(tree)
}

fn unique<'a>(
    names: impl Iterator<Item = &'a str>,
    refuse: impl Fn(usize, &str) -> UrdfError,
) -> Result<HashMap<&'a str, usize>, UrdfError> {
    let mut indices = HashMap::new();
    for (index, name) in names.enumerate() {
        if indices.insert(name, index).is_some() {
            return Err(refuse(index, name));
        }
    }
    Ok(indices)
}

fn root(document: &Document<'_>, robot: &urdf_rs::Robot, tree: &Tree) -> Result<usize, UrdfError> {
    let mut roots = (0..robot.links.len()).filter(|&l| tree.joint_above[l].is_none());
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(root),
        (Some(first), Some(second)) => {
            let other = &robot.links[first].name;
            let problem = format!("has no parent joint, and neither has `{other}`; a humanoid has one root: join them");
            Err(document.refuse(document.link(second), problem))
        }
        (None, _) => Err(cycle(document, robot, tree, 0)),
    }
}

/// The free joint between an empty root and the body, if any.
fn free_joint(robot: &urdf_rs::Robot, tree: &Tree, root: usize) -> Option<usize> {
    let link = &robot.links[root];
    let is_empty = link.visual.is_empty() && link.collision.is_empty() && link.inertial.mass.value == 0.0;
    let &[joint] = tree.joints_below[root].as_slice() else { return None };
    let is_free = matches!(robot.joints[joint].joint_type, JointType::Floating | JointType::Planar);
    (is_empty && is_free).then_some(joint)
}

/// Follows parents from a link that is unreachable from the root until a link repeats.
fn cycle(document: &Document<'_>, robot: &urdf_rs::Robot, tree: &Tree, start: usize) -> UrdfError {
    let mut path = vec![start];
    let mut link = start;
    while let Some(joint) = tree.joint_above[link] {
        link = tree.parent_link[joint];
        if let Some(again) = path.iter().position(|&l| l == link) {
            path.drain(..again);
            break;
        }
        path.push(link);
    }
    path.push(link);
    let names: Vec<&str> = path.iter().rev().map(|&l| robot.links[l].name.as_str()).collect();
    let place = tree.joint_above[link].map_or(document.link(link), |j| document.joint(j));
    document.refuse(place, format!("the links form a cycle ({}); cut one joint", excerpt(&names.join(" -> "))))
}
