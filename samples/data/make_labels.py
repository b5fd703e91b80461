#!/usr/bin/env python3
"""Write ct_labels.seg.nrrd beside this file: a small label map for the examples of README.md, the same bytes each time.

A vertebra (label 1) and a left kidney (label 3), of 2 mm voxels, as 3D Slicer saves a segmentation. The shapes are
ellipsoids; the kidney is dented where its vessels enter. Standard library alone.
"""
import gzip
import pathlib

SIZE, VOXEL = (48, 36, 52), 2.0  # voxels; mm
ORIGIN = (-80.0, -40.0, -52.0)  # mm, right-anterior-superior: the left of the patient has negative x
SEGMENTS = [("vertebra", 1), ("kidney_left", 3)]


def inside(p, center, radius):
    return sum(((a - c) / r) ** 2 for a, c, r in zip(p, center, radius)) < 1


def label(p):
    if inside(p, (-44, -6, 0), (22, 17, 40)) and not inside(p, (-18, -2, 0), (12, 14, 12)):
        return 3
    return 1 if inside(p, (0, -14, 0), (13, 14, 200)) else 0


def main():
    nx, ny, nz = SIZE
    voxels = bytes(label(tuple(o + VOXEL * n for o, n in zip(ORIGIN, (i, j, k)))) for k in range(nz) for j in range(ny) for i in range(nx))
    head = ["NRRD0004", "type: uint8", "dimension: 3", "space: right-anterior-superior", f"sizes: {nx} {ny} {nz}",
            f"space directions: ({VOXEL},0,0) (0,{VOXEL},0) (0,0,{VOXEL})", "space origin: ({},{},{})".format(*ORIGIN), "encoding: gzip"]
    for n, (name, value) in enumerate(SEGMENTS):
        head += [f"Segment{n}_Name:={name}", f"Segment{n}_LabelValue:={value}", f"Segment{n}_Layer:=0"]
    text = "\n".join(head) + "\n\n"
    pathlib.Path(__file__).with_name("ct_labels.seg.nrrd").write_bytes(text.encode() + gzip.compress(voxels, 9, mtime=0))


if __name__ == "__main__":
    main()
