//! `skiagraph report --figures`: the plots of runs, comparisons and sweeps as files.

use std::fs;

use crate::sandbox::{Sandbox, TINY};

/// Names of the files in a folder, in alphabetical order.
fn names(room: &Sandbox, folder: &str) -> Vec<String> {
    let entries = fs::read_dir(room.path(folder)).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn check_figures(room: &Sandbox, folder: &str, expected: &[&str]) {
    let found = names(room, folder);
    for name in expected {
        assert!(found.contains(&format!("{name}.svg")), "{folder}: no {name} in {found:?}");
    }
    let captions = String::from_utf8(room.read(&format!("{folder}/README.txt"))).unwrap();
    for name in found.iter().filter(|name| name.ends_with(".svg")) {
        let text = String::from_utf8(room.read(&format!("{folder}/{name}"))).unwrap();
        assert!(text.starts_with("<svg ") && text.trim_end().ends_with("</svg>"), "{name}");
        assert!(!text.contains("var(--"), "{name}: for any program that reads SVG");
        assert!(captions.contains(&format!("{name}\n    ")), "{name}: {captions}");
    }
}

#[test]
fn a_run_a_comparison_and_a_sweep_have_figures_for_papers() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --seeds 3 --out run");
    let said = room.succeed("report run --figures figures").stdout;
    assert!(said.starts_with("figures: ") && said.contains("figures\n"), "{said}");
    check_figures(&room, "figures", &["error", "joints", "pck", "energy", "survival", "annealing"]);
    // the plot of the error equals that of the page
    let path = |text: &str| {
        text.split("stroke=\"#0068b0\"")
            .nth(1)
            .unwrap()
            .split("points=\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap()
            .to_owned()
    };
    let [file, page] = ["figures/error.svg", "run/report.html"].map(|name| String::from_utf8(room.read(name)).unwrap());
    assert!(!path(&file).is_empty() && page.contains("id=\"error\""));
    let methods = TINY.replace(
        "[tracker.annealed_particle_filter]",
        "[methods.still.frozen]\n[methods.truth.oracle]\n[methods.filter.annealed_particle_filter]",
    );
    room.write("methods.toml", methods);
    room.succeed("run methods.toml --out methods");
    room.succeed("report methods --figures of-methods");
    check_figures(&room, "of-methods", &["methods", "error"]);
    room.succeed("sweep tiny.toml particles=6,12 rig.ring.count=1,2 --out sweep -j 2");
    room.succeed("report sweep --figures of-sweep");
    check_figures(&room, "of-sweep", &["cost-evaluations", "map-1", "axis-particles", "axis-rig-ring-count"]);
    let axis = String::from_utf8(room.read("of-sweep/axis-rig-ring-count.svg")).unwrap();
    assert!(axis.contains(">1<") && axis.contains(">2<") && !axis.contains(">1.5<"), "no half cameras");
    let cost = String::from_utf8(room.read("of-sweep/cost-evaluations.svg")).unwrap();
    assert!(cost.contains("(logarithmic)"), "{cost}");
}

#[test]
fn figures_replace_only_unmodified_figures() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("run tiny.toml --out run");
    room.succeed("run tiny.toml particles=6 --out other");
    room.succeed("report run --figures figures");
    let before = names(&room, "figures");
    room.succeed("report run --figures figures");
    assert_eq!(names(&room, "figures"), before);
    let kept = room.read("other/poses.npz");
    for folder in ["run", "other", "."] {
        let refused = room.skiagraph(["report", "run", "--figures", folder]);
        assert_eq!(refused.code, 2, "{folder}: {}", refused.stderr);
    }
    assert_eq!(room.read("other/poses.npz"), kept, "a run is no figure");
    room.write("figures/error.svg", "mine");
    let refused = room.skiagraph(["report", "run", "--figures", "figures"]);
    assert!(refused.code == 2 && refused.stderr.contains("choose another --figures"), "{}", refused.stderr);
    assert_eq!(room.read("figures/error.svg"), b"mine");
    room.succeed("report run --figures figures --force");
    assert_eq!(room.read("figures~/error.svg"), b"mine");
    let nothing = room.skiagraph(["report", "figures", "--figures", "new"]);
    assert!(
        nothing.code == 2 && nothing.stderr.contains("expected the folder of a measured run"),
        "{}",
        nothing.stderr
    );
    assert!(!room.path("new").exists());
}
