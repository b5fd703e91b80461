#!/usr/bin/env python3
"""Change a run that `omentum study` has written, so that a test knows what its score must be.

    edit_run.py FILE stop STEPS REASON   the path ends after so many steps, for this reason
    edit_run.py FILE move X Y Z          lesion and contour are found so many mm elsewhere
    edit_run.py FILE elements N          a mesh of so many elements
    edit_run.py FILE measured STUDY      finite elements find each contour exactly where STUDY says it was measured
"""
import json
import pathlib
import sys

path, verb, *rest = pathlib.Path(sys.argv[1]), *sys.argv[2:]
run = json.loads(path.read_text())
if verb == "stop":
    ndone = int(rest[0])
    share = ndone / run["nstep"] * run["reached"][-1]["depth"]
    run.update(ndone=ndone, reason=rest[1], step=run["step"][:ndone + 1],
               reached=[r for r in run["reached"] if r["depth"] <= share + 1e-9])
elif verb == "move":
    for reached in run["reached"]:
        for key in ("lesion", "contour"):
            reached[key] = [a + 1e-3 * float(b) for a, b in zip(reached[key], rest)]
elif verb == "elements":
    run["ntet"] = int(rest[0])
elif verb == "measured":
    for at in json.loads(pathlib.Path(rest[0]).read_text())["measured"]:
        for reached in run["reached"]:
            if at["lesion"] == run["lesion"] + 1 and abs(at["depth"] - reached["depth"]) < 1e-9:
                reached["contour"] = at["contour"]
else:
    sys.exit(__doc__)
path.write_text(json.dumps(run))

# The study takes up only what it wrote itself: the folder's list (doc/base.md) gets a line for the changed file.
WORD, PRIME = (1 << 64) - 1, 1099511628211


def om_hash(data):
    h, whole = 14695981039346656037, len(data) // 8 * 8
    for i in range(0, whole, 8):
        h = (h ^ int.from_bytes(data[i:i + 8], "little")) * PRIME & WORD
        h ^= h >> 29
    for byte in data[whole:]:
        h = (h ^ byte) * PRIME & WORD
    return h


study = next(p for p in path.resolve().parents if (p / ".omentum").exists())
with open(study / ".omentum", "a", encoding="utf-8") as listed:
    new = path.read_bytes()
    listed.write(f"file {len(new)} {om_hash(new):016x} {path.resolve().relative_to(study)}\n")
