#!/usr/bin/env bash
# Installs the build into a temporary prefix, then configures, builds and starts examples/minimal against it.
#   install_test.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
build=$1 source=$2
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
cmake --install "$build" --prefix "$prefix/usr" >/dev/null
cmake -S "$source/examples/minimal" -B "$prefix/example" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$prefix/usr" >/dev/null
cmake --build "$prefix/example"
"$prefix/usr/bin/demslam" --version
status=0
"$prefix/example/minimal" 2>/dev/null || status=$?
[ "$status" -eq 2 ] || { echo "the example did not start (exit status $status)"; exit 1; }
