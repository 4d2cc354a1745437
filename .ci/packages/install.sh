#!/bin/sh
# Installs bagreel @VERSION@ on Linux: downloads the archive for this machine, verifies its checksum, and
# copies the command, its manual pages and completions below ~/.local, or below PREFIX. Needs no root, and changes nothing else.
# Tested with a local server instead of the releases' address; BAGREEL_FROM sets another address.
set -eu

main() {
    version=@VERSION@
    from=${BAGREEL_FROM:-https://github.com/bagreel/bagreel/releases/download/v$version}
    prefix=${PREFIX:-$HOME/.local}
    sum=
    case "$(uname -s)-$(uname -m)" in
        Linux-x86_64) target=x86_64 sum=@SHA256:bagreel-x86_64-unknown-linux-musl.tar.gz@ ;;
        Linux-aarch64 | Linux-arm64) target=aarch64 sum=@SHA256:bagreel-aarch64-unknown-linux-musl.tar.gz@ ;;
    esac
    if [ -z "$sum" ]; then
        echo "error: no archive of bagreel $version for $(uname -s) on $(uname -m)" >&2
        echo "hint: with a Rust toolchain and a C compiler, \`cargo install bagreel\` builds it" >&2
        exit 1
    fi
    name=bagreel-$target-unknown-linux-musl
    place=$(mktemp -d)
    trap 'rm -rf "$place"' EXIT
    trap 'exit 130' INT TERM
    if command -v curl > /dev/null; then
        curl --fail --silent --show-error --location --retry 3 --output "$place/$name.tar.gz" "$from/$name.tar.gz"
    else
        wget -q -O "$place/$name.tar.gz" "$from/$name.tar.gz"
    fi
    if ! echo "$sum  $place/$name.tar.gz" | sha256sum -c - > /dev/null 2>&1; then
        echo "error: $from/$name.tar.gz is not the file that this script was made for; nothing is installed" >&2
        exit 1
    fi
    tar -xzf "$place/$name.tar.gz" -C "$place"
    share=$prefix/share
    mkdir -p "$prefix/bin" "$share/man/man1" "$share/bash-completion/completions" "$share/zsh/site-functions" \
        "$share/fish/vendor_completions.d"
    # Beside a command that is running, then in its place.
    cp "$place/$name/bagreel" "$prefix/bin/.bagreel.new"
    mv "$prefix/bin/.bagreel.new" "$prefix/bin/bagreel"
    cp "$place/$name/man/"*.1 "$share/man/man1"
    cp "$place/$name/completions/bagreel.bash" "$share/bash-completion/completions/bagreel"
    cp "$place/$name/completions/_bagreel" "$share/zsh/site-functions"
    cp "$place/$name/completions/bagreel.fish" "$share/fish/vendor_completions.d"
    "$prefix/bin/bagreel" --version
    case ":$PATH:" in
        *":$prefix/bin:"*) ;;
        *) echo "note: $prefix/bin is not on your PATH" >&2 ;;
    esac
}

# At the end, so that half a script does nothing.
main
