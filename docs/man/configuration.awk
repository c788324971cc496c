# SPDX-License-Identifier: Apache-2.0
# loopwardend.yaml(5) for scdoc from docs/reference/configuration.md: headings, paragraphs, lists, code, `words`, the words of links, and tables of keys,
# whose rows become `key: value; default` with the meaning below. Any POSIX awk.  Usage: awk -f THIS configuration.md
function words(text,    link) {
  while (match(text, /\[[^]]*\]\([^)]*\)/)) {  # [words](link)
    link = substr(text, RSTART + 1, RLENGTH - 1)
    text = substr(text, 1, RSTART - 1) substr(link, 1, index(link, "]") - 1) substr(text, RSTART + RLENGTH)
  }
  gsub(/[*_\\]/, "\\\\&", text)
  gsub(/`/, "*", text)
  return text
}
function heading(text,    parts, i, n, made) {  # capitals but for `words`
  n = split(text, parts, "`")
  for (i = 1; i <= n; i++) made = made (i % 2 ? toupper(parts[i]) : parts[i])
  return made
}
function row(text,    cells, fallback) {
  gsub(/\\\|/, "\001", text)
  sub(/^\| `/, "", text)
  sub(/ \|$/, "", text)
  split(text, cells, / \| /)
  sub(/`$/, "", cells[1])
  if (cells[3] == "required") fallback = "; required"
  else if (cells[3] != "") fallback = "; default: " cells[3]
  text = "*" words(cells[1]) "*: " words(cells[2] fallback) "\n\t" words(cells[4]) "\n"
  gsub(/\001/, "|", text)
  return text
}
NR == 1 {
  print "loopwardend.yaml(5)\n\n# NAME\n\nloopwardend.yaml - configuration of loopwardend\n\n# DESCRIPTION"
  next
}
/^## Effects/ { exit }
/^```/ { code = !code; print; next }
code { print; next }
/^<!--|^\| key \||^\|---/ { next }
/^\| `/ { print row($0); next }
/^### / { gsub(/^### |`/, ""); print "## " $0; next }
/^## / { print "# " heading(substr($0, 4)); next }
{ print words($0) }
END {
  print "# EFFECTS\n\nThe effects of a model's valve, process, transmitter, disturbances and faults, and of a jacket's model of the valve,"
  print "with their parameters: *loopwarden effects*.\n\n# SEE ALSO\n\n*loopwardend*(8), *loopwarden*(1)"
}
