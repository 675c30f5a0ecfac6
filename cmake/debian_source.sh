#!/usr/bin/env bash
# debian_source.sh PACKAGE FOLDER
#
# Unpacks the sources of a package of Debian 12 into FOLDER, checked by Debian's signature. Nothing
# else on the machine changes.
set -euo pipefail

package=$1
folder=$2
work=$(mktemp --directory)
trap 'rm --recursive --force "$work"' EXIT
mkdir --parents "$work/lists/partial"
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" \
  >"$work/sources.list"
apt_get=(apt-get --quiet --quiet
  --option "Dir::Etc::SourceList=$work/sources.list" --option "Dir::Etc::SourceParts=-"
  --option "Dir::State::Lists=$work/lists" --option "Dir::Cache=$work"
  --option "APT::Sandbox::User=$(id --user --name)")
"${apt_get[@]}" update
cd "$work"
"${apt_get[@]}" source --download-only "$package"
rm --recursive --force "$folder"
mkdir --parents "$(dirname "$folder")"
dpkg-source --no-check --extract ./"$package"_*.dsc "$folder" >/dev/null
