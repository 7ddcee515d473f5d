//! `truth/props.json`: the props, absent without props. Solids have the format of a body's geometry, in world
//! coordinates.

use serde::{Deserialize, Serialize};

use super::body_file::SolidRecord;
use crate::SetError;
use skiagraph_core::body::{Prop, Solid};
use skiagraph_core::input::excerpt;

pub(crate) const PATH: &str = "truth/props.json";
/// Greatest number of props.
const MOST_PROPS: usize = 1_000;
const SCHEMA: &str = "skiagraph.props/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PropsRecord {
    schema: String,
    props: Vec<PropRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PropRecord {
    name: String,
    solid: SolidRecord,
}

/// The bytes of the file.
pub(crate) fn to_json(props: &[Prop]) -> Result<Vec<u8>, SetError> {
    let record = |prop: &Prop| PropRecord { name: prop.name.clone(), solid: SolidRecord::new(&prop.solid) };
    super::json::to_bytes(PATH, &PropsRecord { schema: SCHEMA.to_owned(), props: props.iter().map(record).collect() })
}

/// The props of a file written by [`to_json`].
pub(crate) fn from_json(bytes: &[u8]) -> Result<Vec<Prop>, SetError> {
    let record: PropsRecord = super::json::from_bytes(PATH, SCHEMA, bytes)?;
    if record.props.len() > MOST_PROPS {
        let detail = format!("{} props; expected at most {MOST_PROPS}", record.props.len());
        return Err(SetError::malformed(PATH, detail));
    }
    let bounded = |solid: Solid| solid.check_bounds().map(|()| solid);
    let prop = |PropRecord { name, solid }| match solid.solid().and_then(bounded) {
        Ok(solid) => Ok(Prop { name, solid }),
        Err(detail) => Err(SetError::malformed(PATH, format!("prop {:?}: {detail}", excerpt(&name)))),
    };
    record.props.into_iter().map(prop).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    #[test]
    fn props_are_read_back_and_a_malformed_file_is_named() {
        let frame = Isometry3::new(Vector3::new(1.0, 2.0, 0.5), Vector3::new(0.0, 0.0, 0.3));
        let crate_ = Solid::Box { link_from_box: frame, half_extents: [0.5, 0.4, 0.3] };
        let pillar = Solid::Cylinder { link_from_cylinder: frame, radius: 0.2, half_length: 1.0 };
        let props = [("crate", crate_), ("pillar", pillar)].map(|(name, solid)| Prop { name: name.to_owned(), solid });
        let bytes = to_json(&props).unwrap();
        let read = from_json(&bytes).unwrap();
        for (read, written) in read.iter().zip(&props) {
            assert_eq!(read.name, written.name);
        }
        let Solid::Box { link_from_box, half_extents } = &read[0].solid else { panic!("{read:?}") };
        assert!((link_from_box.to_homogeneous() - frame.to_homogeneous()).norm() < 1e-12);
        assert_eq!(*half_extents, [0.5, 0.4, 0.3]);
        let text = String::from_utf8(bytes).unwrap().replace("half_extents", "extents");
        assert!(from_json(text.as_bytes()).unwrap_err().to_string().contains("truth/props.json"));
    }

    #[test]
    fn a_prop_of_1e20_m_is_refused_with_the_limit() {
        let ball = SolidRecord::TaperedCapsule { a: [0.0; 3], b: [0.0; 3], radius_a: 1e20, radius_b: 1e20 };
        let props = vec![PropRecord { name: "sun".to_owned(), solid: ball }];
        let bytes = crate::format::json::to_bytes(PATH, &PropsRecord { schema: SCHEMA.to_owned(), props }).unwrap();
        let message = from_json(&bytes).unwrap_err().to_string();
        assert_eq!(message, "truth/props.json: prop \"sun\": a solid of size 1e20 m; expected 0 to 10000 m");
    }
}
