#!/usr/bin/env bash
# biokinesis-sdk: a muscle signal in frames is filtered frame by frame, and is wrong where two of them meet.
#
# The orchestrator of biokinesis-sdk 1.0.2 takes frames of a sensor as they arrive (`ingest_emg`), filters each
# forwards and backwards, and puts the results in a row. Each is filtered as if nothing came before or after it. A
# tone of 150 Hz, which the filter is to let pass, is off by 0.85 of its height at the borders of frames of 50, 100 or
# 250 ms. So the same muscle signal has jumps of its own, ten times a second, and other results by another size of
# frames. In one frame of all samples it is right. Nothing is said.
#
# Guessed before: frames give what the whole signal gives.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 h5py==3.14.0
python/bin/python -m pip install --quiet --no-compile --no-deps biokinesis-sdk==1.0.2
python/bin/python - <<'PYTHON'
import numpy as np
from biokinesis_sdk.core.types import EMGFrame, FilterConfig, SensorConfig
from biokinesis_sdk.orchestrator import Orchestrator

rate = 2000
time = np.arange(2 * rate) / rate


def filtered(signal, size):
    """The filtered signal of a sensor that sends frames of `size` samples."""
    orchestrator = Orchestrator()
    settings = FilterConfig.standard(sample_rate=rate)
    orchestrator.add_sensor(SensorConfig(sensor_id=1, filter_config=settings))
    for start in range(0, len(signal), size):
        part = slice(start, start + size)
        orchestrator.ingest_emg(1, EMGFrame(sensor_id=1, timestamps_us=time[part] * 1e6, data=signal[part], sample_rate=rate))
    return orchestrator.get_sensor(1).get_all_emg_filtered()


signal = np.cos(2 * np.pi * 150 * time)
middle = slice(rate // 2, -rate // 2)
whole = filtered(signal, len(signal))
# The filter lets 20 to 450 Hz pass, and has no delay: the tone comes out as it went in.
assert np.abs(whole - signal)[middle].max() < 0.01
for size in (100, 200, 500):
    error = np.abs(filtered(signal, size) - signal)
    border = np.arange(len(time)) % size
    inside = (border > size * 0.4) & (border < size * 0.6)
    print(f"frames of {size} samples: off by up to {error[middle].max():.2f}, in their middles by {error[inside].max():.3f}")
    assert 0.8 < error[middle].max() < 0.9 and error[inside].max() < 0.1
PYTHON
