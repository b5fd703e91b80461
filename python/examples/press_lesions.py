"""The contact study of chapter 3 from Python: a probe pressed 30 mm over lesions, three methods, several meshes.

    omentum study contact --quick -o out/quick
    python3 press_lesions.py out/quick

Meshes, lesions and truth are those of the study's folder; the figures are those of its runs.csv and errors.csv.
"""
import json
import pathlib
import sys

import numpy as np

import omentum as om

METHODS = ("penalty", "multipliers", "prescribed")


def press(mesh, surface, lesion, method):
    """Press over a lesion; the force at the end, N, and the lesion's error at each depth, mm."""
    tissue = om.Tissue(mesh, element="linear", young=3000, poisson=0.45, law="neo-hookean", gravity=(0, 0, 0),  # as the study
                       solver={"tolerance": 1e-3, "max_iterations": 400})
    normal = np.array(lesion["normal"], float)
    along = np.array([1, 0, 0]) - normal[0] * normal
    along /= np.linalg.norm(along)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([along, np.cross(normal, along), normal])
    pose[:3, 3] = lesion["touch"]
    probe = om.Press(tissue, om.Probe("box", size=(0.05, 0.01, 0.06), rounding=0.002), method, surface=surface)
    probe.place(pose)
    embedding, errors = tissue.embed([lesion["center"]]), {}
    for k in range(1, 151):
        pose[:3, 3] = lesion["touch"] - 2e-4 * k * normal      # 10 mm/s
        report = probe.step(pose, 0.02)
        for truth in lesion["truth"]:
            if abs(truth["depth"] - 2e-4 * k) < 1e-9:
                errors[round(1e3 * truth["depth"])] = 1e3 * np.linalg.norm(embedding.eval(tissue.x)[0] - truth["measured"])
    return report.force @ normal, errors


def main(folder):
    study = json.loads((folder / "study.json").read_text())
    meshes = {int(p.name[:6]): om.TetMesh.load(p, unit=1) for p in sorted((folder / "meshes").glob("*.vtu"))}
    surface = meshes[26220].contact_surface(4000)
    wanted = sorted({int(p.name.split("-")[1]) for p in (folder / "runs").iterdir()})
    for method in METHODS:
        for ntet in wanted:
            for number, lesion in enumerate(study["lesions"], 1):
                force, errors = press(meshes[ntet], surface, lesion, method)
                print(method, ntet, number, f"{force:.5f}", *(f"{d}:{e:.5f}" for d, e in errors.items()), flush=True)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
