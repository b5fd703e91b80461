"""Scans and updates of the twin: against simulated truth, and physics against the network's answers."""
# PARTS 3
import ctypes

import numpy as np
import pytest

import omentum as om

LIFT = 0.03  # m


@pytest.fixture(scope="module")
def lifted(is_slow):
    """A sheet held along one side, of which the twin knows nothing; a corner is lifted, and the camera looks. In the quick run its elements
    are linear."""
    scene = om.Scene.load(om.data_path("scenes/sheet.yaml"))
    scene.seed = 203
    scene.tissue.cells, scene.tissue.world_cells = (12, 12, 1), (18, 18, 1)
    if not is_slow:
        scene.tissue.element = scene.world.element = "linear"
    scene.attach.kind = int(om.capi.OmAttachKind.BOX)
    scene.attach.lo, scene.attach.hi = (0.0, -0.07, -0.01), (0.07, 0.07, 0.01)
    scene.roi.is_random = False
    scene.believed.kind = om.capi.OmBeliefKind.NONE
    twin, world = om.Body(scene), om.SimulatedWorld(scene)
    world.reset()
    twin.settle()
    arm = world.observe().arms[0]
    goal = om.capi.OmPose.from_buffer_copy(arm.tip)

    def go(point, speed, seconds):
        goal.p = point
        world.move(0, goal, speed)
        for _ in range(int(seconds / 0.02)):
            world.advance(0.02)

    def tip():
        return om.capi.OmPose.from_buffer_copy(world.observe().arms[0].tip)

    go((-0.04, -0.04, 0.005), 0.1, 2)
    world.set_jaw(0, 0.0)
    for _ in range(20):
        world.advance(0.02)
    begin = tip()
    twin.grasp(begin)
    go((-0.03, -0.03, 0.005 + LIFT), 0.03, 2.5)
    now = tip()
    twin.move(now)
    twin.settle(strict=False)
    return scene, twin, world, begin, now


def place_above(height):
    """A camera at (0, 0, height) that looks down, its x axis along that of the world."""
    place = np.diag([1.0, -1, -1, 1])
    place[2, 3] = height
    return place


def test_a_camera_of_a_calibration_sees_as_opencv_says():
    """u = fx x/z (1 + k1 r^2 + k2 r^4) + cx, where the centre of the first pixel is 0; ours has it at 0.5."""
    k = np.array([[310.0, 0, 150], [0, 305, 122], [0, 0, 1]])
    camera = om.Camera.from_matrix(k, 320, 240, place_above(0.3), distortion=(0.1, -0.05))
    world = np.array([[0.02, -0.03, 0.05], [-0.06, 0.04, 0.0]])
    x, y, z = world[:, 0], -world[:, 1], 0.3 - world[:, 2]
    r2 = (x / z) ** 2 + (y / z) ** 2
    bend = 1 + 0.1 * r2 - 0.05 * r2**2
    there = np.stack([310 * bend * x / z + 150, 305 * bend * y / z + 122], axis=1)
    assert camera.project(world) == pytest.approx(there + 0.5, abs=1e-9)
    with pytest.raises(ValueError, match="k1, k2, p1, p2, k3 are known"):
        om.Camera.from_matrix(k, 320, 240, distortion=np.zeros(8))
    with pytest.raises(ValueError, match="fx, 0, cx"):
        om.Camera.from_matrix(k.T, 320, 240)


def test_a_scan_of_any_depth_picture():
    """A slope of 1 in 5 over a floor; the mask has the left half, the box leaves out the floor."""
    camera = om.Camera.from_matrix([[300, 0, 159.5], [0, 300, 119.5], [0, 0, 1]], 320, 240, place_above(0.3))
    u, v = np.meshgrid(np.arange(320), np.arange(240))
    x = (u - 159.5) / 300
    depth = np.where(np.abs(v - 119.5) < 80, 0.25 / (1 + 0.2 * x), 0.3)  # z = 0.05 + 0.2 X on the slope
    scan = om.Scan.from_depth(depth, camera, mask=u < 160, box=((-1, -1, 0.01), (1, 1, 1)))
    assert len(scan.x) > 300 and scan.x[:, 0].max() < 0.001 and scan.x[:, 2].min() > 0.01
    assert scan.x[:, 2] == pytest.approx(0.05 + 0.2 * scan.x[:, 0], abs=2e-5)
    normal = scan.normal[np.linalg.norm(scan.normal, axis=1) > 0].mean(axis=0)
    assert normal / np.linalg.norm(normal) == pytest.approx(np.array([-0.2, 0, 1]) / np.sqrt(1.04), abs=0.02)
    everything = om.Scan.from_depth(depth, camera)
    assert everything.x[:, 0].max() > 0.1 and everything.x[:, 2].min() == pytest.approx(0, abs=1e-4)
    with pytest.raises(ValueError, match="metres, 250 mm is 0.25"):
        om.Scan.from_depth(1000 * depth, camera)


def test_the_attachments_are_found_from_a_depth_picture(lifted, alive):
    scene, twin, world, begin, now = lifted
    observation = world.observe(om.DEPTH | om.COLOR)
    scan = om.Scan.from_observation(observation, twin.site, world)
    assert len(scan.x) > 50 and len(scan.tri) > 50 and scan.x[:, 2].max() > 0.5 * LIFT
    length, used = np.linalg.norm(scan.normal, axis=1), np.isin(np.arange(len(scan.x)), scan.tri)
    assert length[used] == pytest.approx(np.ones(used.sum())) and used.mean() > 0.95
    assert all(n == pytest.approx(1) or n == 0 for n in length[~used])  # on a narrow strip a normal is not known
    assert set(np.unique(scan.pixel)) <= {0, 1, 2, 3}
    assert not twin.attached.any()
    matcher = om.Matcher(scene, twin.site)
    estimate = matcher.update([om.Acquisition(scan, [(0, begin, now)], twin.nodes)])
    assert estimate.is_accepted and estimate.reason == ""
    truth = (twin.mesh.x[:, 0] > -0.001) & np.isin(np.arange(len(twin.mesh.x)), twin.mesh.sets["underside"])
    dice = 2 * (estimate.attached & truth).sum() / (estimate.attached.sum() + truth.sum())
    assert dice > 0.6
    assert estimate.summary["after_median"] < estimate.summary["before_median"]
    om.adopt(twin, estimate)
    assert np.array_equal(twin.attached, estimate.attached)


def test_network_and_physics_together(lifted):
    scene, twin, world, begin, now = lifted
    net = om.BanetNet.load()
    installed = ctypes.c_void_p()
    om.lib.om_banet_net_load(None, ctypes.byref(installed))  # found beside the library, not beside Python
    assert om.lib.om_banet_net_hash(installed) == om.lib.om_banet_net_hash(net._c)
    om.lib.om_banet_net_destroy(installed)
    assert 0 < net.threshold < 1 and net.nparameter > 1e6 and float(net.fact("validation_dsc")) > 0.5
    scan = om.Scan.from_observation(world.observe(om.DEPTH | om.COLOR), twin.site, world)
    estimate = om.Matcher(scene, twin.site, net=net).update([om.Acquisition(scan, [(0, begin, now)])])
    assert estimate.is_accepted and estimate.attached.any()


def test_an_update_that_moves_nothing_is_refused(lifted):
    scene, twin, world, begin, _ = lifted
    scan = om.Scan.from_observation(world.observe(om.DEPTH | om.COLOR), twin.site, world)
    estimate = om.Matcher(scene, twin.site).update([om.Acquisition(scan, [(0, begin, begin)])])
    assert not estimate.is_accepted and estimate.reason
    with pytest.raises(om.Invalid):
        om.Scan(np.full((3, 3), np.nan))
