"""What an independent ROS 2 peer needs: message types read from protocol/msg, rmw_zenoh's keys and attachments.

Nothing here comes from the Rust side: eclipse-zenoh and rosbags are other people's implementations.
"""

import json
import struct
import time
import uuid
from pathlib import Path

import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROOT = Path(__file__).resolve().parents[2]


def types():
    """ROS 2 Jazzy's messages, and those of protocol/msg."""
    store = get_typestore(Stores.ROS2_JAZZY)
    found = {}
    for file in sorted((ROOT / "protocol" / "msg").glob("*.msg")):
        found.update(get_types_from_msg(file.read_text(), f"homing_msgs/msg/{file.stem}"))
    store.register(found)
    return store, sorted(found)


def connect(endpoint):
    """A zenoh client of the body's session."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def key(store, topic, message_type, domain=0):
    """rmw_zenoh's key of a topic: domain, name, DDS type name, type hash."""
    package, _, name = message_type.partition("/msg/")
    return f"{domain}/{topic}/{package}::msg::dds_::{name}_/{store.hash_rihs01(message_type)}"


class Reader:
    """Keeps what arrives on a topic, decoded."""

    def __init__(self, session, store, topic, message_type):
        self.store, self.message_type = store, message_type
        self.messages, self.attachments = [], []
        self.subscriber = session.declare_subscriber(key(store, topic, message_type), self.take)

    def take(self, sample):
        self.attachments.append(bytes(sample.attachment) if sample.attachment else b"")
        self.messages.append(self.store.deserialize_cdr(bytes(sample.payload), self.message_type))
        del self.messages[:-200]

    def wait(self, seconds, wanted=lambda message: True):
        """The newest message that is wanted, once there is one."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            for message in reversed(self.messages):
                if wanted(message):
                    return message
            time.sleep(0.02)
        raise SystemExit(f"no {self.message_type} as wanted within {seconds} s; {len(self.messages)} arrived")


class Writer:
    """Publishes on a topic as rmw_zenoh does."""

    def __init__(self, session, store, topic, message_type):
        self.store, self.message_type = store, message_type
        self.publisher = session.declare_publisher(key(store, topic, message_type))
        self.gid, self.sequence = uuid.uuid4().bytes, 0

    def publish(self, message):
        self.sequence += 1
        attachment = struct.pack("<qqB", self.sequence, time.time_ns(), 16) + self.gid
        payload = bytes(self.store.serialize_cdr(message, self.message_type))
        self.publisher.put(payload, attachment=attachment)
