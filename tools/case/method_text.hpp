#pragma once
#include <iosfwd>
#include <span>
#include <string>

// What methods say about themselves, for `probebox solve --methods` and docs/metrology.md.
namespace probebox::casefolder {

// Does what `probebox solve --methods [--json] [METHOD...]` does, but for the command line: without names one line a
// method, else tables with columns, config keys, type B keys and results of each. JSON has all of it, one object a
// line. The keys that every method takes for the record are not named. Returns the exit status: 0, or 2 after an
// unknown name, which is reported on `err`.
int explainMethods(std::span<const std::string> names, bool json, std::ostream& out, std::ostream& err);

// The tables of docs/metrology.md, as Markdown: of all methods what they take and answer, then their type B keys.
std::string methodTables();
std::string typeBTable();

}  // namespace probebox::casefolder
