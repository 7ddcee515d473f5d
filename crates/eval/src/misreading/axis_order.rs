//! The axes along which the coordinates of a file lie.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Matrix3, Vector3};

const NAMES: [&str; 3] = ["x", "y", "z"];

/// The axes of a set (Z up) along which the first, second and third coordinate of a file lie, each with its sign.
/// `x,z,-y` is Y up; `y,z,x` is also Y up, with the set's x as the file's third coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOrder {
    /// Index of the set's axis, per coordinate of the file.
    axes: [usize; 3],
    /// Whether the coordinate has the opposite direction of that axis, per coordinate of the file.
    reversed: [bool; 3],
}

impl AxisOrder {
    /// The axes of the set.
    pub const SAME: Self = Self { axes: [0, 1, 2], reversed: [false; 3] };
    /// Y up as by `--up y`: a rotation about x.
    pub const Y_UP: Self = Self { axes: [0, 2, 1], reversed: [false, false, true] };
    /// Y up as usual in BVH files: the body faces +Z and its left is +X.
    pub const BVH: Self = Self { axes: [1, 2, 0], reversed: [false; 3] };

    /// All 48 orders, the 24 rotations first.
    pub fn all() -> Vec<Self> {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let signs = (0..8).map(|bits| [bits & 1 > 0, bits & 2 > 0, bits & 4 > 0]);
        let mut all: Vec<Self> =
            orders.iter().flat_map(|axes| signs.clone().map(|reversed| Self { axes: *axes, reversed })).collect();
        all.sort_by_key(Self::is_mirrored);
        all
    }

    /// The signed permutation from the file's coordinates to the set's.
    pub fn set_from_file(&self) -> Matrix3<f64> {
        let mut matrix = Matrix3::zeros();
        for (coordinate, (axis, reversed)) in self.axes.iter().zip(self.reversed).enumerate() {
            matrix[(*axis, coordinate)] = if reversed { -1.0 } else { 1.0 };
        }
        matrix
    }

    /// Whether the file's axes are left-handed.
    pub fn is_mirrored(&self) -> bool {
        self.set_from_file().determinant() < 0.0
    }

    /// Whether the vertical direction is the same in file and set.
    pub fn keeps_vertical(&self) -> bool {
        self.axes[2] == 2 && !self.reversed[2]
    }

    /// The order of a file whose coordinates, read as `self`, are to be read as `further`.
    pub fn then(&self, further: Self) -> Self {
        let of = |coordinate: usize| {
            let axis = self.axes[coordinate];
            (further.axes[axis], self.reversed[coordinate] != further.reversed[axis])
        };
        let found = [of(0), of(1), of(2)];
        Self { axes: found.map(|(axis, _)| axis), reversed: found.map(|(_, reversed)| reversed) }
    }

    /// Describes the axis of the file that points up: `Z up`, `-Y up`.
    pub fn up_axis(&self) -> String {
        let up = self.set_from_file().transpose() * Vector3::z();
        let axis = (0..3).find(|axis| up[*axis] != 0.0).unwrap_or(2);
        format!("{}{} up", if up[axis] < 0.0 { "-" } else { "" }, NAMES[axis].to_ascii_uppercase())
    }
}

impl fmt::Display for AxisOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = |coordinate: usize| {
            format!("{}{}", if self.reversed[coordinate] { "-" } else { "" }, NAMES[self.axes[coordinate]])
        };
        write!(f, "{},{},{}", word(0), word(1), word(2))
    }
}

impl FromStr for AxisOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || {
            "expected x, y and z once each, separated by commas, with `-` in front if the file's coordinate has the \
             opposite direction; for example y,z,x or x,z,-y"
                .to_owned()
        };
        let part = |part: &str| {
            let part = part.trim().to_ascii_lowercase();
            let name = part.strip_prefix(['-', '+']).unwrap_or(&part);
            let axis = NAMES.iter().position(|known| *known == name).ok_or_else(refuse)?;
            Ok::<_, String>((axis, part.starts_with('-')))
        };
        let parts = text.split(',').map(part).collect::<Result<Vec<_>, _>>()?;
        let parts: [(usize, bool); 3] = parts.try_into().map_err(|_| refuse())?;
        let axes = parts.map(|(axis, _)| axis);
        let each_once = (0..3).all(|axis| axes.contains(&axis));
        each_once.then(|| Self { axes, reversed: parts.map(|(_, reversed)| reversed) }).ok_or_else(refuse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_48_orders_of_which_half_are_rotations() {
        let all = AxisOrder::all();
        assert_eq!(all.iter().filter(|order| !order.is_mirrored()).count(), 24);
        assert!(all[..24].iter().all(|order| !order.is_mirrored()));
        let distinct: std::collections::BTreeSet<String> = all.iter().map(ToString::to_string).collect();
        assert_eq!(distinct.len(), 48);
        assert!(all.iter().all(|order| order.to_string().parse() == Ok(*order)));
    }

    #[test]
    fn the_order_maps_the_coordinates_of_the_file_to_the_set() {
        let order: AxisOrder = "y,z,-x".parse().unwrap();
        // the file's 1st coordinate is the set's y, its 2nd z, its 3rd -x
        assert_eq!(order.set_from_file() * Vector3::new(1.0, 2.0, 3.0), Vector3::new(-3.0, 1.0, 2.0));
        // Y-up files have always been read so: x, -z, y
        assert_eq!(AxisOrder::Y_UP.set_from_file() * Vector3::new(1.0, 2.0, 3.0), Vector3::new(1.0, -3.0, 2.0));
        assert_eq!(AxisOrder::Y_UP.to_string(), "x,z,-y");
        assert_eq!(AxisOrder::BVH.to_string(), "y,z,x");
        assert_eq!([AxisOrder::Y_UP, AxisOrder::SAME].map(|order| order.up_axis()), ["Y up", "Z up"]);
        assert_eq!("x,-z,y".parse::<AxisOrder>().unwrap().up_axis(), "-Y up");
    }

    #[test]
    fn the_composition_of_two_orders_is_the_product_of_their_matrices() {
        for first in AxisOrder::all() {
            for second in AxisOrder::all() {
                let product = second.set_from_file() * first.set_from_file();
                assert_eq!(first.then(second).set_from_file(), product, "{first} then {second}");
            }
        }
    }

    #[test]
    fn invalid_orders_are_refused_with_an_example() {
        for text in ["", "x,y", "x,y,y", "x,y,w", "x,y,z,x", "x y z", "--x,y,z"] {
            assert!(text.parse::<AxisOrder>().unwrap_err().contains("y,z,x"), "{text}");
        }
        assert_eq!(" X, -Z ,+Y".parse::<AxisOrder>().unwrap().to_string(), "x,-z,y");
    }
}
