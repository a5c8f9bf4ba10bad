# SPDX-License-Identifier: BSD-3-Clause
# For the tests of this folder: each is a list of claims, and fails where one does not hold.
set -euo pipefail

failed_claims=0

# claim SENTENCE COMMAND...: the sentence holds if the command succeeds.
claim() {
  local sentence=$1 output
  shift
  if output=$("$@" 2>&1); then
    echo "holds: $sentence"
  else
    printf '%s\nFAILS: %s\n' "$output" "$sentence"
    failed_claims=$((failed_claims + 1))
  fi
}

# fails COMMAND...: succeeds if the command does not.
fails() {
  ! "$@"
}

# status WANTED COMMAND...: succeeds if the command ends with that status; repeats what it wrote.
status() {
  local wanted=$1 got=0
  shift
  "$@" || got=$?
  ((got == wanted)) || { echo "status $got instead of $wanted"; return 1; }
}

finish() {
  exit $((failed_claims > 0))
}
