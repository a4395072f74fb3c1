# Sourced by tools/setup/fresh and host-tests/vm/prepare: this machine's package sources, for another release too.

# Prints this machine's entries for Debian itself (suites FROM, FROM-updates, FROM-security; component main), with TO in
# place of FROM, so that the mirror is the same. One-line entries, then, after a line "--", paragraphs.
apt_entries() { # FROM TO
  local from=$1 to=$2 file
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [[ -f $file ]] || continue
    sed -nE "s/^(deb( \[[^]]*\])? [^ ]+) $from((-security|-updates|\/updates)?) +(.* )?main( .*)?$/\1 $to\3 main/p" "$file"
  done
  echo "--"
  for file in /etc/apt/sources.list.d/*.sources; do
    [[ -f $file ]] || continue
    awk -v from="$from" -v to="$to" '
      function finish() {
        if (deb && on && component && suites != "") printf "%sSuites:%s\nComponents: main\n\n", kept, suites
        kept = suites = ""; deb = component = 0; on = 1
      }
      BEGIN { finish() }
      /^#/ { next }
      /^[ \t]*$/ { finish(); next }
      /^[^ \t]/ { field = tolower($1) }
      field == "types:" { if ($0 ~ /deb( |$)/) { deb = 1; kept = kept "Types: deb\n" } next }
      field == "enabled:" { on = $2 != "no"; next }
      field == "components:" { if ($0 ~ /[: ]main( |$)/) component = 1; next }
      field == "suites:" {
        for (i = 1; i <= NF; ++i)
          if ($i ~ "^" from "(-security|-updates|/updates)?$") suites = suites " " to substr($i, length(from) + 1)
        next
      }
      { kept = kept $0 "\n" }
      END { finish() }' "$file"
  done
}
