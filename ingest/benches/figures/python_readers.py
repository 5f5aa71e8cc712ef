"""How fast the readers of Python are: the first joint states of a log, to decoded messages.

Prints for each reader, separated by tabs, its name, the messages, their bytes and the seconds, or why it
did not take part. Usage: python_readers.py LOG [MESSAGES]
"""
import sys
import time
from pathlib import Path

from mcap.reader import make_reader

JOINT_STATE = "sensor_msgs/msg/JointState"


def rate(name, messages, limit):
    # What comes before the first message, such as reading the index, is not counted.
    next(messages)
    start, count, size = time.perf_counter(), 0, 0
    for data in messages:
        count += 1
        size += len(data)
        if count == limit:
            break
    print(name, count, size, time.perf_counter() - start, sep="\t")


def joint_topics(path):
    with open(path, "rb") as file:
        summary = make_reader(file).get_summary()
    schemas = summary.schemas
    return [channel.topic for channel in summary.channels.values() if schemas[channel.schema_id].name == JOINT_STATE]


def by_mcap(path, topics):
    with open(path, "rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics, log_time_order=False):
            yield message.data


def by_mcap_decoded(path, topics, factory):
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[factory])
        for item in reader.iter_decoded_messages(topics, log_time_order=False):
            assert item.decoded_message.position
            yield item.message.data


def by_rosbags(path, reader_of, store):
    with reader_of(Path(path)) as reader:
        wanted = [connection for connection in reader.connections if connection.msgtype == JOINT_STATE]
        for _, _, data in reader.messages(connections=wanted):
            assert len(store.deserialize_cdr(data, JOINT_STATE).position)
            yield data


def main():
    path, limit = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 100_000
    topics = joint_topics(path)
    rate("Python mcap, not decoded", by_mcap(path, topics), limit)
    try:
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        print("Python mcap-ros2-support: not installed, skipped")
    else:
        rate("Python mcap, decoded", by_mcap_decoded(path, topics, DecoderFactory()), limit)
    try:
        from rosbags.rosbag2 import Reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        print("Python rosbags: not installed, skipped")
    else:
        rate("Python rosbags, decoded", by_rosbags(path, Reader, get_typestore(Stores.ROS2_HUMBLE)), limit)


if __name__ == "__main__":
    main()
