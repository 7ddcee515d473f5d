//! The XML of a robot: positions of its elements, and the checks required to call `urdf-rs` safely.
//!
//! `urdf-rs` accepts NaN, skips words that are not numbers, and does not name line or element in its errors. It also
//! rejects a file for parts that a body does not need (for example a `<texture>` without a name), so it receives only
//! the elements in [`NEEDED`].

use std::borrow::Cow;

use roxmltree::Node;

use super::UrdfError;
use super::limits::{LONGEST_NAME, MOST_NODES, check_attributes, parse_xml};
use crate::body::bounds::MOST_LINKS;
use crate::input::{excerpt, plain, unquoted};

const MAX_DEPTH: usize = 32;
/// Greatest magnitude of any number except limits.
const MAX_NUMBER: f64 = 1e6;

/// Element, attribute, number of values, whether it is required, whether infinity is allowed.
const NUMBERS: &[(&str, &str, usize, bool, bool)] = &[
    ("origin", "xyz", 3, false, false),
    ("origin", "rpy", 3, false, false),
    ("origin", "quat_xyzw", 4, false, false),
    ("axis", "xyz", 3, true, false),
    ("limit", "lower", 1, false, true),
    ("limit", "upper", 1, false, true),
    ("limit", "effort", 1, false, true),
    ("limit", "velocity", 1, false, true),
    ("mimic", "multiplier", 1, false, false),
    ("mimic", "offset", 1, false, false),
    ("mass", "value", 1, true, false),
    ("inertia", "ixx", 1, true, false),
    ("inertia", "ixy", 1, true, false),
    ("inertia", "ixz", 1, true, false),
    ("inertia", "iyy", 1, true, false),
    ("inertia", "iyz", 1, true, false),
    ("inertia", "izz", 1, true, false),
    ("box", "size", 3, true, false),
    ("sphere", "radius", 1, true, false),
    ("cylinder", "radius", 1, true, false),
    ("cylinder", "length", 1, true, false),
    ("capsule", "radius", 1, true, false),
    ("capsule", "length", 1, true, false),
    ("mesh", "scale", 3, false, false),
];

/// Parent element, child element, attribute: required names.
const WORDS: &[(&str, &str, &str)] = &[
    ("robot", "link", "name"),
    ("robot", "joint", "name"),
    ("robot", "joint", "type"),
    ("joint", "parent", "link"),
    ("joint", "child", "link"),
    ("joint", "mimic", "joint"),
    ("geometry", "mesh", "filename"),
];

/// Elements with those children that define a body; all other elements are ignored.
const NEEDED: &[(&str, &[&str])] = &[
    ("robot", &["link", "joint"]),
    ("link", &["inertial", "visual", "collision"]),
    ("inertial", &["origin", "mass", "inertia"]),
    ("visual", &["origin", "geometry"]),
    ("collision", &["origin", "geometry"]),
    ("geometry", &SHAPES),
    ("joint", &["origin", "parent", "child", "axis", "limit", "mimic"]),
];

/// Greatest number of undeclared XML name spaces that are declared automatically.
const MAX_UNDECLARED: usize = 16;

const JOINT_TYPES: [&str; 7] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];
const SHAPES: [&str; 5] = ["sphere", "cylinder", "capsule", "box", "mesh"];

/// A URDF's XML. Links and joints are counted in the order in which `urdf-rs` lists them.
pub(super) struct Document<'t> {
    file: &'t str,
    xml: roxmltree::Document<'t>,
    links: Vec<roxmltree::NodeId>,
    joints: Vec<roxmltree::NodeId>,
}

impl<'t> Document<'t> {
    pub(super) fn parse(text: &'t str, file: &'t str) -> Result<Self, UrdfError> {
        // files that are not robots are not quoted
        let is_robot = text.contains("<robot");
        let not_xml = |(line, problem): (u32, String)| {
            let reason = if is_robot { problem } else { unquoted(problem) };
            UrdfError::not_xml(file, line, &reason)
        };
        let xml = parse_xml(text, MOST_NODES).map_err(not_xml)?;
        let robot = xml.root_element();
        let ids = |tag: &str| robot.children().filter(|n| n.has_tag_name(tag)).map(|n| n.id()).collect();
        let (links, joints) = (ids("link"), ids("joint"));
        Ok(Self { file, xml, links, joints })
    }

    pub(super) fn link(&self, index: usize) -> Node<'_, 't> {
        self.node(self.links.get(index))
    }

    pub(super) fn joint(&self, index: usize) -> Node<'_, 't> {
        self.node(self.joints.get(index))
    }

    fn node(&self, id: Option<&roxmltree::NodeId>) -> Node<'_, 't> {
        id.and_then(|&id| self.xml.get_node(id)).unwrap_or(self.xml.root_element())
    }

    pub(super) fn refuse(&self, node: Node<'_, '_>, problem: impl Into<String>) -> UrdfError {
        let owner = node.ancestors().find(|n| n.has_tag_name("link") || n.has_tag_name("joint")).unwrap_or(node);
        let is_robot = self.xml.root_element().has_tag_name("robot");
        let element = match owner.attribute("name") {
            _ if !is_robot => "the outermost element".to_owned(),
            Some(name) => format!("{} `{name}`", owner.tag_name().name()),
            None => format!("<{}>", owner.tag_name().name()),
        };
        let line = self.xml.text_pos_at(node.range().start).row;
        let problem: String = problem.into();
        UrdfError::Refused(format!("{}:{line}: {}: {}", plain(self.file), excerpt(&element), plain(problem)))
    }

    pub(super) fn refuse_robot(&self, problem: String) -> UrdfError {
        self.refuse(self.xml.root_element(), problem)
    }

    /// Checks every element that `urdf-rs` will read, then calls it.
    pub(super) fn check_and_read(&self, text: &str) -> Result<urdf_rs::Robot, UrdfError> {
        let robot = self.xml.root_element();
        if !robot.has_tag_name("robot") {
            return Err(self.refuse(robot, "expected <robot> as the outermost element; is this a URDF?"));
        }
        self.check_length(robot, "name")?;
        if self.links.is_empty() {
            return Err(self.refuse(robot, "no <link>; expected at least one"));
        }
        if let Some(&extra) = self.links.get(MOST_LINKS).or(self.joints.get(MOST_LINKS)) {
            let extra = self.node(Some(&extra));
            return Err(self.refuse(extra, format!("more than {MOST_LINKS} links or joints")));
        }
        if let Some(deep) = robot.descendants().find(|n| n.ancestors().nth(MAX_DEPTH).is_some()) {
            return Err(self.refuse(deep, format!("elements nested deeper than {MAX_DEPTH}")));
        }
        for part in robot.children().filter(|n| n.has_tag_name("link") || n.has_tag_name("joint")) {
            for node in part.descendants().filter(|n| n.is_element() && n.ancestors().all(|a| is_needed(&a))) {
                self.check_words(node)?;
                self.check_numbers(node)?;
            }
            self.check_joint(part)?;
            self.check_geometries(part)?;
        }
        let read = urdf_rs::read_from_string(&self.needed(text))
            .map_err(|e| self.refuse(robot, format!("urdf-rs cannot read this URDF: {}", excerpt(&e.to_string()))))?;
        if read.links.len() != self.links.len() || read.joints.len() != self.joints.len() {
            return Err(self.refuse(robot, "urdf-rs found a different number of links and joints"));
        }
        Ok(read)
    }

    /// The quaternions that are not read, because URDF has them since version 1.1.
    pub(super) fn note_of_quaternions(&self) -> Option<String> {
        let has_one = |node: &Node<'_, '_>| node.has_tag_name("origin") && node.has_attribute("quat_xyzw");
        let mut ignored =
            self.xml.descendants().filter(|node| has_one(node) && node.ancestors().all(|a| is_needed(&a)));
        let first = ignored.next().filter(|_| self.version() < (1, 1))?;
        let (line, count) = (self.xml.text_pos_at(first.range().start).row, 1 + ignored.count());
        Some(format!(
            "quat_xyzw of {count} <origin> is ignored, the first in line {line}: URDF has it since version 1.1; write \
             <robot version=\"1.1\" ...>, or rpy in its place"
        ))
    }

    /// The text with unneeded elements replaced by blanks.
    fn needed(&self, text: &str) -> String {
        let mut bytes = text.as_bytes().to_vec();
        let passed_over = self.xml.descendants().filter(|n| n.is_element() && !is_needed(n));
        for range in passed_over.map(|n| n.range()) {
            bytes[range].iter_mut().filter(|b| !b.is_ascii_whitespace()).for_each(|b| *b = b' ');
        }
        String::from_utf8_lossy(&bytes).into_owned()
    }

    fn check_words(&self, node: Node<'_, '_>) -> Result<(), UrdfError> {
        let parent = node.parent_element().map_or("", |p| p.tag_name().name());
        for &(_, tag, attribute) in WORDS.iter().filter(|w| w.0 == parent && node.has_tag_name(w.1)) {
            if node.attribute(attribute).is_none_or(|value| value.trim().is_empty()) {
                return Err(self.refuse(node, format!("<{tag}> needs the attribute `{attribute}`")));
            }
            if attribute != "filename" {
                self.check_length(node, attribute)?;
            }
        }
        Ok(())
    }

    fn check_length(&self, node: Node<'_, '_>, attribute: &str) -> Result<(), UrdfError> {
        let length = node.attribute(attribute).map_or(0, |value| value.chars().count());
        if length <= LONGEST_NAME {
            return Ok(());
        }
        Err(self.refuse(node, format!("`{attribute}` has {length} characters; expected at most {LONGEST_NAME}")))
    }

    fn check_numbers(&self, node: Node<'_, '_>) -> Result<(), UrdfError> {
        for &(tag, attribute, count, required, infinite) in NUMBERS.iter().filter(|n| node.has_tag_name(n.0)) {
            let expected = if count == 1 { "a number".to_owned() } else { format!("{count} numbers") };
            let Some(value) = node.attribute(attribute) else {
                if required {
                    return Err(self.refuse(node, format!("<{tag}> needs `{attribute}` with {expected}")));
                }
                continue;
            };
            let numbers: Vec<Option<f64>> = value.split_whitespace().map(|w| w.parse().ok()).collect();
            let valid = |n: &Option<f64>| n.is_some_and(|n| n.abs() <= MAX_NUMBER || (infinite && !n.is_nan()));
            if numbers.len() != count || !numbers.iter().all(valid) {
                let xacro =
                    if value.contains("${") { "; expand the macros first: `xacro FILE > robot.urdf`" } else { "" };
                return Err(self.refuse(
                    node,
                    format!(
                        "<{tag} {attribute}=\"{}\">: expected {expected}, finite and at most {MAX_NUMBER}{xacro}",
                        excerpt(value)
                    ),
                ));
            }
        }
        Ok(())
    }

    fn check_joint(&self, joint: Node<'_, '_>) -> Result<(), UrdfError> {
        if !joint.has_tag_name("joint") {
            return Ok(());
        }
        let kind = joint.attribute("type").unwrap_or_default();
        if !JOINT_TYPES.contains(&kind) {
            return Err(self.refuse(joint, format!("unknown joint type `{kind}`; expected {}", JOINT_TYPES.join(", "))));
        }
        for end in ["parent", "child"] {
            if child(joint, end).is_none() {
                return Err(self.refuse(joint, format!("needs <{end} link=\"...\"/>")));
            }
        }
        let Some(limit) = child(joint, "limit") else { return Ok(()) };
        let number = |attribute| limit.attribute(attribute).and_then(|v: &str| v.trim().parse::<f64>().ok());
        if let (Some(lower), Some(upper)) = (number("lower"), number("upper"))
            && lower > upper
        {
            return Err(self.refuse(limit, format!("lower limit {lower} is above upper limit {upper}; swap them")));
        }
        let early = self.version() < (1, 2);
        if early && limit.attribute("velocity").is_none() {
            return Err(self.refuse(limit, "<limit> needs `velocity` (greatest speed, rad/s or m/s) and `effort`"));
        }
        Ok(())
    }

    fn check_geometries(&self, link: Node<'_, '_>) -> Result<(), UrdfError> {
        if !link.has_tag_name("link") {
            return Ok(());
        }
        for solid in link.children().filter(|n| n.has_tag_name("visual") || n.has_tag_name("collision")) {
            self.check_length(solid, "name")?;
            let shape = child(solid, "geometry").and_then(|g| g.children().find(Node::is_element));
            if !shape.is_some_and(|s| SHAPES.contains(&s.tag_name().name())) {
                let tag = solid.tag_name().name();
                return Err(self.refuse(solid, format!("<{tag}> needs a <geometry> with one of {}", SHAPES.join(", "))));
            }
        }
        if let Some(inertial) = child(link, "inertial") {
            for part in ["mass", "inertia"] {
                if child(inertial, part).is_none() {
                    return Err(self.refuse(inertial, format!("<inertial> needs <{part}>")));
                }
            }
        }
        Ok(())
    }

    /// The URDF version stated in the text; 1.0 by default.
    fn version(&self) -> (u32, u32) {
        self.xml
            .root_element()
            .attribute("version")
            .and_then(|v| v.trim().split_once('.'))
            .and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)))
            .unwrap_or((1, 0))
    }
}

/// Whether this element, given its parent, is part of a body's definition.
fn is_needed(node: &Node<'_, '_>) -> bool {
    let Some(parent) = node.parent_element() else { return true };
    let children = NEEDED.iter().find(|(tag, _)| parent.has_tag_name(*tag)).map_or(&[][..], |(_, children)| children);
    children.iter().any(|tag| node.has_tag_name(*tag))
}

/// The text with declarations of all undeclared XML name spaces (`<xacro:...>`, `<controller:...>`): those elements
/// are ignored anyway.
pub(super) fn with_name_spaces(text: &str) -> Cow<'_, str> {
    let mut text = Cow::Borrowed(text);
    // the XML reader compares all pairs of attributes: elements with too many are rejected before parsing
    if check_attributes(&text).is_err() {
        return text;
    }
    for _ in 0..MAX_UNDECLARED {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = roxmltree::Document::parse(&text) else { break };
        let Some(at) = text.find("<robot").map(|at| at + "<robot".len()) else { break };
        text.to_mut().insert_str(at, &format!(" xmlns:{prefix}=\"urn:undeclared\""));
    }
    text
}

/// The first child element with this tag.
pub(super) fn child<'a, 't>(node: Node<'a, 't>, tag: &str) -> Option<Node<'a, 't>> {
    node.children().find(|n| n.has_tag_name(tag))
}
