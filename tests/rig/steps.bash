# shellcheck shell=bash disable=SC2154
# What the rig does and what must come of it. Sourced after words.bash and machine.bash.

deb_of_tree() { find build -maxdepth 1 -name 'firstlook_*.deb' | head -n 1; }

# disk_of KIND: its kernel, initrd and disk, in `parts`.
disk_of() {
  local deb
  deb=$(deb_of_tree)
  [ -n "$deb" ] || fail "no build/firstlook_*.deb: make deb"
  say "image $1 (parts that are there are taken as they are)"
  mapfile -t parts < <(tests/rig/guest-image "$1" "$deb")
  [ ${#parts[@]} = 3 ] || fail "no image $1; see above"
}

# image KIND NAME: the emulated computer with the disk of KIND.
image() {
  local parts
  disk_of "$1"
  machine "$2" "${parts[@]}"
}

job_from=0
state_is() { echo "grep -q '\"state\": \"$1\"' /run/firstlook/status.json"; }
status_of() { guest "cat /run/firstlook/status.json"; }

# Seconds from NAME, a property of firstlook.service or 0 for the kernel's start, to its being ready.
ready_seconds() {
  guest "systemctl show -p ActiveEnterTimestampMonotonic -p ExecMainStartTimestampMonotonic firstlook" |
    awk -F = '{ us[$1] = $2 } END {
      printf "Ready %.1f s after the kernel started, %.1f s after the service did (guest time, emulated)\n",
        us["ActiveEnterTimestampMonotonic"] / 1e6,
        (us["ActiveEnterTimestampMonotonic"] - us["ExecMainStartTimestampMonotonic"]) / 1e6 }'
}

# boot SECONDS: switches on and waits for Ready, so many seconds of the guest.
boot() {
  power_on
  greeted || fail "the guest's side of the line does not come up; the console is in $console"
  if ! await "$1" "$(state_is Ready)" >/dev/null; then
    guest_patience_s=100 guest "systemctl status firstlook rig-robot rig-panel rig-cameras --no-pager -n 5" >&2 || true
    fail "not Ready within $1 s of the guest; the console is in $console"
  fi
  say "$(ready_seconds)"
  guest "! systemctl is-failed firstlook >/dev/null" || fail "the service has failed"
}

expect_light() {
  if ! await 20 "grep -qw '$1' /run/rig/panel" >/dev/null; then
    fail "the panel should show $1; it shows: $(guest 'cat /run/rig/panel')"
  fi
  say "the panel's light is $1"
}

# stands SECONDS WHY
stands() {
  local moved
  if moved=$(guest "/usr/lib/rig/rig_await_motion $1"); then fail "the robot $moved, $2"; fi
  [ "$moved" = stood ] || fail "nobody could ask the robot where it stands: $moved"
  say "the robot stands, $2 ($1 s)"
}

play() { say "Play on the pendant: $(guest /usr/lib/rig/play | tail -n 1)"; }
press() { guest "echo press $1 >/run/rig/buttons; sleep 0.5; echo release $1 >/run/rig/buttons"; }

# Play, then the panel's start button: the robot must begin to move.
start_job() {
  local before moved
  job_from=$(guest "date +%s") # what the journal says from here on is of this job
  play
  await 30 "grep -q 'press the start button' /run/firstlook/status.json" >/dev/null ||
    fail "after Play firstlook should ask for the start button; it says: $(status_of)"
  before=$(guest "cut -d ' ' -f 1 /proc/uptime")
  press start
  moved=$(guest "/usr/lib/rig/rig_await_motion 60") || fail "the button was pressed and nothing moved: $(status_of)"
  say "the button's press became motion: $(echo "$before ${moved##* }" | awk '{ printf "%.1f", $2 - $1 }') s (guest time)"
}

# No calibration on the disk is half a one: what has a name is whole.
expect_whole_calibrations() {
  local list
  list=$(guest "/usr/lib/rig/calibrations") || fail "a calibration on the disk is not whole: $list"
  say "calibrations on the disk: ${list:-none}"
}

came_back() {
  expect_light green
  expect_whole_calibrations
  say "it says: $(guest "journalctl -b -u firstlook -o cat --no-pager | grep -E 'cut off|not taken up|ready:' | tail -n 2 | tr '\n' ' '")"
  stands 3 "nobody has pressed anything"
  play
  stands 8 "Play was pressed after the power cut, but no button"
}

short() {
  image "$1" "short-$1"
  say "power on, kernel $1"
  boot 90
  expect_light green
  stands 3 "nobody has pressed anything"
  start_job
  await 60 "journalctl -b -u firstlook -o cat --no-pager | grep -q 'calibration view 1'" >/dev/null ||
    fail "the job does not see its board: $(status_of)"
  say "the job sees its board: $(guest "journalctl -b -u firstlook -o cat --no-pager | grep 'looking for the board' | tail -n 1")"
  say "power cut: $(status_of | sed 's/.*"state": "\([^"]*\)".*/\1/')"
  power_cut
  boot 90
  came_back
  power_down
}

# The disk image for an industrial PC, from its own boot loader to Ready. Its configuration comes as a credential of the
# emulated firmware: the image itself is not touched.
boot_image() {
  local disk config
  disk=$(find build -maxdepth 1 -name "firstlook_*_$1.img" | head -n 1)
  [ -n "$disk" ] || fail "no build/firstlook_*_$1.img: make image KIND=$1"
  need_file /usr/share/OVMF/OVMF_CODE_4M.fd ovmf
  console=$logs/image-$1-console.log
  mkdir -p "$run"
  : >"$console"
  boot_line=1
  cp /usr/share/OVMF/OVMF_VARS_4M.fd "$run/firmware.fd"
  config=$(printf 'd /etc/firstlook 0755\nf /etc/firstlook/firstlook.yaml 0644 - - - cell: empty\\n\n' | base64 -w 0)
  say "power on, $disk from its own boot loader"
  qemu-system-x86_64 -machine q35 -accel tcg,thread=single -icount shift=0 -cpu max,la57=off -smp 1 -m "$memory_mib" \
    -nic none -no-reboot -display none -monitor none \
    -drive if=pflash,format=raw,readonly=on,file=/usr/share/OVMF/OVMF_CODE_4M.fd \
    -drive "if=pflash,format=raw,file=$run/firmware.fd" -drive "file=$disk,if=virtio,format=raw,snapshot=on" \
    -smbios "type=11,value=io.systemd.credential.binary:tmpfiles.extra=$config" \
    -chardev "file,id=console,path=$console" -serial chardev:console </dev/null >"$logs/emulator.log" 2>&1 &
  emulator=$!
  console_says 1800 'Ready' || fail "the image did not come to Ready; see $console"
  say "the image is in Ready: $(console_text | tr -d '\r' | grep -a 'Ready' | tail -n 1 | cut -c 1-120)"
  kill -9 "$emulator"
  wait "$emulator" 2>/dev/null || true
  emulator=0
}
