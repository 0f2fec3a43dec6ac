#!/bin/sh
# Puts Unity 2.4.3 and its runner generator into build/unity. They come out of the Debian source
# package cjson, by way of the mirror that apt on this machine uses, with package lists of their
# own: the machine's are left alone.
set -eu
cd "$(dirname "$0")/.."
unity=build/unity
[ ! -e "$unity/src/unity.c" ] || exit 0

fail() {
    echo "Unity is missing: $1" >&2
    exit 1
}

debian_sources() {
    # shellcheck disable=SC2016 # apt-get expands these
    apt-get indextargets --format 'deb-src $(REPO_URI) $(RELEASE) $(COMPONENT)' \
        'Created-By: Packages' 'Origin: Debian' 'Component: main' | sort -u
}

tools/apt.sh ruby
new=$PWD/$unity.new
rm -rf "$unity" "$new"
mkdir -p "$new/state/lists/partial" "$new/cache"
debian_sources >"$new/sources.list"
if [ ! -s "$new/sources.list" ]; then
    apt-get update -qq || fail "apt has no package lists and cannot fetch them"
    debian_sources >"$new/sources.list"
fi
[ -s "$new/sources.list" ] || fail "no Debian archive is among apt's sources"

cd "$new"
set -- -qq -o Dir::Etc::sourcelist="$new/sources.list" -o Dir::Etc::sourceparts=- \
    -o Dir::State="$new/state" -o Dir::State::status=/var/lib/dpkg/status \
    -o Dir::Cache="$new/cache" -o APT::Sandbox::User=root
apt-get "$@" update || fail "the mirror's list of source packages cannot be fetched"
apt-get "$@" source --download-only --tar-only cjson ||
    fail "the source package cjson cannot be fetched"
tar -xzf cjson_*.orig.tar.gz --strip-components=3 --wildcards '*/tests/unity/src/*' \
    '*/tests/unity/auto/*' '*/tests/unity/examples/unity_config.h' \
    '*/tests/unity/docs/license.txt' ||
    fail "the source package cjson holds no Unity"
rm -rf sources.list state cache cjson_*
mv "$new" "../unity"
