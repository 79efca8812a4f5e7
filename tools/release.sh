#!/usr/bin/env bash
# Makes the parts of a release, each by its name: binary, sdist, wheel, pages, crates. Files go to
# target/release-files.
# The workflow .github/workflows/release.yml calls this script on every system; each part runs on any machine.
set -euo pipefail
cd "$(dirname "$0")/.."
files="$PWD/target/release-files"
mkdir -p "$files"
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
profile=${SNAPROD_PROFILE:-release}

# The program with PNG, PDF and films, its manual, its completions and the scenes, as an archive.
binary() {
    local host built name place
    host=$(rustc -vV | sed -n 's/^host: //p')
    built="target/$([ "$profile" = test ] && echo debug || echo "$profile")"
    cargo build --quiet --profile "$profile" --features png,pdf --bin snaprod
    name="snaprod-$version-$host"
    place="target/release-parts/$name"
    rm -rf "$place"
    mkdir -p "$place/completions"
    cp -r "$built/snaprod$([ "${OS:-}" = Windows_NT ] && echo .exe)" README.md CHANGELOG.md LICENSE-* scenes docs/play.html "$place"
    "$place/snaprod" man >"$place/snaprod.1"
    for shell in bash zsh fish powershell; do "$place/snaprod" completions "$shell" >"$place/completions/$shell"; done
    tar -czf "$files/$name.tar.gz" -C target/release-parts "$name"
    # The archive has a program that runs and draws.
    local trial
    trial=$(mktemp -d)
    tar -xzf "$files/$name.tar.gz" -C "$trial"
    "$trial/$name/snaprod" run "$trial/$name/scenes/snap.toml" --set run.duration=0.1 --png --pdf --quiet --out "$trial/out"
    ls "$trial/out/energies.png" "$trial/out/energies.pdf" >/dev/null
    rm -rf "$trial"
}

# The source of the Python package: pip compiles it where there is no wheel.
sdist() {
    maturin sdist --manifest-path python/Cargo.toml --out "$files"
    tar -tzf "$files/snaprod-$version.tar.gz" | grep 'python/src/lib.rs' >/dev/null
}

# The wheel of this machine, and its installation into a fresh environment.
wheel() {
    local parts
    parts=$(mktemp -d)
    maturin build --profile "$profile" --manifest-path python/Cargo.toml --out "$parts" "$@"
    python3 -m venv "$parts/venv"
    local python="$parts/venv/bin/python"
    [ -x "$python" ] || python="$parts/venv/Scripts/python.exe"
    "$python" -m pip install --quiet numpy
    "$python" -m pip install --quiet --no-index "$parts"/*.whl
    (cd "$parts" && "$python" -c 'import snaprod; assert snaprod.elastica(lam=6.3, kappa=0.6).stable; print("installed:", snaprod.__version__)')
    (cd "$parts" && "$python" -m snaprod --version)
    mv "$parts"/*.whl "$files"
    rm -rf "$parts"
}

# The pages of the project: the rod in the hand, and the documentation of the library.
pages() {
    rm -rf target/pages
    mkdir -p target/pages
    cp docs/play.html target/pages/index.html
    cargo doc --quiet --no-deps --features png,pdf
    cp -r target/doc target/pages/doc
    cp -r figures target/pages/figures
}

# The crates in the order of their dependencies; `crates publish` sends them to crates.io.
crates() {
    local crate
    for crate in snaprod-core snaprod-systems snaprod-waves snaprod-walls snaprod-motion snaprod-plot snaprod; do
        if [ "${1:-}" = publish ]; then
            cargo publish --quiet --package "$crate"
        else
            cargo package --quiet --list --allow-dirty --package "$crate" >/dev/null
            echo "$crate: its files are complete"
        fi
    done
}

part=${1:-}
case "$part" in
binary | sdist | wheel | pages | crates) shift && "$part" "$@" ;;
*) echo "usage: tools/release.sh binary | sdist | wheel [MATURIN OPTIONS] | pages | crates [publish]" >&2 && exit 2 ;;
esac
