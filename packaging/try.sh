#!/usr/bin/env bash
# Tries the packages of packaging/build.sh in clean environments: packaging/try.sh OUT. Installs nothing on this machine.
#
# PYTHON chooses the interpreter (3.11 or later). TIPWATCH_SESSION=1 also tries the wheel with types, Ray and a bucket; it
# downloads mypy, pytest, polars, Ray and a server of S3 into the environment that is tried.
set -euo pipefail
out=$(realpath "${1:?expected the folder of the packages}")
root=$(realpath "$(dirname "$0")/..")
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# no program or library of the sources is found by chance
clean() { env -i PATH=/usr/bin:/bin HOME="$work/home" LANG=C.UTF-8 "$@"; }
mkdir -p "$work/home"
cd "$work"
shopt -s nullglob

# the machine in C finds headers and library, and acknowledges an alarm of the monitor: library folder, example, monitor, and what
# pkg-config is told
try_client() {
    if ! { command -v cc && command -v pkg-config; } >/dev/null; then
        echo "not tried: the library for C, for want of cc or pkg-config" >&2
        return 0
    fi
    local library=$1 example=$2 monitor=$3 found machine=$root/tests/data/tiny.toml prefix=try$$_
    shift 3
    found=$(env "$@" PKG_CONFIG_PATH="$library/pkgconfig" pkg-config --cflags --libs tipwatch_client)
    # shellcheck disable=SC2086 # several words
    cc -std=c11 -Wall -Wextra -Werror "$example" $found -lm -o client
    clean "$monitor" monitor --quiet --prefix "$prefix" --state "$work/state" --machine "$machine" &
    clean LD_LIBRARY_PATH="$library" ./client "$machine" "${machine%.toml}.urdf" 6 --prefix "$prefix"
    wait $!
    rm -rf "/dev/shm/$prefix"* "$work/state"
}

for package in "$out"/*.deb; do
    echo "== $package"
    dpkg-deb --info "$package"
    dpkg-deb --contents "$package" | awk '{ print $2 }' | sort -u | tail -1 | grep -qx root/root
    dpkg-deb --control "$package" control
    for script in control/postinst control/prerm control/postrm; do sh -n "$script"; done
    # installed by dpkg into a root of its own, and removed again at the end
    mkdir -p root/etc root/var/lib/dpkg/info root/var/lib/dpkg/updates root/var/log
    touch root/var/lib/dpkg/status root/var/lib/dpkg/available
    managed() { dpkg --root="$work/root" --force-script-chrootless --force-depends --force-not-root "$@"; }
    managed --install "$package" 2>&1 | grep -v "dependency problems\|Package libc6\|Package libgcc\|^$\|depends on" || true
    managed --verify tipwatch
    test "$(dpkg-query --admindir="$work/root/var/lib/dpkg" --show --showformat '${db:Status-Status}' tipwatch)" = installed
    grep -q '^tipwatch:' root/etc/passwd
    clean root/usr/bin/tipwatch --version
    clean root/usr/bin/tipwatch-live --version
    mkdir demo
    (cd demo && clean ../root/usr/bin/tipwatch demo >demo.txt && head -5 demo.txt)
    for unit in root/usr/lib/systemd/system/*.service; do
        sed "s#/usr/bin/tipwatch-live#$work/root/usr/bin/tipwatch-live#; /^Documentation=/d" "$unit" >"$(basename "$unit")"
        if command -v systemd-analyze >/dev/null; then
            systemd-analyze verify "./$(basename "$unit")"
        else
            echo "not tried: $(basename "$unit"), for want of systemd-analyze" >&2
        fi
    done
    for page in root/usr/share/man/man1/*.1.gz; do
        # mistakes in the markup are warnings of groff
        if command -v groff >/dev/null; then
            gunzip -c "$page" | groff -man -Tutf8 -ww -z 2>warnings || true
            test ! -s warnings || { echo "$page"; head -3 warnings; }
        else
            echo "not tried: $(basename "$page"), for want of groff" >&2
        fi
    done
    folders=(root/usr/lib/*-linux-gnu)
    try_client "$(realpath "${folders[0]}")" root/usr/share/doc/tipwatch/examples/client.c root/usr/bin/tipwatch-live \
        PKG_CONFIG_SYSROOT_DIR="$work/root"
    gunzip -c root/usr/share/man/man1/tipwatch-live-monitor.1.gz >monitor.1
    grep -q 'untimed' monitor.1
    clean bash -c 'source root/usr/share/bash-completion/completions/tipwatch && complete -p tipwatch'
    "$python" -c 'import json, sys; bill = json.load(open(sys.argv[1])); print(len(bill["components"]), "crates")' \
        root/usr/share/doc/tipwatch/tipwatch.cdx.json
    gunzip -c root/usr/share/doc/tipwatch/THIRD-PARTY.txt.gz | grep -c '^=\{100\}$' | sed 's/$/ texts of licences/'
    if command -v lintian >/dev/null; then
        lintian --tag-display-limit 0 "$package" || true
    fi
    managed --purge tipwatch >/dev/null
    test -z "$(find root -path '*tipwatch*' -type f)"
done

for wheel in "$out"/*.whl; do
    echo "== $wheel"
    clean "$python" -m venv venv
    clean venv/bin/pip install --quiet --disable-pip-version-check ${TIPWATCH_PIP:-} "$wheel"
    clean venv/bin/pip check
    mkdir wheel
    cd wheel
    clean ../venv/bin/python - <<'END'
import inspect
import tipwatch

print(tipwatch.__file__, tipwatch.__version__)
for name in tipwatch.__all__:
    found = getattr(tipwatch, name)
    assert inspect.getdoc(found) or isinstance(found, str), f"{name} has no docstring"
assert "rad or m" in tipwatch.Machine.evaluate.__doc__
END
    clean ../venv/bin/tipwatch --version
    clean ../venv/bin/tipwatch demo >demo.txt
    head -5 demo.txt
    clean ../venv/bin/tipwatch-live --version
    # a prefix that pkg-config works out from where the file is
    try_client "$(realpath ../venv/lib)" ../venv/share/doc/tipwatch/examples/client.c ../venv/bin/tipwatch-live X=
    ls ../venv/lib/python3*/site-packages/tipwatch-*.dist-info/licenses
    if [[ -n ${TIPWATCH_SESSION:-} ]]; then
        clean ../venv/bin/pip install --quiet --disable-pip-version-check mypy pytest polars pyarrow 'ray' boto3 'moto[server]'
        cat >typed.py <<'END'
import numpy as np
import tipwatch as tw

machine = tw.Machine("machine.toml")
loads: np.ndarray = machine.evaluate(machine.zero_posture).load
rows: int = len(tw.analyze("log.mcap", machine).samples)
END
        clean ../venv/bin/mypy --strict typed.py
        echo 'tw.analyze(1)' >>typed.py
        if clean ../venv/bin/mypy --strict typed.py; then exit 1; fi
        clean ../venv/bin/python -m pytest -q -p no:cacheprovider "$root/analyze/python/tests/engines/test_session.py"
    fi
    cd ..
done
echo "== all packages work"
