# shellcheck shell=bash disable=SC2154
# The emulated computer: on, off, cut from its power; and a line to it. Sourced after words.bash.
#   machine NAME KERNEL INITRD DISK   what will be booted; its disk is an overlay, DISK stays as it is
#   greeted                                until the guest listens
#   power_on, power_cut, power_down        cut: the emulator is killed; what the guest had not flushed is lost
#   guest COMMAND                          runs it in the guest: prints what it said, returns its code
#   await SECONDS COMMAND                  until it succeeds in the guest, so many of its seconds
run=$work/run.$$
memory_mib=2048
cores=1
emulator=0

machine() {
  local name=$1
  vmlinuz=$2 initrd=$3
  rm -rf "$run"
  mkdir -p "$run"
  console=$logs/$name-console.log
  emulator_log=$logs/$name-emulator.log
  : >"$console"
  mkfifo "$run/line.in" "$run/line.out"
  qemu-img create -q -f qcow2 -F raw -b "$4" "$run/disk.qcow2"
}

# Where the console's log began at the last boot.
boot_line=1

power_on() {
  boot_line=$(($(wc -l <"$console") + 1))
  # Nobody reads what was said before: the line begins empty.
  qemu-system-x86_64 -accel tcg,thread=single -icount shift=0 -cpu max,la57=off -smp "$cores" -m "$memory_mib" -nic none -no-reboot -display none \
    -monitor none -kernel "$vmlinuz" -initrd "$initrd" \
    -append "root=/dev/vda console=ttyS0 quiet panic=-1 mitigations=off tsc=reliable ${append:-}" \
    -drive "file=$run/disk.qcow2,if=virtio,format=qcow2,cache=writeback" -device virtio-rng-pci \
    -object can-bus,id=cable -device kvaser_pci,canbus=cable -device kvaser_pci,canbus=cable \
    -chardev "file,id=console,path=$console,append=on" -serial chardev:console \
    -chardev "pipe,id=line,path=$run/line" -serial chardev:line </dev/null >"$emulator_log" 2>&1 &
  emulator=$!
  exec {to_guest}<>"$run/line.in" {from_guest}<>"$run/line.out"
}

# What is said before the guest listens is lost.
greeted() {
  local line
  while IFS= read -r -t 1500 -u "$from_guest" line; do
    if [[ $line == *"<listening>"* ]]; then return 0; fi
  done
  return 1
}

is_on() { [ "$emulator" != 0 ] && kill -0 "$emulator" 2>/dev/null; }

power_cut() {
  if is_on; then
    kill -9 "$emulator" 2>/dev/null || true
    wait "$emulator" 2>/dev/null || true
  fi
  emulator=0
  while IFS= read -r -t 0.2 -u "$from_guest" _; do :; done
  while IFS= read -r -t 0.2 -u "$to_guest" _; do :; done
  exec {to_guest}>&- {from_guest}>&-
}

power_down() {
  guest "systemctl poweroff" >/dev/null || true
  local left=60
  while is_on && [ $left -gt 0 ]; do
    sleep 1
    left=$((left - 1))
  done
  power_cut
}
trap 'if is_on; then kill -9 "$emulator"; fi; rm -rf "$run"' EXIT

guest() {
  local mine=${EPOCHREALTIME/./} line
  is_on || fail "the emulator has ended; see $emulator_log and $console"
  printf '%s %s\n' "$mine" "$1" >&"$to_guest"
  while IFS= read -r -t "${guest_patience_s:-1500}" -u "$from_guest" line; do
    line=${line%$'\r'}
    if [[ $line =~ ^\<([0-9]+)\ ([0-9]+)\>$ ]]; then
      if [ "${BASH_REMATCH[1]}" = "$mine" ]; then return "${BASH_REMATCH[2]}"; fi
    elif [ -n "$line" ]; then
      echo "$line"
    fi
  done
  return 99
}

# Seconds of the guest: the emulator may be slow, and what is waited for is not to be judged by that.
await() {
  guest "end=\$((\$(cut -d . -f 1 /proc/uptime) + $1)); until { $2; } 2>/dev/null; do [ \$(cut -d . -f 1 /proc/uptime) -lt \$end ] || exit 1; sleep 0.3; done"
}

# The console since the last boot.
console_text() { tail -n +"$boot_line" "$console"; }

# console_says SECONDS WORD [EVERY]: waits until the console says a word since the last boot; false after so many seconds.
console_says() {
  local end=$((SECONDS + $1))
  until console_text | grep -aq "$2"; do
    if [ $SECONDS -ge $end ] || ! is_on; then return 1; fi
    sleep "${3:-0.2}"
  done
}
