#!/usr/bin/env bash
# ahrs: the roll that a matrix is made of comes back as a negative yaw, and two conversions turn the other way than their counterparts.
#
# In ahrs 0.4.0 `DCM(rpy=...)` turns by the roll about z and by the yaw about x; `Quaternion(rpy=...)` turns by the roll about x. `DCM.to_rpy` takes
# the roll about x, but of the inverse. So `DCM(rpy=a).to_rpy()` is not a: 0.3 of roll are -0.3 of yaw. `q2euler` negates what
# `Quaternion.to_angles` gives, and `dcm2quat(q2R(q))` is the inverse of q. All is radians, without a message. A note at `DCM` tells of reversed
# angles; none tells that its own method does not take them back.
#
# Guessed before: each pair of functions takes back what the other gives.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet ahrs==0.4.0 scipy==1.17.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import numpy as np
from ahrs import DCM, Quaternion
from ahrs.common.orientation import dcm2quat, q2euler, q2R
from scipy.spatial.transform import Rotation

roll = np.array([0.3, 0.0, 0.0])
turn = Quaternion(rpy=roll)
quaternion = np.asarray(turn)
about = {
    "Quaternion(rpy)": Rotation.from_matrix(turn.to_DCM()).as_rotvec(),
    "DCM(rpy)": Rotation.from_matrix(np.array(DCM(rpy=roll))).as_rotvec(),
}
back = {
    "Quaternion(rpy).to_angles": turn.to_angles(),
    "DCM(rpy).to_rpy": DCM(rpy=roll).to_rpy(),
    "DCM of the quaternion, to_rpy": DCM(turn.to_DCM()).to_rpy(),
    "q2euler of the quaternion": q2euler(quaternion),
}
for name, value in {**about, **back}.items():
    print(f"{name}: {np.round(value, 6) + 0.0}")
assert np.allclose(about["Quaternion(rpy)"], [0.3, 0, 0]) and np.allclose(about["DCM(rpy)"], [0, 0, 0.3])
for name, right in zip(back, ([0.3, 0, 0], [0, 0, -0.3], [-0.3, 0, 0], [-0.3, 0, 0])):
    assert np.allclose(back[name], right), name
assert np.allclose(q2R(quaternion), turn.to_DCM())
inverse = dcm2quat(q2R(quaternion))
print("dcm2quat(q2R(q)):", inverse.round(6), "q:", quaternion.round(6))
assert np.allclose(inverse, quaternion * [1, -1, -1, -1])
PYTHON
