#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: train_model.sh ORGANS OUTPUT
# Makes the shipped weights again: trains on ORGANS/ORGAN/*.ply (millimetres) and on digital
# phantoms, and leaves checkpoint, curves and unirit.safetensors in OUTPUT. Run again, it goes on
# where it was stopped.
set -euo pipefail
if (($# != 2)) || [[ ! -d $1 ]]; then
  echo "usage: train_model.sh ORGANS OUTPUT; ORGANS is a folder of ORGAN/*.ply" >&2
  exit 2
fi
organs=$(realpath "$1") output=$(realpath -m "$2")
"$(dirname "${BASH_SOURCE[0]}")/build.sh"
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

exec "$root/build/devel/lib/unirit/unirit_train" --data "$organs" --phantoms 6 --output "$output" \
  --steps 7000 --rigid-steps 4000 --alpha 0.5 --batch 32 --points 256 --threads 2 --seed 1 \
  --report-every 250 --save-every 250
