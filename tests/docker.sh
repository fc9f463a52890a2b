#!/usr/bin/env bash
# Builds the image of ../Dockerfile and tries it without a registry and without Docker: a base from debootstrap, buildah
# for the build, and a read-only chroot in its own namespaces in place of `docker run --read-only --tmpfs /tmp:exec`.
#   tests/docker.sh [BINARY]     BINARY: built for Debian 12 already; without it cargo builds one
# Run by hand, as root on Debian. Exit status 77: skipped. The picture and the log stay in target/docker.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '%s\n' "docker.sh: $*" >&2; }
skip() { say "skipped: $*"; exit 77; }
die() { tail -n 20 "$log" >&2; say "FAILED: $*"; exit 1; }

work=$PWD/target/docker log=$PWD/target/docker/serve.log
root='' serving=''

[ "$(id -u)" = 0 ] || skip "needs root (debootstrap, namespaces)"
command -v apt-get >/dev/null || skip "needs Debian's apt-get"
packages=(binutils buildah curl debootstrap iproute2 util-linux)
if ! dpkg-query -W -f '${Status}\n' "${packages[@]}" 2>/dev/null | awk '/ok installed/ { n++ } END { exit n != 6 }'; then
    say "installing ${packages[*]}"
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        "${packages[@]}" >/dev/null; } || skip "cannot install ${packages[*]}"
fi
unshare --mount --pid --net --fork true || skip "needs the right to make namespaces"

mkdir -p "$work/run" "$work/tmp" "$work/context"
: >"$log"
b() { buildah --root "$work/storage" --runroot "$work/run" --storage-driver vfs "$@"; }
cleanup() {
    [ -z "$serving" ] || kill -KILL "$serving" 2>/dev/null || true
    ! mountpoint -q "$work/tmp" || umount "$work/tmp"
    b rm --all >/dev/null 2>&1 || true
    rm -rf --one-file-system "$work/storage" "$work/run" "$work/base" "$work/context"
}
trap cleanup EXIT

# 1. The binary: the host's glibc must not be newer than Debian 12's.
binary=${1:-}
if [ -z "$binary" ]; then
    glibc=$(getconf GNU_LIBC_VERSION)
    printf '%s\n' "${glibc#glibc }" 2.36 | sort -CV || skip "a binary built here ($glibc) does not run on Debian 12 (2.36)"
    PATH=$PATH:$HOME/.cargo/bin
    cargo build --release --locked --quiet
    binary=target/release/cloudchamber
fi
strip -g -o "$work/context/cloudchamber" "$binary"

# 2. A minimal Debian 12 from where this machine's own packages come from, proxy and all; the tar is kept for next time.
if [ ! -s "$work/base.tar" ]; then
    # shellcheck disable=SC2016  # apt's own placeholders
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' 'Origin: Debian' |
        head -n 1)
    [ -n "$mirror" ] || skip "apt knows no bookworm repository"
    say "debootstrap of bookworm (1-2 min)"
    http_proxy=${http_proxy:-} && eval "$(apt-config shell http_proxy Acquire::http::Proxy)" && export http_proxy
    debootstrap --variant=minbase bookworm "$work/base" "$mirror" >"$log" 2>&1 || die "debootstrap"
    apt-config dump | grep -E '^Acquire::(https?::|Check-)' >"$work/base/etc/apt/apt.conf.d/99host" || true
    tar -C "$work/base" --exclude='./dev/*' --exclude='./var/cache/apt/archives/*' -cf "$work/base.part" .
    mv "$work/base.part" "$work/base.tar"
fi
container=$(b from scratch)
b add --quiet "$container" "$work/base.tar" / >/dev/null
b commit --quiet "$container" localhost/bookworm-base >/dev/null

# 3. The image.
say "buildah bud (about 2 min)"
b bud --isolation chroot --format docker --pull-never --build-arg BASE=localhost/bookworm-base \
    --build-arg BINARY=prebuilt -f Dockerfile -t localhost/cloudchamber "$work/context" >"$log" 2>&1 || die "buildah bud"
config() { b inspect --type image --format "{{range .Docker.Config.$1}}{{println .}}{{end}}" localhost/cloudchamber; }
one() { b inspect --type image --format "{{.Docker.Config.$1}}" localhost/cloudchamber; }
user=$(one User)
mapfile -t environment < <(config Env | grep .)
mapfile -t command < <({ config Entrypoint; config Cmd; } | grep .)
mapfile -t healthcheck < <(config Healthcheck.Test | grep . | tail -n +2)
[[ $user =~ ^[1-9][0-9]*$ ]] || die "user is '$user', wanted a number that is not root's"
[ "$(one StopSignal)" = SIGTERM ] || die "stop signal"
[[ " ${environment[*]} " == *" CLOUDCHAMBER_LISTEN=0.0.0.0:8080 "* ]] || die "does not listen to the outside"
[[ $(one ExposedPorts) == *8080/tcp* ]] || die "port 8080 is not exposed"
[ "${command[*]}" = "cloudchamber serve" ] || die "starts '${command[*]}'"
[ "${healthcheck[*]}" = "cloudchamber healthcheck" ] || die "healthcheck is '${healthcheck[*]}'"
container=$(b from --pull-never localhost/cloudchamber)
root=$(b mount "$container")
say "image: $(du -sm "$root" | cut -f 1) MB unpacked, $(du -sm "$work/context/cloudchamber" | cut -f 1) MB of it the binary"

# 4. `docker run --read-only --tmpfs /tmp:exec`: the binary is process 1, not root, in its own network.
mount -t tmpfs -o exec,nosuid,nodev,mode=1777 tmpfs "$work/tmp"
start() {
    # shellcheck disable=SC2016  # expanded inside
    unshare --mount --pid --net --fork --kill-child bash -euc '
        root=$1 tmp=$2 user=$3; shift 3
        mount --bind "$root" "$root" && mount -o remount,bind,ro "$root"
        mount --bind "$tmp" "$root/tmp"
        mount -t proc proc "$root/proc"
        mount -t sysfs -o ro sysfs "$root/sys"
        mount --rbind /dev "$root/dev"
        ip link set lo up
        exec env -i "${@:2:$1}" "$(command -v chroot)" --userspec="$user:$user" --groups= "$root" "${@:$1+2}"
    ' start "$root" "$work/tmp" "$user" "${#environment[@]}" "${environment[@]}" "${command[@]}" >>"$log" 2>&1 &
    unshare=$! since=$EPOCHREALTIME
    until serving=$(cat "/proc/$unshare/task/$unshare/children" 2>/dev/null) && serving=${serving% } && [ -n "$serving" ]; do
        [ -d "/proc/$unshare" ] || die "the container does not start"
        sleep 0.02
    done
}
inside() { # COMMAND... in the running container, as its user
    nsenter -t "$serving" -m -p -n -r -w -S "$user" -G "$user" -- env -i "${environment[@]}" "$@"
}
get() { nsenter -t "$serving" -n -- curl --silent --show-error --fail --noproxy '*' --max-time 60 "$@"; }
seconds() { awk "BEGIN { printf \"%.1f\", $EPOCHREALTIME - $since }"; }
wait_for() { # PATH LIMIT_S
    until get --output /dev/null "http://127.0.0.1:8080$1" 2>/dev/null; do
        [ -d "/proc/$serving" ] || die "the server ended before $1 said yes"
        awk "BEGIN { exit $EPOCHREALTIME - $since < $2 }" && die "$1 does not say yes within $2 s"
        sleep 0.1
    done
    say "$1 says yes after $(seconds) s"
}
stop() {
    since=$EPOCHREALTIME
    kill -TERM "$serving"
    status=0; wait "$unshare" || status=$?
    serving=''
    [ "$status" = 0 ] || die "exit status $status after SIGTERM"
    say "SIGTERM: exit 0 after $(seconds) s"
}

say "cold start"
: >"$log"
start
wait_for /healthz 30
wait_for /readyz 180
[ "$(inside stat -c %u /proc/1)" = "$user" ] || die "process 1 runs as another user"
! inside touch /data/x /usr/x 2>/dev/null || die "the root is writable"
inside "${healthcheck[@]}" || die "healthcheck says no to a healthy server"
! inside env CLOUDCHAMBER_LISTEN=0.0.0.0:9 "${healthcheck[@]}" 2>/dev/null || die "healthcheck says yes to no server"
since=$EPOCHREALTIME
get -H 'Accept: image/png' -H 'Content-Type: application/json' -o "$work/render.png" http://127.0.0.1:8080/v1/renders -d '{
    "technique": "emission_absorption", "volume": {"builtin": "smoke", "resolution": 64},
    "image": {"width": 256, "height": 256}, "budget": {"samples": 8}}' || die "no picture"
[ "$(head -c 8 "$work/render.png" | od -An -tx1 | tr -d ' ')" = 89504e470d0a1a0a ] || die "render.png is no PNG"
say "render: $(stat -c %s "$work/render.png") bytes of PNG after $(seconds) s: $work/render.png"
get http://127.0.0.1:8080/ | grep -qi '<html' || die "no viewer at /"
stop
say "warm start (the same /tmp)"
start
wait_for /readyz 60
stop
say "passed"
