#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: launch_test.sh BUILD BAG
# What the launch files say and how they end, run from the devel space without a display.
source "$(dirname "${BASH_SOURCE[0]}")/claims.bash"
source "$(dirname "${BASH_SOURCE[0]}")/../../scripts/setup.sh"
build=$1 bag=$2
camera=$build/devel/lib/unirit/demo_camera
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export ROS_LOG_DIR=$scratch/log
unset DISPLAY
set +u
# shellcheck source=/dev/null
source "$build/devel/setup.bash"
set -u
cd "$scratch"

# ends STATUS SENTENCE FILE ARGUMENT...: roslaunch ends by itself with this status and said so.
ends() {
  local code=$1 sentence=$2 output=$scratch/output
  shift 2
  status "$code" timeout -s INT 120 roslaunch -p "$(freePort)" unirit "$@" >"$output" 2>&1 || {
    cat "$output"
    return 1
  }
  grep -F "$sentence" "$output" || { cat "$output"; return 1; }
}

# findsBag BAG: the replay has looked into the bag, as far as that goes without starting anything.
findsBag() {
  roslaunch --dump-params unirit replay.launch bag:="$1" | grep "^/bag_version: '2.0"
}

# refusesOrgan SENTENCE FILE PHANTOM: what demo.sh asks before it launches anything.
refusesOrgan() {
  [[ $(status 1 timeout 20 "$camera" --check "${@:2}" 2>&1) == "demo: $1" ]]
}

printf 'v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' >metres.obj
printf 'no organ\n' >text.ply
printf 'not a bag\n' >text.bag
: >empty.bag
mkdir folder.bag
cp "$bag" "a session.bag"

claim "the demo ends by itself after its registrations" \
  ends 0 "demo: 3 of 3 registrations succeeded" demo.launch rviz:=false registrations:=3
claim "the demo names an organ that is not there" \
  ends 0 "nowhere.ply" demo.launch rviz:=false organ:="$scratch/nowhere.ply"
claim "an organ in metres is refused" \
  refusesOrgan "metres.obj holds an organ of 0.3 mm: is it in another unit than millimetres?" \
  metres.obj liver
claim "a file that is no organ is refused" \
  refusesOrgan 'Cannot read "text.ply": it does not begin with "ply".' text.ply liver
claim "an unknown phantom is refused" \
  refusesOrgan 'organ: "heart" is not a phantom'"'"'s name' "" heart
claim "a replay names a bag that is not there" \
  ends 1 "ERROR reading $scratch/nowhere.bag" replay.launch bag:=nowhere.bag
claim "a replay refuses a folder" \
  ends 1 "ERROR reading $scratch/folder.bag" replay.launch bag:="$scratch/folder.bag"
claim "a replay refuses a file that is no bag" \
  ends 1 "This does not appear to be a bag file" replay.launch bag:=text.bag
claim "a replay refuses an empty file" ends 1 "empty file" replay.launch bag:=empty.bag
claim "a replay takes a bag in the present folder" findsBag "a session.bag"
claim "a replay takes a bag's absolute path" findsBag "$scratch/a session.bag"
claim "a replay needs a bag" ends 1 "'bag' is not defined" replay.launch
finish
