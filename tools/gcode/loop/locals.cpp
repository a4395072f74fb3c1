#include "tools/gcode/loop/locals.hpp"

#include <algorithm>
#include <set>

namespace probebox::gcode::loop {
namespace {

// What a subprogram has and calls.
struct Uses {
  std::set<std::string> callers;
  std::set<std::string> locals;
};
using AllUses = std::map<std::string, Uses>;

void add(AllUses& uses, const std::string& owner, const Value& value) {
  if (value.is == Value::Is::variable && value.name.starts_with(owner + "/")) uses[owner].locals.insert(value.name);
  for (const auto& argument : value.arguments) add(uses, owner, argument);
}

void add(AllUses& uses, const std::string& owner, const std::vector<Statement>& statements) {
  for (const auto& one : statements) {
    for (const auto& value : one.values) add(uses, owner, value);
    for (const auto& word : one.words) add(uses, owner, word.value);
    for (const auto& each : one.bodies) add(uses, owner, each);
    if (one.is != Statement::Is::call) continue;
    auto& called = uses[one.text];
    called.callers.insert(owner);
    for (std::size_t i = 1; i <= one.values.size(); ++i) called.locals.insert(one.text + "/" + std::to_string(i));
  }
}

// Behind those of all callers.
std::size_t firstPlace(const AllUses& uses, const std::string& subprogram) {
  std::size_t first = 0;
  for (const auto& caller : uses.at(subprogram).callers)
    first = std::max(first, firstPlace(uses, caller) + uses.at(caller).locals.size());
  return first;
}

}  // namespace

std::map<std::string, std::size_t> placesOfLocals(const std::vector<Subprogram>& subprograms) {
  AllUses uses;
  for (const auto& one : subprograms) {
    uses[one.name];
    add(uses, one.name, one.body);
  }
  std::map<std::string, std::size_t> places;
  for (const auto& [name, of] : uses) {
    std::size_t place = firstPlace(uses, name);
    for (const auto& local : of.locals) places[local] = place++;
  }
  return places;
}

}  // namespace probebox::gcode::loop
