# Sourced by the tests beside it: a box in QEMU, and one line for each thing that holds.
# shellcheck shell=bash disable=SC2034

# Makes $work, with a copy of the image; ended by finish.
make_guest() { # IMAGE
  work=$(mktemp -d "${TMPDIR:-/var/tmp}/probebox-guest.XXXXXX")
  guest='' more=()
  trap finish EXIT
  trap 'exit 130' INT TERM
  cp --sparse=always "$1" "$work/disk.img"
}
finish() {
  stop_box
  [[ ${keep:-} ]] || rm -rf "$work"
}
stop_box() {
  [[ -z $guest ]] || kill "$guest" 2>/dev/null || true
  [[ -z $guest ]] || wait "$guest" 2>/dev/null || true
  guest=''
}
power_on() {
  host-tests/image/boot "$work/disk.img" "$work/box" "${more[@]}" &
  guest=$!
}
start_box() {
  power_on
  local begun=$SECONDS
  until box status >/dev/null 2>&1; do
    kill -0 "$guest" 2>/dev/null && ((SECONDS - begun < ${PATIENCE_S:-1500})) || return 1
    sleep 5
  done
  echo "      (a host was answered $((SECONDS - begun)) s after power-on)"
}

holds() { # WHAT COMMAND...
  if "${@:2}" >"$work/said" 2>&1; then
    echo "  ok  $1"
    grep '^      (' "$work/said" || true
  else
    echo "  NOT $1"
    cat "$work/said"
    echo "The console's end:"
    tail -n 40 "$work/box/console"
    exit 1
  fi
}
box() { build/bin/probebox -u "tcp:127.0.0.1:$(cat "$work/box/port")" "$@"; }
cable() { build/bin/probebox -u "serial:$(cat "$work/box/link"),baud=115200" "$@"; }

# Gives the copy a shell of root on its console, for `inside`: a box as it is made has none.
give_a_shell() {
  local efi=$work/disk.img@@1M
  mcopy -n -i "$efi" ::probebox/grub.cfg "$work/grub.cfg"
  sed -i '/^linux /s/$/ systemd.debug_shell=ttyS0/' "$work/grub.cfg"
  mcopy -o -i "$efi" "$work/grub.cfg" ::probebox/grub.cfg
}

# Runs a command in the guest, whose output comes to stand in $work/inside; its exit status is the command's.
inside() { # COMMAND [SECONDS]
  python3 - "$work/box/shell" "$1" "${2:-60}" <<'EOF' >"$work/inside"
import re, socket, sys, time
door = socket.socket(socket.AF_UNIX)
door.settimeout(1)
door.connect(sys.argv[1])

def answer(command, seconds):
    """What stands between two marks, which the echo of the command does not have, and the exit status."""
    mark = str(time.monotonic_ns())
    door.sendall(f'stty -echo; echo "<""{mark}>"; {{ {command}\n}} 2>&1; echo "<$?/""{mark}>"\n'.encode())
    heard, end = "", time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            heard += door.recv(65536).decode(errors="replace").replace("\r", "")
        except TimeoutError:
            continue
        if found := re.search(rf"<{mark}>\n(.*)<(\d+)/{mark}>", heard, re.S):
            return found
    sys.exit(f"the shell of the box did not answer '{command}' within {seconds} s")

# Nothing of the kernel between the lines.
answer("dmesg -n 1", 10)
found = answer(sys.argv[2], float(sys.argv[3]))
print(found[1], end="")
sys.exit(int(found[2]))
EOF
}
