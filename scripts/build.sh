#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: build.sh [TARGET...]
# Builds all of unirit, or the CMake targets named, in build/; the devel space is build/devel.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

# A folder that is configured keeps its options: those of test.sh serve as well.
[[ -f $root/build/options ]] || configure "$root/build"
build "$root/build" "${@:-all}"
