#pragma once
#include <string>
#include <string_view>
#include <type_traits>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/shown_when.hpp"
#include "tools/probebox/cli/json.hpp"

// JSON of a structure by its fields() list: a key for each line, names of enumerations as text.
namespace probebox::command {

template <class T>
Json jsonOf(const T& value);

namespace detail {
inline bool holds(const auto&) {
  return true;
}
inline bool holds(const published::NullUnless& null) {
  return null.condition;
}
inline bool holds(const published::OmittedUnless& omitted) {
  return omitted.condition;
}
}  // namespace detail

template <messages::Structure T>
Json objectOf(const T& value) {
  Json object = Json::object();
  T::fields(value, [&]<class... Condition>(std::string_view name, const auto& member, std::string_view,
                                           const Condition&... condition) {
    if ((detail::holds(condition) && ...)) {
      object[name] = jsonOf(member);
    } else if (!(std::same_as<Condition, published::OmittedUnless> || ...)) {
      object[name] = nullptr;
    }
  });
  return object;
}

template <class T>
Json jsonOf(const T& value) {
  using messages::nameOf;  // beside those that stand by their enumerations
  if constexpr (messages::Structure<T>) {
    return objectOf(value);
  } else if constexpr (std::is_enum_v<T>) {
    return Json(std::string{nameOf(value)});
  } else if constexpr (requires { value.index; }) {
    return Json(value.index);  // of a tick or sample
  } else if constexpr (requires { value.begin(); } && !messages::Text<T>) {
    Json all = Json::array();
    for (const auto& element : value) all.push_back(jsonOf(element));
    return all;
  } else {
    return Json(value);
  }
}

}  // namespace probebox::command
