#!/bin/sh
# Runs the release binary on PoCL 6: in a root of Debian 13 (trixie) made with debootstrap, as root. Usage: tests/trixie.sh FOLDER
# Each request draws the bytes that it draws outside; the kernels of all lanes build. FOLDER, of 1 GB, is left as it is.
set -eu
cd "$(dirname "$0")/.."
root="${1:?a folder for the root of Debian 13}"
cargo build --release --quiet
command -v debootstrap >/dev/null || apt-get install -y --no-install-recommends debootstrap
mirror="$(grep -rhoE 'https?://[^ ]+/debian/?' /etc/apt/sources.list /etc/apt/sources.list.d 2>/dev/null | grep -v security | head -1)"
[ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase trixie "$root" $mirror
for m in proc sys dev; do mount --rbind "/$m" "$root/$m" && mount --make-rslave "$root/$m"; done
trap 'for m in dev sys proc; do umount -R "$root/$m"; done' EXIT
cp /etc/resolv.conf "$root/etc/"
inside() { chroot "$root" env -i HOME=/root PATH=/usr/local/bin:/usr/bin:/bin DEBIAN_FRONTEND=noninteractive "$@"; }
inside sh -c 'dpkg -s pocl-opencl-icd >/dev/null 2>&1 || { apt-get update -q && apt-get install -qy --no-install-recommends pocl-opencl-icd ocl-icd-libopencl1; }'
cp target/release/cloudchamber "$root/usr/local/bin/"
inside cloudchamber device --data-dir /tmp/data | grep -E '"(platform_version|version|level|lanes)"' | head -4
here="$(mktemp -d)"
n=0
while read -r scene; do
    n=$((n + 1))
    echo "$scene" > "$root/tmp/scene.json"
    for lanes in "" 4 1; do
        target/release/cloudchamber render "$root/tmp/scene.json" --data-dir "$here" ${lanes:+--lanes $lanes} -o "$here/$n.png" >/dev/null 2>&1
        inside cloudchamber render /tmp/scene.json --data-dir /tmp/data ${lanes:+--lanes $lanes} -o "/tmp/$n.png" >/dev/null 2>&1
        cmp "$here/$n.png" "$root/tmp/$n.png" && echo "the same with ${lanes:-the device's} lanes: $scene"
    done
done <<'SCENES'
{"technique":"emission_absorption"}
{"technique":"emission_absorption","emission_absorption":{"shading":true},"volume":{"builtin":"smoke"}}
{"technique":"isosurface","isosurface":{"isovalue":0.3}}
{"technique":"projection"}
{"technique":"slice"}
{"technique":"single_scatter","budget":{"samples":4},"image":{"width":128,"height":128}}
{"technique":"volume_path","budget":{"samples":4},"image":{"width":128,"height":128}}
{"technique":"projection","volume":{"photon_transport":{"photons":200000,"grid":[24,24,24]}}}
SCENES
