"""The camera of LeRobot, in LeRobot."""

import time

import numpy as np
import pytest
import taxel
from taxel._call import call

WHY = "is not installed: pip install 'lerobot[dataset]' python/lerobot_camera_taxel"
cameras = pytest.importorskip("lerobot.cameras", reason=f"lerobot {WHY}")
plugin = pytest.importorskip("lerobot_camera_taxel", reason=f"lerobot_camera_taxel {WHY}")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "moving.mcap"
    call(["synth", "moving", "-n", 300, "--frame-rate", 100, "-o", path])
    return str(path)


def camera_of(**fields):
    """A camera as LeRobot makes it of what a user wrote."""
    import draccus
    from lerobot.utils.import_utils import register_third_party_plugins

    register_third_party_plugins()
    config = draccus.decode(cameras.CameraConfig, {"type": "taxel", **fields})
    return cameras.make_cameras_from_configs({"fingertip": config})["fingertip"]


def test_lerobot_finds_the_camera_and_reads_each_frame_once(recording):
    camera = camera_of(port=recording, protocol="recording", axes=1, black=0, white=1)
    assert isinstance(camera, plugin.TaxelCamera) and not camera.is_connected
    assert (camera.height, camera.width) == (128, 96)
    frames = taxel.read_recording(recording)
    pictures = np.uint8(255 * frames.outputs.reshape(300, 8, 6).clip(0, 1) + 0.5).repeat(16, axis=1).repeat(16, axis=2)
    with camera:
        with pytest.raises(ConnectionError):
            camera.connect()
        start = time.monotonic()
        for _ in range(50):
            picture = camera.async_read()
            assert picture.shape == (128, 96, 3) and picture.dtype == np.uint8
            assert (picture[:, :, :1] == picture).all()
            assert (pictures == picture[:, :, 0]).all(axis=(1, 2)).any()
        # A frame comes every 10 ms.
        assert time.monotonic() - start > 0.45
        assert camera.read_latest().shape == camera.read().shape == (128, 96, 3)
    assert not camera.is_connected
    with pytest.raises(ConnectionError):
        camera.read()


def test_readings_are_shown_between_black_and_white(recording):
    with camera_of(port=recording, protocol="recording", show="readings", black=70, white=45, width=36, height=16) as camera:
        picture = camera.read()[::2, ::2, 0]
    readings = taxel.read_recording(recording).readings.reshape(300, 8, 18)
    shown = np.uint8(255 * ((70 - readings) / 25).clip(0, 1) + 0.5)
    assert np.abs(shown.astype(int) - picture).max(axis=(1, 2)).min() <= 1


def test_what_cannot_be_shown_is_refused(tmp_path):
    for name, value in {"show": "all", "axes": 2, "black": 1.0, "fps": 0}.items():
        with pytest.raises(ValueError, match=f"{name}={value}|{name}='{value}'"):
            plugin.TaxelCameraConfig(**{name: value})
    call(["synth", "contact", "-n", 5, "-o", tmp_path / "contact.mcap"])
    camera = camera_of(port=str(tmp_path / "contact.mcap"), protocol="recording")
    with pytest.raises(ValueError, match="are not 3 of each place: upload a model"):
        camera.connect()
    assert not camera.is_connected


def test_a_dataset_has_the_pictures_that_were_read(recording, tmp_path):
    LeRobotDataset = pytest.importorskip("lerobot.datasets.lerobot_dataset").LeRobotDataset
    camera = camera_of(port=recording, protocol="recording", axes=1, black=0)
    name = "observation.images.fingertip"
    shape = {"dtype": "image", "shape": (camera.height, camera.width, 3), "names": ["height", "width", "channels"]}
    state = {"dtype": "float32", "shape": (2,), "names": ["wrist", "gripper"]}
    dataset = LeRobotDataset.create(
        "taxel/press", 30, {name: shape, "observation.state": state}, root=tmp_path / "set", use_videos=False
    )
    read = []
    with camera:
        for _ in range(12):
            read.append(camera.async_read())
            dataset.add_frame({name: read[-1], "observation.state": np.zeros(2, np.float32), "task": "press"})
    dataset.save_episode()
    if hasattr(dataset, "finalize"):
        dataset.finalize()
    again = LeRobotDataset("taxel/press", root=tmp_path / "set")
    assert len(again) == 12
    for picture, line in zip(read, again):
        assert (np.uint8(255 * line[name].numpy().transpose(1, 2, 0) + 0.5) == picture).all()
