"""Messages of ROS 2 and CRTK for the Python package cyclonedds (PyPI, 0.10 or newer), without ROS: see doc/dvrk.md."""
import os
import time
from dataclasses import dataclass, field

os.environ.setdefault("CYCLONEDDS_URI", "<Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces><AllowMulticast>false</AllowMulticast>"
                      "</General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><LeaseDuration>3s</LeaseDuration>"
                      "<Peers><Peer Address='127.0.0.1'/></Peers></Discovery></Domain>")  # this machine alone, as omentum dvrk

from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.annotations import final  # noqa: E402
from cyclonedds.idl.types import float64, int32, sequence, uint32  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
@final
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
@final
class String(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    data: str = ""


@dataclass
@final
class Point(IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
@final
class Pose(IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
@final
class PoseStamped(IdlStruct, typename="geometry_msgs.msg.dds_.PoseStamped_"):
    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)


@dataclass
@final
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header = field(default_factory=Header)
    name: sequence[str] = field(default_factory=list)
    position: sequence[float64] = field(default_factory=list)
    velocity: sequence[float64] = field(default_factory=list)
    effort: sequence[float64] = field(default_factory=list)


@dataclass
@final
class StringStamped(IdlStruct, typename="crtk_msgs.msg.dds_.StringStamped_"):
    header: Header = field(default_factory=Header)
    string: str = ""


@dataclass
@final
class OperatingState(IdlStruct, typename="crtk_msgs.msg.dds_.OperatingState_"):
    header: Header = field(default_factory=Header)
    state: str = ""
    is_homed: bool = False
    is_busy: bool = False


RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))


def reader(participant, topic, kind):
    return DataReader(participant, Topic(participant, "rt/" + topic, kind), qos=RELIABLE)


def newest(source, seconds=2.0):
    """The last message of a reader; where none comes for so long the program ends, with a sentence."""
    end = time.time() + seconds
    while not (messages := source.take(1000)):
        if time.time() > end:
            raise SystemExit(f"{source.topic.name}: nothing for {seconds:g} s: the robot is gone, not started, or in another domain")
        time.sleep(0.01)
    return messages[-1]


def writer(participant, topic, kind):
    return DataWriter(participant, Topic(participant, "rt/" + topic, kind), qos=RELIABLE)
