# Sourced by tools/demo and tools/test: installs what the build and the tests need, and says nothing when all is there.
# Debian 12 ships libgpiod 1; the 2.x that probebox needs is in its backports.

probebox_packages=(
  g++ cmake ninja-build pkg-config
  libeigen3-dev libgpiod-dev libusb-1.0-0-dev libaio-dev libmd-dev libmodbus-dev libsqlite3-dev libssl-dev libtomlplusplus-dev libcli11-dev nlohmann-json3-dev libsystemd-dev libncurses-dev
  libgtest-dev libgmock-dev libbenchmark-dev librapidcheck-dev libumockdev-dev umockdev
  mbpoll openssl python3)
# What judges fits in tests. Where it cannot be had, those tests are skipped.
probebox_judge_packages=(libceres-dev)
# What renders pages of `probebox report` in tests (system.pages). Some 400 MB, so tools/test does not install it; without it
# that test is skipped.
# shellcheck disable=SC2034
probebox_browser_packages=(chromium)
# What opens recordings in tests (system.readers). Without them the tests that need them are skipped.
# shellcheck disable=SC2034
probebox_reader_packages=(tshark python3-numpy python3-pyte)
# Peers that tools/bench measures beside. Without them those rows are missing.
# shellcheck disable=SC2034
probebox_bench_packages=(libzstd-dev liblz4-dev libflac-dev libceres-dev valgrind)
# A control without a machine (host-tests/cnc), 34 MB to fetch. Where it cannot be had, those tests are skipped.
# shellcheck disable=SC2034
probebox_cnc_packages=(linuxcnc-uspace util-linux)
# What looks at bundles as the updater of an image does, and at device trees. Without them those tests are skipped.
# shellcheck disable=SC2034
probebox_update_packages=(rauc device-tree-compiler squashfs-tools openssl faketime dbus-daemon dbus-bin)
# A PC and a board with an arm64 processor to boot images in (host-tests/image). tools/test --image installs it.
# shellcheck disable=SC2034
probebox_emulated_packages=(qemu-system-x86 ovmf qemu-system-arm qemu-efi-aarch64 mtools)
# What `probebox interference` measures distances with. Without it the command says what is missing.
# shellcheck disable=SC2034
probebox_distance_packages=(libfcl-dev)
# What `probebox view` needs (docs/view.md), some 200 MB, and npm's packages beside them. `tools/test --view` installs it; without it
# the command says what is missing.
# shellcheck disable=SC2034
probebox_view_packages=(libcpp-httplib-dev nodejs npm)
# What probebox-fleet publishes with. Without it the program has /metrics alone.
# shellcheck disable=SC2034
probebox_fleet_packages=(libmosquitto-dev)
# What tests it with the engines that shops have (host-tests/fleet). Without them those tests are skipped.
# shellcheck disable=SC2034
probebox_engine_packages=(mosquitto mosquitto-clients prometheus postgresql python3-paho-mqtt python3-prometheus-client python3-psycopg2 curl openssl)
# What builds the program of the front end (tools/front-end), some 100 MB: of the C++ library the headers alone.
# shellcheck disable=SC2034
probebox_front_end_packages=(gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-dev python3)
# What the tests on a real kernel need beyond that (host-tests/vm). Where these cannot be had, those tests are skipped.
probebox_vm_packages=(qemu-system-x86 busybox-static cpio kmod udev systemd xz-utils make gcc)

# Prints those of PACKAGE... that are missing or too old.
missing_packages() { # PACKAGE...
  local package
  for package in "$@"; do
    if [[ $package == libgpiod-dev ]] && command -v pkg-config >/dev/null; then
      pkg-config --atleast-version=2.1 libgpiod || echo "$package"
    elif [[ $package == npm ]] && command -v npm >/dev/null; then
      :  # of the maker's own package of node, with which Debian's cannot be installed
    elif ! dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed; then
      echo "$package"
    fi
  done
}

# Prints a backports entry made from the entry that this machine has for its own release, so that the mirror is the same.
backports_entry() {
  local release=$1 file
  for file in /etc/apt/sources.list.d/*.sources; do
    [[ -f $file ]] || continue
    awk -v RS= -v ORS='\n' -v release="$release" '
      $0 ~ "(^|\n)Suites:[^\n]* ?" release "( |\n|$)" && !found {
        gsub(/\n#[^\n]*/, ""); sub(/Suites:[^\n]*/, "Suites: " release "-backports"); sub(/Components:[^\n]*/, "Components: main")
        print; found = 1 }' "$file"
  done | awk -v RS= 'NR == 1 { print }'
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [[ -f $file ]] || continue
    sed -nE "s/^(deb( \[[^]]*\])? [^ ]+) $release main.*/\1 $release-backports main/p" "$file"
  done | head -n 1
}

# Adds Debian 12's backports to apt unless some entry already offers a new enough libgpiod.
enable_backports() {
  local release entry target
  release=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  [[ $release == bookworm ]] || return 0
  if apt-cache madison libgpiod-dev | grep -qE '\| *2\.'; then return 0; fi
  entry=$(backports_entry "$release")
  [[ -n $entry ]] || { echo "No entry for $release in /etc/apt/sources.list*: cannot derive its backports." >&2; return 1; }
  target=/etc/apt/sources.list.d/probebox-backports
  if [[ $entry == Types:* ]]; then target+=.sources; else target+=.list; fi
  printf '%s\n' "$entry" >"$target"
  apt_get update
}

# apt-get that waits while another program installs packages, for ten minutes at most; its lists it does not wait for itself.
apt_get() {
  local said tries=0
  until said=$(apt-get -o DPkg::Lock::Timeout=600 "$@" 2>&1); do
    printf '%s\n' "$said"
    [[ $said == *"Could not get lock"* || $said == *"Unable to lock"* ]] || return 1
    [[ $((++tries)) -lt 120 ]] || return 1
    sleep 5
  done
  printf '%s\n' "$said"
}

# Tests start these themselves. As services they would run on this computer for good.
probebox_service_packages=(mosquitto prometheus postgresql)

# As root. Everything it prints belongs into a log.
install_packages() {
  export DEBIAN_FRONTEND=noninteractive
  local services policy=/usr/sbin/policy-rc.d
  mapfile -t services < <(printf '%s\n' "$@" | grep -xF "$(printf '%s\n' "${probebox_service_packages[@]}")")
  if [[ ${#services[@]} -gt 0 && ! -e $policy ]]; then
    # shellcheck disable=SC2064
    trap "rm -f $policy" EXIT
    printf '#!/bin/sh\nexit 101\n' >"$policy"
    chmod 755 "$policy"
  fi
  apt_get update
  enable_backports
  local plain=() package
  for package in "$@"; do
    if [[ $package == libgpiod-dev ]] && apt-cache madison libgpiod-dev | grep -q 'bookworm-backports'; then
      apt_get install -y --no-install-recommends -t bookworm-backports libgpiod-dev
    else
      plain+=("$package")
    fi
  done
  [[ ${#plain[@]} -eq 0 ]] || apt_get install -y --no-install-recommends "${plain[@]}"
  [[ ${#services[@]} -eq 0 ]] || ! command -v systemctl >/dev/null || systemctl disable "${services[@]}"
}

# Fetches npm's packages of a folder, which is the page's, once for each lock file.
fetch_npm_packages() { # [FOLDER]
  local web=${1:-tools/view/web} lock
  lock=$(cksum <"$web/package-lock.json")
  [[ $lock != "$(cat "$web/node_modules/fetched-for" 2>/dev/null)" ]] || return 0
  echo "Fetching npm's packages (once) ..."
  timeout 180 npm ci --prefix "$web" --ignore-scripts --no-audit --no-fund --fetch-retries=1 >build/packages-npm.log 2>&1 || return 1
  echo "$lock" >"$web/node_modules/fetched-for"
}

ensure_packages() { # LOG [PACKAGE...]
  local missing log=$1
  shift
  [[ $# -gt 0 ]] || set -- "${probebox_packages[@]}"
  mapfile -t missing < <(missing_packages "$@")
  [[ ${#missing[@]} -gt 0 ]] || return 0
  local install=(bash -c 'set -e; . "$0"; install_packages "$@"' "$probebox_setup/packages.sh" "${missing[@]}")
  if [[ $EUID -ne 0 ]]; then
    if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
      install=(sudo -n "${install[@]}")
    else
      echo "These Debian packages are missing: ${missing[*]}" >&2
      echo "You may not install packages here. Ask somebody who may to run, once:" >&2
      echo "  sudo bash -c '. $probebox_setup/packages.sh && install_packages ${missing[*]}'" >&2
      return 1
    fi
  fi
  echo "Installing ${#missing[@]} Debian packages (once) ..."
  if ! "${install[@]}" >"$log" 2>&1; then
    tail -n 20 "$log" >&2
    echo "Installing packages failed; the whole log is in $log." >&2
    return 1
  fi
}
