#!/usr/bin/env bash
# play.sh [LOAM]: makes play-panel.png and play-split.png beside it again: the window of `loam play` in the valley, driven
# by xdotool under Xvfb as a player would. A minute and a half on two cores, most of it what the panel measures.
set -euo pipefail
gallery=$(cd "$(dirname "$0")" && pwd)
loam=${1:-$gallery/../../build/release/loam}
loam=$(realpath "$loam")
work=$(mktemp -d)
trap 'kill $game $display 2>/dev/null; rm -r "$work"' EXIT
game='' display=''
export LOAM_DATA=$work
printf 'seen_help = true\npicture_scale = 0.5\nvertical_sync = false\n' >"$work/play.toml"
Xvfb -displayfd 3 -screen 0 1280x720x24 -nolisten tcp 3>"$work/display" >/dev/null 2>&1 &
display=$!
for _ in $(seq 100); do [[ -s $work/display ]] && break; sleep 0.1; done
DISPLAY=:$(cat "$work/display")
export DISPLAY
"$loam" play valley --no-save --size 1280x720 --status "$work/status.json" &
game=$!
until grep -q '"picture":[1-9]' "$work/status.json" 2>/dev/null; do sleep 0.2; done
window=$(xdotool search --name '^Loam' | head -n 1)
xdotool windowfocus --sync "$window" mousemove --window "$window" 640 360 click 1
taken() {  # taken NAME: what the window shows now
  rm -f "$work"/screenshots/*
  xdotool key ctrl+F2
  until ls "$work"/screenshots/*.png >/dev/null 2>&1; do sleep 0.2; done
  sleep 0.5
  mv "$work"/screenshots/*.png "$gallery/$1.png"
}
xdotool key F7
sleep 4
taken play-split
xdotool key F7 F9
sleep "${PANEL_S:-75}"
taken play-panel
kill -INT "$game"
wait "$game"
