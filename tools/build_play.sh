#!/usr/bin/env bash
# Makes docs/play.html: play/page.html with the library's core, compiled to WebAssembly and packed, in it.
# Needs the target: rustup target add wasm32-unknown-unknown. A minute on one core.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --quiet --profile play --package snaprod-play --target wasm32-unknown-unknown --target-dir target/play
packed=target/play/core.txt
gzip --best --no-name --stdout target/play/wasm32-unknown-unknown/play/snaprod_play.wasm | base64 --wrap 0 >"$packed"
echo >>"$packed"
sed -e "/@@core@@/{r $packed" -e 'd}' play/page.html >docs/play.html
wc --bytes docs/play.html
