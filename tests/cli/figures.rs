//! `skiagraph report --figures`: the plots of runs, comparisons and sweeps as files.

use crate::sandbox::{Sandbox, TINY};

fn check_figures(room: &Sandbox, folder: &str, expected: &[&str]) {
    let found = room.entries_of(folder);
    for name in expected {
        assert!(found.contains(&format!("{name}.svg")), "{folder}: no {name} in {found:?}");
    }
    let captions = room.text(&format!("{folder}/README.txt"));
    for name in found.iter().filter(|name| name.ends_with(".svg")) {
        let text = room.text(&format!("{folder}/{name}"));
        assert!(text.starts_with("<svg ") && text.trim_end().ends_with("</svg>"), "{name}");
        assert!(!text.contains("var(--"), "{name}: for any program that reads SVG");
        assert!(captions.contains(&format!("{name}\n    ")), "{name}: {captions}");
    }
}

#[test]
fn results_have_figures_for_papers() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --seeds 3 --out run");
    let said = room.succeed("report run --figures figures").stdout;
    assert!(said.starts_with("figures: ") && said.contains("figures\n"), "{said}");
    check_figures(&room, "figures", &["error", "joints", "pck", "energy", "survival", "annealing"]);
    assert!(room.text("run/report.html").contains("id=\"error\""));
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
    check_figures(&room, "of-sweep", &["cost-evaluations", "axis-particles", "axis-rig-ring-count"]);
    let axis = room.text("of-sweep/axis-rig-ring-count.svg");
    assert!(axis.contains(">1<") && axis.contains(">2<") && !axis.contains(">1.5<"), "no half cameras");
    let cost = room.text("of-sweep/cost-evaluations.svg");
    assert!(cost.contains("(logarithmic)"), "{cost}");
}

#[test]
fn figures_replace_only_unmodified_figures() {
    let room = Sandbox::tiny();
    room.succeed("run tiny.toml --out run");
    room.succeed("report run --figures figures");
    let before = room.entries_of("figures");
    room.succeed("report run --figures figures");
    assert_eq!(room.entries_of("figures"), before);
    room.write("figures/error.svg", "mine");
    room.refused("report run --figures figures", "write elsewhere");
    assert_eq!(room.read("figures/error.svg"), b"mine");
    room.succeed("report run --figures figures --force");
    assert_eq!(room.read("figures~/error.svg"), b"mine");
}
