#!/usr/bin/env bash
# Reads every register of a Loopwarden map once and prints its table, name and value. Needs mbpoll, awk and sed.
# Usage: this file [HOST [PORT]]
host=${1:-@HOST@} port=${2:-@PORT@} failed=0
# read_one NAME TYPE SCALE OPTIONS OF MBPOLL...: -0 counts addresses from 0, -1 reads once, -B is word order ABCD.
read_one() {
  local said value
  if ! said=$(mbpoll -q -1 -0 -m tcp -p "$port" -a @UNIT@ "${@:4}" -c 1 "$host" 2>&1); then
    printf '%s: %s\n' "$1" "$said" >&2
    failed=1
    return
  fi
  # "[136]:  5.5", and of 16 bits "[10]:  65531 (-5)"
  value=$(sed -n 's/^\[[0-9]*\]:[[:space:]]*\([^[:space:]]*\).*/\1/p' <<<"$said")
  case $2 in
    i16) ((value < 32768)) || value=$((value - 65536)) ;;
    u16) ((value >= 0)) || value=$((value + 65536)) ;;
    u32) ((value >= 0)) || value=$((value + 4294967296)) ;; # mbpoll knows signed ones only
  esac
  [ "$3" = 1 ] || value=$(awk "BEGIN { printf \"%.10g\", $value * $3 }")
  printf '%-60s %s\n' "$1" "$value"
}
