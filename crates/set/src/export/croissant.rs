//! Croissant 1.0: a JSON-LD description and a table of the images.

use serde_json::{Value, json};

use super::folder::Folder;
use crate::{BenchmarkSet, SetError};
use skiagraph_core::input::{harmless, hex_sha256};

const README: &str = "\
croissant.json   Croissant 1.0: mlcroissant.Dataset(\"croissant.json\").records(\"frames\")
frames.csv       a row per camera and frame: image, camera, frame, time_s, area_px, markers_visible. A camera's name that
                 readers of tables take for a number, a formula or nothing (NA) has an apostrophe before it, which
                 croissant.json takes off
masks/           the silhouettes that the table names";

/// Addition to the README for a set with images.
const IMAGES: &str = "
images/          what the cameras saw; the column colour names them";

/// Name, type and description of a column.
type Column = (&'static str, &'static str, &'static str);

/// The table's columns; the last one only for a set with images.
const COLUMNS: [Column; 7] = [
    ("image", "sc:Text", "path of the silhouette: 8-bit grey PNG, 255 where the body is"),
    ("camera", "sc:Text", "the camera's name"),
    ("frame", "sc:Integer", "number of the frame, from 0"),
    ("time_s", "sc:Float", "when the image was exposed, seconds from the first frame"),
    ("area_px", "sc:Integer", "pixels of the silhouette"),
    ("markers_visible", "sc:Integer", "how many of HumanEva's 15 markers the camera sees"),
    ("colour", "sc:Text", "path of the camera's image: 8 bits, RGB or grey"),
];

fn columns(set: &BenchmarkSet) -> &'static [Column] {
    if set.blind.has_colour() { &COLUMNS } else { &COLUMNS[..6] }
}

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let images = if set.blind.has_colour() { IMAGES } else { "" };
    folder.readme(&set.blind, &format!("{README}{images}"))?;
    let mut table = csv::Writer::from_writer(Vec::new());
    let malformed = |e: &dyn std::fmt::Display| SetError::malformed("frames.csv", e.to_string());
    table.write_record(columns(set).iter().map(|(name, ..)| name)).map_err(|e| malformed(&e))?;
    folder.for_each_picture(&set.blind, |picture| {
        let image = format!("masks/cam{:02}_{:06}.png", picture.camera, picture.frame);
        folder.write(&image, &picture.png)?;
        let frame = &set.truth.ground_truth.frames[picture.frame];
        let moment = set.blind.moment(picture.frame);
        let exposed_s = moment.and_then(|moment| moment.exposed_s[picture.camera]);
        let visible = frame.visible[picture.camera].iter().filter(|visible| **visible).count();
        let mut row = vec![
            image,
            name_cell(&set.blind.rig.cameras[picture.camera].name),
            picture.frame.to_string(),
            exposed_s.unwrap_or(frame.time_s).to_string(),
            picture.mask.count().to_string(),
            visible.to_string(),
        ];
        if let Some(image) = picture.image(&set.blind)? {
            let path = format!("images/cam{:02}_{:06}.{}", picture.camera, picture.frame, image.extension);
            folder.write(&path, &image.bytes)?;
            row.push(path);
        }
        table.write_record(row).map_err(|e| malformed(&e))
    })?;
    let table = table.into_inner().map_err(|e| malformed(&e))?;
    folder.write("frames.csv", &table)?;
    let text = serde_json::to_vec_pretty(&description(set, &table)).map_err(|e| malformed(&e))?;
    folder.write("croissant.json", &text)
}

/// A name, with an apostrophe before it unless every reader of tables takes it for text.
fn name_cell(name: &str) -> String {
    let name: String = name.chars().map(harmless).collect();
    let other = ["na", "n/a", "nan", "null", "none", "true", "false", "inf", "infinity"];
    let is_text = name.starts_with(char::is_alphabetic) && !other.contains(&name.to_lowercase().as_str());
    if is_text { name } else { format!("'{name}") }
}

fn description(set: &BenchmarkSet, table: &[u8]) -> Value {
    let motion = &set.truth.facts.motion;
    let words = format!(
        "Silhouettes of an animated humanoid from {} cameras, {} frames at {} frames a second, with exact ground truth. \
        Motion: {motion}",
        set.blind.rig.cameras.len(),
        set.blind.frame_count,
        set.blind.frames_per_second
    );
    let rows = "every image of every camera";
    let table = CroissantTable { name: "frames", content: table, rows, columns: columns(set) };
    let mut described = table.describe(&set.blind.name, &words, &set.blind.set_hash);
    // a name that readers of tables take for something else has an apostrophe before it
    if let Some(fields) = described["recordSet"][0]["field"].as_array_mut() {
        for camera in fields.iter_mut().filter(|field| field["name"] == "camera") {
            camera["source"]["transform"] = json!({ "regex": "^'?(.*)$" });
        }
    }
    described
}

/// A table of CSV that a description in Croissant 1.0 covers.
#[derive(Clone, Copy, Debug)]
pub struct CroissantTable<'a> {
    /// The name of its records and, with `.csv`, of its file.
    pub name: &'a str,
    /// The file's bytes.
    pub content: &'a [u8],
    /// What its rows are, in words.
    pub rows: &'a str,
    /// Name, type (`sc:Text`, `sc:Integer`, `sc:Float`) and description of each column.
    pub columns: &'a [(&'a str, &'a str, &'a str)],
}

impl CroissantTable<'_> {
    /// The description of a data set that consists of this table.
    pub fn describe(&self, name: &str, words: &str, identifier: &str) -> Value {
        let (records, file) = (self.name, format!("{}.csv", self.name));
        let field = |(name, kind, words): &(&str, &str, &str)| {
            json!({
                "@type": "cr:Field", "@id": format!("{records}/{name}"), "name": name, "description": words,
                "dataType": kind, "source": { "fileObject": { "@id": file }, "extract": { "column": name } },
            })
        };
        json!({
            "@context": context(),
            "@type": "sc:Dataset",
            "conformsTo": "http://mlcommons.org/croissant/1.0",
            "name": name,
            "description": words,
            "version": "1.0.0",
            "identifier": identifier,
            "isLiveDataset": false,
            "distribution": [{
                "@type": "cr:FileObject", "@id": file, "name": file, "contentUrl": file,
                "encodingFormat": "text/csv", "sha256": hex_sha256(self.content), "description": self.rows,
            }],
            "recordSet": [{
                "@type": "cr:RecordSet", "@id": records, "name": records, "description": self.rows,
                "field": self.columns.iter().map(field).collect::<Vec<_>>(),
            }],
        })
    }
}

/// The context of Croissant 1.0, from its specification.
fn context() -> Value {
    let mut context = json!({
        "@language": "en",
        "@vocab": "https://schema.org/",
        "cr": "http://mlcommons.org/croissant/",
        "rai": "http://mlcommons.org/croissant/RAI/",
        "dct": "http://purl.org/dc/terms/",
        "sc": "https://schema.org/",
        "conformsTo": "dct:conformsTo",
        "data": { "@id": "cr:data", "@type": "@json" },
        "dataType": { "@id": "cr:dataType", "@type": "@vocab" },
        "examples": { "@id": "cr:examples", "@type": "@json" },
    });
    let words = "citeAs column extract field fileProperty fileObject fileSet format includes isLiveDataset jsonPath \
                 key md5 parentField path recordSet references regex repeated replace separator source subField \
                 transform";
    for word in words.split(' ') {
        context[word] = format!("cr:{word}").into();
    }
    context
}
