#!/usr/bin/env bash
# release.sh FOLDER [PLATFORM]...
#
# Builds unflex for other platforms on Debian 12, compares the bytes that they write, and puts what is
# handed out into FOLDER: programs for Windows and Linux, packages for Debian and npm, the page. Without PLATFORM:
# windows, wasm, linux-static, linux-arm64 and linux-armhf, and Debian's package of this machine.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
if (($# == 0)); then
  echo "release.sh: name the folder for what is made" >&2
  exit 1
fi
mkdir --parents "$1"
out=$(realpath "$1")
shift
platforms=("$@")
if ((${#platforms[@]} == 0)); then
  platforms=(windows wasm linux-static linux-arm64 linux-armhf debian)
fi

"$root/cmake/install_packages.sh" --platforms
cd "$root"

cmake -G Ninja -S . -B build-native -DCMAKE_BUILD_TYPE=Release -DUNFLEX_TESTS=OFF >/dev/null
cmake --build build-native
version=$(build-native/unflex --version | cut --delimiter=' ' --fields=2)

others=()
for platform in "${platforms[@]}"; do
  if [[ $platform != debian ]]; then
    cmake --preset "$platform" >/dev/null
    cmake --build --preset "$platform"
    others+=("$platform")
  fi
done
if ((${#others[@]} > 0)); then
  tests/platforms/same_everywhere.sh build-native/unflex "$root" "${others[@]}"
fi

for platform in "${platforms[@]}"; do
  case $platform in
    debian)
      cpack --config build-native/CPackConfig.cmake -B build-native/packages
      cp build-native/packages/unflex_*.deb "$out"
      ;;
    windows)
      rm --force "$out/unflex-$version-windows-x64.zip"
      zip --quiet --junk-paths "$out/unflex-$version-windows-x64.zip" \
        build-windows/unflex.exe build-windows/package/copyright
      ;;
    wasm)
      cp build-wasm/unflex.html "$out/unflex.html"
      tar --create --gzip --file "$out/unflex-$version.tgz" --directory build-wasm \
        --transform 's,^npm,package,' npm
      ;;
    linux-*)
      name=${platform/linux-static/linux-x64}
      tar --create --gzip --file "$out/unflex-$version-$name.tar.gz" \
        --transform "s,.*/,unflex-$version/," "build-$platform/unflex" \
        "build-$platform/package/copyright"
      ;;
  esac
  if [[ $platform == linux-arm64 ]]; then
    cpack --config build-linux-arm64/CPackConfig.cmake -B build-linux-arm64/packages
    cp build-linux-arm64/packages/unflex_*.deb "$out"
  fi
done
(cd "$out" && sha256sum ./* >SHA256SUMS && ls -l)
