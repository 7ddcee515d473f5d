"""Positions of a model of OpenSim, so that ``set.evaluate`` can measure them. Needs the package opensim."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .errors import imported, reading
from .paths import PathName, given


def markers(mot: PathName, osim: PathName) -> dict[str, NDArray[np.float64]]:
    """Centres of joints and markers of a model by name, metres (frames, 3) in a world with Z up.

    Their names are those of the model: ``set.evaluate(markers(mot, osim), joint_map={"knee_r": "right_knee", ...})``.
    Markers on the skin are not joints: map only those at the centres of joints.

    Args:
        mot: the coordinates of inverse kinematics, ``.mot`` or ``.sto``.
        osim: the scaled model that they are of.

    Raises:
        InputError: a file cannot be read, or the coordinates are not those of the model.
        MissingPackageError: opensim is not installed.
    """
    opensim = imported("opensim", "skiagraph.opensim.markers")
    with reading(given(osim, "osim"), "a model of OpenSim", "open it in OpenSim to see why"):
        model = opensim.Model(given(osim, "osim"))
        state = model.initSystem()
    with reading(given(mot, "mot"), "coordinates of this model", "give the scaled model of the inverse kinematics"):
        motion = opensim.TimeSeriesTable(given(mot, "mot"))
        if motion.getTableMetaDataString("inDegrees") == "yes":
            model.getSimbodyEngine().convertDegreesToRadians(motion)
        coordinates = [model.getCoordinateSet().get(name) for name in motion.getColumnLabels()]
        places = {joint.getName(): joint.getChildFrame().getPositionInGround for joint in model.getJointSet()}
        places |= {marker.getName(): marker.getLocationInGround for marker in model.getMarkerSet()}
        rows = []
        for values in motion.getMatrix().to_numpy():
            for coordinate, value in zip(coordinates, values, strict=True):
                coordinate.setValue(state, float(value), False)
            model.realizePosition(state)
            rows.append([place(state).to_numpy() for place in places.values()])
    # OpenSim has Y up
    points = np.array(rows)[..., [0, 2, 1]] * [1, -1, 1]
    return {name: points[:, index] for index, name in enumerate(places)}
