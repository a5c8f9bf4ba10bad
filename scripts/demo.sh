#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail

usage() {
  cat <<'END'
Usage: demo.sh [ORGAN] [--headless] [--registrations N] [--phantom NAME] [--seed N]

Registers an organ that moves and deforms before a simulated depth camera. Sets up and builds first
where that is needed.

  ORGAN              surface of an organ in millimetres: PLY, STL, OBJ or PCD; else a digital phantom
  --headless         without rviz
  --registrations N  end after N registrations; else with Ctrl-C
  --phantom NAME     which digital phantom (default: liver)
  --seed N           another seed is another patient and another motion (default: 1)

Exit status: 0 the demo ran to its end, 1 it failed, 2 unusable arguments, 130 interrupted.
END
}

refuse() {
  echo "demo.sh: $1" >&2
  exit 2
}

checkOrgan() {
  [[ $organ == "" ]] || refuse "$1: one organ at a time, and $organ is one"
  [[ ! -d $1 ]] || refuse "$1: a folder, not a file"
  [[ -f $1 && -r $1 ]] || refuse "$1: no such file, or not readable"
  case ${1,,} in
    *.ply | *.stl | *.obj | *.pcd) ;;
    *) refuse "$1: not a PLY, STL, OBJ or PCD file" ;;
  esac
}

checkNumber() {
  [[ $2 =~ ^[0-9]{1,9}$ ]] || refuse "$1 $2: not a whole number"
  [[ $1 != --registrations || $2 =~ [1-9] ]] || refuse "$1 $2: the demo needs one at least"
}

rviz=true
organ=
phantom=liver
arguments=()
while (($# > 0)); do
  case $1 in
    -h | --help)
      usage
      exit 0
      ;;
    --headless) rviz=false ;;
    --registrations | --seed | --phantom)
      (($# > 1)) || refuse "$1 needs a value"
      if [[ $1 == --phantom ]]; then phantom=$2; else checkNumber "$1" "$2"; fi
      arguments+=("${1#--}:=$2")
      shift
      ;;
    -*) refuse "unknown option $1; --help lists those that exist" ;;
    *)
      checkOrgan "$1"
      organ=$1
      arguments+=("organ:=$(realpath "$organ")")
      ;;
  esac
  shift
done

source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
"$root/scripts/build.sh" "${demo_targets[@]}"
"$root/build/devel/lib/unirit/demo_camera" --check "$organ" "$phantom" || exit 2

if $rviz && ! timeout 5 xdpyinfo &>/dev/null; then
  echo "No display can be opened: running without rviz."
  rviz=false
fi

set +u
# shellcheck source=/dev/null
source "$root/build/devel/setup.bash"
set -u

# A master that runs already may be a robot's, or another demo's.
if [[ ${ROS_MASTER_URI:-http://localhost:11311} == http://localhost:11311 ]] &&
  (exec 3<>/dev/tcp/localhost/11311) 2>/dev/null; then
  ROS_MASTER_URI=http://localhost:$(freePort)
  export ROS_MASTER_URI
  echo "A ROS master is running already; that of the demo is ROS_MASTER_URI=$ROS_MASTER_URI"
fi

# roslaunch ends with 0 however its nodes end; its log says more.
export ROS_LOG_DIR=$logs/demo ROSCONSOLE_STDOUT_LINE_BUFFERED=1
rm -rf "$ROS_LOG_DIR"
roslaunch --no-summary --disable-title "$root/launch/demo.launch" "rviz:=$rviz" "${arguments[@]}" &
launch=$!
trap 'kill -INT "$launch" 2>/dev/null || true' INT TERM
status=0
while kill -0 "$launch" 2>/dev/null; do wait "$launch" || status=$?; done

outcome=$(grep -rhsA 1 --include='roslaunch-*.log' 'REQUIRED process' "$ROS_LOG_DIR" || true)
case $outcome in
  *'finished cleanly'*)
    echo "The demo has come to its end."
    exit 0
    ;;
  *'has died'*) exit 1 ;;
  *) exit $((status == 0 ? 130 : status)) ;;
esac
