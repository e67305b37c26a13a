#!/usr/bin/env bash
# session.sh LOAM FOLDER: drives `loam play` in a window that nobody sees, as a player would: walks, places, breaks,
# undoes, pours water, swaps the backend, resizes, takes pictures, saves and quits; then repeats the recording without a
# window. One line a claim; the exit status is 77 where it could not run, else the number of claims that failed.
set -u
loam=$1 out=$2 failed=0
for program in Xvfb xdotool; do
  command -v $program >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
done
claim() {  # name command...
  local name=$1; shift
  if "$@" >/dev/null 2>&1; then echo "ok: $name"; else echo "FAILED: $name: $(cat "$out/status.json" 2>/dev/null)"; failed=$((failed + 1)); fi
}

mkdir -p "$out/data" && cd "$out" || exit 77
printf 'seen_help = true\npicture_scale = 0.5\nvertical_sync = false\n' > data/play.toml
cat > meadow.toml <<'EOF'
what = "A meadow"
[world]
generator = "flat"
min = [-32, 0, -32]
size = [64, 40, 64]
[[camera]]
name = "ground"
position = [0.5, 17.62, 0.5]
yaw_deg = 0
pitch_deg = -30
EOF
Xvfb -displayfd 3 -screen 0 640x400x24 -nolisten tcp 3>display >/dev/null 2>&1 &
xvfb=$!
trap 'kill $xvfb $game 2>/dev/null' EXIT
for _ in $(seq 100); do [[ -s display ]] && break; sleep 0.1; done
[[ -s display ]] || { echo "skipped: Xvfb does not start here"; exit 77; }
export DISPLAY=:$(cat display) LOAM_DATA=$out/data LOAM_VALIDATION=1

"$loam" play meadow.toml --size 640x400 --record session.log --status status.json 2>play.err &
game=$!
get() { sed -n "s/.*\"$1\":\(\[[^]]*\]\|\"[^\"]*\"\|[^,}]*\).*/\1/p" status.json; }
is() { [[ $(get "$1") == "$2" ]]; }
until_true() { for _ in $(seq 400); do "$@" && return 0; kill -0 $game 2>/dev/null || return 1; sleep 0.1; done; return 1; }
until_is() { until_true is "$1" "$2"; }
drawn() { [[ $(get picture) -gt $1 ]]; }

claim "a window shows the world" until_true drawn 1
window=$(xdotool search --name '^Loam' | head -n 1)
xdotool windowfocus --sync "$window" mousemove --window "$window" 320 200
# Where the window had the keyboard at once, it has the mouse too; else the first click takes it, and breaks nothing.
is captured true || xdotool click 1
claim "the window has the mouse" until_is captured true
claim "  nothing was edited" is undo 0

z_of() { get at | tr -d '[]' | cut -d, -f3 | cut -d. -f1; }
before=$(get at)
xdotool keydown w; sleep 0.6; xdotool keyup w
moved() { [[ $(get at) != "$before" ]]; }
claim "W walks" until_true moved

sees() { [[ $(get target_block) == "\"$1\"" ]]; }
claim "the meadow is what the player looks at" until_true sees grass
xdotool key 2
claim "2 takes the second block" until_is in_hand '"cobblestone"'
xdotool click 3
claim "the right button places" until_is undo 1
claim "  the block that is in hand" until_true sees cobblestone
xdotool click 1
claim "the left button breaks" until_is undo 2
claim "  the block is gone" until_true sees grass
xdotool key ctrl+z
claim "Ctrl+Z brings it back" until_true sees cobblestone
xdotool key ctrl+z
claim "and takes it away" until_is undo 0
xdotool key ctrl+y
claim "Ctrl+Y places it again" until_is undo 1
xdotool key slash
claim "/ opens the console" until_is over 2
xdotool type --delay 3 "give oak_log"
xdotool key Return
claim "  what is typed there is done" until_is in_hand '"oak_log"'
claim "  and it closes" until_is over 0
xdotool key 2
xdotool key q
claim "Q pours water" until_is undo 2
xdotool key p
claim "P stops time" until_is paused true
tick=$(get tick)
xdotool key period
claim "one tick on" until_is tick $((tick + 1))
xdotool key comma
claim "one tick back" until_is tick "$tick"
xdotool key p
claim "time goes on" until_is paused false
claim "the water comes to rest" until_is settled true

pictures() { ls data/screenshots/*.png 2>/dev/null | wc -l; }
have_pictures() { [[ $(pictures) -ge $1 ]]; }
xdotool key F2
claim "F2 writes a picture" until_true have_pictures 1
xdotool key F6
claim "F6 swaps the backend" until_is backend '"raycast"'
xdotool key F2
claim "a picture by rays" until_true have_pictures 2
xdotool key F6
claim "and back" until_is backend '"raster"'
xdotool key F7
claim "F7 splits the view" until_is view 1
xdotool key F7 F8
claim "F8 shows the error" until_is view 2
xdotool key F8
for size in "300 500" "640 240" "33 21" "640 400"; do
  # shellcheck disable=SC2086
  xdotool windowsize "$window" $size
  claim "the picture follows the size $size" until_is width "${size% *}"
  number=$(get picture)
  claim "  and is drawn" until_true drawn "$number"
done
xdotool windowunmap "$window"; sleep 0.5; xdotool windowmap --sync "$window" windowfocus "$window"
number=$(get picture)
claim "a window that was put away is drawn again" until_true drawn "$number"
is over 0 || { xdotool key Escape; until_is over 0; }
xdotool key ctrl+s
saved() { [[ $(get message) == *saved* ]]; }
claim "Ctrl+S saves" until_true saved
claim "Vulkan's validation has nothing to say" is validation 0
[[ -s play.err ]] && { echo "FAILED: it said: $(head -n 3 play.err)"; failed=$((failed + 1)); }

kill -INT $game
for _ in $(seq 300); do kill -0 $game 2>/dev/null || break; sleep 0.1; done
wait $game
claim "it ends well" test $? -eq 0
claim "the world is in its file" "$loam" check data/worlds/meadow.loam
shots=(data/screenshots/*.png)
claim "both backends drew the same" "$loam" diff "${shots[0]}" "${shots[1]}" --max-flip 0.01
claim "the recording repeats to the same hashes" "$loam" replay session.log

ends_well() {
  kill -TERM $game
  for _ in $(seq 300); do kill -0 $game 2>/dev/null || break; sleep 0.1; done
  wait $game
}
# Without a word it goes on with the last world, also where the last time ended by force.
resumes() {
  rm -f status.json
  "$loam" play --size 640x400 --status status.json 2>play.err &
  game=$!
  claim "the last world goes on" until_true drawn 1
}
sed -i '/^last_world/d; /^recent/d' data/play.toml
"$loam" play data/worlds/meadow.loam --size 640x400 --status status.json 2>play.err &
game=$!
knows_it() { grep -q '^last_world.*meadow.loam' data/play.toml; }
claim "the last world is noted when it opens" until_true knows_it
kill -KILL $game
wait $game 2>/dev/null
resumes
claim "the end of a session ends it well" ends_well
claim "the world is in its file" "$loam" check data/worlds/meadow.loam

# A gamepad: through the help and the menu, then in the world.
gamepad=$(dirname "$loam")/libloam_gamepad.so
hold() { printf '%s\n' "$@" > pad; sleep 0.25; }
press() { hold "b $1 1"; hold; }
export LOAM_GAMEPAD=$out/pad
hold
sed -i '/^seen_help/d' data/play.toml
ASAN_OPTIONS=${ASAN_OPTIONS:-}:verify_asan_link_order=0 LD_PRELOAD=$gamepad resumes
claim "the help is shown" until_is over 5
press 1
claim "a gamepad's B closes it" until_is over 0
before=$(get at)
hold "a 1 -1"; sleep 0.4; hold
claim "its left stick walks" until_true moved
before=$(get pitch)
hold "a 3 -0.5"; sleep 0.3; hold
looked() { [[ $(get pitch) != "$before" ]]; }
claim "its right stick looks" until_true looked
hold "a 3 0.4"; until_true sees grass; hold
hold "a 5 1"; hold
claim "its right trigger breaks" until_is undo 1
hold "a 4 1"; hold
claim "its left trigger places" until_is undo 2
press 3
claim "Y opens all blocks" until_is over 1
press 1
claim "  and B closes them" until_is over 0
press 7
claim "start opens the menu" until_is over 3
press 11; press 0
goes_on() { ! is over 3; }
claim "  and A chooses in it" until_true goes_on
claim "  and it ends well" ends_well
unset LOAM_GAMEPAD
sed -i '/^seen_help/d' data/play.toml
sed -i '1i seen_help = true' data/play.toml

# A graphics device that goes away in the middle, and one that always does.
says_shown() { [[ $(get shown_by) == *"$1"* ]]; }
says() { [[ $(get message) == *"$1"* ]]; }
LOAM_LOSE_DEVICE=60 resumes
claim "a device that was lost is opened again" until_true says "opened again"
number=$(get picture)
claim "  and draws on" until_true drawn $((number + 2))
claim "  by the same backend" is backend '"raster"'
claim "Vulkan's validation has nothing to say" is validation 0
claim "  and ends well" ends_well
LOAM_LOSE_DEVICE=1 resumes
claim "where no device stays, rays draw" is backend '"raycast"'
claim "  and OpenGL shows it" until_true says_shown OpenGL
claim "  and ends well" ends_well
claim "the world is in its file" "$loam" check data/worlds/meadow.loam
exit $failed
