#include "firmware/procedure/methods/methods.hpp"

#include <algorithm>
#include <array>

namespace probebox::procedure {
namespace {

#define PROBEBOX_LIST_LIVE_METHOD(name) &name,
constexpr auto kAll = std::to_array<const LiveMethod*>({PROBEBOX_LIVE_METHODS(PROBEBOX_LIST_LIVE_METHOD)});
#undef PROBEBOX_LIST_LIVE_METHOD

}  // namespace

LiveMethods liveMethods() {
  return kAll;
}

std::vector<std::string_view> methodNames() {
  std::vector<std::string_view> names;
  for (const LiveMethod* method : kAll) names.push_back(method->name());
  return names;
}

const LiveMethod* methodNamed(std::string_view name) {
  const auto found = std::ranges::find(kAll, name, &LiveMethod::name);
  return found == kAll.end() ? nullptr : *found;
}

}  // namespace probebox::procedure
