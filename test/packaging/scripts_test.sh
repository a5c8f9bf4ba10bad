#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Usage: scripts_test.sh SOURCE
source "$(dirname "${BASH_SOURCE[0]}")/claims.bash"
source_folder=$1
scripts=$source_folder/scripts
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"

# refuses SENTENCE ARGUMENT...: demo.sh ends with status 2 and this one sentence, and nothing else.
refuses() {
  local sentence=$1
  shift
  [[ $(status 2 timeout 20 "$scripts/demo.sh" "$@" 2>&1) == "demo.sh: $sentence" ]]
}

helps() {
  timeout 20 "$scripts/demo.sh" --help | grep -- '--registrations N'
}

setsUpSilently() {
  [[ -z $("$scripts/setup.sh" 2>&1) ]]
}

noticesMissingPackage() {
  mkdir -p scripts
  printf 'make\nnot-a-package  # of Debian\n' >scripts/packages.txt
  # shellcheck disable=SC2016
  [[ $(bash -c 'source "$1/setup.sh" && root=$PWD && missingPackages' - "$scripts") == not-a-package ]]
}

passesForeignPythonBy() {
  mkdir -p foreign
  printf '#!/bin/sh\nexit 1\n' >foreign/python3
  chmod +x foreign/python3
  local found
  # shellcheck disable=SC2016
  found=$(PATH=$PWD/foreign:$PATH bash -c 'source "$1/setup.sh" && command -v python3' - "$scripts")
  [[ $found == /usr/bin/python3 ]]
}

touch organ.txt first.ply
mkdir folder.ply
claim "--help shows the usage" helps
claim "an unknown option is refused" \
  refuses "unknown option --fast; --help lists those that exist" --fast
claim "an organ that is not there is refused" \
  refuses "nowhere.ply: no such file, or not readable" nowhere.ply
claim "an organ of another format is refused" \
  refuses "organ.txt: not a PLY, STL, OBJ or PCD file" organ.txt
claim "an option without its value is refused" \
  refuses "--registrations needs a value" --registrations
claim "a count that is no number is refused" \
  refuses "--registrations many: not a whole number" --registrations many
claim "no registration at all is refused" \
  refuses "--registrations 0: the demo needs one at least" --registrations 0
claim "a folder in place of an organ is refused" \
  refuses "folder.ply: a folder, not a file" folder.ply
claim "two organs are refused" \
  refuses "second.ply: one organ at a time, and first.ply is one" first.ply second.ply
claim "a foreign python ahead in PATH is passed by" passesForeignPythonBy
claim "a set-up that has been done has nothing to say" setsUpSilently
claim "a missing package is noticed" noticesMissingPackage
claim "shellcheck has nothing to say" \
  shellcheck "$scripts"/*.sh "$source_folder"/test/packaging/*.{bash,sh} "$source_folder/.ci/run"
claim "catkin_lint has nothing to say" \
  catkin_lint --strict -W2 --ignore package_path_name "$source_folder"
finish
