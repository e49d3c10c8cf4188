# shellcheck shell=bash disable=SC2154
# What goes wrong on a cart, done on purpose, and what must come of it. Sourced after steps.bash.

restarts() { guest "systemctl show -p NRestarts --value firstlook"; }
main_pid() { guest "systemctl show -p MainPID --value firstlook"; }

# again SECONDS: back in Ready as a fresh process, and it stands.
again() {
  await "$1" "$(state_is Ready) && systemctl is-active -q firstlook" >/dev/null || fail "not Ready again within $1 s: $(status_of)"
  say "Ready again: $(guest "journalctl -b -u firstlook -o cat --no-pager | grep -E ' E[0-9]+ |^firstlook: E|watchdog|Watchdog' | tail -n 1")"
}

# What a core does for firstlook in Ready. An emulated core is slower than the real one by a factor that a loop of the shell's
# tells; the share of a real core is estimated by it.
idle() {
  local us_guest us_host share
  us_guest=$(guest "/usr/lib/rig/loop-time")
  us_host=$(tests/rig/guest/usr/lib/rig/loop-time)
  share=$(guest "/usr/lib/rig/cpu-share firstlook 30")
  say "in Ready for 30 s: $share % of an emulated core, about $(awk -v s="$share" -v g="$us_guest" -v h="$us_host" \
    'BEGIN { printf "%.1f", s * h / g }') % of a real one (an emulated core is $(awk -v g="$us_guest" -v h="$us_host" \
    'BEGIN { printf "%.0f", g / h }') times slower here)"
}

# tells CODE: the service says that fault within seconds; then the arm has stopped.
tells() {
  await 15 "journalctl -b -u firstlook -o cat --no-pager --since=@$job_from | grep -q 'E$1 '" >/dev/null ||
    fail "firstlook should say E$1: $(guest 'journalctl -b -u firstlook -o cat --no-pager -n 8'); $(status_of)"
  guest "sleep 1" # the arm brakes
}

# A loop that hangs while the arm moves: the robot brakes by itself, systemd makes a new process, nothing moves.
hung_loop() {
  local pid before
  start_job
  before=$(restarts)
  pid=$(main_pid)
  say "the loop hangs (SIGSTOP to the process $pid while the arm moves)"
  guest "kill -STOP $pid"
  guest "sleep 2"
  stands 3 "its program heard nothing for 0.2 s"
  await 60 "[ \"\$(systemctl show -p NRestarts --value firstlook)\" -gt $before ]" >/dev/null ||
    fail "systemd did not start the service again: $(guest 'systemctl status firstlook --no-pager | head -n 5')"
  again 60
  [ "$(main_pid)" != "$pid" ] || fail "the process is still $pid"
  expect_light green
  stands 5 "the watchdog made a new process"
}

# names ROLE...: status.json has each of them among what is missing, within 3 s, and says what to do.
names() {
  local role
  for role in "$@"; do
    await 3 "grep -q '\"role\": \"$role\"[^}]*\"remedy\": \"[^\"]' /run/firstlook/status.json" >/dev/null ||
      fail "status.json should name the $role and a remedy: $(status_of)"
  done
  say "status.json: $(status_of | sed 's/.*"missing": //' | cut -c 1-200)"
}

names_nothing() {
  await "$1" "grep -q '\"missing\": \[\]' /run/firstlook/status.json" >/dev/null || fail "nothing should be missing: $(status_of)"
}

bus_down_in_ready() {
  say "the panel's bus goes down in Ready"
  guest "ip link set can0 down" || fail "can0 does not go down"
  names panel
  guest "ip link set can0 up" || fail "can0 does not come up"
  again 60
  names_nothing 10
  expect_light green
  stands 3 "the bus came back"
}

# Frozen, not ended: v4l2loopback takes no second feeder while its reader looks for it.
cameras_stop() { guest "systemctl kill -s STOP rig-cameras" || fail "the cameras cannot be stopped"; }
cameras_go_on() { guest "systemctl kill -s CONT rig-cameras" || fail "the cameras do not go on"; }

cameras_off_in_ready() {
  say "both cameras stop in Ready"
  cameras_stop
  await 10 "grep -q 'colour camera.*depth camera' /run/firstlook/status.json" >/dev/null ||
    fail "status.json should name both cameras within seconds: $(status_of)"
  names "colour camera" "depth camera"
  expect_light red
  play
  press start
  stands 3 "Play and start were pressed without cameras"
  cameras_go_on
  names_nothing 30
  expect_light green
  stands 3 "the cameras are back"
  guest "/usr/lib/rig/play stop" >/dev/null
}

# From the button to the report, with few views; then a fresh process is in Ready.
job_to_its_end() {
  local before from folder peak
  before=$(restarts)
  start_job
  from=$(guest "cut -d ' ' -f 1 /proc/uptime")
  guest "(group=/sys/fs/cgroup\$(systemctl show -p ControlGroup --value firstlook); while cat \$group/memory.peak; do sleep 1; done) >/run/rig/peaks 2>/dev/null </dev/null & disown"
  guest_patience_s=3000 await 1200 "[ \"\$(systemctl show -p NRestarts --value firstlook)\" -gt $before ]" >/dev/null ||
    fail "the job does not come to its end: $(status_of)"
  folder=$(guest "ls -dt /var/lib/firstlook/runs/*/ | grep -v /waiting/ | head -n 1")
  guest "grep -q '\"outcome\": \"done\"' $folder/result.json" ||
    fail "the job ended with: $(guest "grep -m 3 -E '\"(outcome|reason)\"' $folder/result.json; journalctl -b -u firstlook -o cat --no-pager -n 12")"
  peak=$(guest "sort -n /run/rig/peaks | tail -n 1")
  say "the job ended with its report after $(guest "cut -d ' ' -f 1 /proc/uptime" | awk -v from="$from" '{ printf "%.0f", $1 - from }') s: $(guest "journalctl -b -u firstlook -o cat --no-pager | grep '^done:' | tail -n 1" | cut -c 1-160)"
  say "memory of the service at most $((peak / 1048576)) MiB of the limit of 384"
  [ "$peak" -lt $((384 << 20)) ] || fail "more memory than the limit"
  guest "firstlook replay $folder/journal.flj" || fail "the job's journal does not replay"
  guest "[ ! -e $folder/checkpoint.yaml ]" || fail "a job that has ended left a checkpoint"
  again 60
  expect_light green
  stands 3 "the job has ended"
}

# The same rules as tests/conformance, for the drivers above the guest's kernel; the panel's module and the driver on two
# controllers of their own (kvaser_pci, SJA1000) and one cable.
real_drivers() {
  local out
  say "the conformance suite of the real drivers"
  guest "systemctl stop firstlook; modprobe kvaser_pci && modprobe vivid && sleep 1; for i in can1 can2; do ip link set \$i type can bitrate 125000 restart-ms 100 && ip link set \$i up || exit 1; done" ||
    fail "the emulated CAN controllers do not come up: $(guest 'ip -br link; dmesg | tail -n 5')"
  guest "/usr/lib/rig/rig_panel can2 /usr/lib/rig/firstlook_panel.eds 10 /run/rig/buttons2 /run/rig/panel2 >/dev/null 2>&1 </dev/null & echo \$! >/run/rig/panel2.pid; disown"
  out=$(guest "FIRSTLOOK_RIG_CAMERAS='/dev/video10 320 240 /dev/video20 640 480' FIRSTLOOK_RIG_PANEL='can1 /run/rig/panel2 /run/rig/buttons2' FIRSTLOOK_RIG_RECORDING=/run/rig/cell.oni timeout 200 /usr/lib/rig/rig_conformance") || fail "the real drivers: $out"
  say "the real drivers: $(echo "$out" | tail -n 1)"
  out=$(guest "sed 's|device: openni|device: /run/rig/cell.oni|; s|can_interface: can0|can_interface: can1|' /etc/firstlook/firstlook.yaml >/run/rig/other.yaml; firstlook check --config /run/rig/other.yaml 2>/dev/null" || true)
  echo "$out" >"$logs/check-recording.txt"
  echo "$out" | grep -q 'recording' || fail "check should take depth from the recording: $out"
  echo "$out" | grep -q 'can1 node 10.*ready\|ready.*can1 node 10' || fail "check should find the panel on can1: $out"
  say "check: depth from a recording, the panel on can1"
  guest "kill \$(cat /run/rig/panel2.pid); ip link set can1 down; ip link set can2 down; modprobe -r vivid; systemctl start firstlook --no-block" ||
    fail "the second panel or the virtual camera does not go away"
  again 90
}

# refused WHAT CHANGE TEXT REMEDY: with CHANGE, a script of sed, made to the configuration `check` names the device by
# TEXT and says REMEDY, and no job begins.
refused() {
  local what=$1 out
  guest "sed '$2' /etc/firstlook/firstlook.yaml >/run/rig/bad.yaml"
  out=$(guest "firstlook check --config /run/rig/bad.yaml 2>/dev/null; echo exit \$?")
  echo "$out" | grep -q "$3" || fail "check should name $what ($3): $out"
  echo "$out" | grep -q "to do: .*$4" || fail "check should say what to do about $what ($4): $out"
  echo "$out" | grep -q '^exit 4$' || fail "check should exit with 4: $out"
  out=$(guest "cd /run/rig && timeout 60 firstlook run --config bad.yaml --real-time --out bad-run 2>&1; echo exit \$?")
  echo "$out" | grep -q '^exit 4$' || fail "no job should begin with $what: $out"
  echo "$out" | grep -q "$3" || fail "the job should name $what ($3): $out"
  guest "rm -rf /run/rig/bad-run"
  say "$what: check and job say $(echo "$out" | grep -o "$3.*" | head -n 1 | cut -c 1-110)"
}

# Devices that answer and are not what the configuration says.
bad_devices() {
  local out
  say "devices that are there, and not as they must be"
  guest "systemctl stop firstlook rig-panel"
  guest "/usr/lib/rig/rig_panel can0 /usr/lib/rig/firstlook_panel.eds 11 /run/rig/buttons /run/rig/panel >/dev/null 2>&1 </dev/null & echo \$! >/run/rig/panel11.pid; disown"
  # A module that nobody has configured says its number when it is switched on.
  guest "(while sleep 1; do printf 'power off\npower on\n' >/run/rig/buttons; done) >/dev/null 2>&1 </dev/null & echo \$! >/run/rig/switch.pid; disown"
  refused "a panel with another number" '' 'node 10 does not answer; node 11 does' 'panel.node_id to 11'
  # The emulator's bus has no bit rates: what a controller says when nobody acknowledges, said for it.
  guest "kill \$(cat /run/rig/switch.pid /run/rig/panel11.pid); (while sleep 0.2; do cansend can0 20000004#0020000000000000; done) >/dev/null 2>&1 </dev/null & echo \$! >/run/rig/errors.pid; disown"
  refused "a bus with another bit rate" '' 'nobody on can0 acknowledges our frames' 'same bit rate'
  guest "kill \$(cat /run/rig/errors.pid); systemctl start rig-panel; touch /run/rig/depth-hangs"
  out=$(guest "firstlook check 2>/dev/null; echo exit \$?")
  echo "$out" | grep -q '^exit 4$' || fail "check should exit with 4: $out"
  guest "rm /run/rig/depth-hangs"
  echo "$out" | grep -q 'depth camera *unsuitable.*repeats one picture' || fail "check should name a depth camera that hangs: $out"
  say "a depth camera that hangs: $(echo "$out" | grep -o 'repeats one picture.*' | head -n 1)"
  guest "modprobe vivid && sleep 1" || fail "the kernel's virtual camera cannot be had"
  refused "a camera with pictures of another size" 's|/dev/video10|/dev/video20|' '320 x 180' 'camera.width'
  guest "modprobe -r vivid"
  guest "systemctl start firstlook --no-block"
  again 90
  expect_light green
}

bus_down_in_motion() {
  local from
  start_job
  say "the panel's bus goes down while the arm moves"
  from=$(guest "cut -d ' ' -f 1 /proc/uptime; ip link set can0 down") || fail "can0 does not go down"
  tells 5014
  stands 3 "nobody could hear the panel's stop button"
  # The new process gives the panel up after 6 s.
  await 30 "grep -q '\"role\": \"panel\"' /run/firstlook/status.json" >/dev/null || true
  names panel
  say "it named the panel at most $(guest "cut -d ' ' -f 1 /proc/uptime" | awk -v from="$from" '{ printf "%.0f", $1 - from }') s after the bus went down (guest time)"
  guest "ip link set can0 up" || fail "can0 does not come up"
  again 90
  expect_light green
  stands 3 "the bus came back"
}

bus_off() {
  say "the controller of the bus reports bus-off (an error frame)"
  guest "cansend can0 20000040#0000000000000000" || fail "no error frame can be sent"
  guest "sleep 2"
  again 60
  expect_light green
  stands 3 "after bus-off"
}

stop_button() {
  start_job
  say "the stop button while the arm moves"
  press stop
  tells 5005
  stands 3 "the stop button was pressed"
  again 90
}

cameras_gone() {
  start_job
  say "both cameras stop while the arm moves"
  cameras_stop
  tells 5003
  stands 3 "there are no pictures"
  cameras_go_on
  again 120
  expect_light green
}

# The faults that the kernel's own virtual camera knows, seen by `firstlook check`.
camera_faults() {
  local out lost
  guest "modprobe vivid && sleep 1 && v4l2-ctl -d /dev/video20 --set-ctrl=percentage_of_dropped_buffers=20" ||
    fail "the kernel's virtual camera cannot be had"
  out=$(guest "firstlook check --config /usr/lib/rig/vivid.yaml --json 2>/dev/null" || true)
  lost=$(echo "$out" | sed -n 's/.*"frames_lost": \([0-9.]*\).*/\1/p' | head -n 1)
  say "a camera that drops a fifth of its buffers: check counts ${lost:-no} lost frames"
  [ "${lost%%.*}" -gt 0 ] 2>/dev/null || fail "check should count lost frames: $out"
  guest "v4l2-ctl -d /dev/video20 --set-ctrl=percentage_of_dropped_buffers=0" || true
  guest "(sleep 3; v4l2-ctl -d /dev/video20 --set-ctrl=disconnect=1) >/dev/null 2>&1 & firstlook check --config /usr/lib/rig/vivid.yaml 2>/dev/null" >"$logs/check-disconnect.txt" || true
  say "a camera that is unplugged: $(grep '^colour camera' "$logs/check-disconnect.txt" | cut -c 1-140)"
  guest "modprobe -r vivid" || true
}

# Another program takes all the memory that there is: the kernel ends that one.
memory_pressure() {
  local pid
  pid=$(main_pid)
  say "another program takes all memory"
  guest "systemd-run -q --wait -p OOMScoreAdjust=500 -p MemoryMax=infinity -p MemorySwapMax=0 /bin/bash -c 'head -c 4G /dev/zero | tail' >/dev/null 2>&1; true"
  [ "$(main_pid)" = "$pid" ] || fail "firstlook was started again: it was $pid and is $(main_pid)"
  guest "$(state_is Ready)" || fail "not Ready any more: $(status_of)"
  say "firstlook is still the process $pid, in Ready"
}

memory_of_service() {
  guest 'group=/sys/fs/cgroup$(systemctl show -p ControlGroup --value firstlook); echo "$(($(cat $group/memory.peak) / 1048576)) MiB at most of $(($(cat $group/memory.max) / 1048576)), $(sed -n "s/^oom_kill //p" $group/memory.events) ended by the limit"'
}

full_disk() {
  say "the disk is full"
  guest "fallocate -l \$(df --output=avail -B1 /var/lib | tail -n 1) /var/lib/ballast; dd if=/dev/zero of=/var/lib/ballast2 bs=4k 2>/dev/null; df -h /var/lib | tail -n 1" || true
  guest "systemctl restart --no-block firstlook"
  guest "sleep 20"
  say "it says: $(guest "journalctl -b -u firstlook -o cat --no-pager -n 8 | grep -E 'E[0-9]{4}|ready|Ready' | tail -n 1")"
  stands 3 "the disk is full"
  guest "rm -f /var/lib/ballast /var/lib/ballast2; systemctl reset-failed firstlook; systemctl start firstlook --no-block"
  again 90
}

# The cart is switched on before the robot.
robot_late() {
  say "the robot is off for a minute, firstlook starts without it"
  guest "systemctl stop rig-robot; systemctl restart --no-block firstlook"
  await 60 "grep -q '\"role\": \"arm\"' /run/firstlook/status.json" >/dev/null || fail "status.json should name the arm: $(status_of)"
  names arm
  guest "sleep 30"
  guest "systemctl start rig-robot"
  again 90
}

break_things() {
  image "$1" "full-$1"
  say "power on, kernel $1"
  boot 90
  expect_light green
  idle
  job_to_its_end
  robot_late
  camera_faults
  real_drivers
  cameras_off_in_ready
  bus_down_in_ready
  bus_off
  bad_devices
  memory_pressure
  full_disk
  hung_loop
  bus_down_in_motion
  stop_button
  cameras_gone
  say "memory of the service: $(memory_of_service)"
  power_down
}

# Some of the parts above, NAME,NAME..., on a computer of their own.
part() {
  local names name
  IFS=, read -r -a names <<<"$1"
  for name in "${names[@]}"; do
    declare -F "$name" >/dev/null || fail "there is no part $name; tests/rig/breaking.bash has them"
  done
  image "$2" "part-$2"
  say "power on, kernel $2"
  boot 90
  expect_light green
  for name in "${names[@]}"; do "$name"; done
  power_down
}

# All of it on one kernel.
whole() {
  short "$1"
  break_things "$1"
}

# One of the emulated computers fills one core: with two cores both kernels go at once, each in a process of its own.
full() {
  local kind failed="" parts
  local -A pids
  for kind in std rt; do disk_of "$kind"; done
  if [ "$(toolchain/jobs)" -lt 2 ]; then
    whole std
    whole rt
    return
  fi
  for kind in std rt; do
    (set -o pipefail && tests/rig/rig whole "$kind" 2>&1 | sed -u "s/^/$kind /") &
    pids[$kind]=$!
  done
  for kind in std rt; do wait "${pids[$kind]}" || failed+=" $kind"; done
  [ -z "$failed" ] || fail "not all as it must be:$failed; see above"
}
