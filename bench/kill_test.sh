#!/usr/bin/env bash
# Kills a run (-9) at random moments; each resumed run must end with the bytes of the undisturbed one and a sound map.
#   bench/kill_test.sh DEMSLAM DATASET WORK_FOLDER [KILLS=50] [SEED=1] [run options...]
set -euo pipefail
demslam=$1 dataset=$2 work=$3 kills=${4:-50}
RANDOM=${5:-1}
options=("${@:6}")
results=(trajectory.tum odometry.tum covariance.csv frames.jsonl config.toml summary.json)

mkdir -p "$work"
rm -rf "$work/whole" "$work/killed"
begin=$(date +%s%N)
"$demslam" run "$dataset" -o "$work/whole" "${options[@]}" >"$work/whole.txt"
whole_ms=$((($(date +%s%N) - begin) / 1000000))
echo "undisturbed run: $((whole_ms / 1000)) s"

done_kills=0 runs=0 differing=0 damaged=0
while ((done_kills < kills)); do
  rm -rf "$work/killed"
  # A run is killed again and again, each time within a third of its length, until it gets through.
  while :; do
    "$demslam" run "$dataset" -o "$work/killed" "${options[@]}" >"$work/killed.txt" 2>&1 &
    pid=$!
    if ((done_kills < kills)); then
      delay_ms=$((1 + (RANDOM * 32768 + RANDOM) % (whole_ms / 3)))
      sleep "$((delay_ms / 1000)).$(printf %03d $((delay_ms % 1000)))"
      if kill -9 $pid 2>/dev/null; then
        wait $pid 2>/dev/null || true
        done_kills=$((done_kills + 1))
        if [ -f "$work/killed/map.db" ] && ! "$demslam" map check "$work/killed" >"$work/check.txt" 2>&1; then
          damaged=$((damaged + 1))
          cat "$work/check.txt"
        fi
        continue
      fi
    fi
    wait $pid || { cat "$work/killed.txt"; exit 1; }
    break
  done
  runs=$((runs + 1))
  for name in "${results[@]}"; do
    cmp -s "$work/whole/$name" "$work/killed/$name" || { differing=$((differing + 1)); echo "run $runs: $name differs"; }
  done
done
echo "$done_kills kills in $runs runs: $differing files differ, $damaged maps damaged"
[ $differing = 0 ] && [ $damaged = 0 ]
