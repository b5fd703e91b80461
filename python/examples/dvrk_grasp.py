"""Grasp the tissue of `omentum dvrk SCENE` with PSM1 and pull it up: dvrk_grasp.py [DOMAIN [X Y Z in mm]]."""
import sys
import time

from dvrk_types import DomainParticipant, JointState, OperatingState, PoseStamped, String, StringStamped, newest, reader, writer

robot = DomainParticipant(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
place = [1e-3 * float(x) for x in sys.argv[2:5]] or [-0.03, -0.03, 0.004]
pose, jaw = reader(robot, "PSM1/measured_cp", PoseStamped), reader(robot, "PSM1/jaw/measured_js", JointState)
state, jaw_to = writer(robot, "PSM1/state_command", StringStamped), writer(robot, "PSM1/jaw/move_jp", JointState)
move, event = writer(robot, "PSM1/move_cp", PoseStamped), reader(robot, "PSM1/operating_state", OperatingState)
warning = reader(robot, "PSM1/warning", String)


def wait(seconds):
    """The last pose and the last angle of the jaw after so many seconds."""
    time.sleep(seconds)
    for said in warning.take(10):
        raise SystemExit(f"PSM1: {said.data}")
    return newest(pose).pose, newest(jaw).position[0]


def go(x, y, z):
    goal = PoseStamped(pose=wait(0.1)[0])
    goal.pose.position.x, goal.pose.position.y, goal.pose.position.z = x, y, z
    event.take(100)
    move.write(goal)
    while all(e.is_busy for e in event.take(100)):  # until a move has ended
        wait(0.05)
    return wait(0.5)


wait(1.0)
state.write(StringStamped(string="home"))
while not newest(event, 60).is_homed:
    pass
jaw_to.write(JointState(name=["jaw"], position=[0.7]))
go(*place)
jaw_to.write(JointState(name=["jaw"], position=[0.0]))
wait(0.5)
tip, angle = go(place[0], place[1], place[2] + 0.03)
print(f"tip at z = {1e3 * tip.position.z:.1f} mm; the jaw is open by {57.3 * angle:.1f} degrees: {'it holds tissue' if angle > 0.05 else 'empty'}")
