"""The node of ROS 2 in the docs, run by rclpy; recordings are read by rosbags."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from taxel._call import call

WHY = "is not installed: pip install ros-rclpy ros-rmw-fastrtps-cpp ros-sensor-msgs rosbags"
rclpy = pytest.importorskip("rclpy", reason=f"rclpy {WHY}", exc_type=ImportError)
messages = pytest.importorskip("sensor_msgs.msg", reason=f"sensor_msgs {WHY}", exc_type=ImportError)
rosbags = pytest.importorskip("rosbags.highlevel", reason=f"rosbags {WHY}")

NODE = Path(__file__).parents[2] / "docs" / "ros2_taxel.py"


def test_the_node_publishes_what_rosbags_reads_in_the_recording(tmp_path, monkeypatch):
    path = tmp_path / "press.mcap"
    call(["synth", "press", "-n", 40, "-o", path])
    recorded = {"/taxel/readings": [], "/taxel/truth": []}
    with rosbags.AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            if connection.topic in recorded:
                recorded[connection.topic].append(reader.deserialize(raw, connection.msgtype))
    assert {topic: len(found) for topic, found in recorded.items()} == {"/taxel/readings": 40, "/taxel/truth": 40}

    # Nodes of others are not heard.
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    heard = {messages.Image: [], messages.PointCloud2: []}
    listener = rclpy.create_node("listener")
    topics = {messages.Image: "/taxel/readings", messages.PointCloud2: "/taxel/points"}
    for kind, topic in topics.items():
        listener.create_subscription(kind, topic, heard[kind].append, 10)
    node = subprocess.Popen([sys.executable, NODE, path, "recording"])
    try:
        for _ in range(2000):
            rclpy.spin_once(listener, timeout_sec=0.02)
            if all(len(found) >= 20 for found in heard.values()):
                break
    finally:
        node.terminate()
        node.wait()
        listener.destroy_node()
        rclpy.shutdown()

    images = {bytes(image.data) for image in recorded["/taxel/readings"]}
    assert all(len(found) >= 20 for found in heard.values())
    for image in heard[messages.Image]:
        assert (image.encoding, image.height, image.width, image.step) == ("32FC1", 8, 18, 72)
        assert bytes(image.data) in images
    truths = np.stack([values_of(cloud) for cloud in recorded["/taxel/truth"]])
    for cloud in heard[messages.PointCloud2]:
        assert np.abs(truths - values_of(cloud)).max(axis=(1, 2)).min() < 1e-6


def values_of(cloud):
    """Points × x, y, z, dx, dy, dz, in m."""
    lines = np.frombuffer(bytes(cloud.data), np.uint8).reshape(cloud.width, cloud.point_step)
    columns = []
    for name in ("x", "y", "z", "dx", "dy", "dz"):
        field = next(field for field in cloud.fields if field.name == name)
        size = {7: "<f4", 8: "<f8"}[field.datatype]
        columns.append(np.ascontiguousarray(lines[:, field.offset : field.offset + int(size[-1])]).view(size)[:, 0])
    return np.stack(columns, axis=1)
