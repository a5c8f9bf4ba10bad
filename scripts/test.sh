#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: test.sh
# Sets up, builds, and runs every test with no display; again, the unit tests but those of two slow
# tools, over libraries and tools with the address and undefined behaviour sanitizers. The last line
# is "N passed, N failed"; exit status 0 if none did.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

passed=0 failed=0 skipped=0

# The last line, also where it did not come to the tests.
finish() {
  local status=$? skips=
  if ((status != 0 && failed == 0)); then failed=1; fi
  if ((skipped > 0)); then skips=", $skipped skipped"; fi
  echo "$passed passed, $failed failed$skips"
  exit $((failed > 0))
}
trap finish EXIT

# runTests TITLE FOLDER CTEST-OPTION...: runs them and adds to the counts.
runTests() {
  local log lines line
  log=$logs/test-$(basename "$2").log
  printf '[%(%H:%M:%S)T] %s\n' -1 "$1"
  (cd "$2" && exec env -u DISPLAY ctest --output-on-failure --timeout 600 --parallel "$(nproc)" \
    "${@:3}" 2>&1) |
    tee "$log" || true # the lines tell
  mapfile -t lines < <(grep -E '^ *[0-9]+/[0-9]+ Test +#' "$log")
  for line in "${lines[@]:-no test was run}"; do
    case $line in
      *' Passed '*) passed=$((passed + 1)) ;;
      *'***Skipped'*) skipped=$((skipped + 1)) ;;
      *) failed=$((failed + 1)) ;;
    esac
  done
}

# One of the tests builds the package once more, without ROS: what compiles alike there is not
# compiled again.
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_DIR=${CCACHE_DIR:-$root/build/ccache}
fi

configure "$root/build"
build "$root/build" all
# without LibTorch, which knows nothing of sanitizers
configure "$root/build/sanitized" -DUNIRIT_SANITIZE=ON -DUNIRIT_TRAINING=OFF
build "$root/build/sanitized" unit_tests

runTests "Running all tests" "$root/build"
# Leaks are looked for; no library the unit tests use needs a suppression. No tool of the package
# ends with 99: a test that wants a tool to fail must not take a sanitizer's finding for it.
export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1:exitcode=99
export UBSAN_OPTIONS=print_stacktrace=1:exitcode=99
runTests "Running the unit tests with sanitizers" "$root/build/sanitized" --label-regex '^unit$'
