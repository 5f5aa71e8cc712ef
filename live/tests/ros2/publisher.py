"""Publishes a simulated machine on DDS as ROS 2 does, by Cyclone DDS, and breaks in ways that networks break.

usage: publisher.py DOMAIN LOG FAULT [SECONDS]

It needs the Python packages cyclonedds, mcap and mcap-ros2-support.

FAULT: none, two (from 4 s to 6 s a second publisher sends on /imu/data),
restart (at 4 s the publisher of /imu/data is made anew after 1.5 s), type (a second publisher of another type on
/imu/data), only_wrong_type, flood (from 4 s to 6 s 20000 messages per second on /imu/data), silent_imu (from 4 s on),
back (at 5 s the log begins again), diagnostics (prints the diagnostics that come).
"""

import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Vector3
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


SENSOR_DATA = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5))
RELIABLE = Qos(Policy.Reliability.Reliable(duration(milliseconds=10)), Policy.History.KeepLast(50))
TYPES = {"/joint_states": (JointState, RELIABLE), "/imu/data": (Imu, SENSOR_DATA), "/odom": (Odometry, RELIABLE)}


def header(message):
    stamp = message.header.stamp
    return Header(Time(stamp.sec, stamp.nanosec), message.header.frame_id)


def vector(of):
    return Vector3(of.x, of.y, of.z)


def quaternion(of):
    return Quaternion(of.x, of.y, of.z, of.w)


def converted(name, message):
    if name == "/joint_states":
        lists = [list(part) for part in (message.name, message.position, message.velocity, message.effort)]
        return JointState(header(message), *lists)
    if name == "/imu/data":
        return Imu(
            header(message),
            quaternion(message.orientation),
            list(message.orientation_covariance),
            vector(message.angular_velocity),
            list(message.angular_velocity_covariance),
            vector(message.linear_acceleration),
            list(message.linear_acceleration_covariance),
        )
    pose, twist = message.pose, message.twist
    return Odometry(
        header(message),
        message.child_frame_id,
        PoseWithCovariance(
            Pose(vector(pose.pose.position), quaternion(pose.pose.orientation)), list(pose.covariance)
        ),
        TwistWithCovariance(Twist(vector(twist.twist.linear), vector(twist.twist.angular)), list(twist.covariance)),
    )


def writer(participant, name, kind=None):
    message_type, qos = TYPES[name]
    return DataWriter(participant, Topic(participant, "rt" + name, kind or message_type, qos=qos), qos=qos)


def main():
    domain, log, fault = int(sys.argv[1]), sys.argv[2], sys.argv[3]
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 1e9
    participant = DomainParticipant(domain)
    with open(log, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        messages = [
            (message.log_time, channel.topic, converted(channel.topic, decoded))
            for _, channel, message, decoded in reader.iter_decoded_messages(topics=list(TYPES))
        ]
    writers = {name: writer(participant, name) for name in TYPES}
    if fault == "only_wrong_type":
        writers["/imu/data"] = None
    if fault in ("type", "only_wrong_type"):
        # a participant of its own: one process may not give a topic two types
        stranger = DomainParticipant(domain)
        wrong = DataWriter(stranger, Topic(stranger, "rt/imu/data", Odometry, qos=RELIABLE), qos=RELIABLE)
    second = other = None
    if fault == "two":
        other = DomainParticipant(domain)
        second = writer(other, "/imu/data")
    diagnostics = None
    if fault == "diagnostics":
        diagnostics = DataReader(
            participant, Topic(participant, "rt/diagnostics", DiagnosticArray, qos=RELIABLE), qos=RELIABLE
        )
    time.sleep(2.0)
    start, first = time.monotonic(), messages[0][0]
    count = at = 0
    offset = 0.0
    begun_again = False
    shown = last_odometry = None
    while at < len(messages):
        log_time, name, message = messages[at]
        due = (log_time - first) * 1e-9 + offset
        if due > seconds:
            break
        delay = start + due - time.monotonic()
        if delay > 0:
            time.sleep(delay)
        at += 1
        count += 1
        if fault == "back" and due > 5.0 and not begun_again:
            begun_again, offset, at = True, due, 0
            continue
        if name == "/imu/data":
            if fault == "silent_imu" and due > 4.0:
                continue
            if fault == "restart" and 4.0 < due < 5.5:
                writers[name] = None
                continue
            if fault == "restart" and writers[name] is None:
                writers[name] = writer(DomainParticipant(domain), name)
            if fault == "two" and 4.0 < due < 6.0:
                second.write(message)
            if fault == "flood" and 4.0 < due < 6.0:
                for _ in range(200):
                    writers[name].write(message)
            if fault == "only_wrong_type":
                if last_odometry is not None:
                    wrong.write(last_odometry)
                continue
        if name == "/odom":
            last_odometry = message
            if fault == "type":
                wrong.write(message)
        if writers[name] is not None:
            writers[name].write(message)
        if diagnostics is not None:
            for array_of in diagnostics.take(50):
                for status in array_of.status:
                    line = f"{status.level} {status.name} | {status.message} | {status.hardware_id}"
                    if line != shown:
                        print(line, flush=True)
                        shown = line
    print(f"sent {count}", flush=True)
    time.sleep(0.5)


if __name__ == "__main__":
    main()
