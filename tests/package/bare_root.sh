#!/usr/bin/env bash
# bare_root.sh BUILD [ROOT]
#
# Makes the Debian packages from the build directory BUILD, installs them with apt into a bare
# Debian 12, compensates a print there with the program, then builds the library's example
# and compensates the print with that. ROOT is a folder that debootstrap has filled or, if it is
# missing, will fill; without it a temporary one is used. Needs root, debootstrap and Debian's
# archive (MIRROR, http://deb.debian.org/debian by default), and some minutes.
set -euo pipefail

build=$(realpath -- "${1:?which build directory?}")
mirror=${MIRROR:-http://deb.debian.org/debian}

scratch=$(mktemp -d)
trap 'rm -rf -- "$scratch"' EXIT
root=${2:-$scratch/root}

if [[ ! -e $root/etc/debian_version ]]; then
  debootstrap --variant=minbase bookworm "$root" "$mirror"
fi

(cd -- "$scratch" && cpack --config "$build/CPackConfig.cmake" -B "$scratch/packages" >/dev/null)
cp -- "$scratch"/packages/unflex_*.deb "$root/tmp/unflex.deb"
cp -- "$scratch"/packages/libunflex-dev_*.deb "$root/tmp/libunflex-dev.deb"
cp -- /etc/resolv.conf /etc/hosts "$root/etc/"

in_root=(chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8
         DEBIAN_FRONTEND=noninteractive)
"${in_root[@]}" apt-get --quiet update
install=("${in_root[@]}" apt-get --quiet --yes install --no-install-recommends)
"${install[@]}" /tmp/unflex.deb

"${in_root[@]}" dpkg --status unflex | grep --line-regexp 'Status: install ok installed'
"${in_root[@]}" unflex --version
examples=/usr/share/doc/unflex/examples
"${in_root[@]}" unflex compensate $examples/washer.gcode -o /tmp/out.gcode \
  --printer $examples/printer.toml
"${in_root[@]}" unflex verify /tmp/out.gcode --against $examples/washer.gcode \
  --printer $examples/printer.toml --quiet

# The program in the build directory must write equal bytes.
"$build/unflex" compensate "$root$examples/washer.gcode" -o "$scratch/out.gcode" \
  --printer "$root$examples/printer.toml" --quiet
cmp -- "$root/tmp/out.gcode" "$scratch/out.gcode"

"${install[@]}" /tmp/libunflex-dev.deb cmake g++ make
"${in_root[@]}" cmake -S $examples/library -B /tmp/example
"${in_root[@]}" cmake --build /tmp/example
"${in_root[@]}" /tmp/example/compensate_file $examples/washer.gcode /tmp/example.gcode \
  $examples/printer.toml
cmp -- "$root/tmp/example.gcode" "$scratch/out.gcode"
echo "unflex and its library install and run on a bare Debian $(cat "$root/etc/debian_version")"
