#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: core_dependencies_test.sh LIBUNIRIT_CORE LIBUNIRIT_ROS
source "$(dirname "${BASH_SOURCE[0]}")/claims.bash"
core=$1
ros=$2

needsNoRosOrPcl() {
  local needed
  needed=$(readelf -d "$1" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
  echo "$needed"
  [[ $needed == *libstdc++* ]] && ! grep -E '^lib(ros|tf2|pcl|nodelet|vtk|boost|torch)' <<<"$needed"
}

claim "the core is linked with neither ROS nor PCL" needsNoRosOrPcl "$core"
claim "the ROS edge is, so that the claim above can fail" fails needsNoRosOrPcl "$ros"
finish
