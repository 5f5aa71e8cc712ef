#!/usr/bin/env bash
# Builds the packages: packaging/build.sh OUT [deb] [wheel] [sbom]; all without a choice.
#
#   OUT/tipwatch_VERSION_ARCH.deb     both programs, systemd units, manual pages, completions, library of C, bill of materials
#   OUT/tipwatch-VERSION-*.whl        the Python module with both programs and the library of C (abi3: Python 3.11 and later);
#                                     its build tag says which processor it needs, such as 1_x86_64_v3
#   OUT/tipwatch.cdx.json             bill of materials: every crate with version, hash and licence (CycloneDX)
#   OUT/THIRD-PARTY.txt               the texts of these licences; packages contain it
#
# TIPWATCH_PROFILE=dev builds without optimisation; TIPWATCH_BUILT=FOLDER takes programs that are built: for a quick trial.
# DEBFULLNAME and DEBEMAIL name the maintainer of the .deb.
# The programs need an x86-64-v3 processor (2015 and later); RUSTFLAGS="" builds them for any x86-64.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:?expected a folder for the packages}")
shift
wanted=" ${*:-deb wheel sbom} "
profile=${TIPWATCH_PROFILE:-release}
folder=$([[ $profile == dev ]] && echo debug || echo "$profile")
target=${CARGO_TARGET_DIR:-target}/$folder
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
# files of one commit have one time: the same sources give the same package
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 0)}
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

want() { [[ $wanted == *" $1 "* ]]; }

if [[ -n ${TIPWATCH_BUILT:-} ]]; then
    target=$TIPWATCH_BUILT
else
    # not by package: as part of the whole workspace dependencies have one set of features, and are built once
    cargo build --profile "$profile" --locked --bin tipwatch --bin tipwatch-live --bin tipwatch-packaging
fi
"$target/tipwatch-packaging" sbom >"$work/tipwatch.cdx.json"
"$target/tipwatch-packaging" third-party >"$work/THIRD-PARTY.txt"
if want sbom; then cp "$work/tipwatch.cdx.json" "$work/THIRD-PARTY.txt" "$out/"; fi

# installs headers, library and example of C: where, the folder of libraries there, what pkg-config calls it
install_client() {
    install -D -m 644 -t "$1/include" live/include/*.h
    # cargo leaves a library that others depend on with its dependencies
    local library=$target/deps/libtipwatch_client.so
    [[ -e $library ]] || library=$target/libtipwatch_client.so
    install -D -m 644 "$library" "$1/$2/libtipwatch_client.so.0"
    strip --strip-unneeded "$1/$2/libtipwatch_client.so.0"
    mkdir "$1/$2/pkgconfig"
    cat >"$1/$2/pkgconfig/tipwatch_client.pc" <<EOF
prefix=$3
libdir=\${prefix}/$2
includedir=\${prefix}/include

Name: tipwatch_client
Description: Samples, verdicts and acknowledgements of tipwatch-live, in C and C++
Version: $version
Cflags: -I\${includedir}
Libs: -L\${libdir} -ltipwatch_client
EOF
    install -D -m 644 -t "$1/share/doc/tipwatch/examples" live/examples/client.c
}

if want deb; then
    root=$work/deb
    "$target/tipwatch-packaging" pages "$work/pages"
    install -D -m 755 -t "$root/usr/bin" "$target/tipwatch" "$target/tipwatch-live"
    strip --strip-unneeded "$root"/usr/bin/*
    install -D -m 644 -t "$root/usr/lib/systemd/system" packaging/systemd/*.service
    install -D -m 644 packaging/systemd/tipwatch.sysusers "$root/usr/lib/sysusers.d/tipwatch.conf"
    install -D -m 644 -t "$root/usr/share/man/man1" "$work"/pages/man/*.1
    gzip -9n "$root"/usr/share/man/man1/*
    for program in tipwatch tipwatch-live; do
        install -D -m 644 "$work/pages/completions/bash/$program.bash" "$root/usr/share/bash-completion/completions/$program"
        install -D -m 644 -t "$root/usr/share/zsh/vendor-completions" "$work/pages/completions/zsh/_$program"
        install -D -m 644 -t "$root/usr/share/fish/vendor_completions.d" "$work/pages/completions/fish/$program.fish"
    done
    libraries=lib/$(uname -m)-linux-gnu
    install_client "$root/usr" "$libraries" /usr
    ln -s libtipwatch_client.so.0 "$root/usr/$libraries/libtipwatch_client.so"
    doc=$root/usr/share/doc/tipwatch
    install -D -m 644 -t "$doc" "$work/tipwatch.cdx.json" README.md
    gzip -9nc CHANGELOG.md >"$doc/CHANGELOG.md.gz"
    maintainer="${DEBFULLNAME:-Tipwatch developers} <${DEBEMAIL:-tipwatch@localhost}>"
    printf 'tipwatch (%s) unstable; urgency=medium\n\n  * See CHANGELOG.md.gz beside this file.\n\n -- %s  %s\n' \
        "$version" "$maintainer" "$(date --utc --date="@$SOURCE_DATE_EPOCH" --rfc-email)" | gzip -9n >"$doc/changelog.gz"
    install -D -m 644 packaging/deb/lintian-overrides "$root/usr/share/lintian/overrides/tipwatch"
    gzip -9nc "$work/THIRD-PARTY.txt" >"$doc/THIRD-PARTY.txt.gz"
    {
        echo "Tipwatch is licensed under MIT or Apache-2.0, at your choice. The crates in it are listed in tipwatch.cdx.json"
        echo "beside this file; the texts of their licences are in THIRD-PARTY.txt.gz."
        echo
        cat LICENSE-MIT
        echo
        echo "The Apache License 2.0 is in /usr/share/common-licenses/Apache-2.0."
    } >"$doc/copyright"
    # the newest version of a symbol that programs and library use is what they need
    libc=$(objdump -T "$root"/usr/bin/* "$root/usr/$libraries/libtipwatch_client.so.0" | grep -o 'GLIBC_[0-9.]*' | sort -Vu | tail -1 | cut -d_ -f2)
    install -d "$root/DEBIAN"
    cat >"$root/DEBIAN/control" <<EOF
Package: tipwatch
Version: $version
Architecture: $(dpkg --print-architecture)
Maintainer: $maintainer
Installed-Size: $(du -ks "$root/usr" | cut -f1)
Depends: libc6 (>= $libc), libgcc-s1
Section: science
Priority: optional
Description: wheel loads and tip-over alarms of wheeled machines with an arm
 Computes from the logs of a machine how close it came to tipping over: wheel
 loads, stability indicators, their causes and their uncertainty. The monitor
 does the same beside a machine's logger, over shared memory.
EOF
    echo "activate-noawait ldconfig" >"$root/DEBIAN/triggers"
    echo "libtipwatch_client 0 tipwatch" >"$root/DEBIAN/shlibs"
    install -m 755 packaging/deb/postinst packaging/deb/prerm packaging/deb/postrm "$root/DEBIAN/"
    (cd "$root" && find usr -type f -print0 | sort -z | xargs -0 md5sum) >"$root/DEBIAN/md5sums"
    dpkg-deb --root-owner-group --build "$root" "$out/tipwatch_${version}_$(dpkg --print-architecture).deb"
fi

if want wheel; then
    # the Python module brings `tipwatch`; the monitor is a file of its own beside it
    scripts=$work/scripts
    install -D -m 755 "$target/tipwatch-live" "$scripts/tipwatch-live"
    strip --strip-unneeded "$scripts/tipwatch-live"
    # a wheel has no links: the linker reads where the library is
    # shellcheck disable=SC2016 # for pkg-config
    install_client "$work/data" lib '${pcfiledir}/../..'
    echo "INPUT(libtipwatch_client.so.0)" >"$work/data/lib/libtipwatch_client.so"
    maturin=${MATURIN:-maturin}
    "$maturin" build --profile "$profile" --locked --manifest-path analyze/python/Cargo.toml --out "$work/wheels"
    packaging/wheel_with_files.py "$work"/wheels/*.whl "$out" --program "$scripts/tipwatch-live" --data "$work/data" \
        --licence LICENSE-MIT --licence LICENSE-APACHE --licence "$work/THIRD-PARTY.txt"
fi
ls -l "$out"
