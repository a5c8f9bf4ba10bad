#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail

usage() {
  cat <<'END'
Usage: experiments.sh TRAIN TEST OUTPUT [cpu|cuda]

Makes the paper's experiments again (docs/experiments.md): trains the networks that are missing in
OUTPUT/networks on the organs of TRAIN, compares them and their rivals on those of TEST, and leaves
a folder of tables for each experiment. TRAIN and TEST are folders of ORGAN/*.ply in millimetres.
Run again, it computes what is missing; networks found there are taken as they are. On two cores it
takes about an hour and a half.

Exit status: 0 all tables are written, 2 unusable arguments, else that of the command that failed.
END
}

if [[ ${1:-} == --help ]]; then
  usage
  exit 0
fi
if (($# < 3 || $# > 4)) || [[ ! -d $1/liver || ! -d $2 ]]; then
  usage >&2
  exit 2
fi
train=$(realpath "$1") test=$(realpath "$2") output=$(realpath -m "$3") device=${4:-cpu}
"$(dirname "${BASH_SOURCE[0]}")/build.sh" unirit_train unirit_benchmark
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
programs=$root/build/devel/lib/unirit
shipped=$root/models/unirit.safetensors
published=weights=$root/models/unirit_published.safetensors
networks=$output/networks

# network NAME STEPS OPTION...: trains it unless it is there.
network() {
  local folder=$networks/$1
  [[ -f $folder/unirit.safetensors ]] && return 0
  "$programs/unirit_train" --output "$folder" --device "$device" --data-threads "$(nproc)" \
    --steps "$2" --learning-rate 1e-3 --batch 32 --near-share 0.3 --pairs-per-deformation 16 \
    --decoded-points 128 --report-every 100 --save-every 100 "${@:3}"
}

# choose FOLDER FILE...: a folder of organs with just these.
choose() {
  local file
  for file in "${@:2}"; do
    mkdir -p "$1/$(basename "$(dirname "$file")")"
    ln -sf "$file" "$1/$(basename "$(dirname "$file")")/"
  done
}

all=(--data "$train" --phantoms 6 --hold-out 24)
network fpt 1200 "${all[@]}" --points 512 --method fpt
network norigid 1200 "${all[@]}" --points 512 --pairing nearest --alpha 1
network row 1000 "${all[@]}" --points 128 --pairing row --target paired --partial-share 0 --rotation 0

# few NAME COUNT OPTION...: a network of the first livers alone.
livers=("$train"/liver/*)
few() {
  choose "$output/organs/liver$2" "${livers[@]:0:$2}"
  network "$1" 1800 --points 128 --pairing nearest --data "$output/organs/liver$2" \
    --hold-out 100 "${@:3}"
}
for count in 1 2 4 8; do few "liver$count" "$count"; done
few liver1varied 1 --subjects 20

# The network alone is judged in all cases: its limits are opened.
open=plausibility/max_residual=1:plausibility/max_residual_p95=1:plausibility/min_inliers=0
open+=:plausibility/min_overlap=0:plausibility/max_displacement=2:plausibility/max_stretch=100
open+=:plausibility/min_compression=0:plausibility/max_folded=1:plausibility/max_turn=180
open+=:plausibility/max_joint=10:plausibility/max_jump_translation=10
open+=:plausibility/max_jump_rotation=180
alone=stages=rigid+nonrigid:$open

# weightsOf NAME: as the methods of the benchmark name them.
weightsOf() {
  echo "weights=$networks/$1/unirit.safetensors"
}

# compare NAME OPTION...
compare() {
  "$programs/unirit_benchmark" --output "$output/$1" --weights "$shipped" "${@:2}"
}

rivals=(identity best-rigid icp gicp cpd-rigid cpd bcpd)
ours=("rigid module@unirit:stages=rigid:$published:$open"
  "non-rigid module@unirit:stages=nonrigid:$(weightsOf norigid):$open"
  "UniRiT@unirit:$alone:$published" "UniRiT by flow@unirit:$alone" unirit)
fpt="FPT@unirit:stages=nonrigid:$(weightsOf fpt):$open"

compare all --data "$test" --label "real organs (test split)" \
  --protocols permuted resampled caseb partial --methods "${rivals[@]}" "$fpt" "${ours[@]}"

choose "$output/organs/small_bowel" "$test"/small_bowel/*
compare zero_shot --data "$output/organs/small_bowel" --label "small bowel (zero-shot)" --exclude none \
  --pairs 4 --protocols permuted resampled caseb partial \
  --methods "${rivals[@]}" "$fpt" "${ours[@]}"

choose "$output/organs/liver" "$test"/liver/*
of_livers=("UniRiT of 1 liver varied@unirit:$(weightsOf liver1varied):$alone")
for count in 1 2 4 8; do
  of_livers+=("UniRiT of $count livers@unirit:$(weightsOf "liver$count"):$alone")
done
compare liver --data "$output/organs/liver" --label "livers (test split)" --pairs 8 \
  --protocols permuted resampled caseb partial \
  --methods identity best-rigid icp cpd bcpd "${of_livers[@]}" "UniRiT@unirit:$alone:$published" \
  "UniRiT by flow@unirit:$alone" unirit

compare paired --data "$test" --label "real organs (test split)" --protocols paired permuted \
  --methods identity cpd "UniRiT by rows@unirit-rows:$(weightsOf row)" \
  "UniRiT@unirit:$alone:$published"
