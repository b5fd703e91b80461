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
