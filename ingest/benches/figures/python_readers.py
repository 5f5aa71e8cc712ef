"""How fast the Python readers are on a file that the benchmark `figures` left in its folder.

Needs the packages mcap, mcap-ros2-support (decoding) and rosbags. Usage: python_readers.py FILE [MESSAGES]
"""
import sys
import time

from mcap.reader import make_reader


def rate(name, messages, limit):
    start, count, size = time.perf_counter(), 0, 0
    for data in messages:
        count += 1
        size += len(data)
        if count == limit:
            break
    took = time.perf_counter() - start
    print(f"{name:24} {count / took * 1e-6:7.3f} M messages/s  {size / took * 1e-6:7.1f} MB/s of payload")


def main():
    path, limit = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 200_000
    with open(path, "rb") as file:
        raw = make_reader(file).iter_messages(log_time_order=False)
        rate("mcap, raw", (message.data for _, _, message in raw), limit)
    try:
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        print("mcap-ros2-support is not installed: not decoded")
    else:
        with open(path, "rb") as file:
            decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(log_time_order=False)
            rate("mcap, decoded", (item.message.data for item in decoded if item.decoded_message.position), limit // 4)
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        print("rosbags is not installed")
        return
    store = get_typestore(Stores.ROS2_HUMBLE)

    def by_rosbags():
        with open(path, "rb") as file:
            for _, _, message in make_reader(file).iter_messages(log_time_order=False):
                store.deserialize_cdr(message.data, "sensor_msgs/msg/JointState")
                yield message.data

    rate("rosbags, decoded", by_rosbags(), limit // 4)


if __name__ == "__main__":
    main()
