#!/bin/sh
# f28335.sh images|flash: what `make firmware` and `make flash` do, once TI's tools are there.
# Variables: TI_CGT, UNIFLASH, CCXML, as in firmware/bsp_f28335/f28335.mk.
set -eu
cd "$(dirname "$0")/.."

missing() {
    echo "make: $*" >&2
    exit 2
}

case "$1" in
images)
    [ -x "${TI_CGT:-}/bin/cl2000" ] || missing "TI's C2000 compiler (cl2000, 22.6 LTS) is missing:" \
        "download C2000-CGT from ti.com and say make firmware TI_CGT=/path/to/its/folder"
    ;;
flash)
    [ -x "${UNIFLASH:-}/dslite.sh" ] || missing "TI's UniFlash (dslite.sh) is missing:" \
        "download UNIFLASH from ti.com and say make flash UNIFLASH=/path/to/its/folder"
    [ -f "${CCXML:-}" ] || missing "the target configuration is missing:" \
        "make one for your debug probe and the F28335 in UniFlash and say CCXML=/path/to/it.ccxml"
    [ -f build/f28335/madelung_flash.out ] || missing "build/f28335/madelung_flash.out is missing:" \
        "it comes from make firmware TI_CGT=/path/to/the/compiler"
    ;;
esac
"${MAKE:-make}" --no-print-directory -f firmware/bsp_f28335/f28335.mk "$1" \
    TI_CGT="${TI_CGT:-}" UNIFLASH="${UNIFLASH:-}" CCXML="${CCXML:-}"
