"""Positions of an OpenSim model's markers, joints and bodies in every row of a motion: opensim_model.py MODEL MOTION

Prints them as a table of vectors (.sto), and only them; everything else goes to standard error.
"""

import os
import sys

output = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # OpenSim prints to standard output
sys.path = [place for place in sys.path if place]  # the current folder may have an opensim.py of its own

try:
    import opensim
except ImportError as error:
    sys.exit(f"no module: {error}")


def coordinate_of(label):
    """The coordinate's name of a column's label: `knee_angle_r` or `/jointset/knee_r/knee_angle_r/value`."""
    parts = label.split("/")
    return parts[-2] if len(parts) > 2 and parts[-1] == "value" else label


def main(model_file, motion_file):
    opensim.Logger.removeFileSink()
    opensim.Logger.setLevelString("error")
    model = opensim.Model(model_file)
    state = model.initSystem()
    motion = opensim.TimeSeriesTable(motion_file)
    if motion.hasTableMetaDataKey("inDegrees") and motion.getTableMetaDataAsString("inDegrees") == "yes":
        model.getSimbodyEngine().convertDegreesToRadians(motion)
    known = {coordinate.getName(): coordinate for coordinate in model.getCoordinateSet()}
    labels = [label for label in motion.getColumnLabels() if not label.endswith("/speed")]
    coordinates = [known.get(coordinate_of(label)) for label in labels]
    absent = [label for label, coordinate in zip(labels, coordinates) if coordinate is None]
    if absent:
        sys.exit(f"the model has no coordinate {', '.join(absent[:5])}; it has {', '.join(sorted(known))}")
    columns = [motion.getDependentColumn(label) for label in labels]
    for coordinate in coordinates:
        coordinate.setLocked(state, False)

    places = {}
    for joint in model.getJointSet():
        places[joint.getName()] = joint.getChildFrame().getPositionInGround
    for body in model.getBodySet():
        places.setdefault(body.getName(), body.getPositionInGround)
    for marker in model.getMarkerSet():
        places[marker.getName()] = marker.getLocationInGround
    names = [name for name in places if len(name.split()) == 1]

    print("DataType=Vec3", "endheader", "\t".join(["time", *names]), sep="\n", file=output)
    for row, time in enumerate(motion.getIndependentColumn()):
        for coordinate, column in zip(coordinates, columns):
            coordinate.setValue(state, column[row], False)
        model.realizePosition(state)
        points = [places[name](state) for name in names]
        fields = [",".join(repr(point[axis]) for axis in range(3)) for point in points]
        print("\t".join([repr(time), *fields]), file=output)


try:
    main(*sys.argv[1:])
except RuntimeError as error:
    sys.exit(" ".join(str(error).split()))
