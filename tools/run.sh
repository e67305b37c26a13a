#!/usr/bin/env bash
# tools/run.sh [ARGS]: sets the machine up, builds, and runs `loam ARGS`; without arguments the main job, `loam demo`.
# Paths in ARGS are relative to the folder it is called from.
set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
"$root/tools/setup.sh"
"$root/tools/build.sh" release loam
[[ $# -gt 0 ]] || set -- demo
exec "$root/build/release/loam" "$@"
