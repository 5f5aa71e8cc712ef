#!/usr/bin/env bash
# Tries the packages of packaging/build.sh in clean environments: packaging/try.sh OUT. Installs nothing on this machine.
set -euo pipefail
out=$(realpath "${1:?expected the folder of the packages}")
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# no program or library of the sources is found by chance
clean() { env -i PATH=/usr/bin:/bin HOME="$work/home" LANG=C.UTF-8 "$@"; }
mkdir -p "$work/home"
cd "$work"
shopt -s nullglob

for package in "$out"/*.deb; do
    echo "== $package"
    dpkg-deb --info "$package"
    dpkg -x "$package" root
    dpkg-deb --control "$package" control
    dpkg-deb --contents "$package" | awk '{ print $2 }' | sort -u | tail -1 | grep -qx root/root
    (cd root && md5sum --quiet --check ../control/md5sums)
    for script in control/postinst control/prerm control/postrm; do sh -n "$script"; done
    clean root/usr/bin/tipwatch --version
    clean root/usr/bin/tipwatch-live --version
    mkdir demo
    (cd demo && clean ../root/usr/bin/tipwatch demo >demo.txt && head -5 demo.txt)
    for unit in root/usr/lib/systemd/system/*.service; do
        sed "s#/usr/bin/tipwatch-live#$work/root/usr/bin/tipwatch-live#; /^Documentation=/d" "$unit" >"$(basename "$unit")"
        if command -v systemd-analyze >/dev/null; then
            systemd-analyze verify "./$(basename "$unit")"
        fi
    done
    gunzip -c root/usr/share/man/man1/tipwatch-live-monitor.1.gz >monitor.1
    grep -q 'untimed' monitor.1
    clean bash -c 'source root/usr/share/bash-completion/completions/tipwatch && complete -p tipwatch'
    "$python" -c 'import json, sys; bill = json.load(open(sys.argv[1])); print(len(bill["components"]), "crates")' \
        root/usr/share/doc/tipwatch/tipwatch.cdx.json
done

for wheel in "$out"/*.whl; do
    echo "== $wheel"
    clean "$python" -m venv venv
    clean venv/bin/pip install --quiet --disable-pip-version-check ${TIPWATCH_PIP:-} "$wheel"
    clean venv/bin/pip check
    mkdir wheel
    cd wheel
    clean ../venv/bin/python -c 'import tipwatch; print(tipwatch.__file__)'
    clean ../venv/bin/tipwatch demo >demo.txt
    head -5 demo.txt
    clean ../venv/bin/tipwatch-live --version
    cd ..
done
echo "== all packages work"
