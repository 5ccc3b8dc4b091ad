#!/bin/bash
# Compiles stereo matching for ARM (NEON), runs it in an emulator and compares its bits with those of this processor.
#   run.sh STEREO_BITS FOLDER    STEREO_BITS: the program of stereo_bits.cpp for this processor
# Exit code 77: the compiler, the emulator or a library is not installed (`./setup arm`).
set -euo pipefail
native=$1
mkdir -p "$2"
folder=$(cd "$2" && pwd)
cd "$(dirname "$0")/../.."
for tool in aarch64-linux-gnu-g++ qemu-aarch64; do
  command -v $tool >/dev/null || { echo "skipped: no $tool (./setup arm)"; exit 77; }
done
[ -e /usr/lib/aarch64-linux-gnu/libhwy.so.1 ] || { echo "skipped: no libraries for ARM (./setup arm)"; exit 77; }
# As spartan_flags in cmake/SpartanModule.cmake has them for ARM.
flags=(-std=c++20 -O2 -ffp-contract=off -march=armv8-a+crypto
  '-DHWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)' -DHWY_SHARED_DEFINE -DFMT_SHARED
  -Isrc -isystem /usr/include/eigen3)
reconstruction=src/spartan/reconstruction
sources=(tests/neon/stereo_bits.cpp $reconstruction/disparity_computer.cpp
  $reconstruction/internal/disparity_filters.cpp $reconstruction/internal/matching/*.cpp
  src/spartan/numerics/simd_target.cpp src/spartan/numerics/random.cpp src/spartan/core/*.cpp)
objects=()
for source in "${sources[@]}"; do
  case $source in *_test.cpp) continue ;; esac
  object=$folder/$(basename "$source" .cpp).o
  aarch64-linux-gnu-g++ "${flags[@]}" -c "$source" -o "$object" 2>"$folder/errors" || { cat "$folder/errors"; exit 1; }
  objects+=("$object")
done
aarch64-linux-gnu-g++ "${objects[@]}" -o "$folder/stereo_bits" -l:libfmt.so.9 -l:libspdlog.so.1.10 -l:libtbb.so.12 -l:libhwy.so.1 \
  -l:libyaml-cpp.so.0.7
"$native" >"$folder/here"
qemu-aarch64 -L / "$folder/stereo_bits" >"$folder/neon"
diff "$folder/here" "$folder/neon" && echo "the same bits: $(tr '\n' ' ' <"$folder/neon")"
