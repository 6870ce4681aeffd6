"""A node of ROS 2 that publishes a Taxel sensor: readings as an Image, and electrodes as a PointCloud2, in metres.

    python ros2_taxel.py [PORT]                        # a device whose model has Δx, Δy, Δz of each electrode
    python ros2_taxel.py press.mcap recording          # a recording in its place

Without ROS, `pip install ros-rclpy ros-rmw-fastrtps-cpp ros-sensor-msgs` has what it imports, besides taxel.
"""

import sys

import numpy as np
import rclpy
import taxel
from rclpy.node import Node
from sensor_msgs.msg import Image, PointCloud2, PointField

FIELDS = ("x", "y", "z", "dx", "dy", "dz")
SIZE_M = (0.020, 0.018, 0.005)


class Taxel(Node):
    def __init__(self, port=None, protocol="taxel"):
        super().__init__("taxel")
        self.link = taxel.Link(port, protocol=protocol, send="both")
        self.images = self.create_publisher(Image, "/taxel/readings", 10)
        self.points = self.create_publisher(PointCloud2, "/taxel/points", 10)
        self.create_timer(0.005, self.publish)
        self.last = None

    def publish(self):
        reading = self.link.read_latest()
        if reading is None or reading.frame == self.last:
            return
        self.last = reading.frame
        image = Image(encoding="32FC1", height=reading.readings.shape[0], width=reading.readings.shape[1])
        image.header.stamp, image.header.frame_id = self.get_clock().now().to_msg(), "taxel"
        image.step = 4 * image.width
        image.data = reading.readings.astype("<f4").tobytes()
        self.images.publish(image)
        moved_m = reading.outputs.reshape(len(reading.status), -1, 3) * 1e-3
        rows, places, _ = moved_m.shape
        y, x = np.meshgrid(
            (np.arange(rows) + 0.5) / rows * SIZE_M[1], (np.arange(places) + 0.5) / places * SIZE_M[0], indexing="ij"
        )
        rest_m = np.stack([x, y, np.full_like(x, SIZE_M[2])], axis=2)
        values = np.concatenate([rest_m - moved_m, moved_m], axis=2).astype("<f4")
        cloud = PointCloud2(header=image.header, height=1, width=rows * places, point_step=24, is_dense=False)
        cloud.row_step = cloud.point_step * cloud.width
        cloud.fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate(FIELDS)]
        cloud.data = values.tobytes()
        self.points.publish(cloud)


def main():
    rclpy.init()
    node = Taxel(*sys.argv[1:])
    try:
        rclpy.spin(node)
    finally:
        node.link.close()


if __name__ == "__main__":
    main()
