#!/usr/bin/env bash
# Makes the picture gallery in tools/gallery/ again, with the program itself. Real files come from ../shared/data; a
# picture whose file is missing is skipped with a printed line. Six minutes on two cores (its parts summed, 2026-11-26)
# and the time of the ladder of light models; all but half a minute for the pictures of light.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
loam=${LOAM:-$root/build/release/loam}
gallery=$root/tools/gallery
data=$root/../shared/data
mkdir -p "$gallery"

size=960x540
picture() {  # picture NAME SCENE [ARGS]
  local name=$1 scene=$2
  shift 2
  if [[ $scene == /* && ! -e $scene ]]; then
    echo "skipped $name: $scene is not on this machine"
    return
  fi
  "$loam" render "$scene" -o "$gallery/$name.png" --size "$size" "$@" | head -n 1
}

for camera in oblique ground far cave; do
  picture "valley-$camera" valley --camera "$camera"
done
picture valley-oblique-raycast valley --camera oblique --backend raycast
picture cube cube
picture monu6 "$data/vox/monu6.vox"
picture test-transform "$data/vox/test-transform.vox"
picture church "$data/vox/scene_church1.vox"
picture andorra "$data/dem/N42E001.hgt"
picture smoke "$data/vdb/smoke.vdb"
picture shapes shapes
picture bunny "$data/mesh/stanford-bunny.obj"
picture lidar "$data/points/target.ply"
picture saint-helens "$data/dem/SainteHelens.dem"
size=480x270
picture cottage "$data/schem/green-cottage.schem"
picture mansion "$data/schem/mansion.litematic"
picture viking-house "$data/schem/viking-house1.schematic"
picture region "$data/mca/1.16/r.0.-1.mca"
picture luanti "$data/luanti/map2.sqlite"
picture robot "$data/qb/robo.qb"
size=960x540

# Scenes of light: so small, and with so many samples a pixel, that their noise is no more than grain.
reference() {  # reference SCENE SIZE SAMPLES
  size=$2 picture "$1" "$1" --backend reference --spp "$3"
}
reference cornell 360x360 256
reference nightclub 480x270 128
reference furnace 240x135 64
reference fog_volumes 480x270 320
reference gobo 480x270 256
size=480x270 picture caustics caustics --backend raycast --set light_transport=photons --spp 128

# Scenes of matter, after so many ticks.
simulated() {  # simulated NAME SCENE TICKS [ARGS]
  local folder
  folder=$(mktemp -d)
  "$loam" sim "$2" --ticks "$3" --save "$folder/world.loam" >"$folder/out" 2>&1 || cat "$folder/out"
  picture "$1" "$folder/world.loam" --backend raycast --set light_transport=whitted "${@:4}"
  rm -r "$folder"
}
size=480x320
simulated avalanche avalanche 60
simulated dam dam 60
simulated hourglass hourglass 600
simulated burning_house burning_house 1500
simulated burnt_house burning_house 4000
simulated lava_meets_sea lava_meets_sea 200
simulated standing collapse 0
simulated collapse collapse 2500
simulated rainstorm rainstorm 1000
size=960x540

# The ladder of light models: one cave, a picture a rung, with its time and its error against the path tracer below it.
light_ladder() {
  local folder rung names="" pictures="" facts="" text
  folder=$(mktemp -d)
  local reference=(render cave --backend reference --spp 1024 --size 320x180 --resume "$folder/film")
  "$loam" "${reference[@]}" -o "$folder/reference.exr" --json >"$folder/reference.json"
  "$loam" "${reference[@]}" -o "$gallery/cave-reference.png" | head -n 1
  for rung in none flood4 flood_rgb flux reference; do
    if [[ $rung == reference ]]; then
      text=$(sed -n 's/.*"ms":\([0-9]*\)\.[0-9]*,"nan_samples".*/\1 ms, 1024 samples a pixel/p' "$folder/reference.json")
    else
      local drawn=(render cave --backend raycast --set "light_model=$rung" --size 320x180)
      "$loam" "${drawn[@]}" -o "$gallery/cave-$rung.png" | head -n 1
      "$loam" "${drawn[@]}" -o "$folder/$rung.exr" --json >"$folder/$rung.json"
      text=$(sed -n 's/.*"light":{[^}]*"ms":\([0-9]*\.\?[0-9]\?\).*/\1 ms, /p' "$folder/$rung.json")
      text+=$("$loam" diff "$folder/$rung.exr" "$folder/reference.exr" --json | sed -n 's/.*"flip":\(0\.[0-9]\{4\}\).*/FLIP \1/p')
    fi
    names+="| $rung " pictures+="| ![$rung](cave-$rung.png) " facts+="| $text "
  done
  rm -r "$folder"
  {
    echo "# One cave under five models of light"
    echo
    echo "A lamp in the hall, coloured lamps behind a bend, a shaft to the sky. Below each picture: the time of all its"
    echo "light from nothing, and its mean FLIP against the path tracer. Made by tools/gallery.sh on $(nproc) cores."
    echo
    printf '%s|\n' "$names" "|---|---|---|---|---" "$pictures" "$facts"
  } >"$gallery/light.md"
}
light_ladder
