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

# A loop that hangs while the arm moves: the robot brakes by itself, systemd makes a new process, nothing moves.
hung_loop() {
  local pid before
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

bus_down_in_ready() {
  say "the panel's bus goes down in Ready"
  guest "ip link set can0 down" || fail "can0 does not go down"
  guest "sleep 2"
  say "it says: $(status_of | cut -c 1-160)"
  guest "ip link set can0 up" || fail "can0 does not come up"
  again 60
  expect_light green
  stands 3 "the bus came back"
}

bus_down_in_motion() {
  say "the panel's bus goes down while the arm moves"
  guest "ip link set can0 down" || fail "can0 does not go down"
  guest "sleep 2"
  stands 3 "nobody could hear the panel's stop button"
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
  say "the stop button while the arm moves"
  press stop
  guest "sleep 1"
  stands 3 "the stop button was pressed"
  again 90
}

cameras_gone() {
  say "both cameras stop while the arm moves"
  guest "systemctl stop rig-cameras"
  await 60 "! $(state_is LocateBoard)" >/dev/null || fail "the job goes on without cameras: $(status_of)"
  stands 3 "there are no pictures"
  guest "systemctl start rig-cameras"
  again 120
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
  guest "sleep 60"
  say "it says: $(guest "systemctl show -p ActiveState --value firstlook"), $(guest "journalctl -b -u firstlook -o cat --no-pager -n 5 | grep -E 'E[0-9]{4}' | tail -n 1")"
  guest "systemctl start rig-robot"
  again 90
}

break_things() {
  image "$1" "full-$1"
  say "power on, kernel $1"
  boot 90
  expect_light green
  idle
  robot_late
  camera_faults
  bus_down_in_ready
  bus_off
  memory_pressure
  full_disk
  start_job
  hung_loop
  start_job
  bus_down_in_motion
  start_job
  stop_button
  start_job
  cameras_gone
  say "memory of the service: $(memory_of_service)"
  power_down
}

full() {
  short std
  short rt
  break_things std
  break_things rt
}
