# Sourced by tools/image, after packages.sh, debian.sh and apt_entries.sh, and by its hook: the root, the disk and the bundle of an
# image.
# shellcheck disable=SC2034
probebox_image_packages=(mmdebstrap device-tree-compiler squashfs-tools-ng squashfs-tools dosfstools mtools fdisk e2fsprogs fakeroot grub-common rauc cpio kmod zstd openssl)
# What signs a bundle with a key on a token (--key pkcs11:URI).
# shellcheck disable=SC2034
probebox_token_packages=(libengine-pkcs11-openssl)
# Sizes of partitions, MiB. A slot has room for a root that has grown; holes take no place in the file.
probebox_efi_mib=16 probebox_slot_mib=160 probebox_data_mib=256

# Lets this computer run the programs of another processor, which install themselves into the root.
make_runnable() { # ARCH
  [[ $1 != "$(dpkg --print-architecture)" ]] || return 0
  ensure_packages build/packages-foreign.log qemu-user-static binfmt-support arch-test
  arch-test "$1" >/dev/null && return
  [[ $EUID -eq 0 ]] || { echo "tools/image: programs of $1 do not run here: update-binfmts --enable, as root" >&2; return 1; }
  mountpoint -q /proc/sys/fs/binfmt_misc || mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
  update-binfmts --enable
  arch-test "$1" >/dev/null || { echo "tools/image: programs of $1 do not run here, with qemu-user-static neither" >&2; return 1; }
}

# The values of a name in board/NAME/image.conf, one a line; none where it has none.
board_setting() { # BOARD NAME
  sed -n "s/^$2 \+//p" "board/$1/image.conf"
}

# A key that signs bundles for boxes on the desk, and its certificate. Never part of an image but as its trust.
make_development_key() {
  [[ ! -f build/keys/development.key ]] || return 0
  echo "Making a key for development in build/keys. Boxes that are shipped need one of your own (docs/vendor.md)."
  (umask 077 && openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 3650 -subj "/CN=probebox development" \
    -keyout build/keys/development.key -out build/keys/development.crt 2>/dev/null)
}

# Writes WORK/root.squashfs, and WORK/boot-efi with the loader's modules.
make_root() { # WORK RELEASE ARCH BOARD VERSION CERT DEB...
  local work=$1 release=$2 arch=$3 board=$4 version=$5 cert=$6 kernel
  shift 6
  kernel=$(board_setting "$board" "kernel_$arch")
  [[ $kernel != *.deb ]] || kernel=$(realpath -e "$kernel")
  mkdir -p "$work"/{sources,debs,tree}
  release_sources "$release" "$work/sources"
  # Boards whose chip starts with firmware of its maker.
  [[ -z $(board_setting "$board" firmware) ]] || sed -i '/^deb /s/ main$/ main non-free-firmware/; s/^Components: main$/& non-free-firmware/' "$work"/sources/*
  cp "$@" "$work/debs/"
  cp -a board/image/tree/. "$work/tree/"
  mkdir -p "$work/tree/etc/rauc" "$work/tree/usr/share/probebox/board"
  sed "s/@COMPATIBLE@/probebox-$board-$arch/" board/image/system.conf.in >"$work/tree/etc/rauc/system.conf"
  cp "$cert" "$work/tree/etc/rauc/keyring.pem"
  descriptions_of "$board" "$work/tree/usr/share/probebox/board"
  find "$work/tree" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
  # mmdebstrap's own user has to read what the hooks copy.
  chmod -R a+rX "$work"
  run_quietly "$work/mmdebstrap.log" env WORK="$work" KERNEL="${kernel:-linux-image-$arch}" IMAGE_ARCH="$arch" VERSION="$version" \
    BOARD="$PWD/board/$board" BOARD_FIRMWARE="$(board_setting "$board" firmware)" BOARD_DTB="$(board_setting "$board" dtb)" \
    BOARD_MODULES="$(board_setting "$board" modules)" \
    BOARD_UNITS="$(board_setting "$board" units)" BOARD_LISTEN="$(board_setting "$board" listen)" \
    BOARD_TIME_SERVERS="$(board_setting "$board" time_server)" \
    mmdebstrap --mode=auto --variant=essential --architectures="$arch" --dpkgopt=force-unsafe-io \
    --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
    --dpkgopt='path-exclude=/usr/share/doc/*/*' --dpkgopt='path-include=/usr/share/doc/*/copyright' \
    --dpkgopt='path-include=/usr/share/doc/probeboxd/LICENSE' --dpkgopt='path-include=/usr/share/doc/probeboxd/NOTICE' \
    --dpkgopt='path-include=/usr/share/doc/probeboxd/probebox.spdx' --dpkgopt='path-exclude=/usr/share/info/*' \
    --include="$(image_packages "$work"/debs/*.deb | paste -sd,)" \
    --customize-hook="$PWD/tools/setup/image-hook" --customize-hook="copy-out /boot-efi $work" \
    --customize-hook='rm -r "$1/boot-efi"' "$release" "$work/root.tar" "$work"/sources/*
  # Slots are read by the loader too, which knows xz and no zstd.
  run_quietly "$work/squashfs.log" tar2sqfs -q -f -c xz -b 262144 -d "mtime=$SOURCE_DATE_EPOCH" "$work/root.squashfs" <"$work/root.tar"
}

# Lays a tree of files over a root. Whoever owns the tree, and whatever others may do with it there, it is root's alone to change
# in the root, and so are the folders that both have.
lay_tree() { # TREE ROOT
  tar -c -C "$1" --numeric-owner --owner=0 --group=0 --mode=u=rwX,go=rX -f - . | tar -x -C "$2" -p --numeric-owner -f -
}

# What is installed from Debian: what the image needs, and what the project's packages need.
image_packages() { # DEB...
  local deb
  grep -v '^#' board/image/packages
  for deb in "$@"; do dpkg-deb -f "$deb" Depends | tr ',' '\n' | sed 's/^ *//; s/[ |].*//'; done | sort -u
}

# The descriptions that a box of this board begins with: those of the board that it is based on, then its own.
descriptions_of() { # BOARD INTO
  local base
  base=$(board_setting "$1" base)
  [[ -z $base ]] || cp board/"$base"/*.toml "$2/"
  cp board/"$1"/*.toml "$2/"
}

# A loader as UEFI looks for it on a disk that no entry names.
make_loader() { # WORK ARCH BOARD
  local target file own
  case $2 in amd64) target=x86_64-efi file=BOOTX64.EFI ;; arm64) target=arm64-efi file=BOOTAA64.EFI ;; esac
  mkdir -p "$1/efi/EFI/BOOT" "$1/efi/probebox"
  # What the board's own firmware reads.
  [[ ! -d $1/boot-efi/firmware ]] || cp -r "$1/boot-efi/firmware/." "$1/efi/"
  for own in $(board_setting "$3" firmware_file); do cp "board/$3/$own" "$1/efi/"; done
  grub-mkimage -d "$1/boot-efi/$target" -O "$target" -p /probebox -o "$1/efi/EFI/BOOT/$file" \
    part_gpt fat squash4 xzio linux boot loadenv regexp normal echo test sleep reboot
  sed "s#@CMDLINE@#$(board_setting "$3" cmdline) $(board_setting "$3" "cmdline_$2")#" board/image/grub.cfg >"$1/efi/probebox/grub.cfg"
  grub-editenv "$1/efi/probebox/grubenv" create
  grub-editenv "$1/efi/probebox/grubenv" set "ORDER=A B" A_OK=1 B_OK=1 A_TRY=0 B_TRY=0
}

# GPT: efi, slot-a, slot-b, data. Both slots are filled.
make_disk() { # WORK ARCH BOARD IMAGE VERSION
  local work=$1 image=$4 mib=1 slot
  make_loader "$work" "$2" "$3"
  find "$work/efi" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
  truncate -s 0 "$work/efi.img" && truncate -s "${probebox_efi_mib}M" "$work/efi.img"
  mkfs.vfat --invariant -F 16 -n EFI "$work/efi.img" >/dev/null
  (cd "$work/efi" && find . -mindepth 1 -type d | sort | sed 's#^\./#::#' | xargs mmd -i "$work/efi.img" &&
    find . -type f | sort | while read -r file; do mcopy -m -i "$work/efi.img" "$file" "::${file#./}"; done)
  mkdir -p "$work"/data/{descriptions,state,rauc}
  descriptions_of "$3" "$work/data/descriptions"
  # A version that its maker has tested is not given up on the first day because a description is wrong.
  echo "$5" >"$work/data/rauc/confirmed"
  chmod -R a+rX "$work/data"
  find "$work/data" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
  truncate -s "${probebox_data_mib}M" "$work/data.img"
  E2FSPROGS_FAKE_TIME=$SOURCE_DATE_EPOCH fakeroot mke2fs -q -t ext4 -L data -U 8a5e9a0e-6d1c-4a77-9d8e-6f1a3c2b0d04 \
    -E hash_seed=8a5e9a0e-6d1c-4a77-9d8e-6f1a3c2b0d05,root_owner=0:0 -d "$work/data" "$work/data.img"
  # mke2fs also takes over when a file was changed on this computer, which no program can set there.
  (cd "$work/data" && find . -mindepth 1 | sed "s#^\.\(.*\)#set_inode_field \1 ctime @$SOURCE_DATE_EPOCH#") >"$work/times"
  E2FSPROGS_FAKE_TIME=$SOURCE_DATE_EPOCH debugfs -w -f "$work/times" "$work/data.img" >/dev/null 2>&1
  [[ $(stat -c %s "$work/root.squashfs") -le $((probebox_slot_mib << 20)) ]] || {
    echo "The root does not fit into a slot of $probebox_slot_mib MiB." >&2
    return 1
  }
  rm -f "$image"
  truncate -s $((probebox_efi_mib + 2 * probebox_slot_mib + probebox_data_mib + 2))M "$image"
  sfdisk -q "$image" <<TABLE
label: gpt
label-id: 5C0B6D52-8F53-4D2C-9B0A-0F6A6C1E0001
start=1MiB, size=${probebox_efi_mib}MiB, type=U, name=efi, uuid=5C0B6D52-8F53-4D2C-9B0A-0F6A6C1E0002
size=${probebox_slot_mib}MiB, type=L, name=slot-a, uuid=5C0B6D52-8F53-4D2C-9B0A-0F6A6C1E0003
size=${probebox_slot_mib}MiB, type=L, name=slot-b, uuid=5C0B6D52-8F53-4D2C-9B0A-0F6A6C1E0004
size=${probebox_data_mib}MiB, type=L, name=data, uuid=5C0B6D52-8F53-4D2C-9B0A-0F6A6C1E0005
TABLE
  # A second table of one entry, FAT of LBA, for firmware that knows no GPT.
  [[ -z $(board_setting "$3" hybrid_mbr) ]] ||
    printf '%b' '\x00\xfe\xff\xff\x0c\xfe\xff\xff\x00\x08\x00\x00' "$(printf '\\x%02x' 0 $((probebox_efi_mib * 8)) 0 0)" |
    dd of="$image" bs=1 seek=462 conv=notrunc status=none
  place() { dd if="$1" of="$image" bs=1M seek="$2" conv=notrunc,sparse status=none; }
  place "$work/efi.img" "$mib"
  mib=$((mib + probebox_efi_mib))
  for slot in a b; do
    place "$work/root.squashfs" "$mib"
    mib=$((mib + probebox_slot_mib))
  done
  place "$work/data.img" "$mib"
}

make_bundle() { # WORK COMPATIBLE VERSION KEY CERT BUNDLE
  mkdir -p "$1/bundle"
  ln -f "$1/root.squashfs" "$1/bundle/root.squashfs"
  printf '%s\n' '[update]' "compatible=$2" "version=$3" '' '[bundle]' 'format=verity' '' '[image.rootfs]' 'filename=root.squashfs' \
    >"$1/bundle/manifest.raucm"
  rm -f "$6"
  run_quietly "$1/bundle.log" rauc --cert="$5" --key="$4" bundle "$1/bundle" "$6"
}
