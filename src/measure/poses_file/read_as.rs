//! How the numbers of a file were read: declared by its format or the user, or assumed.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::PosesDeclared;
use skiagraph_eval::AxisOrder;
use skiagraph_truth::mocap::UpAxis;

/// Units of length that can be declared: the value of `--units`, the plural, metres.
pub const UNITS_OF_LENGTH: [(&str, &str, f64); 5] = [
    ("m", "metres", 1.0),
    ("cm", "centimetres", 0.01),
    ("mm", "millimetres", 0.001),
    ("in", "inches", 0.0254),
    ("ft", "feet", 0.3048),
];

/// How another program's file of poses was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadAs {
    pub file: String,
    /// Metres per unit of length; absent if guessed from the size of the body.
    pub metres_per_unit: Option<f64>,
    pub units_from: String,
    /// The file's three coordinates as axes of the set.
    pub axes: String,
    pub axes_from: String,
    /// Whether left and right were exchanged (`--swap-sides`).
    pub swapped_sides: bool,
    /// Number of frames by which the estimates were moved (`--shift`).
    pub shift_frames: Option<i64>,
    /// Offset added to the positions, metres (`--offset`).
    pub offset_m: Option<[f64; 3]>,
    /// The camera in whose axes the positions are (`--camera`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// The keypoint layout of its names, if they are not those of this program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layout: Option<String>,
    /// Names of columns that were not read, as a list; a note of the run lists them too.
    #[serde(skip)]
    pub(in crate::measure) left_out: Option<String>,
    /// The file's name of every marker that it has.
    #[serde(skip)]
    pub(in crate::measure) columns: BTreeMap<String, String>,
    /// Whether its own numbers or times begin at frame 1.
    #[serde(skip)]
    pub(in crate::measure) begins_at_one: bool,
    /// Whether its joint angles were read as degrees.
    #[serde(skip)]
    pub(in crate::measure) angles_in_degrees: bool,
    #[serde(skip, default = "axes_of_the_set")]
    pub(in crate::measure) order: AxisOrder,
    /// The axes without `--up`, `--axes` and `--camera`.
    #[serde(skip, default = "axes_of_the_set")]
    pub(in crate::measure) usual_order: AxisOrder,
    /// The lines of the declared joint map.
    #[serde(skip)]
    pub(in crate::measure) joint_map: BTreeMap<String, String>,
}

/// A file's name without its folder.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn axes_of_the_set() -> AxisOrder {
    AxisOrder::SAME
}

/// The units and axes of a format, used if the user declares none.
#[derive(Clone, Copy, Debug)]
pub(super) struct FormatUsage {
    /// Metres per unit; `None`: guessed.
    pub(super) metres: Option<f64>,
    pub(super) units_from: &'static str,
    pub(super) order: AxisOrder,
    pub(super) axes_from: &'static str,
    /// The axes for `--up y`.
    pub(super) y_up: AxisOrder,
}

impl ReadAs {
    pub(super) fn new(path: &Path, usage: FormatUsage, declared: &PosesDeclared) -> Self {
        let (order, axes_from) = match (declared.axes, declared.up, declared.from) {
            _ if declared.camera.is_some() => (AxisOrder::SAME, "--camera"),
            (Some(order), ..) => (order, "--axes"),
            (None, Some(UpAxis::Y), _) => (usage.y_up, "--up"),
            (None, Some(_), _) => (AxisOrder::SAME, "--up"),
            (None, None, Some(pipeline)) => (pipeline.order, "--from"),
            (None, None, None) => (usage.order, usage.axes_from),
        };
        let (metres_per_unit, units_from) = match declared.metres_per_unit {
            Some(metres) => (Some(metres), "--units"),
            None => (usage.metres, usage.units_from),
        };
        Self {
            file: name(path),
            metres_per_unit,
            units_from: units_from.to_owned(),
            axes: order.to_string(),
            axes_from: axes_from.to_owned(),
            swapped_sides: declared.swap_sides,
            shift_frames: declared.shift,
            offset_m: declared.offset_m,
            camera: declared.camera.clone(),
            begins_at_one: false,
            angles_in_degrees: declared.radians_per_unit.is_some_and(|radians| radians != 1.0),
            layout: None,
            left_out: None,
            columns: BTreeMap::new(),
            order,
            usual_order: declared.from.map_or(usage.order, |pipeline| pipeline.order),
            joint_map: BTreeMap::new(),
        }
    }

    pub(in crate::measure) fn offset(&self) -> Vector3<f64> {
        self.offset_m.map_or(Vector3::zeros(), Vector3::from)
    }

    /// One line with the declared and assumed properties.
    pub fn describe(&self) -> String {
        let unit = self.metres_per_unit.map(|metres| {
            let known = UNITS_OF_LENGTH.iter().find(|(.., known)| *known == metres);
            known.map_or_else(|| format!("units of {metres} m"), |(_, plural, _)| (*plural).to_owned())
        });
        let mut parts = vec![
            format!("{} ({})", unit.unwrap_or_else(|| "units".to_owned()), self.units_from),
            match &self.camera {
                Some(camera) => format!("axes of camera {camera} (--camera)"),
                None => format!("{}, axes {} ({})", self.order.up_axis(), self.axes, self.axes_from),
            },
        ];
        parts.extend(self.layout.as_ref().map(|layout| format!("{layout} names")));
        parts.extend(self.swapped_sides.then(|| "left and right exchanged (--swap-sides)".to_owned()));
        parts.extend(self.shift_frames.map(|shift| format!("frame 0 is the set's frame {shift} (--shift)")));
        parts.extend(self.offset_m.map(|[x, y, z]| format!("moved by {x}, {y}, {z} m (--offset)")));
        parts.extend(self.left_out.as_ref().map(|names| format!("not used: {names}")));
        format!("read {}: {}", self.file, parts.join("; "))
    }
}
