"""Scenes, and what commands tell of them."""

import threading
import time

import numpy as np
import pytest
import taxel

SMALL = {"training__frames": 400, "training__test_frames": 60, "training__centres": 8, "training__refine": False}


def test_fields_of_a_scene_are_replaced():
    scene = taxel.Scene("press")
    noisy = scene.replace(noise__level=0.02)
    few = [taxel.synth(of, 3, seed=1).readings for of in (scene, noisy, scene.replace(noise__level=0))]
    assert np.allclose(few[1] - few[2], 4 * (few[0] - few[2]))  # four times 0.5 %
    in_ohm = [scene.replace(noise={"kind": "absolute", "level_ohm": level}) for level in (0.5, 1)]
    in_ohm = [taxel.synth(of, 3, seed=1).readings - few[2] for of in in_ohm]
    assert np.allclose(in_ohm[1], 2 * in_ohm[0]) and np.allclose(in_ohm[1] * few[2] * 0.005, few[0] - few[2])
    assert taxel.Scene.from_toml(noisy.to_toml()).outputs == scene.outputs
    with pytest.raises(ValueError, match="no_such"):
        scene.replace(noise__no_such=1)
    with pytest.raises(ValueError, match="built-in"):
        taxel.Scene("no-such.toml")


def test_frames_are_those_of_the_command(tmp_path):
    from taxel._call import call

    call(["synth", "press", "-n", 5, "--seed", 9, "-o", tmp_path / "f.csv"])
    table = np.loadtxt(tmp_path / "f.csv", delimiter=",", skiprows=1)
    frames = taxel.synth("press", 5, seed=9, stream="training")
    assert np.array_equal(table, np.hstack([frames.readings, frames.outputs]))


def test_a_trade_has_points_a_front_and_what_was_chosen():
    scene = taxel.Scene("press").replace(**SMALL)
    trade = taxel.trade(scene, centres=[4, 8], refine=False, max_error=1.0)
    assert trade.chosen in trade.front and trade.chosen in trade.points
    assert trade.model.blob_.centres == trade.chosen["centres"]
    assert len(trade.to_pandas()) == len(trade.points) and "<svg" in trade._repr_html_()
    with pytest.raises(ValueError, match="max_error"):
        taxel.trade(scene, centres=[4], refine=False, max_error=-1.0)


def test_errors_of_a_model_are_those_of_the_command():
    frames = taxel.synth("press", 400, stream="training")
    x, y = frames.to_pandas()
    model = taxel.Model(8, refine=False).fit(x, y)
    fresh = taxel.synth("press", 100)
    errors = taxel.evaluate(model, fresh.readings, fresh.outputs)
    left = (model.predict(fresh.readings) - fresh.outputs)[:, 2::3]
    rmse = next(of["rmse"] for of in errors["decoders"][0]["errors"] if of["group"] == "dz_mm")
    assert np.isclose(rmse, np.sqrt((left**2).mean()), rtol=1e-5)


def test_python_runs_during_training_and_ctrl_c_ends_it():
    import _thread

    ticks = []
    ticking = threading.Event()

    def tick():
        while not ticking.wait(0.02):
            ticks.append(time.monotonic())
            if len(ticks) == 25:
                _thread.interrupt_main()

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            taxel.Model(256).fit(*[np.random.default_rng(1).normal(size=(20000, n)) for n in (20, 4)])
    finally:
        ticking.set()
        thread.join()
    assert len(ticks) >= 25 and time.monotonic() - began < 20
