#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: no_ros_build_test.sh SOURCE BUILD
source "$(dirname "${BASH_SOURCE[0]}")/claims.bash"
source_folder=$1
build=$2
install=$build/install

configure() {
  cmake -S "$source_folder" -B "$build" -G "Unix Makefiles" -DCMAKE_BUILD_TYPE=Release \
    -DUNIRIT_ROS=OFF -DUNIRIT_TRAINING=OFF -DBUILD_TESTING=OFF -DUNIRIT_WERROR=ON \
    -DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON
}

# The compiler's own lists say which headers were read, wherever they are installed.
readsNo() {
  local lists
  mapfile -t lists < <(find "$build/src" -path "*$2*" -name '*.o.d')
  ((${#lists[@]} > 0)) || return 1
  ! grep -hoE "[^ ]*/($1)[^ ]*" "${lists[@]}" | sort -u
}

runsRegister() {
  env -u LD_LIBRARY_PATH "$install/lib/unirit/unirit_register" --help
}

rm -rf "$install"
claim "CMake finds all that it needs without catkin" configure
claim "everything but the ROS edge is built" \
  cmake --build "$build" -- -j "$(nproc)"
claim "no header of ROS is read" \
  readsNo 'ros/|tf2|catkin|nodelet/|pluginlib/|[a-z]+_msgs/' ''
claim "the core reads no header of PCL" readsNo 'pcl' unirit_core
claim "file reading does, so that the claims above can fail" fails readsNo 'pcl' unirit_io
claim "it can be installed" cmake --install "$build" --prefix "$install"
claim "the installed command runs without further environment" runsRegister
finish
