"""Hooks of the site: pages from all over the repository, and reference pages that are made from the program.

Every page keeps its path in the repository, so a relative link means the same here and in the checkout. Pages outside
`docs/` that are named here are added, and their pictures. Links to other files lose their link and keep their text:
the site has pages only.

The commands are those of the program `skiagraph` on the path, or of the one that the variable SKIAGRAPH names.
"""

import json
import os
import pathlib
import posixpath
import re
import shutil
import subprocess

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files, InclusionLevel

ROOT = pathlib.Path(__file__).resolve().parent.parent
# pages and pictures outside docs/
OTHERS = [
    "*.md",
    "scenarios/README.md",
    "scenarios/keys.md",
    "scenarios/motions/README.md",
    "robots/README.md",
    "results/*.md",
    "results/*.svg",
    "results/*.png",
]
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")


def on_files(files, config):
    """The pages of `docs/` and the others at their paths in the repository, and the generated pages."""
    # what belongs to the theme stays where it is
    pages = Files([file for file in files if file.src_dir != config.docs_dir])
    own = [
        f"docs/{file.src_uri}"
        for file in files
        if file.src_dir == config.docs_dir and file.inclusion != InclusionLevel.EXCLUDED
    ]
    others = [path.relative_to(ROOT).as_posix() for pattern in OTHERS for path in sorted(ROOT.glob(pattern))]
    for path in own + others:
        pages.append(File(path, str(ROOT), config.site_dir, config.use_directory_urls, dest_uri=address(path)))
    generated = {"docs/reference/commands.md": commands()}
    for path in (path for path in own if path.endswith(".ipynb")):
        generated[f"{path.removesuffix('.ipynb')}.md"] = notebook(ROOT / path)
    for path, text in generated.items():
        page = File.generated(config, path, content=text)
        page.dest_uri = address(path)
        pages.append(page)
    return pages


def address(path):
    """Where a file of the repository is on the site: `docs/` is its root."""
    known = {"README.md": "readme.html"}
    inside = known.get(path, path.removeprefix("docs/"))
    if not inside.endswith(".md"):
        return inside
    return re.sub(r"README$", "index", inside.removesuffix(".md")) + ".html"


def on_page_markdown(markdown, page, config, files):
    """Removes links to files that are not on the site; a file that does not exist stays, for --strict to report."""

    def unlinked(link):
        text, target = link[1], link[2]
        if target.endswith(".ipynb"):
            # its page is made from it
            return link[0].replace(target, f"{target.removesuffix('.ipynb')}.md")
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page.file.src_uri), target))
        is_elsewhere = (ROOT / path).exists() and files.get_file_from_path(path) is None
        return text if is_elsewhere else link[0]

    return LINK.sub(unlinked, markdown)


def run(*arguments):
    """What the program prints."""
    program = os.environ.get("SKIAGRAPH") or shutil.which("skiagraph")
    if program is None:
        raise PluginError("there is no program skiagraph on the path; install it, or name it in the variable SKIAGRAPH")
    done = subprocess.run([program, *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise PluginError(f"{program} {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def subcommands(help_text):
    """Names of the subcommands in a help text, without `help`."""
    listed = re.search(r"^Commands:\n((?:  .*\n|\n(?=  ))+)", help_text, re.MULTILINE)
    names = re.findall(r"^  (\w[\w-]*)", listed[1], re.MULTILINE) if listed else []
    return [name for name in names if name != "help"]


def commands():
    """Every command's help."""
    top = run("--help")
    page = [
        "# Commands",
        "",
        "Made from the program's own help: `skiagraph COMMAND --help` prints the same.",
        "",
        "```text",
        top.rstrip(),
        "```",
    ]
    for name in subcommands(top):
        page += command([name], 2)
    return "\n".join(page) + "\n"


def command(names, level):
    """The help of a command and of its subcommands, as sections."""
    text = run(*names, "--help")
    page = ["", f"{'#' * level} {' '.join(names)}", "", "```text", text.rstrip(), "```"]
    for name in subcommands(text):
        page += command([*names, name], level + 1)
    return page


def notebook(path):
    """The cells of a notebook and what they print."""
    page = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] != "code":
            page.append(text)
            continue
        page.append(f"```python\n{text}\n```")
        printed = "".join("".join(output.get("text", [])) for output in cell["outputs"]).rstrip()
        page += [f"```text\n{printed}\n```"] if printed else []
    return "\n\n".join(page) + "\n"
