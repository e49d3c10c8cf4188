# shellcheck shell=bash disable=SC2154
# Power cuts at moments drawn from a seed, on a minimal computer (guest/usr/lib/rig/tiny-init): what must be on the disk
# when it comes back. Sourced after steps.bash.

# draw SEED I MODULUS: a number below MODULUS, the same for the same seed.
draw() { echo $((16#$(echo "$1 $2" | sha256sum | cut -c 1-8) % $3)); }

# Until the console has so many lines of firstlook's since Ready.
await_lines() {
  local end=$((SECONDS + 900))
  until [ "$(console_text | sed -n '/ Ready/,$p' | wc -l)" -ge "$1" ] || [ $SECONDS -ge $end ] || ! is_on; do sleep 0.1; done
}

# Whether a calibration must be on the disk after this boot: one that was accepted in it, or BEFORE ("yes") in an earlier
# one, and whose job has not ended.
calibration_expected() {
  console_text | tr -d '\r' | awk -v expected="$1" '
    /^EMPTIED/ { expected = "no" }
    /calibration accepted/ { expected = "yes" }
    /^ENDED/ { expected = "no" }
    END { print expected }'
}

# The checkpoint is written just before the job says that its calibration is accepted. Every second cut aims at that, on
# an empty disk: the first of them waits for it and takes the time since the validation began, the others cut after 0.7
# to 1.1 of that. The others fall anywhere: so many lines after Ready, and up to a second more.
await_moment() {
  local began share
  if [ $(($2 % 2)) = 0 ]; then
    console_says 900 'validating the calibration' 0.03 || fail "cut $2: the job does not come to its calibration; see $console"
    began=$EPOCHREALTIME
    if [ -z "$validation_s" ]; then
      console_says 900 'calibration accepted' 0.03 || fail "cut $2: the job does not accept its calibration; see $console"
      validation_s=$(awk -v a="$began" -v b="$EPOCHREALTIME" 'BEGIN { print b - a }')
      moment="behind the checkpoint, $validation_s s after the validation began"
      return
    fi
    share=$((70 + $(draw "$1" "$2+" 41)))
    sleep "$(awk -v t="$validation_s" -v share="$share" 'BEGIN { print t * share / 100 }')"
    moment="about the checkpoint, $share % of that ($(console_text | grep -ac "calibration accepted" || true) accepted)"
    return
  fi
  local lines=$((1 + $(draw "$1" "$2" 45)))
  await_lines "$lines"
  sleep "0.$(printf '%03d' "$(draw "$1" "$2+" 1000)")"
  moment="$lines lines after Ready"
}

cut_power() {
  local cuts=$1 seed=$2 i expected=no found lost=0 halves=0 offered=0 accepted=0 moment validation_s=""
  image std power
  say "$cuts power cuts, moments drawn from seed $seed"
  for ((i = 1; i <= cuts; ++i)); do
    append="init=/usr/lib/rig/tiny-init"
    if [ $((i % 2)) = 0 ]; then append+=" rig_empties"; fi
    power_on
    console_says 900 '^FOUND code' || fail "cut $i: the computer did not come back; see $console"
    found=$(console_text | tr -d '\r' | sed -n '/^FOUND begin/,/^FOUND code/p')
    if echo "$found" | grep -q HALF; then halves=$((halves + 1)); fi
    if [ "$expected" = yes ] && ! echo "$found" | grep -q 'whole .*\(checkpoint\|hand_eye\).yaml'; then lost=$((lost + 1)); fi
    console_says 900 'Ready' || fail "cut $i: firstlook did not come back to Ready; see $console"
    if console_text | grep -q 'was cut off after its calibration'; then offered=$((offered + 1)); fi
    await_moment "$seed" "$i"
    power_cut
    expected=$(calibration_expected "$expected")
    if [ "$expected" = yes ]; then accepted=$((accepted + 1)); fi
    say "cut $i/$cuts, $moment: found $(echo "$found" | grep -c whole || true) whole, $(echo "$found" | grep -c HALF || true) half; before the cut: $(console_text | tr -d '\r' | grep -E '^\[|^ENDED' | tail -n 1 | cut -c 1-60)"
    if [ $((lost + halves)) != 0 ]; then fail "cut $i: a calibration is lost ($lost) or half-written ($halves): $found"; fi
  done
  say "$cuts cuts: $accepted after a calibration was accepted, $offered times a run was offered to be taken up; 0 lost, 0 half-written"
}
