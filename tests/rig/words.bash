# shellcheck shell=bash disable=SC2034
# What the scripts of the rig share; sourced by them from the top of the tree. What they make is below build/rig.
export PATH=$PATH:/usr/sbin:/sbin
work=$PWD/build/rig
logs=$work/logs
mkdir -p "$work" "$logs"

began=$EPOCHREALTIME
since_began() { awk -v a="$began" -v b="$EPOCHREALTIME" 'BEGIN { printf "%6.1f s", b - a }'; }
say() { echo "[$(since_began)] $*"; }
fail() {
  echo "[$(since_began)] FAILED: $*" >&2
  exit 1
}

# need PROGRAM PACKAGE...: a program that the rig cannot do without.
need() {
  if ! command -v "$1" >/dev/null 2>&1; then
    echo "rig: $1 is missing; toolchain/install-dependencies rig installs it (package $2)" >&2
    exit 4
  fi
}

need_file() {
  if [ ! -f "$1" ]; then
    echo "rig: $1 is missing; toolchain/install-dependencies rig installs it (package $2)" >&2
    exit 4
  fi
}

# quietly NAME COMMAND...: what it says goes to logs/NAME.log; shown when it fails. In the background, for there alone
# errexit holds within COMMAND.
quietly() {
  local log=$logs/$1.log
  shift
  ("$@") >"$log" 2>&1 &
  if ! wait $!; then
    tail -n 20 "$log" >&2
    fail "$1 did not succeed; all that it said is in $log"
  fi
}

# A key of what something is made from: of the names and the contents of files, of words.
key_of() { { for item in "$@"; do if [ -f "$item" ]; then cat "$item"; else echo "$item"; fi; done; } | sha256sum | cut -c 1-12; }

# remove FOLDER...: trees that something may be mounted in are not followed.
remove() { rm -rf --one-file-system "$@"; }
