#!/usr/bin/env bash
# Builds with Clang's sanitizers and runs the tests that they are for.
#
#   scripts/sanitize.sh asan    addresses and undefined behaviour: all short tests, and each fuzz target for some seconds
#   scripts/sanitize.sh tsan    data races: the short tests of the parallel code
#   scripts/sanitize.sh         both
#   scripts/sanitize.sh fuzz    hostile bytes into the readers: 20 minutes or 10 million inputs for each fuzz target
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=$(nproc)

# Debian's oneTBB is not instrumented, so the thread sanitizer cannot see how it synchronises and
# reports races that are none. Builds Debian's source package with the sanitizer, once.
build_tsan_onetbb() {
  local tree=$PWD/build/tsan-onetbb
  [[ -e $tree/install/done ]] && return
  echo "Building oneTBB with the thread sanitizer"
  rm -rf "$tree"
  mkdir -p "$tree"/{source,sources.d,lists/partial}

  # The machine's own package sources, as sources of source packages, for this call alone.
  local entries
  for entries in /etc/apt/sources.list /etc/apt/sources.list.d/*.{list,sources}; do
    [[ -f $entries ]] || continue
    sed -E 's/^Types:.*/Types: deb-src/; s/^deb([[:space:]])/deb-src\1/' "$entries" \
      >"$tree/sources.d/$(basename "$entries")"
  done
  local apt=(apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$tree/sources.d"
    -o Dir::State::lists="$tree/lists" -o APT::Sandbox::User="$(id -un)")
  "${apt[@]}" update
  (cd "$tree/source" && "${apt[@]}" source onetbb >/dev/null)

  cmake -S "$tree"/source/onetbb-*/ -B "$tree/build" -G Ninja \
    -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_INSTALL_PREFIX="$tree/install" -DTBB_SANITIZE=thread -DTBB_TEST=OFF \
    -DTBBMALLOC_BUILD=OFF >"$tree/log" &&
    cmake --build "$tree/build" >>"$tree/log" &&
    cmake --install "$tree/build" >>"$tree/log" || { tail -n 40 "$tree/log" >&2; exit 1; }
  touch "$tree/install/done"
}

# The program's tests hold it to one line on stderr. The symbolizer that the thread sanitizer starts, also for
# races that scripts/tsan.supp passes over, writes there too, when it is asked about an address on the stack.
make_quiet_symbolizer() {
  printf '#!/bin/sh\nexec llvm-symbolizer-14 "$@" 2>/dev/null\n' >"$1"
  chmod +x "$1"
}

# run <preset> <targets> <label> <ctest option>...
run() {
  local preset=$1 targets=$2 label=$3
  shift 3
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  # shellcheck disable=SC2086  # a list
  cmake --build --preset "$preset" --target $targets
  ctest --preset "$preset" --parallel "$jobs" --label-regex "$label" "$@"
}

scripts/setup.sh checks
export UBSAN_OPTIONS=print_stacktrace=1
symbolizer=$PWD/build/tsan-onetbb/llvm-symbolizer  # this name is how the sanitizer knows its kind
export TSAN_OPTIONS="suppressions=$PWD/scripts/tsan.supp:external_symbolizer_path=$symbolizer"
opengl='/(View\.|Gl|Headless|All/SamePicture|.*OpenGl)'  # tests that draw with it
# Plots, packages and shells tell nothing about memory or threads of ours.
without="$opengl|^scripts/|/Manual\."
[[ $# -gt 0 ]] || set -- asan tsan
for sanitizer in "$@"; do
  case $sanitizer in
    asan)
      run asan all short --exclude-regex "$without"
      # The leak sanitizer now and then crashes over the threads that Mesa leaves running.
      ASAN_OPTIONS=detect_leaks=0 run asan all short --tests-regex "$opengl"
      ;;
    tsan)
      build_tsan_onetbb
      make_quiet_symbolizer "$symbolizer"
      # Nor does the thread sanitizer see how Mesa's threads synchronise: no test of OpenGL.
      run tsan "formats_tests stages_tests viewer_tests end_to_end_tests" short \
        --tests-regex '^(stages/|viewer/|end_to_end/|formats/(Remote|.*(PassingFailure|RefusedAnswer)))' \
        --exclude-regex "$without"
      ;;
    fuzz) run asan all fuzz ;;
    *) grep '^#   ' "scripts/$(basename "$0")" >&2; exit 2 ;;
  esac
done
