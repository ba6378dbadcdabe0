# Completion of `nacre` in bash, asked of the command itself: verbs, their options, and the
# words that an option's help lists. Files otherwise.

_nacre_help() {
  "${COMP_WORDS[0]}" "$@" --help 2> /dev/null
}

_nacre() {
  local word=${COMP_WORDS[COMP_CWORD]} verb="" index nested=()
  for ((index = 1; index < COMP_CWORD; index++)); do
    case ${COMP_WORDS[index]} in
      -*) ;;
      *)
        verb=${COMP_WORDS[index]}
        break
        ;;
    esac
  done
  if [[ $word == -* ]]; then
    if [[ $verb == preset && -n ${COMP_WORDS[index + 1]} && ${COMP_WORDS[index + 1]} != -* ]]; then
      nested=("${COMP_WORDS[index + 1]}")
    fi
    mapfile -t COMPREPLY < <(compgen -W "$(_nacre_help ${verb:+"$verb"} "${nested[@]}" |
      grep -oE '(^|[ ,])--?[a-zA-Z][a-z0-9-]*' | tr -d ' ,' | sort -u)" -- "$word")
  elif [[ -z $verb ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(_nacre_help |
      sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p')" -- "$word")
  elif [[ $verb == preset && $index -eq $((COMP_CWORD - 1)) ]]; then
    mapfile -t COMPREPLY < <(compgen -W "make list show check" -- "$word")
  else
    compopt -o default 2> /dev/null
    COMPREPLY=()
  fi
}

complete -F _nacre nacre
