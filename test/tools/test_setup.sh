#!/bin/bash
# tools/setup.sh with a made-up dpkg-query, apt-get, id and sudo: what it asks for, and when it stops.
set -euo pipefail
setup=$(cd "$(dirname "$0")/../.." && pwd)/tools/setup.sh
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir "$tmp/bin"
printf '# tools\nalpha\nbeta  # why\n\ngamma-dev\n' > "$tmp/list"

fake() { printf '#!/bin/bash\n%s\n' "$2" > "$tmp/bin/$1"; chmod +x "$tmp/bin/$1"; }
fake dpkg-query 'shift 3; for p in "$@"; do grep "^$p " '"$tmp"'/installed || bad=1; done; exit ${bad:-0}'
fake apt-get 'echo "$*" >> '"$tmp"'/apt'
fake id 'echo ${FAKE_UID:-0}'
fake sudo 'shift; [ "${FAKE_SUDO:-}" = yes ] || exit 1; exec "$@"'
run() { rm -f "$tmp/apt"; touch "$tmp/apt"; PATH=$tmp/bin:$PATH "$setup" "$tmp/list"; }
fail() { echo "test_setup: $1"; exit 1; }

# Everything is there: silence.
printf 'alpha installed\nbeta installed\ngamma-dev installed\n' > "$tmp/installed"
[ -z "$(run)" ] || fail "printed something with nothing to do"
[ ! -s "$tmp/apt" ] || fail "called apt-get with nothing to do"

# One unknown, one removed but configured: exactly these two, as root and by sudo.
printf 'alpha installed\nbeta config-files\n' > "$tmp/installed"
run > /dev/null
grep -qx 'install -q -y --no-install-recommends beta gamma-dev' "$tmp/apt" || fail "root: $(cat "$tmp/apt")"
FAKE_UID=1000 FAKE_SUDO=yes run > /dev/null
grep -qx 'install -q -y --no-install-recommends beta gamma-dev' "$tmp/apt" || fail "sudo: $(cat "$tmp/apt")"

# Neither: the line to run, on standard output, and a failure.
if line=$(FAKE_UID=1000 run 2> /dev/null); then fail "success without rights"; fi
[ "$line" = 'apt-get update && apt-get install -y --no-install-recommends beta gamma-dev' ] ||
    fail "printed '$line'"
[ ! -s "$tmp/apt" ] || fail "called apt-get without rights"
echo "test_setup: passed"
