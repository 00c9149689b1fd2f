#!/bin/sh
# Installs the Debian packages that building Rayfold needs, and says which. On a machine that has them all it asks
# nothing and returns at once. Arguments: "build" (default) or "test" for what the tests need besides.
set -u
needed="gcc libc6-dev cmake ninja-build pkg-config libjansson-dev"
# Without one of these a picture format, compressed models or the window is left out, and the rest works.
optional="libpng-dev libturbojpeg0-dev libwebp-dev libopenexr-dev libstb-dev libmeshoptimizer-dev libnanovdb-dev libsdl2-dev fonts-dejavu-core"
[ "${1:-build}" = test ] && needed="$needed g++ clang xvfb $optional" optional=""

missing() { # packages...: prints those that are not there, each with a space before it
  installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "$@" 2>/dev/null | sed -n 's/ installed$//p')
  for p in "$@"; do
    # Tools that came from elsewhere are as good as Debian's.
    case $p in
    gcc | cmake | clang | g++ | pkg-config) command -v "$p" >/dev/null 2>&1 && continue ;;
    ninja-build) command -v ninja >/dev/null 2>&1 && continue ;;
    esac
    echo "$installed" | grep -qx -e "$p" || printf ' %s' "$p"
  done
}
# Ends the set-up without the packages: an error only if the build cannot do without them.
go_without() { # why
  # shellcheck disable=SC2086
  without=$(missing $needed)
  if [ -z "$without" ]; then
    echo "setup: $1; going on without$lacking" >&2
    exit 0
  fi
  echo "setup: $1; as root, run: apt-get install$lacking" >&2
  exit 1
}

# shellcheck disable=SC2086
lacking=$(missing $needed $optional)
[ -z "$lacking" ] && exit 0
if ! command -v apt-get >/dev/null 2>&1; then
  echo "setup: this is not Debian; please install what these packages hold, if it is not there:$lacking" >&2
  exit 0
fi
sudo=""
if [ "$(id -u)" != 0 ]; then
  command -v sudo >/dev/null 2>&1 || go_without "not root and no sudo"
  sudo="sudo"
fi
echo "setup: installing$lacking" >&2
$sudo env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2 || true
# shellcheck disable=SC2086
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $lacking >&2 ||
  go_without "apt-get could not install them"
