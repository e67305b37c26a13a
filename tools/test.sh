#!/usr/bin/env bash
# Sets the machine up, builds with warnings as errors, checks the layout of the code, runs all tests, and then runs
# them again in a build that looks for memory errors and undefined behaviour, as far as the time allows.
# The last line is "N passed, N failed"; the exit status is 0 where nothing failed.
set -u
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 3
last_start_s=1800  # no new stage starts after this
end_s=2280         # a sanitizer stage is stopped here
passed=0 failed=0

finish() {
  echo "$passed passed, $failed failed"
  exit $(( failed > 0 ))
}

# Runs one program of ctest's list; its log is shown where it fails.
run_tests() {  # label build-folder part limit_s [1: reaching the limit is no failure]
  local log began=$SECONDS status=0 good bad skipped
  log=$(mktemp)
  ctest --test-dir "$2" -R "^$3\$" -V --no-tests=error --timeout "$4" </dev/null 2>&1 | sed 's/^[0-9]*: //' >"$log"
  status=${PIPESTATUS[0]}
  good=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) test.*/\1/p' "$log" | tail -n 1)
  skipped=$(sed -n 's/^\[  SKIPPED \] \([0-9]*\) test.*/\1/p' "$log" | tail -n 1)
  bad=$(sed -n 's/^\[  FAILED  \] \([0-9]*\) test.*/\1/p' "$log" | tail -n 1)
  if [[ $status -ne 0 && -z $bad ]]; then
    if (( SECONDS - began >= $4 && ${5:-0} )) && ! grep -q -e 'Sanitizer' -e 'runtime error:' "$log"; then
      # Only the time for all of this is over.
      good=$(grep -c '^\[       OK \] ' "$log")
      passed=$(( passed + good ))
      echo "$1: $good passed, then skipped: $(( end_s / 60 )) minutes have passed"
      rm -f "$log"
      return
    fi
    bad=1  # it crashed or ran out of time
  fi
  passed=$(( passed + ${good:-0} )) failed=$(( failed + ${bad:-0} ))
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

tools/setup.sh || { failed=1; finish; }

unformatted=$(find world sim render tools tests \( -name '*.h' -o -name '*.cpp' \) -print0 2>/dev/null |
  xargs -0 clang-format-14 --dry-run --Werror 2>&1) || {
  echo "$unformatted" | grep 'error:' | sed 's/:.*//' | sort | uniq -c | sort -rn | head -n 20
  echo "format: run clang-format-14 -i on the files above"
  failed=$(( failed + 1 ))
}

tools/build.sh release all -- -DLOAM_WERROR=ON -DLOAM_PRECOMPILE=ON || { failed=$(( failed + 1 )); finish; }
parts=$(ctest --test-dir build/release -N | sed -n 's/^ *Test *#[0-9]*: //p')
[[ -n $parts ]] || { echo "test: there are no tests"; failed=1; }
for part in $parts; do run_tests "$part" build/release "$part" 600; done

export ASAN_OPTIONS=detect_leaks=0  # drivers keep memory until the process ends
export UBSAN_OPTIONS=print_stacktrace=1
for part in $parts; do
  program=loam_${part}_tests
  if (( SECONDS > last_start_s )); then
    echo "skipped: $part with sanitizers: $(( SECONDS / 60 )) minutes have passed"
    continue
  fi
  status=0
  timeout $(( end_s - SECONDS )) tools/build.sh sanitize "$program" -- -DCMAKE_BUILD_TYPE=Debug -DLOAM_SANITIZE=ON || status=$?
  if [[ $status -eq 124 ]]; then
    echo "skipped: $part with sanitizers: it was not built when $(( end_s / 60 )) minutes had passed"
  elif [[ $status -ne 0 ]]; then
    failed=$(( failed + 1 ))
  else
    run_tests "$part, with sanitizers" build/sanitize "$part" $(( end_s > SECONDS + 60 ? end_s - SECONDS : 60 )) 1
  fi
done
finish
