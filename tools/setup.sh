#!/bin/bash
# setup.sh LIST...: install exactly those packages named in the lists that are missing (Debian 12).
# One dpkg-query when nothing is missing. Without root or sudo it prints the apt line to run and stops.
set -euo pipefail

mapfile -t wanted < <(sed -e 's/#.*//' "$@" | tr -s ' \t' '\n' | sed '/^$/d')
if ! command -v dpkg-query > /dev/null; then
    echo "setup: this is not a Debian system; install the equivalents of: ${wanted[*]}" >&2
    for tool in cmake ninja cc pkg-config; do
        command -v $tool > /dev/null || { echo "setup: $tool is missing" >&2; exit 1; }
    done
    exit 0
fi

# dpkg-query exits non-zero when a package is unknown to it, and says nothing of it on standard output.
installed=$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "${wanted[@]}" 2> /dev/null || true)
missing=()
for package in "${wanted[@]}"; do
    grep -qx "$package installed" <<< "$installed" || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo > /dev/null && sudo -n true 2> /dev/null; then
        as_root=(sudo -n)
    else
        echo "setup: ${#missing[@]} packages are missing and neither root nor sudo is at hand; run" >&2
        echo "apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
        exit 1
    fi
fi
echo "setup: installing ${missing[*]}"
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -q < /dev/null
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends "${missing[@]}" < /dev/null
