# Completion of unflex' command line for bash. It needs nothing but bash itself.

# Commands and options. `unflex COMMAND --help` has the same options.
_unflex_options() {
  local print='--printer --set --report -q --quiet'
  case $1 in
    '') echo '-h --help --version' ;;
    compensate)
      echo "-h --help -o --output --in-place --log --strict $print --faster --timing --max-deviation --engine --check-solver -j --jobs" ;;
    batch) echo "-h --help -o --output $print --summary --shard --watch --faster --timing --max-deviation --engine --check-solver -j --jobs" ;;
    verify) echo "-h --help --against --strict $print --faster --max-deviation" ;;
    inspect) echo "-h --help --all --strict $print" ;;
    filament) echo '-h --help -o --output --in-place --strict --printer --set --filament-start-mm -q --quiet' ;;
    study) echo "-h --help --case --machines --map --faster --at-all-times --accel --scale-m204 --keep-rms $print --engine -j --jobs" ;;
    identify)
      echo '-h --help --axis --freq-start --freq-end --wave-spacing-mm --speed-mm-s --decay' \
           '--second --make-test -o --output --printer --set --report -q --quiet' ;;
    tune)
      echo '-h --help --read --pressure -o --output --like --nozzle-temp --bed-temp --accel --printer --set' \
           '--report -j --jobs -q --quiet' ;;
    hotend)
      echo '-h --help --power --heater --ambient --ku --pu --rule --target --flow --heater-watts' \
           '--printer --set --report -q --quiet' ;;
    kinematics) echo '-h --help --fit --printer --set -q --quiet' ;;
    translate) echo '-h --help -o --output --in-place --strict --printer --set -q --quiet' ;;
    printer) echo '-h --help' ;;
    'printer line-test') echo '-h --help -o --output --printer --set -q --quiet' ;;
    'printer macros') echo '-h --help -o --output --printer --set -q --quiet' ;;
    'printer keys') echo '-h --help' ;;
    'printer init') echo '-h --help --from --record -o --output --set -q --quiet' ;;
  esac
}

_unflex_commands() {
  case $1 in
    '') echo 'compensate batch verify inspect filament study identify tune hotend kinematics translate printer' ;;
    printer) echo 'init line-test macros keys' ;;
  esac
}

# Prints what may follow a word: `files PATTERN`, `folders`, `words WORD...`, `keys`, `any` for values
# that cannot be guessed, or nothing if the word takes no value. If no file matches, all files are
# offered.
_unflex_value() {
  local print='*.@(gcode|gco|g|bgcode|gcode.gz)' printer='*.@(toml|cfg|g|txt)'
  case $1:$2 in
    'printer macros:-o' | 'printer macros:--output') echo 'files *.cfg' ;;
    'printer init:-o' | 'printer init:--output') echo 'files *.toml' ;;
    batch: | batch:-o | batch:--output | batch:--report) echo 'folders' ;;
    batch:--summary) echo 'files *.@(json|xml)' ;;
    batch:--shard) echo 'words auto' ;;
    *:--log) echo 'files *.@(log|txt)' ;;
    *:-o | *:--output | *:--against | *:--like) echo "files $print" ;;
    *:--from | *:--printer) echo "files $printer" ;;
    *:--record) echo 'files *.csv' ;;
    tune:--report) echo 'files *.html' ;;
    inspect:--report) echo 'files *.json' ;;
    study:--report) echo 'files *.@(json|html|svg)' ;;
    *:--report) echo 'files *.@(json|html)' ;;
    compensate:--timing | batch:--timing) echo 'words scaled optimal' ;;
    study:--engine | compensate:--engine | batch:--engine) echo 'words auto banded ipopt' ;;
    hotend:--rule) echo 'words simc simc-pi zn zn-pi cc tl' ;;
    hotend:--heater) echo 'words extruder extruder1 heater_bed' ;;
    *:--axis | *:--make-test) echo 'words x y' ;;
    *:--machines) echo 'folders' ;;
    *:--case) echo 'words ref 1A 1B 2A 2B 3A 3B 4A 4B 5A 5B' ;;
    *:--set) echo 'keys' ;;
    *:--max-deviation | *:-j | *:--jobs | *:--freq-start | *:--freq-end | \
      *:--wave-spacing-mm | *:--speed-mm-s | *:--decay | *:--read | *:--nozzle-temp | \
      *:--bed-temp | *:--accel | *:--keep-rms | *:--power | *:--ambient | *:--ku | *:--pu | \
      *:--target | *:--flow | *:--heater-watts | *:--filament-start-mm) echo 'any' ;;
    *:--fit) echo 'files *.csv' ;;
    compensate: | verify: | inspect: | filament: | study: | tune: | kinematics: | translate:) echo "files $print" ;;
    identify:) echo 'files *.csv' ;;
    hotend:) echo 'files *.@(csv|log|txt)' ;;
  esac
}

# Keys for --set, each with its equals sign.
_unflex_keys() {
  local line
  unflex printer keys 2>/dev/null | while IFS= read -r line; do
    [[ $line == ' '* ]] || echo "${line%% *}="
  done
}

# The words that a key may be, if it is one of words.
_unflex_words_of() {
  local key=$1 line
  unflex printer keys 2>/dev/null | while IFS= read -r line; do
    case $line in
      "$key  true, false") echo 'true false' ;;
      "$key  \""*\"*) line=${line#"$key  "}; line=${line//[\",]/}; echo "${line%%  *}" ;;
    esac
  done
}

# Folders, and files that match the pattern; all files if none matches.
_unflex_files() {
  local word=$1 pattern=$2 file extglob
  extglob=$(shopt -p extglob)
  shopt -s extglob
  mapfile -t COMPREPLY < <(compgen -f -X "!$pattern" -- "$word"; compgen -d -- "$word")
  eval "$extglob"
  if ((${#COMPREPLY[@]} == 0)); then
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
  compopt -o filenames 2>/dev/null
}

_unflex() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command= word kind
  local before=$((COMP_CWORD - 1)) key=
  # Bash splits --engine=ipopt into three words, and so it does KEY=VALUE.
  if [[ $current == = ]]; then
    current=
    key=$previous before=$((COMP_CWORD - 2))
  elif [[ $previous == = ]]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
    key=$previous before=$((COMP_CWORD - 3))
  fi
  if [[ $key == -* || $before -lt 1 ]]; then
    key=
  elif [[ ${COMP_WORDS[before]} == = ]]; then
    ((--before))
  fi
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [[ " $(_unflex_commands "$command") " == *" $word "* ]]; then
      command+=${command:+ }$word
    fi
  done
  COMPREPLY=()
  kind=
  if [[ -n $key && ${COMP_WORDS[before]} == --set ]]; then
    kind="words $(_unflex_words_of "$key")"
  elif [[ $previous == -* ]]; then
    kind=$(_unflex_value "$command" "$previous")
  fi
  if [[ -z $kind && $current == -* ]]; then
    kind="words $(_unflex_options "$command")"
  elif [[ -z $kind && -n $(_unflex_commands "$command") ]]; then
    kind="words $(_unflex_commands "$command")"
  elif [[ -z $kind ]]; then
    kind=$(_unflex_value "$command" '')
  fi
  case $kind in
    folders)
      mapfile -t COMPREPLY < <(compgen -d -- "$current")
      compopt -o filenames 2>/dev/null ;;
    keys)
      mapfile -t COMPREPLY < <(compgen -W "$(_unflex_keys)" -- "$current")
      compopt -o nospace 2>/dev/null ;;
    files\ *) _unflex_files "$current" "${kind#files }" ;;
    words\ *) mapfile -t COMPREPLY < <(compgen -W "${kind#words }" -- "$current") ;;
  esac
}

complete -F _unflex unflex
