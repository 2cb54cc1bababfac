#!/bin/sh
# Fetches what `--features embree` needs and this machine lacks: Embree 4 and libclang.
#
# What the system has is used and nothing is downloaded. Otherwise pip fetches pinned wheels, checks
# their hashes, and the libraries go to third-party/ in the project: nothing outside it changes.
# Run it as often as you like; a second run only checks.

set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."

embree_pin='embreex==4.4.0.post1'
libclang_pin='libclang==18.1.1'
third_party=third-party
config=.cargo/config.toml
config_mark='# Written by scripts/setup.sh; `make clean` removes it.'
os=$(uname -s)
machine=$(uname -m)

say() { printf 'setup: %s\n' "$*"; }

fail() {
    printf 'setup: %s\n' "$*" >&2
    exit 1
}

by_hand='install Embree 4 and libclang by hand (Debian, Ubuntu: libembree-dev libclang-dev; Fedora: embree-devel clang-devel; Homebrew: embree llvm) or set EMBREE_DIR and LIBCLANG_PATH; `cargo build` without Embree needs neither'

# The wheels' tag and SHA-256. One Python tag a platform: the libraries inside do not depend on it.
case $os-$machine in
Linux-x86_64)
    embree_platform=manylinux_2_28_x86_64
    embree_sha=2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
    libclang_platform=manylinux2010_x86_64
    libclang_sha=c533091d8a3bbf7460a00cb6c1a71da93bffe148f172c7d03b1c31fbf8aa2a0b
    ;;
Linux-aarch64)
    # There is no Embree wheel.
    embree_platform=
    embree_sha=
    libclang_platform=manylinux2014_aarch64
    libclang_sha=54dda940a4a0491a9d1532bf071ea3ef26e6dbaf03b5000ed94dd7174e8f9592
    ;;
Darwin-arm64)
    embree_platform=macosx_13_0_arm64
    embree_sha=3ed370224566681071f245bbc5104feebee1354097679ab69cb3a70c94633cb3
    libclang_platform=macosx_11_0_arm64
    libclang_sha=0b2e143f0fac830156feb56f9231ff8338c20aecfe72b4ffe96f19e5a1dbb69a
    ;;
Darwin-x86_64)
    embree_platform=macosx_13_0_x86_64
    embree_sha=85d9b232805e95be845ee5d77ddea4e6b21c992b7e60fa7bdf4f578b84797a15
    libclang_platform=macosx_10_9_x86_64
    libclang_sha=6f14c3f194704e5d09769108f03185fce7acaf1d1ae4bbb2f30a72c2400cb7c5
    ;;
*)
    embree_platform=
    embree_sha=
    libclang_platform=
    libclang_sha=
    ;;
esac

case $os in
Darwin) library_suffix=dylib ;;
*) library_suffix=so ;;
esac
embree_file=lib/libembree4.$library_suffix
libclang_file=libclang.$library_suffix

# --- What the system has ------------------------------------------------------------------------

# Prints the folder of a linkable Embree 4: EMBREE_DIR's or the system's, as build.rs looks.
find_system_embree() {
    if [ -n "${EMBREE_DIR:-}" ]; then
        for dir in "$EMBREE_DIR/lib" "$EMBREE_DIR/lib64" "$EMBREE_DIR/lib/$machine-linux-gnu" "$EMBREE_DIR"; do
            if [ -e "$dir/libembree4.$library_suffix" ]; then
                printf '%s\n' "$dir"
                return 0
            fi
        done
        fail "EMBREE_DIR=$EMBREE_DIR holds no libembree4.$library_suffix (looked in lib, lib64 and the folder itself)"
    fi
    while IFS= read -r dir; do
        case $dir in '#'* | '') continue ;; esac
        # Another machine's libraries may lie beside ours.
        case $dir in *-linux-gnu) [ "${dir##*/}" = "$machine-linux-gnu" ] || continue ;; esac
        if [ -e "$dir/libembree4.$library_suffix" ]; then
            printf '%s\n' "$dir"
            return 0
        fi
    done <scripts/library-dirs.txt
    return 1
}

# Prints a libclang of the folder, by the names that bindgen's loader accepts. libclang-cpp is
# another library.
libclang_in() {
    for file in "$1"/libclang.$library_suffix "$1"/libclang-*.so "$1"/libclang.so.* "$1"/libclang-*.so.*; do
        case ${file##*/} in *-cpp.* | *'*'*) continue ;; esac
        if [ -e "$file" ]; then
            printf '%s\n' "$file"
            return 0
        fi
    done
    return 1
}

# Prints the libclang that bindgen's loader finds without our help.
find_system_libclang() {
    if [ -n "${LIBCLANG_PATH:-}" ]; then
        if [ -f "$LIBCLANG_PATH" ]; then
            printf '%s\n' "$LIBCLANG_PATH"
        else
            libclang_in "$LIBCLANG_PATH" || fail "LIBCLANG_PATH=$LIBCLANG_PATH holds no libclang"
        fi
        return 0
    fi
    if prefix=$("${LLVM_CONFIG_PATH:-llvm-config}" --prefix 2>/dev/null); then
        libclang_in "$prefix/lib" && return 0
        libclang_in "$prefix/lib64" && return 0
    fi
    case $os in
    Darwin)
        toolchain=$(xcode-select --print-path 2>/dev/null || true)
        for dir in "$toolchain/Toolchains/XcodeDefault.xctoolchain/usr/lib" \
            /Library/Developer/CommandLineTools/usr/lib \
            /Applications/Xcode.app/Contents/Developer/Toolchains/XcodeDefault.xctoolchain/usr/lib \
            /usr/local/opt/llvm*/lib; do
            libclang_in "$dir" && return 0
        done
        ;;
    *)
        for dir in /usr/local/llvm*/lib* /usr/local/lib*/*/* /usr/local/lib*/* /usr/local/lib* \
            /usr/lib*/*/* /usr/lib*/* /usr/lib*; do
            [ -d "$dir" ] && libclang_in "$dir" && return 0
        done
        ;;
    esac
    return 1
}

# Whether the libclang beside this file comes with its own stddef.h; runtime-only packages do not.
has_clang_headers() {
    dir=$(dirname "$1")
    for header in "$dir"/clang/*/include/stddef.h "$dir"/../lib/clang/*/include/stddef.h \
        /usr/lib*/clang/*/include/stddef.h /usr/lib/llvm*/lib/clang/*/include/stddef.h; do
        [ -e "$header" ] && return 0
    done
    return 1
}

# --- What we fetched before ---------------------------------------------------------------------

sha256() {
    if command -v sha256sum >/dev/null 2>&1; then
        sha256sum "$@"
    else
        shasum -a 256 "$@"
    fi
}

# Whether folder $1 is whole: made from the wheel with hash $2, with file $3, and no file changed
# since.
is_whole() {
    [ -n "$2" ] && [ -e "$1/$3" ] && [ -f "$1/wheel.sha256" ] &&
        [ "$(cat "$1/wheel.sha256")" = "$2" ] &&
        (cd "$1" && sha256 -c files.sha256 >/dev/null 2>&1)
}

# --- Fetching -----------------------------------------------------------------------------------

work=
cleanup() { [ -z "$work" ] || rm -rf "$work"; }
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

make_work() {
    [ -z "$work" ] || return 0
    mkdir -p "$third_party"
    # A killed run cannot clean up after itself.
    find "$third_party" -maxdepth 1 -name '.setup.*' -mmin +60 -exec rm -rf {} +
    work=$(mktemp -d "$third_party/.setup.XXXXXX")
}

find_python() {
    for python in python3 python; do
        if "$python" -c 'import sys; sys.exit(sys.version_info[0] < 3)' 2>/dev/null; then
            return 0
        fi
    done
    fail "cannot fetch $1 without Python 3 and its pip; $by_hand"
}

find_pip() {
    if "$python" -m pip --version >/dev/null 2>&1; then
        pip() { "$python" -m pip "$@"; }
    elif pip3 --version >/dev/null 2>&1; then
        pip() { pip3 "$@"; }
    else
        fail "cannot fetch $1 without pip (Debian, Ubuntu: apt install python3-pip); $by_hand"
    fi
}

# Fetches the wheel of requirement $1 with platform tag $2 and hash $3, and unpacks it to $work/$4.
fetch() {
    [ -n "$2" ] || fail "there is no pinned wheel of $1 for $os $machine; $by_hand"
    if [ "$os" = Linux ] && ! getconf GNU_LIBC_VERSION >/dev/null 2>&1; then
        fail "the pinned wheel of $1 needs glibc, which this system does not have; $by_hand"
    fi
    find_python "$1"
    find_pip "$1"
    say "fetching $1"
    mkdir "$work/$4.wheel"
    printf '%s --hash=sha256:%s\n' "$1" "$3" >"$work/$4.txt"
    if ! PIP_REQUIRE_VIRTUALENV=0 pip download --quiet --no-input --disable-pip-version-check \
        --retries 2 --no-deps --only-binary :all: --require-hashes --platform "$2" \
        --python-version 311 --implementation cp --abi cp311 --abi none \
        --dest "$work/$4.wheel" --requirement "$work/$4.txt" >"$work/$4.log" 2>&1; then
        # pip's last error line names the cause; its retries come before it.
        why=$(grep '^ERROR' "$work/$4.log" | tail -n 1)
        fail "pip could not fetch $1 (${why:-no reason given}): is there a network? Run \`make setup\` again, or $by_hand"
    fi
    mkdir "$work/$4"
    "$python" -m zipfile -e "$work/$4.wheel"/*.whl "$work/$4" ||
        fail "could not unpack $1"
}

# Puts the finished folder $work/$1.done, from the wheel with hash $2 and with file $3, in place as
# $third_party/$1 in one step.
install_folder() {
    (cd "$work/$1.done" && find . -type f ! -name '*.sha256' | sort | while IFS= read -r file; do
        sha256 "$file"
    done >files.sha256)
    printf '%s\n' "$2" >"$work/$1.done/wheel.sha256"
    # A run beside this one may have been first.
    ! is_whole "$third_party/$1" "$2" "$3" || return 0
    if [ -e "$third_party/$1" ]; then
        mv "$third_party/$1" "$work/$1.old"
    fi
    # Not mv, which would put the folder into one that has just appeared.
    "$python" -c 'import os, sys; os.rename(sys.argv[1], sys.argv[2])' \
        "$work/$1.done" "$third_party/$1" 2>/dev/null ||
        is_whole "$third_party/$1" "$2" "$3" || fail "could not put $third_party/$1 in place"
}

fetch_embree() {
    fetch "$embree_pin" "$embree_platform" "$embree_sha" embree
    lib="$work/embree.done/lib"
    mkdir -p "$lib"
    case $os in
    Darwin)
        mv "$work"/embree/embreex/.dylibs/libembree4*.dylib "$work"/embree/embreex/.dylibs/libtbb*.dylib "$lib/"
        for file in "$lib"/libembree4*.dylib; do
            name=${file##*/}
            # The library names itself by the folder it was packed in; a changed file needs signing.
            install_name_tool -id "@rpath/$name" "$file" 2>/dev/null &&
                codesign --force --sign - "$file" 2>/dev/null ||
                fail "could not rename $name (install_name_tool and codesign come with Xcode's command line tools)"
            ln -s "$name" "$lib/libembree4.dylib"
        done
        ;;
    *)
        mv "$work"/embree/embreex.libs/libembree4*.so* "$work"/embree/embreex.libs/libtbb*.so* "$lib/"
        # Its file name is its SONAME, with a hash in it; the linker looks for the plain name.
        for file in "$lib"/libembree4*.so*; do
            ln -s "${file##*/}" "$lib/libembree4.so"
        done
        ;;
    esac
    [ -e "$lib/libembree4.$library_suffix" ] || fail "the wheel of $embree_pin holds no libembree4"
    mv "$work"/embree/*.dist-info/licenses/* "$work/embree.done/" 2>/dev/null || true
    install_folder embree "$embree_sha" "$embree_file"
}

fetch_libclang() {
    fetch "$libclang_pin" "$libclang_platform" "$libclang_sha" libclang
    mkdir "$work/libclang.done"
    mv "$work/libclang/libclang-18.1.1.data/platlib/clang/native/libclang.$library_suffix" \
        "$work"/libclang/*.dist-info/LICENSE.TXT "$work/libclang.done/" ||
        fail "the wheel of $libclang_pin holds no libclang"
    install_folder libclang "$libclang_sha" "$libclang_file"
}

# --- Telling cargo ------------------------------------------------------------------------------

# Where clang's own headers are missing (the wheel never has them), the C compiler's do.
clang_args() {
    # Two ways to ask: gcc's and clang's.
    headers=$(${CC:-cc} -print-file-name=include 2>/dev/null) && [ -e "$headers/stddef.h" ] ||
        headers=$(${CC:-cc} -print-resource-dir 2>/dev/null)/include
    [ -e "$headers/stddef.h" ] ||
        fail "found no C compiler (${CC:-cc}): install one; Rust links with it and bindgen needs its headers"
    printf -- "-idirafter '%s'" "$headers"
    if [ "$os" = Darwin ]; then
        printf -- " -isysroot '%s'" "$(xcrun --show-sdk-path)"
    fi
}

config_is_ours() { [ -e "$config" ] && [ "$(head -n 1 "$config")" = "$config_mark" ]; }

# Writes cargo's [env] for a libclang from the wheel or, without a path, from the system. A user's
# own environment wins over it: cargo does not replace variables that are set.
write_config() {
    args=$(clang_args)
    text=$(
        printf '%s\n[env]\n' "$config_mark"
        [ "$1" = system ] || printf 'LIBCLANG_PATH = { value = "%s/libclang", relative = true }\n' "$third_party"
        printf 'BINDGEN_EXTRA_CLANG_ARGS = "%s"\n' "$args"
    )
    if [ -e "$config" ]; then
        [ "$text" != "$(cat "$config")" ] || return 0
        if ! config_is_ours; then
            ! grep -q BINDGEN_EXTRA_CLANG_ARGS "$config" || return 0
            fail "$config is yours, so add these lines to it by hand: $(printf '%s' "$text" | sed 1d | tr '\n' ' ')"
        fi
    fi
    mkdir -p .cargo
    printf '%s\n' "$text" >"$config.$$"
    mv "$config.$$" "$config"
    say "told cargo where libclang is, in $config"
}

# --- All together -------------------------------------------------------------------------------

if dir=$(find_system_embree); then
    embree="Embree 4 in $dir"
elif [ -n "${EMBREE_DIR:-}" ]; then
    exit 1
else
    if ! is_whole "$third_party/embree" "$embree_sha" "$embree_file"; then
        make_work
        fetch_embree
    fi
    embree="Embree 4.4.0 in $third_party/embree"
fi

if file=$(find_system_libclang); then
    libclang="libclang in $(dirname "$file")"
    if ! has_clang_headers "$file"; then
        [ -n "${BINDGEN_EXTRA_CLANG_ARGS:-}" ] || write_config system
    elif config_is_ours; then
        rm "$config"
    fi
elif [ -n "${LIBCLANG_PATH:-}" ]; then
    exit 1
else
    if ! is_whole "$third_party/libclang" "$libclang_sha" "$libclang_file"; then
        make_work
        fetch_libclang
    fi
    libclang="libclang 18.1.1 in $third_party/libclang"
    write_config wheel
fi

say "ready: $embree, $libclang"
