"""Recordings read by PyPI's readers: rosbags, and mcap with mcap-ros2-support.

The example `record` writes a recording and the same frames as CSV; every message of every frame is compared with its line. Then
it records frames at their times, and is killed; the example `recover` mends what is left, and that is compared, too. So is what
`recover` makes of a copy that PyPI's writer wrote, and that was cut.

    python compare/recording.py [number of kills]
"""

import io
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/examples"
READINGS, ELECTRODES, FORCES = 144, 48, 3
OUTPUTS = 3 * ELECTRODES + FORCES
#: Frames a second, and the most seconds that a kill may cost.
RATE, MOST_LOST_S = 100, 1.0


def by_rosbags(path):
    """Messages as topic, time in ns, and message."""
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, stamp, raw in reader.messages():
            yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype)


def by_mcap(path):
    """The same by the readers of the format's makers, which also tell frame numbers and the device's times."""
    numbers = {}
    with path.open("rb") as file:
        # The checksums of all bytes and of chunks, by reading from the first byte to the last.
        list(StreamReader(file, validate_crcs=True).records)
        file.seek(0)
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_summary().statistics.message_count > 0
        names = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        assert names == {"model.bin": bytes([1, 2, 3, 4]), "scene.toml": b'name = "example"\n'}, names
        for _, channel, message, decoded in reader.iter_decoded_messages():
            number = message.publish_time // 1000, message.sequence
            assert numbers.setdefault(message.log_time, number) == number, "two frames at one time"
            yield channel.topic, message.log_time, decoded
    by_mcap.numbers = [number for _, number in sorted(numbers.items())]


def frames(messages):
    """Messages of each frame by topic, with its time in ns, in order."""
    found = {}
    for topic, stamp, message in messages:
        assert topic not in found.setdefault(stamp, {}), f"two messages on {topic} at {stamp}"
        found[stamp][topic] = message
    return sorted(found.items())


def lines(path):
    """Fields of the whole lines of a CSV."""
    text = path.read_text()
    return [line.split(",") for line in text[: text.rfind("\n") + 1].splitlines()]


def numbers(fields, kind=np.float32):
    """Numbers as they were written; `None` for empty fields."""
    return None if fields[0] == "" else np.array(fields, dtype=kind)


def same(found, expected, what):
    """Whether numbers are the same bits, or both missing, or both NaN."""
    assert (found is None) == (expected is None), what
    if found is not None:
        found = np.asarray(found)
        assert found.dtype == expected.dtype and found.shape == expected.shape, what
        assert np.array_equal(found, expected, equal_nan=True), what


def millimetres(metres):
    return (np.asarray(metres) * 1000).astype(np.float32)


def points(message, outputs, deviations, places_mm):
    """Compares points with outputs and deviations, in mm."""
    kinds = {7: "<f4", 8: "<f8"}
    dtype = np.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": [kinds[field.datatype] for field in message.fields],
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    table = np.frombuffer(bytes(message.data), dtype)
    assert len(table) == ELECTRODES == message.width and message.height == 1
    moved = outputs[: 3 * ELECTRODES].reshape(-1, 3)
    for axis, name in enumerate("xyz"):
        same(millimetres(table[f"d{name}"]), moved[:, axis], f"d{name}")
        place = (places_mm[:, axis] / 1000 - moved[:, axis].astype(np.float64) / 1000).astype(np.float32)
        same(table[name], place, name)
        if deviations is None:
            assert f"s{name}" not in table.dtype.names
        else:
            same(millimetres(table[f"s{name}"]), deviations[axis : 3 * ELECTRODES : 3], f"s{name}")
    assert message.is_dense == bool(np.isfinite(moved).all())


def array(message, outputs, deviations):
    """Compares outputs that belong to no electrode."""
    expected = [values[3 * ELECTRODES :] for values in (outputs, deviations) if values is not None]
    same(np.asarray(message.data, dtype=np.float64), np.concatenate(expected).astype(np.float64), "forces")
    assert message.layout.dim[-1].label == "force_x_n,force_y_n,force_z_n"
    assert [dim.size for dim in message.layout.dim][-1] == FORCES


def compare(path, reader):
    """Compares a recording with its CSV, and counts frames and messages."""
    found, written = frames(reader(path)), lines(path.with_suffix(".csv"))
    places = [((e % 6 + 0.5) * 20 / 6, (e // 6 + 0.5) * 18 / 8, 5.0) for e in range(ELECTRODES)]
    places = np.array(places)
    messages, state = 0, None
    for (stamp, by_topic), fields in zip(found, written):
        rest = iter(fields)
        take = lambda count: [next(rest) for _ in range(count)]
        time_us, number = map(int, take(2))
        readings = numbers(take(READINGS))
        outputs, deviations, truth = (numbers(take(OUTPUTS)) for _ in range(3))
        place, force = numbers(take(3)), numbers(take(3))
        lost = next(rest)
        assert stamp - found[0][0] == (time_us - int(written[0][0])) * 1000

        image = by_topic["/taxel/readings"]
        assert (image.height, image.width, image.encoding) == (8, 18, "32FC1")
        same(np.frombuffer(bytes(image.data), "<f4"), readings, "readings")
        points(by_topic["/taxel/points"], outputs, deviations, places)
        points(by_topic["/taxel/truth"], truth, None, places)
        array(by_topic["/taxel/outputs"], outputs, deviations)
        array(by_topic["/taxel/true_outputs"], truth, None)
        contact, wrench = by_topic.get("/taxel/contact"), by_topic.get("/taxel/wrench")
        vector = lambda it: it and np.array([it.x, it.y, it.z])
        same(contact and millimetres(vector(contact.point)), place, "contact")
        same(wrench and vector(wrench.wrench.force).astype(np.float32), force, "force")
        if wrench:
            torque = np.cross(vector(contact.point), vector(wrench.wrench.force))
            assert np.allclose(vector(wrench.wrench.torque), torque, rtol=1e-12, atol=1e-15)
        if status := by_topic.get("/diagnostics"):
            (status,) = status.status
            state = {pair.key: pair.value for pair in status.values}
        is_open = number // 150 % 2 == 1
        wire = "open" if is_open else "sound"
        assert (state["lost frames"], state["row-wire 3"], state["novel"]) == (lost, wire, "yes" if is_open else "no")
        assert ("/tf_static" in by_topic) == (number == 0)
        for message in by_topic.values():
            if header := getattr(message, "header", None):
                assert header.stamp.sec * 10**9 + header.stamp.nanosec == stamp
        messages += len(by_topic)
    if reader is by_mcap:
        expected = [tuple(map(int, fields[:2])) for fields in written[: len(found)]]
        assert by_mcap.numbers == expected, "times of the device, or numbers"
    return len(found), messages


def kill(folder, after_s):
    """Frames that were recorded in `after_s` until a kill, and those that were recovered."""
    path = folder / "killed.mcap"
    recorder = subprocess.Popen([EXAMPLES / "record", path, "60", "--paced"])
    time.sleep(after_s)
    recorder.send_signal(signal.SIGKILL)
    recorder.wait()
    written = len(lines(path.with_suffix(".csv")))
    try:
        list(by_rosbags(path))
        raise SystemExit("rosbags reads a file that was cut: nothing is shown")
    except Exception as error:
        refused = type(error).__name__
    said = subprocess.run([EXAMPLES / "recover", path], capture_output=True, text=True, check=True).stdout
    recovered = int(re.match(r"(\d+) frames", said).group(1))
    for reader in (by_rosbags, by_mcap):
        assert compare(path, reader)[0] == recovered
    lost_s = (written - recovered) / RATE
    print(f"killed after {after_s:4.2f} s: {written} frames, {recovered} recovered, {lost_s:.2f} s lost (before: {refused})")
    assert lost_s <= MOST_LOST_S
    return lost_s


def copy(path, to):
    """Writes a recording anew by PyPI's writer, but for the last byte."""
    copied = io.BytesIO()
    with path.open("rb") as file:
        reader = make_reader(file)
        writer = Writer(copied, chunk_size=200_000, compression=CompressionType.NONE)
        writer.start("ros2")
        numbers = {}
        for schema, channel, message in reader.iter_messages():
            if channel.id not in numbers:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, schema_id)
            number = numbers[channel.id]
            writer.add_message(number, message.log_time, message.data, message.publish_time, message.sequence)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for it in reader.iter_attachments():
            writer.add_attachment(it.create_time, it.log_time, it.name, it.media_type, it.data)
        writer.finish()
    to.write_bytes(copied.getvalue()[:-1])


def main():
    subprocess.run(["cargo", "build", "--quiet", "-p", "taxel-recording", "--examples"], cwd=ROOT, check=True)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        path = folder / "whole.mcap"
        subprocess.run([EXAMPLES / "record", path, "20"], check=True)
        for reader in (by_rosbags, by_mcap):
            count, messages = compare(path, reader)
            assert count == len(lines(path.with_suffix(".csv")))
            print(f"{reader.__name__[3:]}: {count} frames, {messages} messages, all equal")
        copied = folder / "copied.mcap"
        copy(path, copied)
        path.with_suffix(".csv").rename(copied.with_suffix(".csv"))
        subprocess.run([EXAMPLES / "recover", copied], check=True, stdout=subprocess.DEVNULL)
        for reader in (by_rosbags, by_mcap):
            assert compare(copied, reader) == (count, messages)
        print("a copy by PyPI's writer is recovered whole")
        kills = int(sys.argv[1]) if len(sys.argv) > 1 else 10
        lost_s = [kill(folder, 0.8 + 0.37 * number) for number in range(kills)]
        print(f"{kills} kills cost {max(lost_s):.2f} s at most, all before that is equal")


if __name__ == "__main__":
    main()
