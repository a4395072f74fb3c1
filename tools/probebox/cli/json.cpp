#include "tools/probebox/cli/json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace probebox::command {

struct Printing {
  using Printed = nlohmann::ordered_json;

  static Printed printed(const Json& json) {
    switch (json.kind_) {
      case Json::Kind::null:
        return nullptr;
      case Json::Kind::boolean:
        return json.whole_ != 0;
      case Json::Kind::count:
        return json.whole_;
      case Json::Kind::integer:
        return static_cast<std::int64_t>(json.whole_);
      case Json::Kind::real:
        return json.real_;
      case Json::Kind::string:
        return json.text_;
      case Json::Kind::array:
        return printedArray(json);
      case Json::Kind::object:
        return printedObject(json);
    }
    return nullptr;
  }

 private:
  static Printed printedArray(const Json& json) {
    Printed all = Printed::array();
    for (const auto& item : json.items_) all.push_back(printed(item));
    return all;
  }
  static Printed printedObject(const Json& json) {
    Printed all = Printed::object();
    for (std::size_t k = 0; k < json.items_.size(); ++k) all[json.keys_[k]] = printed(json.items_[k]);
    return all;
  }
};

Json::Json() = default;
Json::Json(std::nullptr_t) {}
Json::Json(const char* text) : kind_{Kind::string}, text_{text} {}
Json::Json(std::string_view text) : kind_{Kind::string}, text_{text} {}
Json::Json(const std::string& text) : kind_{Kind::string}, text_{text} {}
Json::Json(const Json& other) = default;
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(const Json& other) = default;
Json& Json::operator=(Json&& other) noexcept = default;
Json::~Json() = default;

Json::Json(std::initializer_list<Json> items) : kind_{Kind::array} {
  if (!std::ranges::all_of(items, &Json::isMember)) {
    items_ = items;
    return;
  }
  kind_ = Kind::object;
  for (const auto& item : items) (*this)[item.items_[0].text_] = item.items_[1];
}

Json Json::array() {
  Json json;
  json.kind_ = Kind::array;
  return json;
}

Json Json::object() {
  Json json;
  json.kind_ = Kind::object;
  return json;
}

// A key and its value, as they stand in braces.
bool Json::isMember() const {
  return kind_ == Kind::array && items_.size() == 2 && items_[0].kind_ == Kind::string;
}

void Json::push_back(Json item) {
  if (kind_ == Kind::null) kind_ = Kind::array;
  items_.push_back(std::move(item));
}

Json& Json::operator[](std::string_view key) {
  if (kind_ == Kind::null) kind_ = Kind::object;
  const auto known = std::ranges::find(keys_, key);
  if (known != keys_.end()) return items_[static_cast<std::size_t>(known - keys_.begin())];
  keys_.emplace_back(key);
  return items_.emplace_back();
}

void Json::update(const Json& object) {
  for (std::size_t k = 0; k < object.items_.size(); ++k) (*this)[object.keys_[k]] = object.items_[k];
}

std::string Json::dump() const {
  // Text may come from a box or a file: it need not be UTF-8, and in ASCII it holds nothing that a terminal obeys.
  return Printing::printed(*this).dump(-1, ' ', true, Printing::Printed::error_handler_t::replace);
}

}  // namespace probebox::command
