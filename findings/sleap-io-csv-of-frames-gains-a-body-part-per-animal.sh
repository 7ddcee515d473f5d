#!/usr/bin/env bash
# sleap-io: a CSV of frames that it wrote comes back with one more body part for every animal, and with the parts in another order.
#
# save_csv of sleap-io 0.9.5 with format="frames" writes columns such as inst0.nose.x and inst0.track_score. load_csv takes the columns of an animal
# for those of a body part inst0, so that two animals have six parts in place of four, two of them always empty. It also sorts the parts by the
# alphabet, although the file has them in the order of the skeleton: row 0 of the array is the ankle, not the nose. The same is so with the format
# named. Coordinates stay with their names, tracks too. With save_metadata=True, or as format="points", the four parts come back in their order.
#
# Guessed before: the same body parts in the same order.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile sleap-io==0.9.5 numpy==2.4.6
python/bin/python -W ignore - <<'PYTHON'
import numpy as np
import sleap_io

parts = ["nose", "neck", "hip", "ankle"]
skeleton = sleap_io.Skeleton(nodes=list(parts), edges=[("nose", "neck"), ("neck", "hip"), ("hip", "ankle")])
video = sleap_io.Video(filename="walk.mp4", open_backend=False)
tracks = [sleap_io.Track("left"), sleap_io.Track("right")]
places = np.arange(16, dtype=float).reshape(2, 4, 2) * 10 + 50
frames = []
for number in range(3):
    animals = [
        sleap_io.PredictedInstance.from_numpy(place + number, skeleton=skeleton, point_scores=np.full(4, 0.9), score=0.8, track=track)
        for place, track in zip(places, tracks)
    ]
    frames.append(sleap_io.LabeledFrame(video=video, frame_idx=number, instances=animals))
labels = sleap_io.Labels(frames, videos=[video], skeletons=[skeleton], tracks=tracks)


def again(form, **how):
    sleap_io.save_csv(labels, "walk.csv", format=form)
    loaded = sleap_io.load_csv("walk.csv", **how)
    return loaded.skeletons[0].node_names, np.asarray(loaded[0].instances[0].numpy())


names, array = again("frames")
with open("walk.csv") as file:
    columns = [name for name in file.readline().strip().split(",") if name.startswith("inst0.") and name.count(".") == 1]
print("columns without a part:", ", ".join(columns))
print(f"written {parts}, read {names}; row 0 of the first animal is {array[0]}, its nose was at {places[0, 0]}")
assert names == ["ankle", "hip", "inst0", "inst1", "neck", "nose"] and again("frames", format="frames")[0] == names
assert np.isnan(array[2:4]).all() and (array[0] == places[0, 3]).all() and (array[5] == places[0, 0]).all()
sleap_io.save_csv(labels, "noted.csv", format="frames", save_metadata=True)
assert sleap_io.load_csv("noted.csv").skeletons[0].node_names == parts
names, array = again("points")
print(f"format points: read {names}")
assert names == parts and (array == places[0]).all()
PYTHON
