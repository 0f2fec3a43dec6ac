#!/bin/sh
# Makes .venv with the locked Python packages and the madelung command.
set -eu
cd "$(dirname "$0")/.."
python=
for candidate in python3 python3.11 /usr/bin/python3; do
    if "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' \
        2>/dev/null; then
        python=$candidate
        break
    fi
done
if [ -z "$python" ]; then
    tools/apt.sh python3 python3-venv
    python=/usr/bin/python3
fi
"$python" -m venv .venv
.venv/bin/pip install --quiet --disable-pip-version-check --require-hashes -r tools/requirements.lock
.venv/bin/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e tools
