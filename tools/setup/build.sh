# Sourced by tools/demo, tools/test and host-tests/vm/build, after packages.sh: configures and builds; shows what failed.

# Rewrites one line of the terminal with how far ninja or ctest is by their LOG. Runs until it is ended.
show_progress() { # LOG
  local step
  while sleep 2; do
    step=$(grep -oE '^\[[0-9]+/[0-9]+\]|^ *[0-9]+/[0-9]+ Test ' "$1" 2>/dev/null | tail -n 1 | tr -dc '0-9/')
    [[ -z $step ]] || printf '\r  %s of %s ' "${step%/*}" "${step#*/}"
  done
}

# announce STEP: minutes and seconds since the start, so that a log tells what takes the time.
announce() {
  printf '[%2d:%02d] %s ...\n' $((SECONDS / 60)) $((SECONDS % 60)) "$1"
}

# with_progress LOG COMMAND...: the output goes to LOG; on a terminal one line shows how far COMMAND is.
with_progress() {
  local log=$1 progress='' status=0
  shift
  : >"$log"
  if [[ -t 1 ]]; then
    show_progress "$log" &
    progress=$!
  fi
  "$@" >"$log" 2>&1 || status=$?
  if [[ -n $progress ]]; then
    kill "$progress"
    wait "$progress" 2>/dev/null || true
    printf '\r                        \r'
  fi
  return "$status"
}

# run_quietly LOG COMMAND...: the output goes to LOG; its end is shown when the command fails.
run_quietly() {
  if ! with_progress "$@"; then
    tail -n 40 "$1" >&2
    echo "Failed: ${*:2} (the whole log is in $1)" >&2
    return 1
  fi
}

# Prints the packages, the compiler and the presets that a build folder depends on.
build_inputs() {
  dpkg-query -W -f '${db:Status-Status} ${Package} ${Version}\n' "${probebox_packages[@]}" "${probebox_judge_packages[@]}" \
    "${probebox_distance_packages[@]}" "${probebox_view_packages[@]}" "${probebox_fleet_packages[@]}" 2>/dev/null | sed -n 's/^installed //p' | sort
  "${CXX:-c++}" --version | head -n 1
  cmake --version | head -n 1
  echo "CMakePresets.json $(cksum <CMakePresets.json)"
  [[ ! -d tools/view/web/node_modules/esbuild ]] || echo "npm packages of the page"
}

# configure_once FOLDER INPUTS COMMAND...: runs COMMAND --fresh, which configures FOLDER, unless it has run for the same
# INPUTS. Fresh, because a cache remembers what was missing. What was built with packages that are gone or older is built
# again: ninja goes by the times of headers, and a new package's are older than the objects.
configure_once() {
  local folder=$1 inputs=$2 record=$1/configured-for stale=''
  shift 2
  mkdir -p "$folder"
  if [[ -f $folder/build.ninja ]]; then
    [[ $inputs != "$(cat "$record" 2>/dev/null)" ]] || return 0
    announce "Configuring $folder anew: packages, compiler or presets have changed"
    if [[ -f $record ]] && grep -qvxF -f <(printf '%s\n' "$inputs") "$record"; then stale=1; fi
  fi
  run_quietly "$folder/setup.log" "$@" --fresh || return 1
  [[ -z $stale ]] || run_quietly "$folder/setup.log" ninja -C "$folder" -t clean || return 1
  printf '%s\n' "$inputs" >"$record"
}

# Prints the folder that a preset builds in.
preset_folder() { # PRESET
  case $1 in release) echo build ;; *) echo "build-$1" ;; esac
}

# build_preset PRESET [TARGET...]: configures when needed, then builds.
build_preset() {
  local preset=$1 folder
  shift
  folder=$(preset_folder "$preset")
  configure_once "$folder" "$(build_inputs)" cmake --preset "$preset" || return 1
  # How many steps there are ninja cannot say beforehand: it has to look for new sources first.
  announce "Building $preset${*:+ ($*)}"
  run_quietly "$folder/setup.log" cmake --build "$folder" ${@:+--target "$@"}
}
