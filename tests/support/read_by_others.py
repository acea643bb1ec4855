"""Reads a recording with other programs' readers; runs in an environment of its own (`make oracles`): `python read_by_others.py FILE`.

Prints for each reader the messages of each topic with images, and whether they have our bytes when they are written again.
"""

import json
import sys
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def by_mcap(path: Path) -> dict[str, list[Any]]:
    """What mcap and mcap-ros2-support read, with all checksums checked."""
    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        reader, factory = make_reader(file, validate_crcs=True), DecoderFactory()
        for schema, channel, message in reader.iter_messages():
            if schema is None:
                found.setdefault(channel.topic, []).append(sorted(json.loads(message.data)))
                continue
            decoder = factory.decoder_for(channel.message_encoding, schema)
            assert decoder is not None
            decoded = decoder(message.data)
            stamp = decoded.header.stamp
            content = len(decoded.data) if hasattr(decoded, "data") else list(decoded.p)
            found.setdefault(channel.topic, []).append(
                [stamp.sec * 10**9 + stamp.nanosec, decoded.header.frame_id, content]
            )
        found["attachments"] = [each.name for each in reader.iter_attachments()]
        found["metadata"] = [each.name for each in reader.iter_metadata()]
    return found


def by_rosbags(path: Path) -> dict[str, list[Any]]:
    """What rosbags reads, and whether it writes the same bytes."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    found: dict[str, list[Any]] = {}
    with AnyReader([path], default_typestore=store) as reader:
        wanted = [one for one in reader.connections if one.msgtype.startswith("sensor_msgs")]
        for connection, _, raw in reader.messages(wanted):
            message: Any = reader.deserialize(raw, connection.msgtype)
            again = bytes(store.serialize_cdr(message, connection.msgtype))
            found.setdefault(connection.topic, []).append([message.header.frame_id, again == bytes(raw)])
    return found


if __name__ == "__main__":
    file = Path(sys.argv[1])
    print(json.dumps({"mcap": by_mcap(file), "rosbags": by_rosbags(file)}))
