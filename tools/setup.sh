#!/usr/bin/env bash
# Installs what building, running and testing need and this machine lacks. Debian 12; asks sudo where not root.
# Quick where nothing is missing: one look at dpkg's list.
set -eu

packages=(
  g++ cmake ninja-build ccache pkg-config git                            # to build
  libopenvdb-dev libboost-dev libboost-iostreams-dev libblosc-dev        # sparse trees, and what their headers need
  libtbb-dev libimath-dev zlib1g-dev
  libdeflate-dev                                                         # zlib and gzip streams, four times as fast
  libglm-dev libfmt-dev libhwy-dev libtomlplusplus-dev                   # vectors, text, SIMD, scene files
  libsqlite3-dev libzstd-dev libxxhash-dev                               # saves
  libembree-dev                                                          # rays that meet triangle meshes
  libosd-dev                                                             # subdivision surfaces
  libpng-dev libopenexr-dev                                              # pictures
  libvulkan-dev libvulkan-volk-dev glslang-tools spirv-tools mesa-vulkan-drivers  # Vulkan, with a software device
  libglfw3-dev libimgui-dev                                              # the window of play, and what is in it
  nlohmann-json3-dev libcli11-dev                                        # the command
  libgtest-dev libgmock-dev librapidcheck-dev clang-format-14            # tests
  libnanovdb-dev                                                         # .nvdb files, and a rival of benchmarks
  vulkan-validationlayers libopenvdb-tools sqlite3
  xvfb xauth xdotool libgl1-mesa-dri                                     # tests that open a window without a display
)

installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${packages[@]}" 2>/dev/null || true)
missing=()
for package in "${packages[@]}"; do
  [[ $'\n'$installed$'\n' == *$'\n'"installed $package"$'\n'* ]] || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

command -v apt-get >/dev/null || { echo "setup: no apt-get here; install by hand: ${missing[*]}" >&2; exit 3; }
as_root=()
if [[ $(id -u) -ne 0 ]]; then
  command -v sudo >/dev/null || { echo "setup: run as root: apt-get install ${missing[*]}" >&2; exit 3; }
  as_root=(sudo)
fi
echo "setup: installing ${#missing[@]} packages with apt-get${as_root:+ (by sudo)}: ${missing[*]}" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
quietly() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive "$@" </dev/null >"$log" 2>&1; }
# The package list of a fresh image is empty, and an old one names files that are gone: so update comes first.
if ! quietly apt-get -q update || ! quietly apt-get -qy install --no-install-recommends "${missing[@]}"; then
  tail -n 20 "$log" >&2
  echo "setup: apt-get failed; the lines above are its last" >&2
  exit 3
fi
