"""An independent ROS 2 peer of a running system.

client.py ENDPOINT read    reads camera, odometry and goal estimate, and prints what it read as JSON
client.py ENDPOINT drive   turns the robot with velocity commands, and prints its heading before and after as JSON
"""

import json
import math
import sys
import time

from peer import Reader, Writer, connect, types

LIMIT_S = 60
SILENCE_NS = 500_000_000


def nanoseconds(header):
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def yaw(odometry):
    q = odometry.pose.pose.orientation
    return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def read(session, store):
    image_reader = Reader(session, store, "camera/color/image_raw", "sensor_msgs/msg/Image")
    odometry_reader = Reader(session, store, "odom", "nav_msgs/msg/Odometry")
    estimate_reader = Reader(session, store, "goal_estimate", "homing_msgs/msg/GoalEstimate")
    estimate = estimate_reader.wait(LIMIT_S, lambda e: e.goal_id == 1 and e.n_matches > 0)
    image = image_reader.wait(LIMIT_S)
    odometry = odometry_reader.wait(LIMIT_S)
    attachments = image_reader.attachments + odometry_reader.attachments + estimate_reader.attachments
    return {
        "image_stamp_ns": nanoseconds(image.header),
        "image_frame": image.header.frame_id,
        "image_encoding": image.encoding,
        "image_size": [image.width, image.height, image.step, len(image.data)],
        "image_sum": int(image.data.sum(dtype="uint64")),
        "odometry_frames": [odometry.header.frame_id, odometry.child_frame_id],
        "odometry_norm": math.hypot(odometry.pose.pose.orientation.z, odometry.pose.pose.orientation.w),
        "estimate_stamp_ns": nanoseconds(estimate.header),
        "estimate_n_matches": estimate.n_matches,
        "estimate_kind": estimate.kind,
        "attachment_lengths": sorted({len(a) for a in attachments}),
    }


def drive(session, store):
    reader = Reader(session, store, "odom", "nav_msgs/msg/Odometry")
    writer = Writer(session, store, "cmd_vel", "geometry_msgs/msg/TwistStamped")
    before = reader.wait(LIMIT_S)
    names = ("builtin_interfaces/msg/Time", "std_msgs/msg/Header", "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Twist")
    time_type, header, vector, twist = (store.types[name] for name in names)
    stamped = store.types["geometry_msgs/msg/TwistStamped"]
    message = stamped(
        header=header(stamp=time_type(sec=0, nanosec=0), frame_id="base_link"),
        twist=twist(linear=vector(x=0.0, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.5)),
    )
    deadline = time.monotonic() + LIMIT_S
    turned = 0.0
    while turned < 0.6:
        if time.monotonic() > deadline:
            raise SystemExit(f"the robot turned {turned:.3f} rad in {LIMIT_S} s")
        writer.publish(message)
        time.sleep(0.05)
        turned = math.remainder(yaw(reader.messages[-1]) - yaw(before), math.tau)
    # Silence, on the robot's own clock: a busy simulator's is slower than the wall's.
    said = nanoseconds(reader.messages[-1].header)
    first = reader.wait(LIMIT_S, lambda o: nanoseconds(o.header) > said + SILENCE_NS)
    last = reader.wait(LIMIT_S, lambda o: nanoseconds(o.header) > said + 2 * SILENCE_NS)
    return {
        "turned_rad": turned,
        "turning_after_silence_rad_s": first.twist.twist.angular.z,
        "crept_rad": abs(yaw(last) - yaw(first)),
    }


def main():
    endpoint, what = sys.argv[1:]
    store, _ = types()
    with connect(endpoint) as session:
        print(json.dumps({"read": read, "drive": drive}[what](session, store)))


main()
