# SPDX-License-Identifier: Apache-2.0
# Puts the commands of docs/reference/commands.md in place of @COMMANDS@ in loopwarden.1.scd. Any POSIX awk.
# Usage: awk -f THIS commands.md loopwarden.1.scd
FNR == NR && /^## `loopwarden [a-z]/ { gsub(/^## `loopwarden |`$/, ""); wanted = 1; commands = commands "## " $0 "\n"; next }
FNR == NR && /^## / { wanted = 0 }
FNR == NR { if (wanted) commands = commands $0 "\n"; next }
$0 == "@COMMANDS@" { printf "%s", commands; next }
{ print }
