#!/usr/bin/env bash
# Makes the picture gallery in tools/gallery/ again, with the program itself. Real files come from ../shared/data; a
# picture whose file is missing is skipped with a printed line. Some minutes on two cores, most of them for the pictures
# of light.
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
reference fog_volumes 480x270 128
reference gobo 480x270 256
size=480x270 picture caustics caustics --backend raycast --set light_transport=photons --spp 64
