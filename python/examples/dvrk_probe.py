"""Does an arm of `omentum dvrk SCENE` keep the rules of CRTK? dvrk_probe.py [DOMAIN [ARM]]. It moves the arm by 5 mm.

States before motion, frame, scale of lengths and angles, rate of messages, time-out of servo commands: a line each.
"""
import math
import sys
import time
from statistics import median

from dvrk_types import DomainParticipant, Header, JointState, OperatingState, PoseStamped, String, StringStamped, newest, reader, writer

robot, arm = DomainParticipant(int(sys.argv[1]) if len(sys.argv) > 1 else 0), sys.argv[2] if len(sys.argv) > 2 else "PSM1"
pose, joints = reader(robot, f"{arm}/measured_cp", PoseStamped), reader(robot, f"{arm}/measured_js", JointState)
event, warning = reader(robot, f"{arm}/operating_state", OperatingState), reader(robot, f"{arm}/warning", String)
state = writer(robot, f"{arm}/state_command", StringStamped)
move, move_joints = writer(robot, f"{arm}/move_cp", PoseStamped), writer(robot, f"{arm}/move_jp", JointState)
servo_joints = writer(robot, f"{arm}/servo_jp", JointState)
wrong = []


def check(name, is_right, figure):
    print(f"{'ok  ' if is_right else 'FAIL'} {name}: {figure}")
    wrong.extend([] if is_right else [name])


def at(message):
    p = message.pose.position
    return p.x, p.y, p.z


def turn(a, b):
    """The angle between two orientations, rad."""
    return 2 * math.acos(min(1, abs(sum(getattr(a, k) * getattr(b, k) for k in "xyzw"))))


def seconds(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def fresh(source):
    """A message that comes from now on."""
    source.take(1000)
    return newest(source)


def refusal():
    """What the robot says to a command within a second; "": nothing."""
    end = time.time() + 1
    while time.time() < end:
        for said in warning.take(10):
            return said.data
        time.sleep(0.01)
    return ""


def order(topic, message):
    """Send a move, and wait for its end; a refusal is returned."""
    event.take(100)
    warning.take(100)
    topic.write(message)
    end = time.time() + 20
    while all(e.is_busy for e in event.take(100)) and time.time() < end:
        for said in warning.take(10):
            return said.data
        time.sleep(0.01)
    time.sleep(0.2)
    return ""


def goal_of(message, frame, dx):
    goal = PoseStamped(header=Header(frame_id=frame), pose=message.pose)
    goal.pose.position.x += dx
    return goal


def by_joints(change):
    """A command of all joints, each changed by so much."""
    q = fresh(joints)
    return JointState(name=q.name, position=[value + more for value, more in zip(q.position, change)])


time.sleep(1)  # until all topics have met
start = fresh(pose)
frame = start.header.frame_id
state.write(StringStamped(string="disable"))
newest(event)
said = order(move, goal_of(fresh(pose), frame, 0.005))
way = math.dist(at(start), at(fresh(pose)))
check("state", said != "" and way < 0.002, f"a move of a disabled arm: {said or 'not refused'}; {1e3 * way:.1f} mm")
event.take(100)
state.write(StringStamped(string="home"))
while not newest(event, 60).is_homed:
    pass

start = fresh(pose)
said = order(move, goal_of(fresh(pose), "nowhere", 0.005))
way = math.dist(at(start), at(fresh(pose)))
check("frame", frame != "" and said != "" and way < 0.002, f'poses are in "{frame}"; a goal in "nowhere": {said or "not refused"}')
said = order(move, goal_of(fresh(pose), frame, 0.005))
there = fresh(pose)
along, way = at(there)[0] - at(start)[0], math.dist(at(start), at(there))
check("length", said == "" and abs(along - 0.005) < 0.001 and way < 0.006, f"a goal 5 mm along x: {1e3 * along:.2f} mm along x, {1e3 * way:.2f} mm in all {said}")

start = fresh(pose)
said = order(move_joints, by_joints([0, 0, 0, 0.2, 0, 0]))
angle = turn(start.pose.orientation, fresh(pose).pose.orientation)
check("angle", said == "" and abs(angle - 0.2) < 0.01, f"the roll moved by 0.2 rad turns the tip by {angle:.3f} rad {said}")

pose.take(1000)
time.sleep(2)
stamps = [seconds(m) for m in pose.take(1000)]
period = median(b - a for a, b in zip(stamps, stamps[1:]))
check("rate", 0.005 <= period <= 0.05, f"a pose every {1e3 * period:.1f} ms")

before = fresh(joints).position[3]
warning.take(100)
servo_joints.write(by_joints([0, 0, 0, -1, 0, 0]))
said = refusal()
time.sleep(0.5)
stopped = before - fresh(joints).position[3]
time.sleep(0.5)
later = before - fresh(joints).position[3]
check("time-out", 0 < stopped < 0.9 and abs(later - stopped) < 0.01, f"one servo command of 1 rad: stopped after {stopped:.2f} rad: {said}")
sys.exit(f"{len(wrong)} of 6: {', '.join(wrong)}" if wrong else 0)
