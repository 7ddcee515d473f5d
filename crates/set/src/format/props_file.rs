//! `truth/props.json`: the props, absent without props. Solids have the format of a body's geometry, in world
//! coordinates.

use serde::{Deserialize, Serialize};

use super::body_file::SolidRecord;
use crate::SetError;
use skiagraph_core::body::{Prop, Solid};
use skiagraph_core::input::excerpt;

pub(crate) const PATH: &str = "truth/props.json";
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

pub(crate) fn to_json(props: &[Prop]) -> Result<Vec<u8>, SetError> {
    let record = |prop: &Prop| PropRecord { name: prop.name.clone(), solid: SolidRecord::new(&prop.solid) };
    super::json::to_bytes(PATH, &PropsRecord { schema: SCHEMA.to_owned(), props: props.iter().map(record).collect() })
}

pub(crate) fn from_json(bytes: &[u8]) -> Result<Vec<Prop>, SetError> {
    let record: PropsRecord = super::json::from_bytes(PATH, &[SCHEMA], bytes)?;
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
