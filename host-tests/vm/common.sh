# Sourced by prepare, run and in-root: which kernels there are, where they are kept, and what this machine lacks.
# A target is a Debian release by its code name; without a name it is this machine's own.

vm_project=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
vm_cache=${PROBEBOX_VM_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/probebox/vm}
vm_skipped=77

vm_own_release() {
  # shellcheck disable=SC1091
  (. /etc/os-release && echo "${VERSION_CODENAME:-}")
}

# "Skipped: " begins the line that tools/test shows.
vm_skip() {
  echo "Skipped: no virtual machine here: $*"
  exit "$vm_skipped"
}

vm_sum() { cksum | cut -d' ' -f1; }

# What prepare made for this state of the project: names of links in the release's folder. Another work tree may need
# other ones.
vm_kernel_link() { echo "kernel-$(cat "$vm_project"/host-tests/vm/{gpio-sim,counter-sim,iio-sim}/* | vm_sum)"; }
vm_root_link() { echo "root-$({ vm_root_packages && echo 'accounts of base-passwd'; } | vm_sum)"; }

# Into a root of another release goes what the project needs there, a kernel module, and a guest.
vm_root_packages() {
  # shellcheck disable=SC1091
  (. "$vm_project/tools/setup/packages.sh" &&
    printf '%s\n' "?essential" "${probebox_packages[@]}" gcc make kmod procps linux-headers-amd64)
}

# The folder of a release's newest prepared kernel; nothing when there is none.
vm_kernel() { readlink -e "$vm_cache/$1/$(vm_kernel_link)" || true; }

# The folder that becomes the guest's root: this machine's own, or one made of another release's packages.
vm_root() {
  if [[ $1 == "$(vm_own_release)" ]]; then
    echo /
  else
    readlink -e "$vm_cache/$1/$(vm_root_link)" || true
  fi
}

# Ends the script when no guest can run here, and says why.
vm_need_tools() {
  local missing=() tool
  [[ $(uname -m) == x86_64 ]] || vm_skip "guests are x86-64, and this machine is $(uname -m)"
  command -v apt-get dpkg-deb >/dev/null || vm_skip "kernels are taken from Debian's packages, and this is no Debian"
  for tool in qemu-system-x86_64:qemu-system-x86 busybox:busybox-static cpio:cpio depmod:kmod xz:xz-utils; do
    PATH=$PATH:/usr/sbin:/sbin command -v "${tool%:*}" >/dev/null || missing+=("${tool#*:}")
  done
  [[ ${#missing[@]} -eq 0 ]] || vm_skip "missing packages: ${missing[*]}"
}
