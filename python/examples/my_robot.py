"""A robot of your own runs a retraction to its end: 30 lines between omentum and your driver.

    tools/python_run.sh python/examples/my_robot.py        # PYTHONPATH and library of this checkout

The methods of MyRobot would call the driver of a robot. Here a simulated body stands for the patient, and the arms go where they
are told.
"""
import contextlib

import numpy as np

import omentum as om


class MyRobot(om.World):
    def __init__(self, scene):
        super().__init__(narm=2, sources=om.VISIBILITY)
        self.patient, self.time = om.Body(scene, "world"), 0.0
        self.patient.settle(strict=False)
        self.arms = [om.Arm(self.patient.site.tip(i), jaw=0.6) for i in range(2)]
        self.goal = [None, None]

    def move(self, arm, goal, speed):  # goal.p, m, and goal.q; m/s
        self.goal[arm], self.arms[arm].is_moving = (goal, speed), True

    def set_jaw(self, arm, angle):  # rad
        self.arms[arm].jaw_goal = angle

    def stop(self, arm):
        self.arms[arm].is_moving = False

    def advance(self, dt):  # s
        for i, arm in enumerate(self.arms):
            if arm.is_moving:
                goal, speed = self.goal[i]
                way = np.linalg.norm(goal.p - arm.tip.p)
                part = min(1.0, speed * dt / max(way, 1e-9))
                turned = (1 - part) * arm.tip.q + part * np.copysign(1, arm.tip.q @ goal.q) * goal.q
                arm.tip.p, arm.tip.q = arm.tip.p + part * (goal.p - arm.tip.p), turned / np.linalg.norm(turned)
                arm.is_moving = part < 1
            if arm.jaw_goal < np.radians(20) <= arm.jaw:
                with contextlib.suppress(om.Invalid):  # no tissue between the jaws
                    self.patient.grasp((arm.tip.p, arm.tip.q), i)
            elif arm.jaw_goal >= np.radians(20):
                self.patient.release(i)
            arm.jaw = max(arm.jaw_goal, np.radians(5) if self.patient.is_holding(i) else 0)  # tissue stops the jaw
            self.patient.move((arm.tip.p, arm.tip.q), i)
        self.patient.step(dt)
        self.time += dt

    def observe(self, what):
        return om.Observation(self.time, self.arms, self.patient.visibility() if what & om.VISIBILITY else 0.0)


def main(scene):
    """The result, and the robot at the end."""
    robot = MyRobot(scene)
    return om.Loop(scene, robot).run(), robot


if __name__ == "__main__":
    scene = om.Scene()
    scene.seed, scene.tissue.cells = 2, (6, 6, 1)  # a sheet on a board, coarser than by default: seconds
    result, robot = main(scene)
    print(f"{result.outcome}: {100 * robot.patient.visibility():.0f} % of the region is visible, at most "
          f"{np.nanmax(result.samples['force']):.2f} N, {result.samples['time'][-1]:.1f} s")
