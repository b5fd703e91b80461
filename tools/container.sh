#!/bin/bash
# container.sh [OUT]: build the image of Containerfile by buildah and run `omentum demo` in it; report in OUT (default
# build/container). Neither a daemon nor namespaces of users are needed (--isolation chroot), but root is. Where debian:12 cannot be
# pulled, debootstrap makes it from Debian's packages: the same ones.
# Exit code 77, and the reason: buildah, root, or Debian's packages are not at hand.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-$here/build/container}
skip() { echo "skip: container.sh: $1"; exit 77; }
[ "$(id -u)" -eq 0 ] || skip "needs root"
command -v buildah > /dev/null || skip "no buildah; install buildah debootstrap"
mkdir -p "$out"
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot
store=(--root "$here/build/images" --runroot "$here/build/images/run")
buildah() { command buildah "${store[@]}" "$@"; }

# The base.
if ! buildah images -q debian:12 > /dev/null 2>&1 && ! timeout 60 buildah pull -q docker.io/library/debian:12 > "$out/log" 2>&1; then
    command -v debootstrap > /dev/null || skip "debian:12 cannot be pulled, and there is no debootstrap"
    root=${BASE_ROOT:-$here/build/images/base}
    [ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase bookworm "$root" http://deb.debian.org/debian > "$out/log" 2>&1 ||
        { rm -rf "$root"; skip "debian:12 cannot be pulled, and deb.debian.org cannot be reached"; }
    rm -rf "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/*
    base=$(buildah from scratch)
    buildah copy -q "$base" "$root" / > /dev/null
    buildah config --cmd bash "$base"
    buildah commit -q --rm "$base" docker.io/library/debian:12 > /dev/null
    echo "container.sh: debian:12 by debootstrap"
fi

# What git tracks, as Containerfile copies a checkout.
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
git -C "$here" ls-files -z | (cd "$here" && xargs -0 sh -c 'for f; do [ -e "$f" ] && printf "%s\0" "$f"; done' sh) | tar -C "$here" --null -T - -cf - | tar -C "$tmp" -xf -
buildah build --pull-never --layers -t omentum -f "$tmp/Containerfile" "$tmp" > "$out/build.log" 2>&1 || { tail -n 30 "$out/build.log" >&2; exit 1; }
work=$(buildah from --pull-never omentum)
buildah run -v "$out:/out" "$work" -- omentum --version
buildah run -v "$out:/out" "$work" -- omentum demo -q -o /out/demo > "$out/demo.log" 2>&1 || { tail -n 30 "$out/demo.log" >&2; exit 1; }
size=$(du -sm "$(buildah mount "$work")" | cut -f1)
buildah rm "$work" > /dev/null
[ -s "$out/demo/report.html" ] || { echo "container.sh: no report" >&2; exit 1; }
echo "container.sh: image of $size MB, report in $out/demo/report.html"
