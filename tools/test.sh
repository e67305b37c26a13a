#!/usr/bin/env bash
# Sets the machine up, builds with warnings as errors, checks the layout of the code, runs all tests, and then runs
# them again in a build that looks for memory errors and undefined behaviour, as far as the time allows.
# The last line is "N passed, N failed"; the exit status is 0 where nothing failed.
set -u
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 3
last_start_s=1800  # no sanitizer stage starts after this
end_s=2340         # a sanitizer stage is stopped here; the release build and tests aren't, however slow the machine
hung_s=1800        # a release test program that runs longer has failed
side_by_side=2     # test programs: most of their time they use one core
counts=$(mktemp)   # "passed failed", a line a stage

count() {  # passed failed
  echo "$1 $2" >>"$counts"
}
finish() {
  awk '{ passed += $1; failed += $2 }
    END { printf "%d passed, %d failed\n", passed, failed; exit failed > 0 }' "$counts"
  local status=$?
  rm -f "$counts"
  exit $status
}
minutes_passed() { echo "$(( SECONDS / 60 )) minutes have passed"; }
seconds_left() { echo $(( SECONDS < end_s ? end_s - SECONDS : 1 )); }

# Runs one test program; its log is shown where it fails. May run in the background: all it says is said at its end.
run_tests() {  # label build-folder part [1: it is stopped at end_s, which is no failure]
  local log began=$SECONDS limit=$hung_s status=0 good bad skipped
  (( ! ${4:-0} )) || limit=$(seconds_left)
  log=$(mktemp)
  timeout -k 10 "$limit" "$2/loam_$3_tests" </dev/null >"$log" 2>&1 || status=$?
  good=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) test.*/\1/p' "$log" | tail -n 1)
  skipped=$(sed -n 's/^\[  SKIPPED \] \([0-9]*\) test.*/\1/p' "$log" | tail -n 1)
  bad=$(sed -n 's/^\[  FAILED  \] \([0-9]*\) test.*/\1/p' "$log" | tail -n 1)
  # Killed before its summary: what had failed by then counts.
  [[ -n $good$bad ]] || good=$(grep -c '^\[       OK \] ' "$log") bad=$(grep -c '^\[  FAILED  \] ' "$log")
  if [[ $status -ne 0 && ${bad:-0} -eq 0 ]]; then
    if (( ${4:-0} && (status == 124 || status == 137) && SECONDS >= end_s )) &&
        ! grep -q -e 'Sanitizer' -e 'runtime error:' "$log"; then
      # Only the time for all of this is over.
      count "$good" 0
      echo "$1: $good passed, then skipped: $(minutes_passed)"
      rm -f "$log"
      return
    fi
    bad=1  # it crashed or ran out of time
    (( status != 124 && status != 137 )) || echo "$1: stopped, $(minutes_passed)"
  fi
  count "${good:-0}" "${bad:-0}"
  echo "$1: ${good:-0} passed, ${bad:-0} failed, ${skipped:-0} skipped, $(( SECONDS - began )) s"
  grep '^skipped: ' "$log" | sort -u
  if [[ $status -ne 0 ]]; then
    grep -v -e '^\[ RUN  ' -e '^\[       OK' -e '^\[-----' "$log" | tail -n 200
    # The sanitizers' own words last: what they print after a stack is long, and logs are cut.
    grep -e '^\[ RUN  ' "$log" | tail -n 1
    grep -m 1 -A 30 -e 'ERROR: .*Sanitizer' -e 'runtime error:' "$log" | cut -c1-300
  fi
  rm -f "$log"
}

tools/setup.sh || { count 0 1; finish; }

unformatted=$(find world sim render tools tests \( -name '*.h' -o -name '*.cpp' \) -print0 2>/dev/null |
  xargs -0 clang-format-14 --dry-run --Werror 2>&1) || {
  echo "$unformatted" | grep 'error:' | sed 's/:.*//' | sort | uniq -c | sort -rn | head -n 20
  echo "format: run clang-format-14 -i on the files above"
  count 0 1
}

tools/build.sh release all -- -DLOAM_WERROR=ON -DLOAM_PRECOMPILE=ON || { count 0 1; finish; }
parts=$(ctest --test-dir build/release -N | sed -n 's/^ *Test *#[0-9]*: //p')
[[ -n $parts ]] || { echo "test: there are no tests"; count 0 1; }
# The longest first, so that the others run beside it.
for part in $(grep -x render <<<"$parts") $(grep -vx render <<<"$parts"); do
  while (( $(jobs -rp | wc -l) >= side_by_side )); do wait -n; done
  { report=$(run_tests "$part" build/release "$part"); echo "$report"; } &
done
wait

export ASAN_OPTIONS=detect_leaks=0  # drivers keep memory until the process ends
export UBSAN_OPTIONS=print_stacktrace=1
for part in $parts; do
  program=loam_${part}_tests
  if (( SECONDS > last_start_s )); then
    echo "skipped: $part with sanitizers: $(minutes_passed)"
    continue
  fi
  status=0
  timeout "$(seconds_left)" tools/build.sh sanitize "$program" -- -DCMAKE_BUILD_TYPE=Debug -DLOAM_SANITIZE=ON || status=$?
  if [[ $status -eq 124 ]]; then
    echo "skipped: $part with sanitizers: it was not built when $(minutes_passed)"
  elif [[ $status -ne 0 ]]; then
    count 0 1
  else
    run_tests "$part, with sanitizers" build/sanitize "$part" 1
  fi
done
finish
