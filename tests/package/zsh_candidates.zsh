# zsh_candidates.zsh FOLDER DUMP LINE: prints what zsh, with the completions in FOLDER, offers at
# the end of LINE, one candidate per line. zsh stores the completions it found in DUMP, to be
# quicker the next time.
zmodload zsh/zpty
found=$(mktemp)
zpty shell zsh -f -i
zpty -w shell "found=${(q)found}; fpath=(${(q)1} \$fpath); PROMPT= "
zpty -w shell "autoload -U compinit; compinit -u -d ${(q)2}"
# zsh hands candidates to compadd. With -O, -A or -D compadd only computes.
zpty -w shell 'compadd() {
  if [[ ${@[1,(i)(-|--)]} == *-(O|A|D)* ]]; then builtin compadd "$@"; return; fi
  local -a hits; builtin compadd -A hits "$@"; print -rl -- $hits >>$found; builtin compadd "$@"
}'
zpty -w shell 'report() { _main_complete; print -r -- "end of candidates" >>$found }'
zpty -w shell 'zle -C report complete-word report; bindkey "^I" report; print -r ready >$found'
wait_for() {
  for (( i = 0; i < 4000; ++i )); do
    [[ "$(<$found)" == *$1* ]] && return
    zpty -rt shell line 2>/dev/null
    sleep 0.02
  done
  print -u2 "zsh never came to: $1"
  exit 1
}
wait_for ready
zpty -n -w shell "$3"$'\t'
wait_for 'end of candidates'
grep -vx -e ready -e 'end of candidates' -e '' $found
rm -f $found
zpty -d shell
