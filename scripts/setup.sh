#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the packages of packages.txt that are missing and prepares the environment. The other
# scripts source it for `root`, `step` and `configure`; run by itself it is the set-up alone.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
logs=$root/build/log
# What roslaunch needs for the demo.
# shellcheck disable=SC2034
demo_targets=(demo_camera registration_node unirit_nodelet)

# Debian's python before any other: the ROS modules are there alone.
export PATH=/usr/bin:$PATH
# A machine's own name need not resolve; where another machine's master is named, it must.
if [[ -z ${ROS_MASTER_URI:-}${ROS_IP:-} ]]; then export ROS_HOSTNAME=${ROS_HOSTNAME:-localhost}; fi

# step TITLE LOG COMMAND...: runs the command with its output in $logs/LOG, says every 20 s how far
# it is, and shows the end of the output where it fails.
step() {
  local title=$1 log=$logs/$2 status=0 watcher
  shift 2
  mkdir -p "$logs"
  : >"$log"
  printf '[%(%H:%M:%S)T] %s\n' -1 "$title"
  while sleep 20 &>/dev/null && kill -0 $$ 2>/dev/null; do
    printf '           ... %s\n' "$(tail -n 1 "$log" | tr -d '\r' | cut -c 1-110)"
  done &
  watcher=$!
  "$@" >"$log" 2>&1 </dev/null || status=$?
  kill "$watcher"
  wait "$watcher" 2>/dev/null || true
  if ((status != 0)); then
    tail -n 40 "$log"
    printf '[%(%H:%M:%S)T] failed: %s (status %d, all output in %s)\n' -1 "$title" "$status" "$log"
  fi
  return "$status"
}

# For a ROS master of one's own.
freePort() {
  python3 -c 'import socket; s = socket.socket(); s.bind(("", 0)); print(s.getsockname()[1])'
}

missingPackages() {
  local wanted
  mapfile -t wanted < <(sed 's/#.*//' "$root/scripts/packages.txt" | grep -o '[^ ]*')
  comm -23 <(printf '%s\n' "${wanted[@]}" | sort -u) \
    <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null |
      sed -n 's/^installed //p' | sort -u)
}

asRoot() {
  if ((EUID == 0)); then
    "$@"
  else
    sudo "$@"
  fi
}

aptGet() {
  asRoot env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 -y "$@"
}

installPackages() {
  local missing
  mapfile -t missing < <(missingPackages)
  if ((${#missing[@]} == 0)); then return; fi
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      echo "missing packages, and neither root nor sudo to install them: ${missing[*]}" >&2
      return 1
    fi
    sudo -v # asks for the password here, where it can be seen
  fi
  step "Fetching the lists of packages" apt-update.log aptGet update
  step "Installing ${#missing[@]} packages and what they need (minutes)" apt-install.log \
    aptGet install --no-install-recommends "${missing[@]}"
}

# configure FOLDER OPTION...: runs CMake unless it ran there with the same options before. Warnings
# are errors where the variable UNIRIT_WERROR is ON.
configure() {
  local folder=$1
  set -- "${@:2}" "-DUNIRIT_WERROR=${UNIRIT_WERROR:-OFF}"
  local options=$*
  if [[ -f $folder/Makefile && -f $folder/options && $(<"$folder/options") == "$options" ]]; then
    return
  fi
  mkdir -p "$folder"
  rm -f "$folder/options"
  step "Configuring $folder" "configure-$(basename "$folder").log" \
    cmake -S "$root" -B "$folder" -G "Unix Makefiles" -DCMAKE_BUILD_TYPE=Release \
    -DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython3_EXECUTABLE=/usr/bin/python3 "$@"
  printf '%s\n' "$options" >"$folder/options"
}

# build FOLDER TARGET...
build() {
  local cores gigabytes
  cores=$(nproc)
  gigabytes=$(awk '/^MemAvailable/ { print int($2 / 2 ^ 20) }' /proc/meminfo)
  # LibTorch's headers take two gigabytes a compiler
  step "Building in $1: ${*:2}" "build-$(basename "$1").log" \
    cmake --build "$1" --target "${@:2}" -- -j "$((gigabytes / 2 < cores ? gigabytes / 2 + 1 : cores))"
}

# Debian has ROS in /usr; Ubuntu in /opt/ros, and its packages have other names.
if [[ -f /opt/ros/noetic/setup.bash ]]; then
  set +u
  # shellcheck source=/dev/null
  source /opt/ros/noetic/setup.bash
  set -u
else
  installPackages
fi
