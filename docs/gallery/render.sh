#!/bin/sh
# Renders the README's gallery anew, each picture from the scene of its name. A scene without a volume shows the scan: the MRI head
# of Debian's mricron-data.
set -eu
cd "$(dirname "$0")"
scan=${1:-/usr/share/mricron/templates/ch2.nii.gz}
[ -r "$scan" ] || { echo "no scan at $scan: install mricron-data, or name one" >&2; exit 1; }
cargo build --release --quiet
for scene in *.json; do
    if grep -q '"volume"' "$scene"; then set --; else set -- --volume "$scan"; fi
    ../../target/release/cloudchamber render "$scene" "$@" -o "${scene%.json}.png" 2>/dev/null
done
