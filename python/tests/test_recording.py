"""Recordings, and sensors with other protocols."""

import os
import threading
import time

import numpy as np
import pytest
import taxel
from taxel._call import call


def test_a_recording_has_the_frames_that_were_written(tmp_path):
    path = tmp_path / "press.mcap"
    call(["synth", "press", "-n", 50, "--seed", 4, "-o", path])
    found = taxel.read_recording(path)
    frames = taxel.synth("press", 50, seed=4, stream="training")
    assert found.reading_names == frames.reading_names and found.output_names == frames.output_names
    assert np.array_equal(found.readings, frames.readings.astype(np.float32))
    assert np.array_equal(found.outputs, frames.outputs.astype(np.float32))
    assert found.estimates is None and np.allclose(np.diff(found.time_s), 0.01)
    assert repr(found) == "<50 Frames of 144 readings and 144 outputs>"


def test_estimates_are_no_truth(tmp_path):
    X, y = taxel.synth("press", 400).to_pandas()
    model = taxel.Model(4, refine=False).fit(X, y)
    model.save(tmp_path / "m.bin")
    X[:30].to_csv(tmp_path / "x.csv", index=False)
    call(["decode", tmp_path / "m.bin", tmp_path / "x.csv", "-o", tmp_path / "d.mcap"])
    found = taxel.read_recording(tmp_path / "d.mcap")
    assert found.outputs.shape == (30, 0) and found.output_names == []
    assert np.array_equal(found.estimates, model.predict(X[:30]).astype(np.float32))
    with pytest.raises(ValueError, match="nothing.mcap"):
        taxel.read_recording(tmp_path / "nothing.mcap")


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="pseudo-terminals are Unix's")
def test_other_sensors_are_iterated_over_like_a_device():
    far, near = os.openpty()
    stop = threading.Event()

    def send():
        while not stop.is_set():
            os.write(far, b"\xaa\x55" + bytes(range(12)))
            time.sleep(0.005)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        import tty

        tty.setraw(near)
        with taxel.Link(os.ttyname(near), protocol="flexitac", shape=(3, 4)) as link:
            assert np.array_equal(next(iter(link)).readings, np.arange(12.0).reshape(3, 4))
            with pytest.raises(RuntimeError, match="only sends readings"):
                link.zero()
    finally:
        stop.set()
        sender.join()
    with pytest.raises(ValueError, match="shape"):
        taxel.Link("/dev/null", protocol="csv")
    with pytest.raises(ValueError, match="protocol"):
        taxel.Link("/dev/null", protocol="other", shape=(1, 1))
