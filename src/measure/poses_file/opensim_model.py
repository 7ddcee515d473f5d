"""Positions of an OpenSim model's markers, joints and bodies in every row of a motion.

opensim_model.py MODEL MOTION yes|no: whether the motion is in degrees. Prints a table of vectors (.sto), and only it;
everything else goes to standard error. Its header names the coordinates that the motion lacks.
"""

import os
import re
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


def first_line(error):
    """The first line of OpenSim's message, without places in its source."""
    places = r"std::exception in '[^']*': |SimTK Exception thrown at \S+:\s|Error detected by .*?\(\): "
    text = re.sub(places, "", str(error))
    return next((line.strip() for line in text.splitlines() if line.strip()), "unknown error")


def read(what, reader, file):
    try:
        return reader(file)
    except RuntimeError as error:
        sys.exit(f"{what}: {first_line(error)}")


def main(model_file, motion_file, in_degrees):
    opensim.Logger.removeFileSink()
    opensim.Logger.setLevelString("error")
    model = read("model", opensim.Model, model_file)
    state = read("model", lambda _: model.initSystem(), model_file)
    motion = read("motion", opensim.TimeSeriesTable, motion_file)
    if motion.hasTableMetaDataKey("inDegrees"):
        motion.removeTableMetaDataKey("inDegrees")
    motion.addTableMetaDataString("inDegrees", in_degrees)
    if in_degrees == "yes":
        model.getSimbodyEngine().convertDegreesToRadians(motion)
    known = {coordinate.getName(): coordinate for coordinate in model.getCoordinateSet()}
    # paths are states, of which speeds, muscles and controllers tell no position
    labels = [label for label in motion.getColumnLabels() if "/" not in label or label.endswith("/value")]
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

    given = {coordinate.getName() for coordinate in coordinates}
    lacking = ",".join(name for name in known if name not in given)
    print("DataType=Vec3", f"lacking={lacking}", "endheader", "\t".join(["time", *names]), sep="\n", file=output)
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
    sys.exit(first_line(error))
