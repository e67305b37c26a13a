#!/usr/bin/env bash
# Measures what README.md says again, keeps it in tools/bench/results/, and writes it into README.md. For an idle machine:
# a suite a process, so that none has another's memory; some 13 minutes for the suites on two cores, and twelve for the
# subjects. What has ended is kept when it is stopped.
#
#   tools/measure.sh              all suites, then all subjects (report.html, with pictures, goes to out/report)
#   tools/measure.sh suites       `loam bench run` of every suite
#   tools/measure.sh subjects     `loam bench pareto --report out/report`; the plots are kept too
#   tools/measure.sh store light  these suites alone
set -uo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
loam=${LOAM:-$root/build/release/loam}
results=$root/tools/bench/results
report=${OUT:-$root/out}/report
failed=0

suites() {
  local suite
  for suite in "$@"; do
    local start=$SECONDS
    "$loam" bench run "$suite" --keep "$results" || failed=1
    echo "$suite took $((SECONDS - start)) s" >&2
  done
}

subjects() {
  local plot
  "$loam" bench pareto --report "$report" --plot "$report/plots" --keep "$results" >"$report.txt" || failed=1
  for plot in "$results"/plots/*.svg; do  # those that README.md shows
    cp "$report/plots/$(basename "$plot")" "$plot"
  done
}

mapfile -t all < <(cd "$root/tools/bench/suites" && printf '%s\n' *.cpp | sed 's/\.cpp$//')
mkdir -p "$report"
case ${1:-} in
  "") suites "${all[@]}" && subjects ;;
  suites) suites "${all[@]}" ;;
  subjects) subjects ;;
  *) suites "$@" ;;
esac
"$loam" bench document "$root/README.md" || failed=1
exit $failed
