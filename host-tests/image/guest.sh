# Sourced by the tests beside it: a box in QEMU, and one line for each thing that holds.
# shellcheck shell=bash disable=SC2034

# Makes $work, with a copy of the image; ended by finish.
make_guest() { # IMAGE
  [[ -x build/bin/probebox ]] || { echo "build/bin/probebox is missing, which asks the box: build it first" >&2; exit 2; }
  work=$(mktemp -d "${TMPDIR:-/var/tmp}/probebox-guest.XXXXXX")
  guest='' drives=()
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
  wait_for_the_end
}
# QEMU is killed in the middle of whatever it does: what the box has not written is not written.
cut_power() {
  kill -KILL "$(cat "$work/box/pid")"
  wait_for_the_end
}
wait_for_the_end() {
  [[ -z $guest ]] || wait "$guest" 2>/dev/null || true
  guest=''
}
power_on() {
  rm -rf "$work"/box/{console,port,tunnel,pid,shell}
  host-tests/image/boot "$work/disk.img" "$work/box" "${drives[@]}" &
  guest=$!
}
# within SECONDS COMMAND...: until it succeeds, while the box is on.
within() {
  local begun=$SECONDS
  until "${@:2}"; do
    kill -0 "$guest" 2>/dev/null && ((SECONDS - begun < $1)) || return 1
    sleep 2
  done
  echo "      (after $((SECONDS - begun)) s)"
}
patience_s=${PATIENCE_S:-1500}
answers() { box status >/dev/null 2>&1; }
start_box() {
  power_on
  within "$patience_s" answers
}

holds() { # WHAT COMMAND...
  if "${@:2}" >"$work/said" 2>&1; then
    echo "  ok  $1"
    grep -a '^      (' "$work/said" || true
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
# A box that gets a fraction of a processor may accept later than the command waits.
is_solved() {
  cable propose host-tests/unit/report/cases/bore-fit --as-this-machine --by Ada || return 1
  cable accept 1 --by Ada || true
  within "$patience_s" in_force
}
in_force() { box results | sed -n '/^in force/,/^[a-z]/p' | grep 'bore-fit, accepted by Ada'; }

# The slots that were started since the power is on, such as AAAB.
starts() { tr -d '\r' <"$work/box/console" | sed -n 's/.*Kernel command line: .* rauc\.slot=\([AB]\) .*/\1/p' | tr -d '\n'; }
grubenv() { mcopy -n -i "$work/disk.img@@1M" ::probebox/grubenv -; }
counted() { # NAME=VALUE...: in grubenv
  local said
  said=$(grubenv) || return 1
  for value in "$@"; do grep -qx "$value" <<<"$said" || return 1; done
}

# Gives the copy a shell of root on its console, for `inside`: a box as it is made has none.
give_a_shell() {
  local efi=$work/disk.img@@1M
  mcopy -n -i "$efi" ::probebox/grub.cfg "$work/grub.cfg"
  sed -i '/^linux /s/\bconsole=\(tty[A-Z0-9]*\).*/& systemd.debug_shell=\1 systemd.show_status=no/' "$work/grub.cfg"
  mcopy -o -i "$efi" "$work/grub.cfg" ::probebox/grub.cfg
}
# Runs a command in the box, once it answers hosts, and prints what it prints; its exit status is the command's.
inside() { # COMMAND [SECONDS]
  python3 - "$work/box/shell" "$1" "${2:-300}" <<'PYTHON'
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
    sys.exit(f"the shell of the box did not answer '{command}' within {seconds} s; it said: {heard[-500:]}")

# Nothing of the kernel between the lines.
answer("dmesg -n 1", 300)
found = answer(sys.argv[2], float(sys.argv[3]))
print(found[1], end="")
sys.exit(int(found[2]))
PYTHON
}
