#!/usr/bin/env bash
# tools/build.sh FOLDER TARGET... [-- CMAKE-ARGUMENTS]: configures build/FOLDER and builds targets in it ("all" for all).
# Talks on stderr only: a line a build, and the compiler's words where it fails. Without CMAKE-ARGUMENTS a folder that is
# configured keeps its settings.
set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
folder=$root/build/$1
shift
targets=()
while [[ $# -gt 0 && $1 != -- ]]; do targets+=("$1") && shift; done
[[ $# -eq 0 ]] || shift

mkdir -p "$folder"
log=$folder/build.log
if [[ $# -gt 0 || ! -e $folder/build.ninja ]]; then
  cmake -S "$root" -B "$folder" -G Ninja "$@" >"$log" 2>&1 || {
    rm -f "$folder/build.ninja"  # so that the next try configures again
    tail -n 30 "$log" >&2
    echo "build: cmake could not configure $folder" >&2
    exit 3
  }
fi

# Files that include OpenVDB need up to 2 GiB each to compile.
jobs=$(nproc)
memory_gib=$(awk '/^MemTotal/ { print int($2 / 1048576 + 0.5) }' /proc/meminfo)
(( jobs * 2 <= memory_gib )) || jobs=$(( memory_gib / 2 > 0 ? memory_gib / 2 : 1 ))

started=$SECONDS
(sleep 3 >/dev/null 2>&1; echo "build: compiling in $folder; from nothing that takes some minutes ..." >&2) &
notice=$!
status=0
ninja -C "$folder" -j "$jobs" "${targets[@]}" >"$log" 2>&1 </dev/null || status=$?
kill "$notice" 2>/dev/null || true
if [[ $status -ne 0 ]]; then
  grep -v '^\[[0-9]*/[0-9]*\]' "$log" | cut -c1-400 | head -n 120 >&2
  echo "build: failed; the whole output is in $log" >&2
  exit 3
fi
(( SECONDS - started < 4 )) || echo "build: done in $(( SECONDS - started )) s" >&2
