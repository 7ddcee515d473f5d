//! Modified sets with corrected hashes, and unmodified sets of every kind.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use skiagraph::benchmark_set::{Verification, VerifyOptions, verify};
use skiagraph::npz::{Array, Npz, Values};

use crate::sandbox::{Sandbox, TINY};

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Corrects the hash of a file in a list of the set, or removes it if the file is missing.
fn correct(list: &Path, name: &str, bytes: Option<&[u8]>) {
    let text = fs::read_to_string(list).unwrap();
    let line = |line: &str| match (line.ends_with(&format!("  {name}")), bytes) {
        (true, Some(bytes)) => format!("{}  {name}\n", digest(bytes)),
        (true, None) => String::new(),
        (false, _) => format!("{line}\n"),
    };
    fs::write(list, text.lines().map(line).collect::<String>()).unwrap();
}

/// A set on disk to modify.
struct ForgedSet(PathBuf);

impl ForgedSet {
    fn read(&self, file: &str) -> Vec<u8> {
        fs::read(self.0.join(file)).unwrap()
    }

    /// Writes a file and corrects its hash.
    fn write(&self, file: &str, bytes: &[u8]) {
        fs::write(self.0.join(file), bytes).unwrap();
        correct(&self.0.join("files.sha256"), file, Some(bytes));
    }

    fn remove(&self, file: &str) {
        fs::remove_file(self.0.join(file)).unwrap();
        correct(&self.0.join("files.sha256"), file, None);
    }

    fn json(&self, file: &str, change: impl FnOnce(&mut serde_json::Value)) {
        let mut value = serde_json::from_slice(&self.read(file)).unwrap();
        change(&mut value);
        self.write(file, serde_json::to_string_pretty(&value).unwrap().as_bytes());
    }

    fn arrays(&self, file: &str, change: impl Fn(&str, &Array) -> Option<Array>) {
        let npz = Npz::from_bytes(file, &self.read(file)).unwrap();
        let changed = npz.iter().filter_map(|(name, array)| Some((name, change(name, array)?)));
        self.write(file, &changed.collect::<Npz>().to_bytes(file).unwrap());
    }

    fn verified(&self) -> Verification {
        verify(&self.0, VerifyOptions::default()).unwrap()
    }

    #[track_caller]
    fn is_sound(&self) {
        let found = self.verified();
        let not_made = found.checks.iter().filter(|check| !check.made).collect::<Vec<_>>();
        assert!(found.is_sound(), "{:#?} {not_made:#?}", found.faults().collect::<Vec<_>>());
    }

    /// Modifies the set, checks that the fault is found, and restores everything.
    #[track_caller]
    fn found(&self, check: &str, file: &str, words: &str, forge: impl FnOnce(&Self)) {
        let before: Vec<(PathBuf, Vec<u8>)> =
            files(&self.0).map(|path| (path.clone(), fs::read(path).unwrap())).collect();
        forge(self);
        let found = self.verified();
        let is_it = |(name, fault): (&str, &skiagraph::benchmark_set::Fault)| {
            name == check && fault.file == file && fault.detail.contains(words)
        };
        let all: Vec<_> = found.faults().collect();
        assert!(all.iter().copied().any(is_it), "{check}, {file}, {words} is not among {all:#?}");
        assert!(all.iter().all(|(check, _)| *check != "hashes"), "{all:#?}");
        before.into_iter().for_each(|(path, bytes)| fs::write(path, bytes).unwrap());
    }
}

fn files(folder: &Path) -> Box<dyn Iterator<Item = PathBuf>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    Box::new(entries.flat_map(|path| if path.is_dir() { files(&path) } else { Box::new(std::iter::once(path)) }))
}

fn times(array: &Array, factor: f64) -> Array {
    let Values::F64(values) = &array.values else { panic!() };
    Array::new(&array.shape, values.iter().map(|x| x * factor).collect::<Vec<f64>>())
}

fn rendered(room: &Sandbox, settings: &str) -> ForgedSet {
    room.write("tiny.toml", TINY);
    room.succeed(&format!("render tiny.toml rig.ring.size_px=[48,36] {settings} --quiet --out set"));
    ForgedSet(room.path("set"))
}

#[test]
fn what_trackers_learn_from_and_are_known_by_is_recomputed_for_a_body_that_is_not_the_actor_s() {
    let room = Sandbox::new();
    let set = rendered(
        &room,
        "motion.last_frame=16 actor.robot=actor tracker_body.robot=actor tracker_body.mismatch=standard",
    );
    set.is_sound();
    set.found("start", "start/spread.npz", "2.000", |set| {
        set.arrays("start/spread.npz", |name, array| {
            Some(if name == "names" { array.clone() } else { times(array, 2.0) })
        });
    });
    set.found("start", "start/spread.npz", "1.020", |set| {
        set.arrays("start/spread.npz", |name, array| {
            Some(if name == "names" { array.clone() } else { times(array, 1.02) })
        });
    });
    set.found("start", "start/body.json", "times as thick", |set| {
        set.json("start/body.json", |body| thicker(body, 1.05))
    });
    set.found("poses", "truth/truth.npz", "1.0000 degrees", |set| {
        set.arrays("truth/truth.npz", |name, array| {
            let mut array = array.clone();
            if let (Values::F64(values), "refitted_angles") = (&mut array.values, name) {
                values[60] += 1_f64.to_radians();
            }
            Some(array)
        });
    });
    fingerprints_are_checked(&set);
}

fn fingerprints_are_checked(set: &ForgedSet) {
    let path = "truth/recording.npz";
    let with = |change: &dyn Fn(&str, &Array) -> Option<Array>| set.arrays(path, change);
    set.found("recording", path, "leg lengths", |_| {
        with(&|name, array| match (&array.values, name) {
            (Values::F32(v), "fingerprint") => Some(Array::new(&array.shape, vec![0.0_f32; v.len()])),
            _ => Some(array.clone()),
        });
    });
    set.found("recording", path, "leg lengths", |_| {
        with(&|name, array| match (&array.values, name) {
            (Values::F32(v), "fingerprint") => {
                Some(Array::new(&array.shape, v.iter().rev().map(|x| 1.9 - x).collect::<Vec<f32>>()))
            }
            _ => Some(array.clone()),
        });
    });
    for without in ["fingerprint_version", "fingerprint"] {
        set.found("recording", path, "has no fingerprint", |_| {
            with(&|name, array| match (name, without) {
                (name, "fingerprint") if name.starts_with(without) => None,
                ("fingerprint_version", "fingerprint_version") => Some(Array::new(&[], vec![2_i64])),
                _ => Some(array.clone()),
            });
        });
    }
    set.found("recording", path, "rows of fingerprints", |_| {
        with(&|name, array| match (&array.values, name) {
            (Values::F32(v), "fingerprint") => Some(Array::new(&[3, 16], v[..48].to_vec())),
            (_, "fingerprint_rows") => Some(Array::new(&[1], vec![3_i64])),
            _ => Some(array.clone()),
        });
    });
    set.found("recording", path, "is missing", |set| set.remove(path));
}

/// Increases the radii of the last link with capsules.
fn thicker(body: &mut serde_json::Value, factor: f64) {
    let links = body["links"].as_array_mut().unwrap();
    let solids =
        links.iter_mut().rev().map(|link| link["solids"].as_array_mut().unwrap()).find(|solids| !solids.is_empty());
    for solid in solids.unwrap() {
        for radius in ["radius_a", "radius_b"] {
            let capsule = &mut solid["tapered_capsule"];
            capsule[radius] = (factor * capsule[radius].as_f64().unwrap()).into();
        }
    }
}

#[test]
fn forged_sets_are_also_found_for_a_tracker_with_another_robot() {
    let room = Sandbox::new();
    let set = rendered(&room, "motion.last_frame=16 actor.robot=actor tracker_body.robot=tracker25");
    set.is_sound();
    set.found("start", "start/spread.npz", "times those", |set| {
        set.arrays("start/spread.npz", |name, array| {
            Some(if name == "names" { array.clone() } else { times(array, 2.0) })
        });
    });
    set.found("start", "start/body.json", "times as thick", |set| {
        set.json("start/body.json", |body| thicker(body, 1.05))
    });
}

/// Additions to the scenario and to the command for every kind of set.
const KINDS: [(&str, &str); 6] = [
    (
        "[actor]\nshape = { population = \"adults\", seed = 3 }\n[tracker_body]\nmismatch = \"population\"\n\
         [[prop]]\nname = \"post\"\nshape = { cylinder = { radius_m = 0.1, length_m = 1.6 } }\nplace_m = [0.9, 0.9, 0.8]\n",
        "layers=[\"depth\",\"parts\",\"normals\",\"flow\",\"coverage\",\"colour\"]",
    ),
    (
        "[actor]\nskin = \"person_coarse\"\n[tracker_body]\nskin = \"person_coarse\"\nmismatch = \"standard\"\n",
        "layers=[\"depth\",\"normals\",\"flow\",\"coverage\"]",
    ),
    (
        "[observation]\nsilhouette = \"corrupted\"\nseed = 9\ncorruption = { start_mm = 30.0, start_deg = 4.0, calibration_mm = 8.0, \
         calibration_deg = 0.3, wrong_body_percent = 4.0, boundary_px = 1.0, salt_and_pepper = 0.002, dropped_frames = 0.1, \
         desynchronisation_ms = 8.0 }\n",
        "motion.mirror=true",
    ),
    ("[observation]\nsilhouette = \"segmented\"\nimages = { background_frames = 5 }\n[actor]\ncontact = \"fix\"\n", ""),
    (
        "[actor]\ncontact = \"simulate\"\nroot_wrench = 0.2\n[tracker_body]\nrobot = \"tracker40\"\n\
         [motion.variation]\nseed = 4\ntempo_percent = 10.0\nposture_deg = 4.0\n",
        "motion.speed=1.2",
    ),
    (
        "[observation]\nsilhouette = \"corrupted\"\ncorruption = { calibration_mm = 8.0, start_deg = 2.0 }\n\
         [[rig.motion]]\ncamera = \"cam00\"\nkeyframes = [\n\
         { time_s = 0.0, position_m = [3.0, 3.0, 1.6], look_at_m = [0.2, 0.0, 1.0] },\n\
         { time_s = 0.6, position_m = [2.6, 3.3, 1.6], look_at_m = [0.4, 0.0, 1.0] }]\n\
         [[rig.timing]]\ncamera = \"cam01\"\noffset_ms = 4.0\nline_delay_us = 100.0\n",
        "layers=[\"depth\",\"normals\"]",
    ),
];

#[test]
fn sets_of_many_kinds_are_sound_as_they_are_rendered() {
    for (tables, settings) in KINDS {
        let room = Sandbox::new();
        room.write("tiny.toml", format!("{TINY}{tables}"));
        room.succeed(&format!(
            "render tiny.toml motion.last_frame=16 rig.ring.size_px=[48,36] {settings} --quiet --out set"
        ));
        let answer = room.skiagraph(["verify", "set"]);
        assert_eq!(answer.code, 0, "{tables}{settings}\n{}", answer.stdout);
    }
}

/// The files of a tar archive.
fn entries(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = tar::Archive::new(bytes);
    let entries = archive.entries().unwrap().map(|entry| {
        let mut entry = entry.unwrap();
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
        (entry.path().unwrap().display().to_string(), content)
    });
    entries.collect()
}

fn tar_of(entries: &[(String, Vec<u8>)], header_of: impl Fn(&mut tar::Header)) -> Vec<u8> {
    let mut builder = tar::Builder::new(Vec::new());
    for (name, content) in entries {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(0);
        header_of(&mut header);
        builder.append_data(&mut header, name, &content[..]).unwrap();
    }
    builder.into_inner().unwrap()
}

type Entries = Vec<(String, Vec<u8>)>;

const TRUE_SHARD: &str = "truth/shards/000001.tar";
const SEEN_SHARD: &str = "observations/shards/000000.tar";

/// Changes the content of a shard.
fn repacked(set: &ForgedSet, shard: &str, change: impl FnOnce(&mut Entries)) {
    let mut entries = entries(&set.read(shard));
    change(&mut entries);
    set.write(shard, &tar_of(&entries, |_| {}));
}

/// Like [`repacked`], with `packed.sha256` corrected.
fn repacked_and_listed(set: &ForgedSet, shard: &str, path: &str, change: impl FnOnce(&mut Entries) -> Vec<u8>) {
    let mut changed = Vec::new();
    repacked(set, shard, |entries| changed = change(entries));
    correct(&set.0.join("packed.sha256"), path, Some(&changed));
    let list = set.read("packed.sha256");
    set.write("packed.sha256", &list);
}

#[test]
fn changes_of_shards_are_found_although_every_hash_was_corrected() {
    let room = Sandbox::new();
    let set = rendered(&room, "layers=[\"depth\"] --shards 2");
    set.is_sound();
    let shard = |words: &str, file: &str, forge: &dyn Fn(&ForgedSet)| set.found("shards", file, words, forge);
    let sample = |entries: &mut Entries, extension: &str| {
        entries.iter().position(|(name, _)| name.ends_with(&format!("_cam01.{extension}"))).unwrap()
    };
    // numbers of a sample
    for (key, place) in [
        ("camera", None),
        ("frame", None),
        ("time_s", None),
        ("width", None),
        ("height", None),
        ("K", Some("/K/0/0")),
        ("R", Some("/R/1/2")),
        ("t", Some("/t/2")),
        ("distortion", Some("/distortion/0")),
        ("joints", Some("/joints/4/0")),
        ("markers", Some("/markers/7/1")),
        ("markers_2d", Some("/markers_2d/3/0")),
        ("visible", Some("/visible/5")),
    ] {
        shard(key, TRUE_SHARD, &|set| {
            repacked(set, TRUE_SHARD, |entries| {
                let at = sample(entries, "json");
                let mut said: serde_json::Value = serde_json::from_slice(&entries[at].1).unwrap();
                let value = said.pointer_mut(place.unwrap_or(&format!("/{key}"))).unwrap();
                *value = match &value {
                    serde_json::Value::Bool(flag) => (!*flag).into(),
                    serde_json::Value::String(_) => "ring9".into(),
                    number => (number.as_f64().unwrap_or(3.0) + 1e-3).into(),
                };
                entries[at].1 = said.to_string().into_bytes();
            });
        });
    }
    let edited = |extension: &str, change: &dyn Fn(Vec<u8>) -> Vec<u8>| {
        repacked(&set, TRUE_SHARD, |entries| {
            let at = sample(entries, extension);
            entries[at].1 = change(std::mem::take(&mut entries[at].1));
        });
    };
    let keys = |change: &dyn Fn(&mut serde_json::Map<String, serde_json::Value>)| {
        edited("json", &|bytes| {
            let mut said: serde_json::Map<_, _> = serde_json::from_slice(&bytes).unwrap();
            change(&mut said);
            serde_json::to_vec(&said).unwrap()
        });
    };
    shard("json: ", TRUE_SHARD, &|_| keys(&|said| drop(said.remove("markers"))));
    shard("json: ", TRUE_SHARD, &|_| keys(&|said| drop(said.insert("pose".into(), 3.into()))));
    shard("joints", TRUE_SHARD, &|_| keys(&|said| said["joints"].as_array_mut().unwrap().reverse()));
    shard("is not valid JSON", TRUE_SHARD, &|_| edited("json", &|bytes| bytes[..bytes.len() / 2].to_vec()));
    // images of a sample
    let exchanged = |extension: &'static str, shard: &'static str| {
        move |set: &ForgedSet| {
            repacked(set, shard, |entries| {
                let same: Vec<usize> = (0..entries.len()).filter(|i| entries[*i].0.ends_with(extension)).collect();
                let (a, b) = (entries[same[0]].1.clone(), entries[same[2]].1.clone());
                (entries[same[0]].1, entries[same[2]].1) = (b, a);
            });
        }
    };
    for extension in [".mask.png", ".layers.exr", ".depth.png"] {
        shard("in packed.sha256", TRUE_SHARD, &exchanged(extension, TRUE_SHARD));
    }
    shard("in packed.sha256", SEEN_SHARD, &exchanged(".png", SEEN_SHARD));
    shard("mask.png", TRUE_SHARD, &|_| edited("mask.png", &|_| Vec::new()));
    shard("layers.exr", TRUE_SHARD, &|_| edited("layers.exr", &|bytes| [bytes, vec![0; 8]].concat()));
    // content and order of a shard
    for (words, forge) in [
        ("it has no", (&|e: &mut Entries| drop(e.pop())) as &dyn Fn(&mut Entries)),
        ("it has no", &|e| drop(e.remove(0))),
        ("belongs to none", &|e| e.push(("notes.txt".into(), b"pose".to_vec()))),
        ("belongs to none", &|e| e.insert(0, ("000000_cam00.pose.npy".into(), vec![7; 99]))),
        ("out of order", &|e| e.swap(0, 1)),
        ("out of order", &|e| e.reverse()),
        ("have the same name", &|e| e.push(e[0].clone())),
        ("it has no", &|e| e[0].0 = "999999_cam00.json".into()),
    ] {
        for file in [TRUE_SHARD, SEEN_SHARD] {
            shard(words, file, &|set| repacked(set, file, forge));
        }
    }
    // bytes between and after the files
    for (words, forge) in [
        ("header or padding", (&|h: &mut tar::Header| h.set_mtime(1234)) as &dyn Fn(&mut tar::Header)),
        ("header or padding", &|h| h.set_mode(0o600)),
        ("header or padding", &|h| h.set_username("0.12 0.34").unwrap()),
    ] {
        for file in [TRUE_SHARD, SEEN_SHARD] {
            shard(words, file, &|set| {
                let entries = entries(&set.read(file));
                set.write(file, &tar_of(&entries, forge));
            });
        }
    }
    for file in [TRUE_SHARD, SEEN_SHARD] {
        shard("after its last file", file, &|set| set.write(file, &[set.read(file), b"pose".to_vec()].concat()));
        shard("after its last file", file, &|set| set.write(file, &[set.read(file), vec![0; 512]].concat()));
        shard("padding", file, &|set| {
            let mut bytes = set.read(file);
            let size = entries(&bytes)[0].1.len();
            assert!(!size.is_multiple_of(512));
            bytes[512 + size] = b'p';
            set.write(file, &bytes);
        });
        shard("cannot be read", file, &|set| {
            let bytes = set.read(file);
            set.write(file, &bytes[..bytes.len() / 2]);
        });
    }
    shard("it has no", TRUE_SHARD, &|set| set.write(TRUE_SHARD, &set.read("truth/shards/000000.tar")));
    shard("it has no", SEEN_SHARD, &|set| set.write(SEEN_SHARD, &set.read("observations/shards/000001.tar")));
    // images with correct hashes
    let depth = "truth/layers/cam01/000003-depth.png";
    set.found("layers", depth, "differ from the depth of the body", |set| {
        repacked_and_listed(set, TRUE_SHARD, depth, |entries| {
            let [at, other] = ["000003_cam01.depth.png", "000004_cam01.depth.png"]
                .map(|key| entries.iter().position(|(name, _)| name == key).unwrap());
            entries[at].1 = entries[other].1.clone();
            entries[at].1.clone()
        });
    });
    let mask = "observations/cam01/silhouette/000000.png";
    set.found("silhouettes", mask, "it is that of frame 1", |set| {
        repacked_and_listed(set, SEEN_SHARD, mask, |entries| {
            let at = |frame: usize| format!("observations/cam01/silhouette/{frame:06}.png");
            let [own, next] = [0, 1].map(|frame| entries.iter().position(|(name, _)| *name == at(frame)).unwrap());
            entries[own].1 = entries[next].1.clone();
            entries[own].1.clone()
        });
    });
    set.is_sound();
}
