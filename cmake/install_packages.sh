#!/usr/bin/env bash
# install_packages.sh [--quick-tests] [--tests] [--platforms]
#
# Installs the packages that unflex is built from on Debian 12. --quick-tests adds those of the tests
# with the label `quick`; --tests those of all tests, of sanitizers, of fuzzing and of counting lines;
# --platforms those that build for other systems and run what they have built. Does nothing if all is
# installed; otherwise it needs root or sudo.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config
  # Ipopt links LAPACK and BLAS, which its package merely recommends.
  coinor-libipopt-dev libblas-dev liblapack-dev
  libcli11-dev libeigen3-dev libexpected-dev libfmt-dev libtomlplusplus-dev nlohmann-json3-dev
  libzstd-dev zlib1g-dev
)
quick_test_packages=(
  libgmock-dev libgtest-dev
  # Results of core/math are held against it.
  libmpfr-dev
  # Builds are cached, the format of sources is checked, scripts are tests.
  ccache clang-format python3
)
test_packages=(
  # The picture of modules is drawn.
  graphviz
  # Another compiler reads what changed, with sanitizers and without; lines that run are counted.
  # Debian's default clang, 14, does not understand the ranges of libstdc++ 12.
  clang-16 libclang-rt-16-dev llvm-16 gcovr
  # Tests look at HTML reports in a real browser.
  chromium
  # Tests make packages, format the manual page and let shells complete command lines.
  dpkg-dev file fish groff man-db mandoc zsh
  # Tests run the hook in a real slicer, read the examples for continuous integration as YAML, and
  # run Klipper's macros.
  prusa-slicer python3-jinja2 python3-yaml
)

platform_packages=(
  # WebAssembly, and what runs it.
  clang-22 lld-22 libc++-22-dev-wasm32 libc++abi-22-dev-wasm32 libclang-rt-22-dev-wasm32 wasi-libc
  binaryen nodejs python3 xz-utils
  # Windows.
  g++-mingw-w64-x86-64-posix wine wine64
  # Linux on other processors.
  g++-aarch64-linux-gnu g++-arm-linux-gnueabihf qemu-user
  # Libraries that are built along, and packages.
  dpkg-dev ca-certificates zip
  # Prints on many machines.
  slurm-wlm munge
)

for option in "$@"; do
  case $option in
    --quick-tests) packages+=("${quick_test_packages[@]}") ;;
    --tests) packages+=("${quick_test_packages[@]}" "${test_packages[@]}") ;;
    --platforms) packages+=("${platform_packages[@]}") ;;
    *)
      echo "install_packages.sh: unknown option $option" >&2
      exit 1
      ;;
  esac
done

if ! command -v dpkg-query >/dev/null; then
  echo "This is not Debian: unflex needs what Debian calls ${packages[*]}" >&2
  exit 0
fi

missing=()
for package in "${packages[@]}"; do
  if ! dpkg-query --show --showformat='${db:Status-Status}\n' "$package" 2>/dev/null |
      grep --quiet --line-regexp installed; then
    missing+=("$package")
  fi
done
if ((${#missing[@]} == 0)); then
  exit 0
fi

as_root=(env)
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "Packages are missing. As root: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo env)
fi
echo "Installing ${missing[*]}"
apt_get=("${as_root[@]}" DEBIAN_FRONTEND=noninteractive
         apt-get --quiet --yes --option DPkg::Lock::Timeout=120)
"${apt_get[@]}" update
"${apt_get[@]}" install --no-install-recommends "${missing[@]}"
