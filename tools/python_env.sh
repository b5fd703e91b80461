#!/bin/bash
# python_env.sh [LIST [DIR]]: the Python that runs the tests of the package: a virtual environment in build/python with the
# packages of LIST (default python/requirements.txt). It sees the packages of the system (where python3 is Debian's: those of
# tools/packages_python.txt, installed if they are missing), and fetches from PyPI what these lack. With DIR: an environment
# of its own there, which sees nothing of the system.
# Nothing is done where the environment is as the list says. Without a network the tests use what python3 has, and those
# that need more are skipped by name: the script says so and succeeds.
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
list=${1:-$here/python/requirements.txt}
dir=${2:-$here/build/python}
site=--system-site-packages
[ $# -gt 1 ] && site=
stamp=$dir/$(basename "$list")

python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))' 2> /dev/null ||
    { echo "python_env: python3 of version 3.9 or later is missing: the tests of the Python package are skipped" >&2; exit 0; }
if [ -n "$site" ] && ! python3 -c 'import ensurepip, h5py, numpy, pytest' 2> /dev/null && [[ $(readlink -f "$(command -v python3)") == /usr/bin/python3* ]]; then
    "$here/tools/setup.sh" "$here/tools/packages_python.txt" ||
        echo "python_env: without the packages of tools/packages_python.txt" >&2
fi
want=$(python3 -c 'import sys; print(sys.executable, sys.version.split()[0])'; cat "$list")
[ "$(cat "$stamp" 2> /dev/null)" = "$want" ] && "$dir/bin/python3" -c '' 2> /dev/null && exit 0

[ "$(head -n 1 "$dir/python" 2> /dev/null)" = "$(head -n 1 <<< "$want")" ] || rm -rf "$dir"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if [ ! -x "$dir/bin/python3" ]; then
    mkdir -p "$(dirname "$dir")"
    python3 -m venv $site "$dir" > "$log" 2>&1 ||
        { rm -rf "$dir"; tail -n 3 "$log" >&2; echo "python_env: python3 makes no virtual environment (package python3-venv)" >&2; exit 0; }
    head -n 1 <<< "$want" > "$dir/python"
fi
echo "python_env: installing what is missing of $(sed 's/#.*//' "$list" | tr -s '\n' ' ')"
if "$dir/bin/python3" -m pip install -q --disable-pip-version-check --no-input --retries 1 --timeout 20 -r "$list" > "$log" 2>&1; then
    echo "$want" > "$stamp"
else
    tail -n 2 "$log" >&2
    echo "python_env: PyPI cannot be reached; the tests use the packages that python3 has" >&2
fi
exit 0
