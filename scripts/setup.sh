#!/bin/sh
# Installs every Debian package that toile needs to build, test and film. Safe to run again:
# what is there already is left alone. Works as root or through sudo.
set -eu

packages="
build-essential pkg-config
libosmesa6-dev libgl-dev libegl-dev libegl1 libassimp-dev libsuitesparse-dev libopenblas-dev liblapacke-dev
libavcodec-dev libavfilter-dev libavformat-dev libavutil-dev libswscale-dev libpng-dev libopenexr-dev libcairo2-dev fonts-dejavu-core
libyaml-dev libudunits2-dev libqhull-dev libgmp-dev libxxhash-dev libcmocka-dev
clang-format clang-tidy cppcheck ffmpeg
python3 python3-numpy python3-matplotlib
"

if ! command -v dpkg-query >/dev/null 2>&1 || ! command -v apt-get >/dev/null 2>&1; then
    echo "setup: this script knows Debian's packages only; install the likes of these by hand:" >&2
    echo $packages >&2
    exit 1
fi

missing=""
for package in $packages; do
    status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
    [ "$status" = "install ok installed" ] || missing="$missing $package"
done
if [ -z "$missing" ]; then
    echo "setup: every package is installed"
    exit 0
fi

if [ "$(id -u)" -eq 0 ]; then
    as_root=""
elif command -v sudo >/dev/null 2>&1; then
    as_root="sudo"
else
    echo "setup: root or sudo is needed to install:$missing" >&2
    exit 1
fi

echo "setup: installing$missing"
export DEBIAN_FRONTEND=noninteractive
if ! $as_root apt-get update -q >/dev/null; then
    echo "setup: 'apt-get update' failed; is there a network?" >&2
    exit 1
fi
if ! $as_root apt-get install -y -q --no-install-recommends $missing >/dev/null; then
    echo "setup: 'apt-get install$missing' failed" >&2
    exit 1
fi
echo "setup: done"
