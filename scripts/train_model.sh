#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: train_model.sh ORGANS OUTPUT [cpu|cuda]
# Trains weights as those of models/unirit.safetensors were: on ORGANS/ORGAN/*.ply (millimetres) and
# on digital phantoms, and leaves checkpoint, curves and unirit.safetensors in OUTPUT. Run again, it
# goes on where it was stopped. On two cores it takes an hour; cuda needs a LibTorch that has it
# (see src/training/CMakeLists.txt).
set -euo pipefail
if (($# < 2 || $# > 3)) || [[ ! -d $1 ]]; then
  echo "usage: train_model.sh ORGANS OUTPUT [cpu|cuda]; ORGANS is a folder of ORGAN/*.ply" >&2
  exit 2
fi
organs=$(realpath "$1") output=$(realpath -m "$2") device=${3:-cpu}
"$(dirname "${BASH_SOURCE[0]}")/build.sh" unirit_train
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

exec "$root/build/devel/lib/unirit/unirit_train" --data "$organs" --phantoms 6 --hold-out 24 \
  --output "$output" --device "$device" --steps 1400 --batch 32 --points 512 --iterations 6 \
  --partial-share 0.65 --near-share 0.35 --pairs-per-deformation 8 --learning-rate 5e-4 --seed 2 \
  --report-every 50 --save-every 50
