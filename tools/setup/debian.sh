# Sourced by tools/package and tools/image, after packages.sh: builds the Debian packages of the tree.

# Needed beside what every build needs.
# shellcheck disable=SC2034
probebox_deb_packages=(debhelper dpkg-dev fakeroot)

own_release() {
  # shellcheck disable=SC1091
  (. /etc/os-release && echo "${VERSION_CODENAME:-}")
}

# Prints the version of the packages: that of CMakeLists.txt where the commit has its tag, else one that sorts before it
# and after all earlier commits. The release of Debian is part of it, because libraries have other names in the next.
package_version() { # RELEASE
  local version debian
  version=$(sed -nE 's/^project\(probebox VERSION ([0-9.]+).*/\1/p' CMakeLists.txt)
  case $1 in bookworm) debian=deb12 ;; trixie) debian=deb13 ;; esac
  if [[ $(git describe --exact-match --tags 2>/dev/null) != "v$version" ]]; then
    version+="~dev.$(git rev-list --count HEAD).g$(git rev-parse --short=8 HEAD)"
  fi
  [[ -z $(git status --porcelain) ]] || version+=.changed
  echo "$version~$debian"
}

# Copies the tree, without what git ignores, and writes debian/changelog; its date, the commit's, is that of all files. Objects of
# the copy before stay.
copy_source() { # VERSION INTO
  local date old=$2/source fresh=$2/source.new
  date=$(git log -1 --format=%cD)
  rm -rf "$fresh"
  mkdir -p "$old" "$fresh"
  git ls-files -z --cached --others --exclude-standard | tar -c --null -T - -f - --ignore-failed-read | tar -x -C "$fresh" -f -
  printf 'probebox (%s) unstable; urgency=medium\n\n  * Commit %s: see CHANGELOG.md.\n\n -- %s  %s\n' "$1" \
    "$(git rev-parse HEAD)" "$(sed -n 's/^Maintainer: //p' debian/control)" "$date" >"$fresh/debian/changelog"
  # ninja compares times, and a file may have been edited while the copy before was compiled: what differs is as new as now.
  { diff -rq --no-dereference -x 'build-deb-*' -x node_modules "$old" "$fresh" || true; } |
    sed -n 's/^Files .* and \(.*\) differ$/\1/p' | xargs -r -d '\n' touch
  find "$old" -mindepth 1 -maxdepth 1 -name 'build-deb-*' -exec mv -t "$fresh" {} +
  rm -rf "$old"
  mv "$fresh" "$old"
}

# Puts npm's packages of the page into a copy of the tree.
copy_npm_packages() { # INTO
  local web=tools/view/web
  fetch_npm_packages || return 1
  rm -rf "$1/source/$web/node_modules"
  cp -a "$web/node_modules" "$1/source/$web/"
}

# Builds the packages of a copy of the tree; they come to lie beside it. Objects are kept, so that the next time is short.
build_packages() { # SOURCE ARCH
  local options=(-b -us -uc -nc -a "$2")
  # Headers of "all" satisfy a foreign architecture too, which dpkg does not know.
  [[ $2 == "$(dpkg --print-architecture)" ]] || options+=(-d)
  (cd "$1" && rm -rf debian/{probebox,probeboxd,probebox-fleet,.debhelper,files,*.substvars,*.debhelper.log,debhelper-build-stamp} &&
    DEB_BUILD_OPTIONS="nocheck parallel=$(nproc)" dpkg-buildpackage "${options[@]}")
}

# Makes the folder of a release in which packages of ARCH are built, once; with "tests" also what the tests need.
make_build_root() { # ROOT RELEASE ARCH [tests]
  local native packages=() package sources=$1.sources backports=''
  [[ $2 != bookworm ]] || backports=/bookworm-backports  # whose own libgpiod is too old
  native=$(dpkg --print-architecture)
  packages=(debhelper dpkg-dev fakeroot cmake ninja-build pkg-config libeigen3-dev libcli11-dev nlohmann-json3-dev ccache)
  if [[ $3 == "$native" ]]; then packages+=(g++); else packages+=("crossbuild-essential-$3" "pkgconf:$3" qemu-user-static); fi
  for package in "${probebox_packages[@]}"; do
    case $package in
      libeigen3-dev | libcli11-dev) ;;
      libgtest-dev | libgmock-dev | libbenchmark-dev | librapidcheck-dev | libumockdev-dev | umockdev)
        [[ -z ${4:-} ]] || packages+=("$package:$3")
        ;;
      libgpiod-dev) packages+=("$package:$3$backports") ;;
      lib*-dev) packages+=("$package:$3") ;;
    esac
  done
  # Of the page, only what compiles it: npm's packages come with the tree.
  [[ ${4:-} ]] || packages+=(nodejs "libcpp-httplib-dev:$3" "libfcl-dev:$3" "libmosquitto-dev:$3")
  [[ ${packages[*]} != "$(cat "$1/made" 2>/dev/null)" ]] || return 0
  [[ $EUID -eq 0 ]] || { echo "A root for $2 can only be made by root: run this as root." >&2; return 1; }
  . "$probebox_setup/apt_entries.sh"
  rm -rf --one-file-system "$1"
  mkdir -p "$1" "$sources"
  release_sources "$2" "$sources"
  mmdebstrap --quiet --mode=root --variant=minbase --architectures="$native${3/#/,}" --dpkgopt=force-unsafe-io \
    --aptopt='APT::Default-Release "'"$2"'"' --include="$(IFS=, && echo "${packages[*]}")" "$2" "$1" "$sources"/*
  echo "${packages[*]}" >"$1/made"
}

# Writes this machine's entries of apt for another release, with its backports, which have libgpiod 2 for Debian 12.
release_sources() { # RELEASE INTO
  local entries
  entries=$(apt_entries "$(own_release)" "$1")
  printf '%s\n' "${entries%%--*}" >"$2/debian.list"
  printf '%s\n' "${entries#*--}" >"$2/debian.sources"
  if [[ $1 == bookworm ]]; then
    sed -nE "s/^(deb .*) bookworm main.*/\1 bookworm-backports main/p" "$2/debian.list" | head -n 1 >"$2/backports.list"
    awk -v RS= -v ORS='\n\n' '/Suites: *bookworm( |\n)/ && !found { sub(/Suites:[^\n]*/, "Suites: bookworm-backports"); print; found = 1 }' \
      "$2/debian.sources" >"$2/backports.sources"
  fi
  find "$2" -type f ! -exec grep -q '[^[:space:]]' {} \; -delete
}

# Runs a command in such a folder, with the project at its own place. A compiler launcher of the environment, such as ccache, is
# used there too.
in_build_root() { # ROOT COMMAND...
  # shellcheck disable=SC2016
  unshare --mount --pid --fork --mount-proc bash -c '
    set -e
    root=$1
    shift
    mkdir -p "$root/$PWD"
    mount --bind "$PWD" "$root/$PWD"
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    mount --rbind /sys "$root/sys"
    cache=${CCACHE_DIR:-}
    if [[ ${CCACHE_CONFIGPATH:-} ]]; then
      cache=$(sed -n "s/^cache_dir = //p" "$CCACHE_CONFIGPATH")
      cp "$CCACHE_CONFIGPATH" "$root/tmp/"
    fi
    [[ -z $cache ]] || { mkdir -p "$root/$cache" && mount --bind "$cache" "$root/$cache"; }
    exec chroot "$root" env LC_ALL=C.UTF-8 bash -c "cd \"\$0\" && exec \"\$@\"" "$PWD" "$@"
    ' in_build_root "$@"
}

build_packages_in_root() { # RELEASE ARCH
  local root=${XDG_CACHE_HOME:-$HOME/.cache}/probebox/package/$1-$2
  make_build_root "$root" "$1" "$2" || return 1
  # shellcheck disable=SC2016
  in_build_root "$root" bash -c 'set -e; . tools/setup/debian.sh; build_packages "$@"' package "build/package/$1/source" "$2"
}
