"""Models: the same bytes and bits as the command line, and what users of scikit-learn expect."""

import json
import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pandas
import pytest
import taxel

RANDOM = np.random.default_rng(5)


def command_line(*arguments):
    command = [sys.executable, "-m", "taxel", *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def smooth(lines=400, features=3):
    """Readings about 50 Ω and two outputs that follow from them."""
    x = RANDOM.uniform(-1, 1, (lines, features))
    y = np.column_stack([np.sin(2 * x[:, 0]) + 0.3 * x[:, 1], x[:, 1] * x[:, 2 % features]])
    return 50 + 8 * x, y


@pytest.fixture(scope="module")
def frames():
    return taxel.synth("press", 600, stream="training", seed=3)


@pytest.mark.parametrize("parameters", [{}, {"format": "fixed16", "reading_model": "full"}])
def test_the_blob_is_that_of_the_command_line(tmp_path, parameters):
    x, y = smooth()
    model = taxel.Model(12, refine=False, penalty=1e-6, **parameters).fit(x, y)
    names = [*(f"x{i}" for i in (1, 2, 3)), "y1", "y2"]
    pandas.DataFrame(np.column_stack([x, y]), columns=names).to_csv(tmp_path / "data.csv", index=False)
    options = ["--format", "fixed16", "--reading-model", "full"] if "format" in parameters else []
    command_line(
        *("train", tmp_path / "data.csv", "--inputs", "x1..x3", "--outputs", "y1,y2", "--no-refine"),
        *("--centres", 12, "--penalty", 1e-6, *options, "-o", tmp_path / "model.bin"),
    )
    assert model.to_bytes() == (tmp_path / "model.bin").read_bytes()
    command_line("decode", tmp_path / "model.bin", tmp_path / "data.csv", "-o", tmp_path / "out.csv")
    decoded = pandas.read_csv(tmp_path / "out.csv")[["y1", "y2"]].to_numpy()
    assert np.array_equal(decoded.astype(np.float32), model.predict(x).astype(np.float32))
    assert np.abs(model.predict(x) - y).max() < 0.5


def test_one_frame_after_the_other_has_the_bits_of_all_at_once(frames):
    scene = taxel.Scene("press")
    assert (scene.rows, scene.columns, frames.readings.shape) == (8, 18, (600, 144))
    x, y = frames.to_pandas()
    model = taxel.Model(16, refine=False).fit(x, y)
    decoder = taxel.Decoder(model)
    together = model.predict(x)
    for line in range(20):
        estimate = decoder.decode(frames.readings[line])
        assert np.array_equal(estimate.outputs, together[line].astype(np.float32))
        assert (estimate.status.tolist(), estimate.clamped) == ([0] * 8, False)
    broken = frames.readings[0].copy()
    broken[5] = np.nan
    assert decoder.decode(broken).status.tolist() == [1] * 8
    assert np.array_equal(decoder.decode_many(frames.readings), together)
    assert decoder.decode(frames.readings[0] + 1e4).clamped


def test_arrays_of_any_layout_and_precision_give_the_same(frames):
    x, y = smooth()
    x = x.astype(np.float32)
    model = taxel.Model(8, refine=False).fit(x, y)
    expected = model.predict(x)
    strided = np.asfortranarray(np.repeat(x, 2, axis=0))[::2]
    for same in (x.astype(np.float64), strided, x.tolist()):
        assert np.array_equal(model.predict(same), expected)
        assert taxel.Model(8, refine=False).fit(same, y).to_bytes() == model.to_bytes()
    before = x.copy()
    model.predict(x)
    assert np.array_equal(before, x)


def test_names_of_pandas_are_those_of_the_model():
    x, y = smooth()
    x = pandas.DataFrame(x, columns=["left", "right", "thumb"])
    y = pandas.DataFrame(y, columns=["force_n", "place_mm"])
    model = taxel.Model(8, refine=False).fit(x, y)
    assert model.blob_.input_names == ["left", "right", "thumb"]
    assert model.output_names_ == ["force_n", "place_mm"]
    assert model.feature_names_in_.tolist() == ["left", "right", "thumb"]
    with pytest.raises(ValueError, match="feature names"):
        model.predict(x[["right", "left", "thumb"]])


def test_a_place_is_none_without_a_touch_and_counts_as_the_mean():
    lines = np.arange(1200)
    force = np.where(lines // 60 % 2, 5.0, 0.0)
    place = np.where(force[:, None] > 0, RANDOM.uniform(1, 3, (len(lines), 2)), 2.0)
    cells = np.stack(np.meshgrid(range(5), range(5)), axis=-1).reshape(25, 1, 2)
    x = 100 + force * np.exp(-np.sum((cells - place) ** 2, axis=-1)) + RANDOM.normal(0, 0.01, (25, len(lines)))
    y = pandas.DataFrame(np.column_stack([place, force]), columns=["x_mm", "y_mm", "force_n"])
    model = taxel.Model(16, refine=False, grid=(5, 5), features_kind="normalised").fit(x.T, y)
    is_told = ~np.isnan(model.predict(x.T))
    assert is_told[force > 0].all() and is_told[:, 2].all() and is_told[force == 0, :2].mean() < 0.01
    assert model.score(x.T, y) > 0.99
    y.loc[force == 0, ["x_mm", "y_mm"]] = np.nan
    model = taxel.Model(16, refine=False, grid=(5, 5), features_kind="normalised").fit(x.T, y)
    assert model.score(x.T, y) > 0.99


def test_missing_readings_are_filled_by_a_model_that_can():
    x, y = smooth(1500, 4)
    x[:, 3] = x[:, 0] + 0.5 * x[:, 1] + RANDOM.normal(0, 0.05, len(x))
    model = taxel.Model(16, refine=False, reading_model="fill").fit(x, y)
    gaps = x[:200].copy()
    gaps[:, 3] = np.nan
    assert np.isfinite(model.predict(gaps)).all()
    assert np.abs(model.predict(gaps) - model.predict(x[:200])).mean() < 0.1
    with pytest.raises(ValueError, match="NaN"):
        taxel.Model(8, refine=False).fit(x, y).predict(gaps)


def test_deviations_and_novelty_need_a_full_reading_model():
    x, y = smooth(1200)
    model = taxel.Model(16, refine=False, reading_model="full").fit(x, y)
    outputs, std, novelty = model.predict(x, return_std=True, return_novelty=True)
    assert outputs.shape == std.shape == (1200, 2) and (std > 0).all()
    assert (novelty > 0).mean() < 0.05
    far = model.predict(x + 40, return_novelty=True)[1]
    assert (far > 0).all()
    with pytest.raises(ValueError, match="reading_model="):
        taxel.Model(8, refine=False).fit(x, y).predict(x, return_std=True)


def test_groups_are_held_out_and_relative_inputs_take_a_baseline():
    x, y = smooth(600)
    groups = np.repeat([3, 8, 9], 200)
    assert taxel.Model(8, reading_model="full", refine=False).fit(x, y, groups=groups).blob_.reading_model == "full"
    rest = np.array([50.0, 52.0, 47.0])
    y[:60], x[:60] = 0, rest + RANDOM.normal(0, 0.02, (60, 3))
    model = taxel.Model(8, refine=False, relative_inputs=True, format="f32")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(x, y)
    # A drift of the gain cancels.
    same = model.predict(x * 1.1, baseline=rest * 1.1)
    assert np.allclose(same, model.predict(x, baseline=rest), atol=1e-4)
    with pytest.raises(ValueError, match="baseline"):
        model.predict(x)


def test_a_model_survives_pickle_and_files(tmp_path):
    x, y = smooth()
    model = taxel.Model(8, refine=False).fit(x, y[:, 0])
    assert model.predict(x).shape == (400,)
    copy = pickle.loads(pickle.dumps(model))
    assert np.array_equal(copy.predict(x), model.predict(x)) and copy.to_bytes() == model.to_bytes()
    model.save(tmp_path / "m.bin")
    loaded = taxel.Model.load(tmp_path / "m.bin")
    assert np.array_equal(loaded.predict(x)[:, 0], model.predict(x))
    assert loaded.centres == 8 and pickle.loads(pickle.dumps(taxel.Scene("paper"))).rows == 8
    page = model._repr_html_()
    assert model.report_["verdict"]["sentence"].split(":")[0] in page and "<svg" in page


def test_fewer_lines_than_centres_take_fewer_with_a_warning():
    x, y = smooth(20)
    with pytest.warns(UserWarning, match="19 centres instead of 64"):
        model = taxel.Model(64, refine=False, penalty=1e-6).fit(x, y)
    assert model.blob_.centres == 19 and taxel.Model(64).fit(x, y).blob_.centres == 14 and taxel.Model().fit(x, y).blob_.centres <= 8


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"centres": 0}, "centres"),
        ({"format": "f16"}, "f16"),
        ({"spread": -1.0}, "spread"),
        ({"penalty": -2.0}, "penalty"),
        ({"features_kind": "shape"}, "normalised"),
    ],
)
def test_bad_parameters_are_value_errors_with_the_same_message(parameters, message):
    x, y = smooth()
    with pytest.raises(ValueError, match=message):
        taxel.Model(**({"refine": False} | parameters)).fit(x, y)
    with pytest.raises(ValueError, match="not a weight blob|too short|truncated|Taxel"):
        taxel.Model.of_bytes(b"no blob")


def test_scikit_learn_finds_nothing_to_complain_of():
    from sklearn.utils.estimator_checks import check_estimator

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = check_estimator(taxel.Model(16, refine=False), on_fail=None)
    failed = {check["check_name"]: str(check["exception"]) for check in found if check["status"] == "failed"}
    assert not failed and len(found) > 40


def test_the_ten_lines_of_the_page_do_what_they_say(tmp_path, monkeypatch, capsys):
    page = Path(__file__).parents[2] / "docs/python.md"
    code = re.search(r"## Ten lines\n\n```python\n(.*?)```", page.read_text(), re.DOTALL).group(1)
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert float(capsys.readouterr().out) > 0.8
    model = taxel.Model.load("model.bin")
    model.export_c("model-c", "finger")
    assert "int finger_decode(" in (tmp_path / "model-c/src/finger.h").read_text()


def test_a_mat_is_recognised_by_names_or_grid_and_not_by_numbers():
    x, y = smooth(200, 64)
    names = [f"adc_{cell}" for cell in range(64)]
    fit = lambda x, **grid: taxel.Model(4, refine=False, **grid).fit(x, y).blob_.input_names[:1]
    assert fit(x) == ["x1"]
    assert fit(x, grid=(8, 8)) == ["r1c1_x1"]
    assert fit(pandas.DataFrame(x, columns=names)) == ["r1c1_adc_0"]
    model = taxel.Model(4, refine=False).fit(pandas.DataFrame(x, columns=names), y)
    assert model.predict(pandas.DataFrame(x, columns=names)).shape == (200, 2)


def named(x, names):
    return pandas.DataFrame(x, columns=names)


def test_a_loaded_model_takes_columns_by_their_names(tmp_path):
    x, y = smooth(features=4)
    x[:, 0] = 50  # tells nothing, and is left out
    names = ["unused", "left, upper", "-b", "c [Ω] "]
    model = taxel.Model(8, refine=False, penalty=1e-6).fit(named(x, names), named(y, ["Fx, N", "!y"]))
    assert (model.blob_.input_names, model.output_names_) == (names[1:], ["Fx, N", "!y"])
    model.save(tmp_path / "model.bin")
    loaded, known = taxel.Model.load(tmp_path / "model.bin"), model.predict(named(x, names))
    others = named(x, names)[names[::-1]]
    assert np.array_equal(loaded.predict(others), known)
    assert np.array_equal(taxel.Decoder(tmp_path / "model.bin").decode_many(others), known)
    assert np.array_equal(loaded.predict(x[:, 1:]), known)
    with pytest.raises(ValueError, match="X has no column '-b'; the model takes left, upper"):
        loaded.predict(others.rename(columns={"-b": "b"}))
    with pytest.raises(ValueError, match="X has 4 columns, and the model takes 3: left, upper"):
        loaded.predict(x)
    assert loaded.score(others, y) == model.score(named(x, names), y) > 0.5


def test_a_baseline_is_one_reading_above_zero_for_each_input():
    x, y = smooth()
    y[:100], x[:100] = 0, 50
    names = ["a", "b", "c"]
    model = taxel.Model(8, refine=False, relative_inputs=True).fit(named(x, names), y)
    rest = np.array([50.0, 51, 52])
    known = model.predict(named(x, names), baseline=rest)
    turned = named(rest[np.newaxis, ::-1], names[::-1])
    assert np.array_equal(model.predict(named(x, names), baseline=turned), known)
    assert np.array_equal(taxel.Decoder(model, baseline=turned).decode_many(x), known)
    assert model.score(named(x, names), y, baseline=rest) < 1
    for bad, says in [([50, 51], "baseline has 2 columns"), ([50, 0, 52], "baseline of b is 0.0"), (None, "baseline=")]:
        with pytest.raises(ValueError, match=says):
            model.predict(named(x, names), baseline=bad)
        with pytest.raises(ValueError, match=says):
            taxel.Decoder(model, baseline=bad)


def test_what_a_model_cannot_take_is_told_in_the_words_of_python(tmp_path):
    x, y = smooth()
    for parameters, says in [
        ({"centres": 1.5}, "centres=1.5: give a whole number, 1 or above"),
        ({"centres": "16"}, "centres='16'"),
        ({"format": "float16"}, 'format=\'float16\': give "f32"'),
        ({"grid": 12}, "grid=12: give rows and columns"),
        ({"random_state": -1}, "random_state=-1"),
    ]:
        with pytest.raises(ValueError, match=says):
            taxel.Model(**{"centres": 4, "refine": False, **parameters}).fit(x, y)
    for groups, says in [([1, 2], "400 lines and groups 2"), (np.arange(400), "groups has no effect")]:
        with pytest.raises(ValueError, match=says):
            taxel.Model(4, refine=False, penalty=1e-6).fit(x, y, groups=groups)
    x[3, 1] = np.nan
    with pytest.raises(ValueError, match="NaN: missing readings need Model"):
        taxel.Model(4, refine=False).fit(x, y)
    with pytest.raises(TypeError, match="a ndarray: give a Scene"):
        taxel.trade(x)
    with pytest.raises(TypeError, match="a ndarray: give a Model"):
        taxel.evaluate(x, x, y)


def test_few_noisy_lines_are_told_no_worse_than_by_ridge():
    from sklearn.datasets import load_diabetes, load_linnerud
    from sklearn.linear_model import RidgeCV
    from sklearn.model_selection import ShuffleSplit, cross_val_score
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    ridge = make_pipeline(StandardScaler(), RidgeCV(np.logspace(-3, 4, 15)))
    for data, splits, ways in ((load_diabetes, 3, (False, True)), (load_linnerud, 40, (False,))):
        x, y = data(return_X_y=True)
        split = ShuffleSplit(splits, test_size=0.3, random_state=0)
        known = cross_val_score(ridge, x, y, cv=split, scoring="r2").mean()
        for model in (taxel.Model(refine=False, select=select) for select in ways):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = cross_val_score(model, x, y, cv=split).mean()
            assert found > known - 0.02, (data, model)


def test_few_lines_have_their_own_spread_and_are_refined():
    from sklearn.datasets import make_friedman1

    x, y = make_friedman1(1750, noise=1.0, random_state=0)
    for refine, least in ((False, 0.84), (None, 0.93)):
        model = taxel.Model(refine=refine).fit(x[:750], y[:750])
        assert model.score(x[750:], y[750:]) > least
        assert len(model.report_["selection"]["scored"]) > 100


def test_outputs_may_be_missing_constant_or_named_like_a_feature():
    x, y = smooth()
    model = taxel.Model(8, refine=False, penalty=1e-6)
    whole = model.fit(x, y).score(x, y)
    noisy = y[:, 0] + RANDOM.normal(size=len(y))
    assert abs(model.fit(x, noisy + 3e5).score(x, noisy + 3e5) - model.fit(x, noisy).score(x, noisy)) < 0.01
    y[::4, 1] = np.nan
    assert abs(model.fit(x, y).score(x, y) - whole) < 0.1
    constant = np.full(len(x), 3.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(x, constant)
    assert (model.score(x, constant), model.score(x, constant + 1)) == (1, 0)
    model.fit(named(x, ["a", "b", "c"]), pandas.Series(y[:, 0], name="b"))
    assert model.output_names_ == ["b_out"]


def test_a_weight_is_a_number_of_lines_and_a_seed_may_be_drawn():
    x, y = smooth(200)
    counts = np.arange(200) % 3
    groups = np.arange(200) // 20
    model = taxel.Model(8, refine=False)
    weighted = model.fit(x, y, sample_weight=2 * counts, groups=groups).to_bytes()
    again = [np.repeat(it, counts, axis=0) for it in (x, y, groups)]
    assert model.fit(again[0], again[1], groups=again[2]).to_bytes() == weighted
    assert model.fit(x, y, sample_weight=RANDOM.random(200)).score(x, y, sample_weight=counts) > 0.5
    for seed in (None, np.random.RandomState(3)):
        assert taxel.Model(8, refine=False, random_state=seed).fit(x, y).score(x, y) > 0.5
    with pytest.raises(ValueError, match="sample_weight"):
        model.fit(x, y, sample_weight=np.ones(3))


def test_lines_with_gaps_train_a_model_that_fills_them():
    x, y = smooth(600, 4)
    x[:, 3] = x[:, 0] + 0.5 * x[:, 1]
    x[RANDOM.random(600) < 0.4, 3] = np.nan
    x[7] = np.nan
    with pytest.warns(taxel.TaxelWarning, match="1 of 600 lines"):
        model = taxel.Model(8, refine=False, reading_model="fill").fit(x, y)
    assert model.report_["training_frames"] == 599 and model.score(x, y) > 0.5


def test_a_grid_warns_once_of_each_kind_in_words_of_python():
    from sklearn.model_selection import GridSearchCV

    x, y = smooth(60)
    taxel._call._given.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        GridSearchCV(taxel.Model(refine=False, penalty=1e-6), {"centres": [5, 10, 20]}, cv=3).fit(x, y)
    said = [str(it.message) for it in caught if it.category is taxel.TaxelWarning]
    assert 1 <= len(said) <= 3 and not any("--" in it for it in said)


def test_a_picture_of_many_outputs_names_none_in_its_sentence():
    x, _ = smooth()
    y = np.column_stack([np.sin(x[:, 0] * factor / 8) for factor in range(1, 13)])
    page = taxel.Model(8, refine=False, penalty=1e-6).fit(x, y)._repr_html_()
    assert "12 groups of outputs, with R² from" in page and "y7" not in page


def test_types_are_exported_to_strict_checkers(tmp_path):
    pytest.importorskip("mypy")
    code = "import taxel\nmodel: taxel.Model = taxel.Model(8, n_jobs=2)\nprint(taxel.synth('press', 2).readings, taxel.Link)\n"
    (tmp_path / "user.py").write_text(code)
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "user.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
