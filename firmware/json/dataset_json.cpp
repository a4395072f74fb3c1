#include "firmware/json/dataset_json.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "firmware/json/numbers.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::json {
namespace {

using Json = nlohmann::ordered_json;

// Appends to one text: a document in memory would take several times the room of the numbers, in a box that locks all
// its memory.
class Writer {
 public:
  std::string take() && { return std::move(text_); }

  void raw(std::string_view text) { text_ += text; }
  void add(const std::string& text) { text_ += Json(text).dump(-1, ' ', false, Json::error_handler_t::replace); }
  void add(bool flag) { text_ += flag ? "true" : "false"; }

  // The shortest digits that come back to the last bit, never as an integer: that would lose the sign of zero.
  void add(double value) {
    if (!std::isfinite(value)) return raw("null");
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    const std::string_view written{digits.data(), static_cast<std::size_t>(end - digits.data())};
    raw(written);
    if (written.find_first_of(".e") == std::string_view::npos) raw(".0");
  }

  template <class T>
  void add(const std::vector<T>& list) {
    each('[', ']', list, [this](const T& item) { add(item); });
  }

  void each(char open, char close, const auto& list, const auto& write) {
    text_ += open;
    bool first = true;
    for (const auto& item : list) {
      if (!first) text_ += ',';
      first = false;
      write(item);
    }
    text_ += close;
  }

 private:
  std::string text_;
};

void write(Writer& writer, const metrology::Table& table) {
  writer.raw(R"({"name":)");
  writer.add(table.name);
  writer.raw(R"(,"columns":)");
  writer.each('[', ']', table.columns, [&](const metrology::Column& column) {
    writer.raw(R"({"name":)");
    writer.add(column.name);
    writer.raw(R"(,"values":)");
    writer.add(column.values);
    writer.raw("}");
  });
  writer.raw("}");
}

metrology::Value value(const Json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_string()) return json.get<std::string>();
  if (!json.is_array()) return number(json);
  if (json.empty() || !json.front().is_array()) return numbers(json);
  metrology::Matrix rows;
  for (const auto& row : json) rows.push_back(numbers(row));
  return rows;
}

// Names of tables and columns become those of files and of columns in a table: letters, digits, underscores and
// hyphens, such as C_rad_clockwise_from_plus_y.
struct NotAName {
  std::string name;
};
std::string name(const Json& json) {
  auto text = json.at("name").get<std::string>();
  const auto plain = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-'; };
  if (text.empty() || text.front() == '-' || text.size() > kLongestName || !std::ranges::all_of(text, plain))
    throw NotAName{shown(text, 60)};
  return text;
}

metrology::Table table(const Json& json) {
  metrology::Table all{.name = name(json), .columns = {}};
  for (const auto& column : json.at("columns")) {
    all.columns.push_back({name(column), numbers(column.at("values"))});
  }
  return all;
}

metrology::Dataset dataset(const Json& json) {
  metrology::Dataset all;
  all.method = json.at("method").get<std::string>();
  for (const auto& [key, content] : json.at("config").items()) all.config.emplace(key, value(content));
  for (const auto& item : json.at("tables")) all.tables.push_back(table(item));
  return all;
}

}  // namespace

std::string toJson(const metrology::Dataset& dataset) {
  Writer writer;
  writer.raw(R"({"method":)");
  writer.add(dataset.method);
  writer.raw(R"(,"config":)");
  writer.each('{', '}', dataset.config, [&](const auto& entry) {
    writer.add(entry.first);
    writer.raw(":");
    std::visit([&](const auto& content) { writer.add(content); }, entry.second);
  });
  writer.raw(R"(,"tables":)");
  writer.each('[', ']', dataset.tables, [&](const metrology::Table& each) { write(writer, each); });
  writer.raw("}");
  return std::move(writer).take();
}

Outcome<metrology::Dataset> datasetFromJson(std::string_view text) {
  try {
    return dataset(Json::parse(text));
  } catch (const NotAName& e) {
    return Error{"the measured data name a table or a column '" + e.name +
                 "': use letters, digits, underscores and hyphens"};
  } catch (const Json::exception& e) {
    return Error{std::string{"the measured data from the box cannot be read ("} + e.what() +
                 "); update the older of the two"};
  }
}

}  // namespace probebox::json
