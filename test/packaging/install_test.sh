#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: install_test.sh BUILD
source "$(dirname "${BASH_SOURCE[0]}")/claims.bash"
source "$(dirname "${BASH_SOURCE[0]}")/../../scripts/setup.sh"
build=$1
# Outside of the source tree, where roslaunch would find the installed launch files beside ours
prefix=$(mktemp -d)
configured=$(sed -n 's/^CMAKE_INSTALL_PREFIX:[A-Z]*=//p' "$build/CMakeCache.txt")
trap 'rm -rf "$prefix"; cmake -DCMAKE_INSTALL_PREFIX="$configured" "$build" >/dev/null' EXIT
consumer=$root/test/packaging/consumer

# Runs a command as a new shell would that knows the installed package and no other of this name.
installed() {
  # shellcheck disable=SC2016
  env -i HOME="$prefix/home" PATH=/usr/bin:/bin ROS_HOSTNAME=localhost \
    bash -c 'source "$0/setup.bash" && exec "$@"' "$prefix" "$@"
}

isFound() {
  [[ $(installed rospack find unirit) == "$prefix/share/unirit" ]]
}

isPlugin() {
  installed rospack plugins --attrib=plugin nodelet |
    grep -x "unirit $prefix/share/unirit/nodelet_plugins.xml"
}

hasFiles() {
  local file
  for file in share/unirit/{models/{unirit,unirit_published}.safetensors,config/unirit.yaml,rviz/demo.rviz} \
    share/unirit/launch/{registration,replay,demo}.launch include/unirit/registration.hpp; do
    [[ -s $prefix/$file ]] || { echo "$file is missing"; return 1; }
  done
}

registersInDemo() {
  local output
  output=$(installed timeout -s INT 150 roslaunch -p "$(freePort)" unirit demo.launch \
    rviz:=false registrations:=2 2>&1)
  echo "$output"
  [[ $output == *'demo: 2 of 2 registrations succeeded'* ]]
}

knowsMessages() {
  installed rosmsg show unirit/RegistrationResult | grep residual_rms >/dev/null &&
    installed python3 -c 'import unirit.msg, unirit.srv; unirit.srv.RegisterRequest()'
}

buildsConsumer() {
  installed cmake -S "$consumer" -B "$prefix/consumer" -DPYTHON_EXECUTABLE=/usr/bin/python3 &&
    installed cmake --build "$prefix/consumer" && installed "$prefix/consumer/consumer"
}

mkdir -p "$prefix/home"
# Catkin's setup files take the prefix that was configured, whatever `cmake --install` is told
claim "a prefix can be chosen" cmake -DCMAKE_INSTALL_PREFIX="$prefix" "$build"
claim "it can be installed" cmake --install "$build"
claim "weights, configuration, launch files and headers are there" hasFiles
claim "ROS finds the package in the prefix" isFound
claim "nodelet managers find the plugin" isPlugin
claim "python tools know the messages" knowsMessages
claim "the demo launched from the prefix registers" registersInDemo
claim "another package builds against the library" buildsConsumer
finish
