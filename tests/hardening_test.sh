#!/usr/bin/env bash
# Programs are position independent, bound at start with read-only relocations, their
# stacks guarded and not executable: hardening_test.sh PROGRAM…
set -euo pipefail
for program in "$@"; do
  fail() { echo "$program: $1" >&2; exit 1; }
  header=$(readelf --wide --file-header --program-headers --dynamic "$program")
  symbols=$(readelf --wide --dyn-syms "$program")
  grep -q 'Type: *DYN' <<< "$header" || fail "isn't position independent"
  grep -q 'GNU_RELRO' <<< "$header" || fail "relocations stay writable"
  grep -qE 'BIND_NOW|FLAGS_1.*NOW' <<< "$header" || fail "isn't bound at start"
  grep -qE 'GNU_STACK.* RW ' <<< "$header" || fail "its stack is executable"
  grep -q '__stack_chk_fail' <<< "$symbols" || fail "has no guards on its stack"
done
