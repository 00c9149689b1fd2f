#!/bin/sh
# Installs the Debian packages that building Rayfold needs, and says which. On a machine that has them all it asks
# nothing and returns at once. Arguments: "build" (default) or "test" for what the tests need besides.
set -u
packages="gcc libc6-dev make cmake ninja-build pkg-config libjansson-dev libpng-dev libturbojpeg0-dev libwebp-dev
  libopenexr-dev libstb-dev libmeshoptimizer-dev"
[ "${1:-build}" = test ] && packages="$packages g++ clang"

missing=""
for p in $packages; do
  dpkg-query -W -f='${db:Status-Status}\n' "$p" 2>/dev/null | grep -qx installed || missing="$missing $p"
done
# Tools that came from elsewhere are as good as Debian's.
still=""
for p in $missing; do
  case $p in
  gcc | make | cmake | clang | g++) command -v "$p" >/dev/null 2>&1 || still="$still $p" ;;
  ninja-build) command -v ninja >/dev/null 2>&1 || still="$still $p" ;;
  pkg-config) command -v pkg-config >/dev/null 2>&1 || still="$still $p" ;;
  *) still="$still $p" ;;
  esac
done
[ -z "$still" ] && exit 0

if ! command -v apt-get >/dev/null 2>&1; then
  echo "setup: this is not Debian; please install what these packages hold:$still" >&2
  exit 0
fi
sudo=""
if [ "$(id -u)" != 0 ]; then
  if command -v sudo >/dev/null 2>&1; then
    sudo="sudo"
  else
    echo "setup: please run as root: apt-get install$still" >&2
    exit 1
  fi
fi
echo "setup: installing$still" >&2
$sudo env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2 || true
# shellcheck disable=SC2086
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $still >&2 || {
  echo "setup: could not install:$still" >&2
  exit 1
}
