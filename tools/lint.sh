#!/bin/sh
# Checks what can be checked without running it. The first tool that finds something ends it.
set -eu
cd "$(dirname "$0")/.."
tools/apt.sh gcc libc6-dev gcc-avr avr-libc cppcheck clang-format shellcheck

say() {
    echo "lint: $*"
}

# files PATTERN...: those that exist; names without blanks.
files() {
    for file in "$@"; do
        [ ! -e "$file" ] || printf '%s ' "$file"
    done
}

# compile FILES COMPILER FLAG...: each C source by itself; a warning is an error.
compile() {
    sources=$1
    shift
    for file in $sources; do
        "$@" -std=c99 -Wall -Wextra -pedantic -Wconversion -Wdouble-promotion -Werror -O2 \
            -ffp-contract=off -Ifirmware/core -Ifirmware/hal -Ifirmware/app -Ihost_sim/board \
            -c -o build/lint.o "$file"
    done
}

# inspect --platform=PLATFORM FILE...
# What is suppressed: register fields set to 0 that are named as the others are; start-up code that
# walks between the linker's symbols, and its vector table, which only the processor reads.
inspect() {
    cppcheck -q "$@" --std=c99 --enable=warning,style,performance,portability \
        --suppress='badBitmaskCheck:firmware/bsp_*' \
        --suppress='comparePointers:firmware/bsp_mps2/startup.c' \
        --suppress='unusedStructMember:firmware/bsp_mps2/startup.c' \
        --inline-suppr --error-exitcode=1 -Ifirmware/core -Ifirmware/hal -Ifirmware/app \
        -Ifirmware/bsp_f28335 -Ifirmware/bsp_mps2 -Ihost_sim -Ihost_sim/board -Itools/madelung/binding \
        -Itests/reference -Itests/target -DMDL_FAKE_REGISTERS
}

mkdir -p build
core=$(files firmware/core/*.c)
dsp=$(files firmware/app/*.c firmware/bsp_f28335/*.c) # for the fake register file
arm=$(files firmware/bsp_mps2/*.c)
host=$(files host_sim/*.c host_sim/board/*.c tools/madelung/binding/*.c tests/reference/*.c \
    tests/target/*.c)
unit=$(files tests/unit/*.c tests/unit/*/*.[ch] tests/unit/*/*/*.[ch])
headers=$(files firmware/*/*.h host_sim/*.h host_sim/board/*.h tools/madelung/binding/*.h \
    tests/reference/*.h tests/target/*.h)

say "gcc, float and double"
compile "$core$dsp" gcc -DMDL_FAKE_REGISTERS
compile "$core" gcc -DMDL_REAL_DOUBLE -DMDL_N_U=65536
say "avr-gcc, whose int has 16 bits"
compile "$core$dsp" avr-gcc -mmcu=atmega1284p -DMDL_FAKE_REGISTERS -DFAKE_LOG_LENGTH=16 \
    -DFAKE_DAC_LENGTH=16

# shellcheck disable=SC2086 # lists of files
{
    say "cppcheck"
    inspect --platform=avr8 $core $dsp
    inspect --platform=tools/c28x.xml $core $dsp
    inspect --platform=unix32 $arm
    inspect --platform=unix64 $core $host
    say "clang-format"
    clang-format --dry-run -Werror $core $dsp $arm $host $unit $headers
}

say "shellcheck"
shellcheck tools/*.sh .ci/run
say "ruff"
.venv/bin/ruff check -q --config tools/pyproject.toml tools tests
.venv/bin/ruff format -q --check --config tools/pyproject.toml tools tests
say "mypy"
(cd tools && ../.venv/bin/mypy --no-error-summary)
say "nothing found"
