#!/usr/bin/env bash
# completion_test.sh NACRE SCRIPT: what bash offers for words begun.
set -uo pipefail
PATH=$(dirname "$1"):$PATH
# shellcheck source=/dev/null  # given
source "$2"
failed=0

# offers "WORDS BEGUN" WORD…: each WORD is among what is offered for the last of them.
offers() {
  read -ra COMP_WORDS <<< "$1"
  [[ $1 == *" " ]] && COMP_WORDS+=("")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  COMPREPLY=()
  _nacre
  shift
  for word in "$@"; do
    if ! printf '%s\n' "${COMPREPLY[@]}" | grep -qxe "$word"; then
      echo "'${COMP_WORDS[*]}' doesn't offer '$word', but: ${COMPREPLY[*]}" >&2
      failed=1
    fi
  done
}

offers "nacre " render factor report
offers "nacre fac" factor
offers "nacre --" --help --version
offers "nacre factor --te" --terms
offers "nacre render --" --out --seed --png
offers "nacre preset " make list show check
offers "nacre preset make --ti" --title
read -ra COMP_WORDS <<< "nacre fac"
COMP_CWORD=1
_nacre
[ "${#COMPREPLY[@]}" -eq 1 ] || { echo "'fac' is factor alone, not: ${COMPREPLY[*]}" >&2; failed=1; }
exit "$failed"
