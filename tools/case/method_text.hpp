#pragma once
#include <iosfwd>
#include <span>
#include <string>

// Prints the descriptors of methods, for `probebox solve --methods` and docs/metrology.md.
namespace probebox::casefolder {

// Runs `probebox solve --methods [--json] [METHOD...]` after its command line was parsed. Without names it prints one
// line per method, else tables with columns, config keys, type B keys and results of each; JSON always has everything,
// one object per line. Keys that every method takes only for the record are omitted. Returns the exit status: 0, or 2
// after an unknown name, which is reported on `err`.
int explainMethods(std::span<const std::string> names, bool json, std::ostream& out, std::ostream& err);

// The tables of docs/metrology.md, as Markdown: inputs and results of all methods; their type B keys;
// checks of every case.
std::string methodTables();
std::string tableOfChecks();
std::string typeBTable();

}  // namespace probebox::casefolder
