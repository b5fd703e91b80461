"""Grasp the tissue of `omentum dvrk SCENE --udp 7400` and pull it up, without DDS: dvrk_udp.py [PORT [X Y Z in mm]]."""
import json
import socket
import sys
import time

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 7400
PLACE = [1e-3 * float(x) for x in sys.argv[2:5]] or [-0.03, -0.03, 0.004]
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.settimeout(2)


def ask(**operation):
    """Send one operation of PSM1, and return the state of the arm."""
    link.sendto(json.dumps({"arm": "PSM1", **operation}).encode(), ("127.0.0.1", PORT))
    try:
        answer = json.loads(link.recv(65536))
    except OSError as error:
        raise SystemExit(f"no answer on port {PORT}: {error}") from None
    if answer["refused"]:
        raise SystemExit(answer["refused"])
    return answer["PSM1"]


def go(x, y, z):
    """Move the tip there, with the orientation that it has, and wait until it is there."""
    ask(move_cp=[x, y, z] + ask()["measured_cp"][3:])
    time.sleep(0.1)
    while ask()["is_busy"]:
        time.sleep(0.05)


def jaw(angle):
    ask(jaw=angle)
    time.sleep(0.5)


ask(state_command="home")
jaw(0.7)
go(*PLACE)
jaw(0.0)
go(PLACE[0], PLACE[1], PLACE[2] + 0.03)
arm = ask()
print(f"tip at z = {1e3 * arm['measured_cp'][2]:.1f} mm; the jaw is open by {57.3 * arm['jaw']:.1f} degrees: "
      f"{'it holds tissue' if arm['jaw'] > 0.05 else 'empty'}")
