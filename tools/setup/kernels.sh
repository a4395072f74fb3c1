# Sourced by tools/kernel and host-tests/image/boards, after debian.sh and apt_entries.sh: packages of Debian for any processor, fetched
# and unpacked with lists of their own, without privileges. They are kept in ~/.cache/probebox/kernels.
kernels_cache=${XDG_CACHE_HOME:-$HOME/.cache}/probebox/kernels

# Prepares apt for a processor; its lists are brought up to date once a day. False when the mirror cannot be reached.
open_apt_of() { # ARCH
  local folder=$kernels_cache/$1
  mkdir -p "$folder"/{lists/partial,archives/partial,sources}
  if [[ -z $(find "$folder/updated" -mtime -1 2>/dev/null) ]]; then
    release_sources "$(own_release)" "$folder/sources"
    sed -i '/^deb /s/ main$/ main non-free-firmware/; s/^Components: main$/& non-free-firmware/; s/^Types: deb$/& deb-src/' "$folder"/sources/*
    sed -n 's/^deb /deb-src /p' "$folder"/sources/*.list >"$folder/sources.list" 2>/dev/null || true
    mv "$folder/sources.list" "$folder/sources/source.list"
  fi
  : >"$folder/status"
  printf '%s\n' "APT::Architecture \"$1\";" "#clear APT::Architectures;" "APT::Architectures \"$1\";" "Dir::State \"$folder\";" \
    "Dir::State::status \"$folder/status\";" "Dir::State::lists \"$folder/lists\";" "Dir::Cache \"$folder\";" \
    "Dir::Cache::archives \"$folder/archives\";" 'Dir::Etc::sourcelist "/dev/null";' "Dir::Etc::sourceparts \"$folder/sources\";" \
    'APT::Sandbox::User "";' 'Acquire::Languages "none";' >"$folder/apt.conf"
  export APT_CONFIG=$folder/apt.conf
  [[ -z $(find "$folder/updated" -mtime -1 2>/dev/null) ]] || return 0
  apt-get -o APT::Update::Error-Mode=any update >"$folder/apt.log" 2>&1 || return 1
  touch "$folder/updated"
}

# Prints a package's folder, unpacked once for each version; behind a name for the newest kernel stands the one that it needs. A file of
# your own is unpacked each time.
unpacked() { # ARCH PACKAGE|FILE.deb
  local package=$2 newest version folder
  if [[ $package == *.deb ]]; then
    folder=$kernels_cache/$1/own/$(basename "$package" .deb)
    rm -rf "$folder"
    mkdir -p "$folder"
    dpkg-deb -x "$package" "$folder" && dpkg-deb -f "$package" >"$folder/control" && echo "$folder"
    return
  fi
  newest=$(apt-cache depends "$package" | sed -n 's/^ *Depends: \(linux-image-[0-9][^ ]*\)$/\1/p' | head -n 1)
  package=${newest:-$package}
  version=$(apt-cache show --no-all-versions "$package" | sed -n 's/^Version: //p' | head -n 1)
  folder=$kernels_cache/$1/${package}_$version
  if [[ ! -e $folder ]]; then
    rm -rf "$folder.part" "$kernels_cache/$1/${package}"_*
    mkdir -p "$folder.part"
    (cd "$folder.part" && apt-get download -qq "$package") >&2 || return 1
    dpkg-deb -x "$folder.part"/*.deb "$folder.part"
    dpkg-deb -f "$folder.part"/*.deb >"$folder.part/control"
    rm "$folder.part"/*.deb
    mv "$folder.part" "$folder"
  fi
  echo "$folder"
}
