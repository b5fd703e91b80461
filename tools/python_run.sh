#!/bin/bash
# python_run.sh ARGUMENT...: python3 with the package of this checkout and the library of build/release, in the environment of
# the tests (tools/python_env.sh) where it is made, or in the environment that OM_PYTHON names.
here=$(cd "$(dirname "$0")/.." && pwd)
python=${OM_PYTHON:-$here/build/python}/bin/python3
[ -x "$python" ] || python=python3
export PYTHONPATH=$here/python${PYTHONPATH:+:$PYTHONPATH} OMENTUM_LIBRARY=${OMENTUM_LIBRARY:-$here/build/release/libomentum.so}
exec "$python" -B "$@"
