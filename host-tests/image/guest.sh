# Sourced by the tests beside it: a box in QEMU, and one line for each thing that holds.
# shellcheck shell=bash disable=SC2034

# Makes $work, with a copy of the image; ended by finish.
make_guest() { # IMAGE
  work=$(mktemp -d "${TMPDIR:-/var/tmp}/probebox-guest.XXXXXX")
  guest=''
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
  host-tests/image/boot "$work/disk.img" "$work/box" &
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
