# Sourced by prepare, after tools/setup/apt_entries.sh: apt with lists and a cache of its own, so that any release of Debian
# can be looked at and fetched from without privileges and without touching this machine's. Needs $home, the release's folder.

vm_apt_options=()

# Prepares apt for a release, and brings its lists up to date once a day. False when the mirror cannot be reached.
vm_apt_open() { # OWN RELEASE
  local apt=$home/apt entries
  mkdir -p "$apt"/{lists/partial,archives/partial,sources}
  entries=$(apt_entries "$1" "$2")
  printf '%s\n' "${entries%%--*}" >"$apt/sources/vm.list"
  printf '%s\n' "${entries#*--}" >"$apt/sources/vm.sources"
  : >"$apt/status"
  vm_apt_options=(-o "Dir::State=$apt" -o "Dir::State::status=$apt/status" -o "Dir::State::lists=$apt/lists"
    -o "Dir::Cache=$apt" -o "Dir::Cache::archives=$apt/archives" -o Dir::Etc::sourcelist=/dev/null
    -o "Dir::Etc::sourceparts=$apt/sources" -o APT::Sandbox::User= -o APT::Install-Recommends=false
    -o Acquire::Languages=none)
  [[ -z $(find "$apt/updated" -mtime -1 2>/dev/null) ]] || return 0
  apt-get "${vm_apt_options[@]}" -o APT::Update::Error-Mode=any update >"$home/apt.log" 2>&1 || return 1
  touch "$apt/updated"
}

# A field of the newest version of a package.
vm_apt_field() { # PACKAGE FIELD
  apt-cache "${vm_apt_options[@]}" show --no-all-versions "$1" | sed -n "s/^$2: //p" | head -n 1
}

# The packages by which PACKAGE, a name for the newest of a kind, stands for a version: "linux-image-6.1.0-56-amd64".
vm_apt_newest() { # PACKAGE
  vm_apt_field "$1" Depends | grep -oE "^${1%-amd64}-[^ ,]+"
}

vm_apt_fetch() { # INTO PACKAGE...
  mkdir -p "$1"
  (cd "$1" && apt-get "${vm_apt_options[@]}" download "${@:2}")
}

# Fetches PACKAGE... with all that they need, and unpacks them. Their maintainer's scripts do not run.
vm_apt_unpack_all() { # INTO PACKAGE...
  local deb archives=$home/apt/archives
  apt-get "${vm_apt_options[@]}" install -y --download-only "${@:2}"
  # The folders that others link into come first.
  for deb in "$archives"/base-files_*.deb "$archives"/*.deb; do dpkg-deb -x "$deb" "$1"; done
  apt-get "${vm_apt_options[@]}" clean
}
