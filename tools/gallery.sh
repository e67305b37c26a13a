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

# One density twice: the faces of its voxels, and marching cubes.
surfaces() {
  local folder method file=$data/vdb/dragon.vdb
  if [[ ! -e $file ]]; then
    echo "skipped surfaces: $file is not on this machine"
    return
  fi
  folder=$(mktemp -d)
  for method in blocks marching_cubes; do
    "$loam" convert "$file" "$folder/$method.ply" --surface $method --iso 0.3 >/dev/null
  done
  local matter='density_kg_per_m3 = 1000
heat_capacity_j_per_kg_k = 1000
heat_conductivity_w_per_m_k = 1
hardness_mohs = 3'
  cat >"$folder/surfaces.toml" <<END
[world]
generator = "empty"
size = [64, 32, 64]
[sun]
direction = [0.45, 0.6, -0.66]
[block.ground]
albedo = [0.3, 0.33, 0.36]
$matter
[block.jade]
albedo = [0.3, 0.62, 0.42]
$matter
[[fill]]
min = [-200, -1, -60]
max = [200, -1, 200]
block = "ground"
[[mesh]]
file = "blocks.ply"
position = [3, 0, 0]
scale = 5
block = "jade"
[[mesh]]
file = "marching_cubes.ply"
position = [-32, 0, 0]
scale = 5
block = "jade"
smooth = true
[[camera]]
name = "both"
position = [11.5, 22, -45]
look_at = [11.5, 10.5, 25]
fov_deg = 24.5
END
  size=720x300 picture surfaces "$folder/surfaces.toml" --backend reference --spp 128
  rm -r "$folder"
}
surfaces

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

# One picture by both backends and where they differ, with a table of how much: at the usual settings, and with no coarser
# levels of what is far, which are the rasterizer's alone.
twins() {
  local folder=$gallery/twins table=$gallery/twins.md
  mkdir -p "$folder"
  {
    echo "# The same picture by the rasterizer and by rays"
    echo
    echo "Written by \`tools/gallery.sh\`. Differences are FLIP's map; the last columns are at \`lod_error_px=0\`, which leaves"
    echo "out coarser levels of what is far. What is left lies on edges between two colours."
    echo
    echo "| | rasterizer | rays | difference | FLIP, mean | within 1/255 | FLIP, no coarser levels | within 1/255 |"
    echo "|---|---|---|---|---|---|---|---|"
  } >"$table"
  twin "the valley at dawn" dawn valley --camera ground --set time_of_day=5.2 light_model=flood_rgb exposure=1
  twin "at noon" noon valley --camera oblique --set time_of_day=12 light_model=flood4
  twin "at nightfall" night valley --camera ground --set time_of_day=20 light_model=flood_rgb exposure=5 tone_map=filmic
  twin "a cave, lamps, coloured glass" grotto grotto
  twin "a glasshouse" glasshouse glasshouse
  twin "under water" underwater glasshouse --camera underwater
  twin "mist" mist mist
  twin "fog in a box, an ellipsoid, a half space, and by height" fog fog_volumes --set light_transport=direct
  twin "beams of the sun in a ruin" ruin ruin --camera nave --set fog_sun_rays=48
  twin "meshes: a bottle in red light" bottle nightclub --set light_transport=direct
  twin "meshes: two blocks under a square lamp" blocks cornell --set light_transport=direct light_samples=16
  twin "a level set, sphere.vdb, by triangles and by its field" sphere "$data/vdb/sphere.vdb" --set contours=field
  twin "rain" rain shower --ticks 240
  twin "clouds, their shadows, and a lake that mirrors them" clouds fair_weather --camera lake
  twin "snow" snow snowfall --camera pond --ticks 700
  twin "scene_church1.vox" church "$data/vox/scene_church1.vox" --position -10 20 22 --look-at 66 4 -60 --fov 42 \
    --set time_of_day=16 light_model=flood4 exposure=0.5
  twin "a region of Minecraft's, .mca" region "$data/mca/1.16/r.0.-1.mca" --position 300 108 -20 --look-at 380 85 -110 \
    --fov 60 --set time_of_day=9 light_model=flood4 exposure=0.5
}
twin() {  # twin WORDS NAME SCENE [ARGS]
  local words=$1 name=$2 scene=$3 folder=$gallery/twins scratch numbers="" lod
  shift 3
  if [[ $scene == /* && ! -e $scene ]]; then
    echo "skipped twins of $name: $scene is not on this machine"
    return
  fi
  scratch=$(mktemp -d)
  for lod in usual none; do
    local knobs=()
    [[ $lod == usual ]] || knobs=(--set lod_error_px=0)
    "$loam" render "$scene" --size 480x270 "$@" "${knobs[@]}" -o "$scratch/raster.png" | head -n 1
    "$loam" render "$scene" --size 480x270 "$@" "${knobs[@]}" --backend raycast -o "$scratch/raycast.png" | head -n 1
    "$loam" diff "$scratch/raster.png" "$scratch/raycast.png" --map "$scratch/map.png" >"$scratch/numbers"
    numbers+=" | $(awk '$1 == "flip" { printf "%.5f", $2 }' "$scratch/numbers")"
    numbers+=" | $(awk '$1 == "fraction_within_1" { printf "%.3f %%", 100 * $2 }' "$scratch/numbers")"
    if [[ $lod == usual ]]; then
      cp "$scratch/raster.png" "$folder/$name.png"
      cp "$scratch/raycast.png" "$folder/$name-rays.png"
      cp "$scratch/map.png" "$folder/$name-difference.png"
    fi
  done
  rm -r "$scratch"
  echo "| $words | ![]($(basename "$folder")/$name.png) | ![](twins/$name-rays.png) | ![](twins/$name-difference.png)$numbers |" \
    >>"$gallery/twins.md"
}
twins

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
