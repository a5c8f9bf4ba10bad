#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: table_test.sh BUILD
# The README's commands from a folder of meshes to a table, with fewer steps and smaller clouds.
source "$(dirname "${BASH_SOURCE[0]}")/claims.bash"
source "$(dirname "${BASH_SOURCE[0]}")/../../scripts/setup.sh"
build=$(realpath "$1")
[[ -x $build/devel/lib/unirit/unirit_train ]] || exit 77
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
PATH=$build/devel/lib/unirit:$PATH
cd "$scratch"

# ellipsoid LENGTH: of that length [mm], as ASCII STL.
ellipsoid() {
  awk -v length_mm="$1" '
    function corner(i, j, u, v) {
      u = 6.283185307 * i / 32; v = 3.141592654 * j / 16
      return sprintf("vertex %.4f %.4f %.4f\n", length_mm / 2 * sin(v) * cos(u),
                     length_mm / 3 * sin(v) * sin(u), length_mm / 4 * cos(v))
    }
    function face(a, b, c) { printf "facet normal 0 0 0\nouter loop\n%s%s%sendloop\nendfacet\n", a, b, c }
    BEGIN {
      print "solid"
      for (i = 0; i < 32; ++i) for (j = 0; j < 16; ++j) {
        if (j < 15) face(corner(i, j), corner(i, j + 1), corner((i + 1) % 32, j + 1))
        if (j > 0) face(corner(i, j), corner((i + 1) % 32, j + 1), corner((i + 1) % 32, j))
      }
      print "endsolid"
    }'
}

shownCommands() {
  sed -n '/^### From meshes to a table/,/^### Train/p' "$root/README.md" | grep '^unirit_'
}

# small COMMAND: the same, done in seconds.
small() {
  sed -E 's/(--rigid-steps) [0-9]+/\1 1/; s/(--steps) [0-9]+/\1 2/; s/(--points) [0-9]+/\1 64/' <<<"$1"
}

# runs COMMAND: its words may not hold spaces.
runs() {
  local words
  read -ra words <<<"$1"
  "${words[@]}"
}

hasTable() {
  local method
  for method in identity 'unirit rigid' unirit; do
    grep "^| $method" mine/table/tables.md
  done
}

# refuses SENTENCE COMMAND...: status 2, the sentence, and nothing written to the folder "out".
refuses() {
  local sentence=$1
  shift
  status 2 "$@" >output 2>&1 && grep -qF "$sentence" output && [[ ! -e out ]] && return
  cat output
  return 1
}

mkdir -p organs/train organs/test/liver empty broken
ellipsoid 200 >organs/train/s0001_liver.stl
ellipsoid 220 >organs/train/000002_Liver.stl
ellipsoid 210 >organs/test/liver/3.stl
head -n 100 organs/train/s0001_liver.stl >broken/s0004_liver.stl
mkdir flat
sed -E 's/^vertex .*/vertex 0 0 0/' organs/train/s0001_liver.stl >flat/flat_liver.stl
mapfile -t commands < <(shownCommands)

claim "the README shows three commands" [ "${#commands[@]}" == 3 ]
for command in "${commands[@]}"; do
  claim "it runs: $command" runs "$(small "$command")"
done
claim "they end in a table" hasTable
rm -rf mine
for command in "${commands[@]}"; do
  # shellcheck disable=SC2001
  phantoms=$(sed 's/--data [^ ]*/--phantoms 1/' <<<"$command")
  claim "it runs: $phantoms" runs "$(small "$phantoms")"
done
claim "phantoms end in a table, too" hasTable

for folder in nowhere empty broken; do
  sentence="$folder: not a folder" train_sentence="$folder: not a folder"
  if [[ $folder == empty ]]; then sentence="no organ surface was found" train_sentence="no organs"; fi
  if [[ $folder == broken ]]; then sentence="no pair could be made" train_sentence="no organs"; fi
  claim "unirit_pairs refuses the organs $folder" \
    refuses "$sentence" unirit_pairs --data "$folder" --output out/pairs.safetensors
  claim "unirit_train refuses the organs $folder" \
    refuses "$train_sentence" unirit_train --data "$folder" --output out
done
claim "unirit_pairs names a broken mesh" \
  refuses 'Cannot read "broken/s0004_liver.stl"' unirit_pairs --data broken --output out/pairs
touch file
claim "unirit_train refuses an output that is a file" \
  refuses "file/unirit.safetensors cannot be written" unirit_train --phantoms 1 --output file
claim "unirit_train leaves out a mesh without area" \
  refuses "left out: liver flat_liver: cannot be deformed" unirit_train --data flat --output out
claim "unirit_pairs refuses an output below a file" \
  refuses "file/pairs cannot be written" unirit_pairs --data organs --output file/pairs
claim "unirit_benchmark refuses pairs that are not there" \
  refuses '"nowhere" is not a folder' unirit_benchmark --cases nowhere --output empty
claim "unirit_benchmark refuses a file of no pairs" \
  refuses '"file" is empty' unirit_benchmark --cases file --output empty
finish
