// Writes the tables of methods in docs/metrology.md. `methods_page FILE` puts them between their markers in the file;
// `methods_page --check FILE` fails when the file says something else.
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "tools/case/method_text.hpp"

namespace {

namespace procedure = probebox::procedure;

// The page with the text between "<!-- NAME -->" and "<!-- end of NAME -->" replaced; nothing without these lines.
std::optional<std::string> replaced(const std::string& page, const std::string& name, const std::string& text) {
  const std::string begin = "<!-- " + name + " -->\n";
  const auto from = page.find(begin);
  const auto to = page.find("<!-- end of " + name + " -->\n");
  if (from == std::string::npos || to == std::string::npos || to < from) return std::nullopt;
  return page.substr(0, from + begin.size()) + text + page.substr(to);
}

std::string_view byTrigger(const procedure::LiveMethod& method, std::string_view option) {
  const auto by = option == " --head"    ? procedure::ReadBy::head
                  : option == " --shank" ? procedure::ReadBy::shank
                                         : procedure::ReadBy::tip;
  switch (procedure::byTrigger(method, by)) {
    case procedure::ByTrigger::refused:
      return "no";
    case procedure::ByTrigger::as_it_is:
      return "yes";
    case procedure::ByTrigger::with_pre_travel:
      break;
  }
  return method.usual.tool_count == 0     ? "with `pre-travel` in force"
         : by == procedure::ReadBy::shank ? "with that of the tip's tool in force"
                                          : "with that of each tool in force";
}

void addRun(std::ostream& out, const procedure::LiveMethod& method, std::string_view option, std::string_view steps) {
  std::string told = method.finds_a_place ? "a delay in force" : "";
  if (option == " --head") told = "a result about `sensor-head` in force";
  std::string places;
  const auto add = [&](std::string_view place) {
    const bool names_file = place.find(".toml") != std::string_view::npos;
    (places += places.empty() ? (names_file ? "" : "machine.toml ") : ", ") += place;
  };
  for (const auto* fact : method.needs) {
    if (option != " --shank" || !fact->shank_replaces) add(fact->place);
  }
  if (option == " --shank") add("`[probe_shank]`");
  if (option == " --axis B") {
    for (const auto* fact : method.needs_about_b) add(fact->place);
  }
  if (option == " --head") add("`[sensor_head]`");
  if (!told.empty() && !places.empty()) told += ", ";
  told += places;
  const std::string again = method.closes == 0                     ? ""
                            : &method.poses == &procedure::kAtZero ? "; the first touch again last"
                            : method.closes == 1                   ? "; the first pose again last"
                                                                   : "; the first stop again last";
  out << "| `" << method.name() << option << "` | " << steps << again << " | " << told << (told.empty() ? "| " : " | ")
      << byTrigger(method, option) << " |\n";
}

// Table of the machine's motions for each live method, in alphabetical order.
std::string tableOfRuns() {
  std::map<std::string_view, const procedure::LiveMethod*> sorted;
  for (const auto* method : procedure::liveMethods()) {
    if (method->calibrates) sorted[method->name()] = method;
  }
  std::ostringstream out;
  out << "| method | steps | told beforehand | by a touch-trigger probe |\n|---|---|---|---|\n";
  for (const auto& [name, method] : sorted) {
    addRun(out, *method, "", method->steps);
    if (method->measuresBOrC()) addRun(out, *method, " --axis B", method->steps_about_b);
    if (!method->steps_by_head.empty()) addRun(out, *method, " --head", method->steps_by_head);
    if (method->takesShank()) addRun(out, *method, " --shank", method->steps_by_shank);
  }
  return out.str();
}

}  // namespace

int main(int argc, char** argv) {
  const bool check = argc == 3 && std::string_view{argv[1]} == "--check";
  if (argc != 2 && !check) {
    std::cerr << "usage: methods_page [--check] FILE\n";
    return 2;
  }
  const char* file = argv[argc - 1];
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  auto page = replaced(text.str(), "methods", probebox::casefolder::methodTables());
  if (page) page = replaced(*page, "type B keys", probebox::casefolder::typeBTable());
  if (page) page = replaced(*page, "checks", probebox::casefolder::tableOfChecks());
  if (page) page = replaced(*page, "runs", tableOfRuns());
  if (!page) {
    std::cerr << file
              << " lacks the markers <!-- methods -->, <!-- type B keys -->, <!-- checks --> and <!-- runs --> with "
                 "their ends\n";
    return 1;
  }
  if (check) {
    if (*page == text.str()) return 0;
    std::cerr << file << " is stale; run: cmake --build build --target methods-page\n";
    return 1;
  }
  return std::ofstream{file} << *page ? 0 : 1;
}
