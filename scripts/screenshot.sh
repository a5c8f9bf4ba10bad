#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: screenshot.sh [OUT.png [ARGUMENT-OF-DEMO...]]
# Makes the picture of rviz in the demo, by default docs/images/rviz.png, with no display.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
"$root/scripts/build.sh" "${demo_targets[@]}"

picture=$(realpath -m "${1:-$root/docs/images/rviz.png}")
scratch=$(mktemp -d)
processes=()

endAll() {
  local i
  for ((i = ${#processes[@]} - 1; i >= 0; --i)); do
    kill "${processes[i]}" 2>/dev/null || true
    wait "${processes[i]}" || true
  done
  rm -rf "$scratch"
}
trap endAll EXIT
trap 'exit 130' INT TERM

# waitUntil SECONDS WHAT COMMAND...: until the command succeeds; ends the script after the deadline.
waitUntil() {
  local deadline=$((SECONDS + $1)) what=$2
  echo "Waiting for $what"
  until "${@:3}"; do
    if ((SECONDS > deadline)) || ! kill -0 "${processes[@]}" 2>/dev/null; then
      if [[ -f $scratch/demo ]]; then tail -n 30 "$scratch/demo"; fi
      echo "screenshot.sh: $what did not come" >&2
      exit 1
    fi
    sleep 0.5
  done
}

countRegistrations() {
  grep -c '^registration .* SUCCEEDED' "$scratch/demo" || true
}

rvizListens() {
  [[ $(rosnode info /rviz 2>/dev/null) == */unirit/deformed* ]]
}

isDrawn() {
  (($(countRegistrations) >= enough))
}

Xvfb -displayfd 3 -screen 0 1280x800x24 -nolisten tcp 3>"$scratch/display" 2>/dev/null &
processes+=($!)
waitUntil 30 "the virtual display" test -s "$scratch/display"
DISPLAY=:$(<"$scratch/display")
ROS_MASTER_URI=http://localhost:$(freePort)
export DISPLAY ROS_MASTER_URI LIBGL_ALWAYS_SOFTWARE=1

"$root/scripts/demo.sh" "${@:2}" >"$scratch/demo" 2>&1 &
processes+=($!)
waitUntil 120 "rviz" rvizListens
# rviz has shown the first of these by the time of the last
enough=$(($(countRegistrations) + 4))
waitUntil 120 "registrations" isDrawn
mkdir -p "$(dirname "$picture")"
import -window root "$picture"
echo "Wrote $picture"
