#!/usr/bin/env bash
# mlcroissant reads a column of texts as numbers first: camera "007" is 7.0, serial number "12e5" is 1200000.0.
#
# A Croissant file says of each column what it holds. mlcroissant 1.1.1 lets pandas guess the types of a CSV table or of JSON lines, and turns the
# result into the declared `sc:Text` afterwards. Leading zeros are gone, and a serial number of digits with an "e" becomes a large number. In JSON
# lines this happens to strings in quotation marks. Names of cameras and takes then no longer match the names of files. There is no message.
#
# Guessed before: what is declared as text stays as it is in the file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet mlcroissant==1.1.1 pandas==3.1.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import hashlib
import json
import logging
import pathlib

import mlcroissant

logging.disable(logging.CRITICAL)
rows = [{"camera": "007", "frame": "0012"}, {"camera": "12e5", "frame": "0013"}]


def read(path, kind):
    digest = hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()
    table = mlcroissant.FileObject(id=path, name=path, content_url=path, encoding_formats=[kind], sha256=digest)
    fields = []
    for name in rows[0]:
        source = mlcroissant.Source(file_object=path, extract=mlcroissant.Extract(column=name))
        fields.append(mlcroissant.Field(id=f"views/{name}", name=name, data_types=mlcroissant.DataType.TEXT, source=source))
    views = mlcroissant.RecordSet(id="views", name="views", fields=fields)
    described = mlcroissant.Metadata(name="views", distribution=[table], record_sets=[views])
    pathlib.Path("croissant.json").write_text(json.dumps(described.to_json(), default=str))
    found = mlcroissant.Dataset("croissant.json").records("views")
    return [tuple(row[f"views/{name}"].decode() for name in rows[0]) for row in found]


pathlib.Path("views.csv").write_text("camera,frame\n" + "".join(f"{row['camera']},{row['frame']}\n" for row in rows))
pathlib.Path("views.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
table, lines = read("views.csv", "text/csv"), read("views.jsonl", "application/jsonlines")
print("in the files", [tuple(row.values()) for row in rows], "from CSV", table, "from JSON lines", lines)
assert table == lines == [("7.0", "12"), ("1200000.0", "13")]
PYTHON
