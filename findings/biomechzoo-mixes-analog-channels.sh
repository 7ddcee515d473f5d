#!/usr/bin/env bash
# biomechzoo: the analog channels of a C3D file come out mixed, so that no force of a plate is right.
#
# ezc3d gives analog data as (1, channels, samples). biomechzoo 0.8.25 reshapes this to (samples, channels) without turning it: with three
# channels, each gets every third sample of the first one, then of the second, then of the third. A plate with constant forces of 1, 2 and 700 N
# gives three equal channels that step from 1 to 2 to 700. Names, rate and length look right, and there is no message. One channel is right.
#
# Guessed before: each channel under its name.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet biomechzoo==0.8.25 ezc3d==1.7.2 numpy==1.26.4
python/bin/python - <<'PYTHON'
import ezc3d
import numpy as np
from biomechzoo.conversion.c3d2zoo_data import c3d2zoo_data

forces = {"Fx": 1.0, "Fy": 2.0, "Fz": 700.0}
written = ezc3d.c3d()
for group, rate, labels in (("POINT", 100.0, ("heel",)), ("ANALOG", 1000.0, tuple(forces))):
    written["parameters"][group]["RATE"]["value"] = [rate]
    written["parameters"][group]["LABELS"]["value"] = labels
written["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
written["data"]["points"] = np.ones((4, 1, 30))
written["data"]["analogs"] = np.tile(np.array(list(forces.values()))[None, :, None], (1, 1, 300))
written.write("plate.c3d")

read = ezc3d.c3d("plate.c3d")
data = c3d2zoo_data(read)
for index, (name, force) in enumerate(forces.items()):
    samples = data[name]["line"].ravel()
    steps = samples[[0, 150, 299]].tolist()
    print(f"{name}: {len(samples)} samples, first, middle and last {steps}; in the file {force} throughout")
    assert steps == [1, 2, 700] and len(samples) == 300
    assert (read["data"]["analogs"][0, index] == force).all()
PYTHON
