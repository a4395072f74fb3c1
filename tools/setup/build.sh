# Sourced by tools/demo and tools/test, after packages.sh: quiet configure and build, loud when they fail.

# run_quietly LOG COMMAND...: the output goes to LOG; its end is shown when the command fails.
run_quietly() {
  local log=$1
  shift
  if ! "$@" >"$log" 2>&1; then
    tail -n 40 "$log" >&2
    echo "Failed: $* (the whole log is in $log)" >&2
    return 1
  fi
}

# build_preset PRESET [TARGET...]: configures when needed, then builds.
build_preset() {
  local preset=$1 dir log
  shift
  case $preset in release) dir=build ;; *) dir=build-$preset ;; esac
  mkdir -p "$dir"
  log=$dir/setup.log
  [[ -f $dir/build.ninja ]] || run_quietly "$log" cmake --preset "$preset" || return 1
  local todo
  todo=$(ninja -C "$dir" -n ${@:+"$@"} 2>/dev/null | grep -c '^\[' || true)
  if [[ $todo -gt 3 ]]; then echo "Building $preset: $todo steps ..."; fi
  run_quietly "$log" cmake --build "$dir" ${@:+--target "$@"}
}
