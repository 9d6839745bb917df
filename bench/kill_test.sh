#!/usr/bin/env bash
# Kills a run (-9) at random moments; each resumed run must end with the bytes of the undisturbed one, and its map must be
# sound after every kill.
#   bench/kill_test.sh DEMSLAM DATASET WORK_FOLDER [KILLS=50] [SEED=1] [run options...]
set -euo pipefail
demslam=$1 dataset=$2 work=$3 kills=${4:-50}
RANDOM=${5:-1}
options=("${@:6}")
results=(trajectory.tum odometry.tum covariance.csv residuals.csv frames.jsonl config.toml summary.json)

mkdir -p "$work"
rm -rf "$work/whole" "$work/killed"
"$demslam" run "$dataset" -o "$work/whole" "${options[@]}" >"$work/whole.txt"
lines() { cat "$1/frames.jsonl" 2>/dev/null | wc -l; }
frames=$(lines "$work/whole")

run() { "$demslam" run "$dataset" -o "$work/killed" "${options[@]}" >"$work/killed.txt" 2>&1; }
fail() { cat "$work/$1.txt"; exit 1; }

# Up to a third of the run further, and then up to 200 ms: while a frame is worked on, stored or finished.
kill_once() {
  run 2>/dev/null & local pid=$! goal=$(($(lines "$work/killed") + RANDOM % (frames / 3)))
  while [ "$(lines "$work/killed")" -lt "$goal" ] && kill -0 $pid 2>/dev/null; do sleep 0.01; done
  sleep "0.$(printf %03d $((RANDOM % 200)))"
  kill -9 "$(pgrep -P $pid)" 2>/dev/null || { wait $pid || fail killed; return 1; }
  wait $pid 2>/dev/null || true
}

done_kills=0 runs=0 differing=0
while ((done_kills < kills)); do
  rm -rf "$work/killed"
  while ((done_kills < kills)) && [ ! -f "$work/killed/summary.json" ] && kill_once; do
    done_kills=$((done_kills + 1))
    [ ! -f "$work/killed/map.db" ] || "$demslam" map check "$work/killed" >"$work/check.txt" 2>&1 || fail check
  done
  [ -f "$work/killed/summary.json" ] || run || fail killed
  runs=$((runs + 1))
  for name in "${results[@]}"; do
    cmp -s "$work/whole/$name" "$work/killed/$name" || { differing=$((differing + 1)); echo "run $runs: $name differs"; }
  done
done
echo "$frames frames; $done_kills kills in $runs runs, every map sound; $differing files differ"
[ $differing = 0 ]
