#include "tools/case/case_folder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <unistd.h>
#include <utility>
#include <vector>

#include "tools/case/csv.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using ConfigJson = nlohmann::json;  // one that keeps the order of its keys compares all with all
using metrology::Dataset;
using metrology::Refusal;
using metrology::Table;
using metrology::Value;

constexpr const char* kConfig = "config.json";
constexpr std::size_t kMostTold = 20;  // problems of a folder

std::string inLines(const std::vector<std::string>& reasons) {
  std::string text;
  for (std::size_t k = 0; k < std::min(reasons.size(), kMostTold); ++k) text += (k == 0 ? "" : "\n  ") + reasons[k];
  if (reasons.size() > kMostTold) text += "\n  and more, of which these are the first";
  return text;
}

// Collects what is wrong with a case folder, so that one reading names every problem.
class Problems {
 public:
  // No case: a file that cannot be read, or a configuration that names no method.
  void addUnreadable(std::string reason) { unreadable_.push_back(std::move(reason)); }
  // A case whose content supports no answer.
  void add(Refusal refusal) { refusals_.push_back(std::move(refusal)); }

  bool none() const { return unreadable_.empty() && refusals_.empty(); }
  // One problem a line, in the order of finding; of very many only the first. A refusal has the name of the first.
  Problem problem(const std::string& method) const {
    std::vector<std::string> reasons = unreadable_;
    for (const auto& refusal : refusals_)
      reasons.push_back(reasons.empty() ? refusal.reason : refusal.name + ": " + refusal.reason);
    if (!unreadable_.empty()) return Unreadable{inLines(reasons)};
    return Unsupported{method, {refusals_.front().name, inLines(reasons)}};
  }

 private:
  std::vector<std::string> unreadable_;
  std::vector<Refusal> refusals_;
};

// Only of files: a pipe or a device may never end.
std::optional<std::string> contentOf(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  std::ifstream stream{file, std::ios::binary};
  if (!stream) return std::nullopt;
  std::ostringstream content;
  if (stream.peek() != std::ifstream::traits_type::eof()) content << stream.rdbuf();  // of nothing it would fail
  if (stream.bad() || !content) return std::nullopt;
  return std::move(content).str();
}

bool allNumbers(const ConfigJson& list) {
  return std::ranges::all_of(list, [](const ConfigJson& entry) { return entry.is_number(); });
}

bool allRows(const ConfigJson& list) {
  return std::ranges::all_of(list, [](const ConfigJson& entry) { return entry.is_array() && allNumbers(entry); });
}

std::optional<Value> valueOf(const ConfigJson& json) {
  if (json.is_boolean()) return Value{json.get<bool>()};
  if (json.is_number()) return Value{json.get<double>()};
  if (json.is_string()) return Value{json.get<std::string>()};
  if (json.is_array() && allNumbers(json)) return Value{json.get<std::vector<double>>()};
  if (json.is_array() && allRows(json)) return Value{json.get<metrology::Matrix>()};
  return std::nullopt;
}

// Lists of lists of pairs, as arcs of several patterns, are flattened to their rows.
std::optional<Value> flattened(const ConfigJson& json) {
  if (!json.is_array() ||
      !std::ranges::all_of(json, [](const ConfigJson& entry) { return entry.is_array() && allRows(entry); })) {
    return std::nullopt;
  }
  metrology::Matrix rows;
  for (const auto& group : json) {
    for (const auto& row : group) rows.push_back(row.get<std::vector<double>>());
  }
  return Value{std::move(rows)};
}

// "line 2: `"sigma_mm": NaN}`; ..." for the byte that could not be read, counted from 1.
std::string placeOf(const std::string& text, std::size_t byte) {
  constexpr std::size_t kMostShown = 60;
  const auto at = std::min(byte > 0 ? byte - 1 : 0, text.size());
  const auto before = std::string_view{text}.substr(0, at);
  const std::string line = "line " + std::to_string(1 + std::ranges::count(before, '\n'));
  if (text.find_first_not_of(" \t\r\n", at) == std::string::npos) {
    return line + ": the text ends too early; close what was opened, or copy the file again";
  }
  const auto begin = before.rfind('\n') + 1;  // npos + 1 is 0
  std::string shown = text.substr(begin, std::min(text.find('\n', at) - begin, kMostShown));
  std::ranges::replace_if(
      shown, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  return line + ": `" + shown + "`; names and text stand in double quotes, a comma between entries, numbers as 1.25";
}

// The configuration; without one there is a problem.
ConfigJson readConfig(const fs::path& folder, Problems& problems) {
  const std::string file = (folder / kConfig).string();
  const auto text = contentOf(folder / kConfig);
  if (!text) {
    problems.addUnreadable(folder.string() + ": cannot read config.json, which makes a folder a case");
    return {};
  }
  std::set<std::string> keys;
  const auto watch = [&](int depth, ConfigJson::parse_event_t event, ConfigJson& parsed) {
    if (depth == 1 && event == ConfigJson::parse_event_t::key && !keys.insert(parsed.get<std::string>()).second) {
      problems.addUnreadable(file + ": key '" + parsed.get<std::string>() + "' is there twice: remove one");
    }
    return true;
  };
  try {
    ConfigJson config = ConfigJson::parse(*text, watch);
    if (config.is_object()) return config;
    problems.addUnreadable(file + ": must be one JSON object");
  } catch (const ConfigJson::parse_error& error) {
    problems.addUnreadable(file + ": not JSON at " + placeOf(*text, error.byte));
  } catch (const ConfigJson::exception&) {
    problems.addUnreadable(file + ": a number in it is too large; numbers go up to 1.7e308");
  }
  return {};
}

std::string methodOf(const ConfigJson& config, const fs::path& folder, Problems& problems) {
  const auto method = config.find("method");
  if (method != config.end() && method->is_string() && !method->get<std::string>().empty())
    return method->get<std::string>();
  problems.addUnreadable((folder / kConfig).string() + ": names no method; add \"method\": \"sphere-fit\" or another");
  return {};
}

void fill(Dataset& dataset, const ConfigJson& config, Problems& problems) {
  for (const auto& [key, json] : config.items()) {
    if (key == "method") continue;
    auto value = valueOf(json);
    if (!value) value = flattened(json);
    if (value) {
      dataset.config.emplace(key, std::move(*value));
    } else {
      problems.add(
          {"bad-config", "config.json, key '" + key + "': must be a number, true or false, text, or lists of numbers"});
    }
  }
}

std::string lowered(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return text;
}

// A disk that knows capitals alone says nothing about those of a name.
std::string tableName(const fs::path& file) {
  const std::string stem = file.stem().string();
  const auto is_small = [](char c) { return c >= 'a' && c <= 'z'; };
  return file.extension() == ".csv" || std::ranges::any_of(stem, is_small) ? stem : lowered(stem);
}

std::vector<fs::path> tablesIn(const fs::path& folder, Problems& problems) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry{folder, error}; !error && entry != fs::directory_iterator{};
       entry.increment(error)) {
    if (lowered(entry->path().extension().string()) == ".csv") files.push_back(entry->path());
  }
  if (error) problems.addUnreadable(folder.string() + ": " + error.message());
  std::ranges::sort(files);  // the order of a folder is the file system's whim
  return files;
}

void addTable(Dataset& dataset, const fs::path& file, Problems& problems) {
  const auto text = contentOf(file);
  if (!text) return problems.addUnreadable(file.string() + ": cannot be read; is it a file, and may it be read?");
  auto table = parseCsv(*text, tableName(file));
  if (table && dataset.table(table->name) != nullptr) {
    problems.addUnreadable(file.string() + ": there is another file of table '" + table->name + "': remove one");
  } else if (table) {
    dataset.tables.push_back(std::move(table).value());
  } else {
    for (const auto& refusal : table.error()) problems.add(refusal);
  }
}

ConfigJson jsonOf(const Value& value) {
  return std::visit([](const auto& content) { return ConfigJson(content); }, value);
}

bool plainName(const std::string& name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && std::ranges::all_of(name, plain);
}

// Makes a new file and adds it to `made`; one that is there already is left alone.
std::optional<Error> writeNewFile(const fs::path& file, const std::string& text, std::vector<fs::path>& made) {
  std::FILE* const stream = std::fopen(file.c_str(), "wbxe");
  if (stream != nullptr) made.push_back(file);
  const bool written = stream != nullptr && std::fwrite(text.data(), 1, text.size(), stream) == text.size();
  const bool closed = stream != nullptr && std::fclose(stream) == 0;
  if (written && closed) return std::nullopt;
  return Error{file.string() + ": cannot be written; is it there already, the disk full, or the folder read-only?"};
}

void removeAll(const std::vector<fs::path>& made) {
  std::error_code gone;
  for (const auto& path : made) fs::remove(path, gone);
}

// Makes the folder, which must hold nothing that a reader of the case would take for a part of it.
std::optional<Error> makeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{folder.string() + ": cannot be made (" + error.message() + "); give another folder"};
  if (fs::exists(fs::symlink_status(folder / kConfig, error)))
    return Error{folder.string() + " holds a case already; give another folder"};
  Problems problems;
  const auto tables = tablesIn(folder, problems);
  if (!problems.none()) return Error{std::get<Unreadable>(problems.problem({})).reason};
  if (tables.empty()) return std::nullopt;
  return Error{tables.front().string() + " would be a table of the case; give another folder"};
}

// The deepest first.
std::vector<fs::path> missingFolders(const fs::path& folder) {
  std::vector<fs::path> missing;
  std::error_code error;
  for (auto at = folder; !at.empty() && !fs::exists(at, error); at = at.parent_path()) missing.push_back(at);
  return missing;
}

}  // namespace

Outcome<Dataset, Problem> readCase(const fs::path& folder) {
  std::error_code none;
  if (!fs::is_directory(folder, none)) return Problem{Unreadable{folder.string() + ": there is no such folder"}};
  Problems problems;
  Dataset dataset;
  if (const auto config = readConfig(folder, problems); config.is_object()) {
    dataset.method = methodOf(config, folder, problems);
    fill(dataset, config, problems);
  }
  for (const auto& file : tablesIn(folder, problems)) addTable(dataset, file, problems);
  if (!problems.none()) return problems.problem(dataset.method);
  return dataset;
}

std::optional<Error> whyNoPlaceForCase(const fs::path& folder) {
  const auto folders = missingFolders(folder);
  std::vector<fs::path> made;
  auto why = makeFolder(folder);
  if (!why) why = writeNewFile(folder / (".trial-" + std::to_string(getpid())), "\n", made);
  removeAll(made);
  removeAll(folders);
  return why;
}

Outcome<fs::path> writeCase(const Dataset& dataset, const fs::path& folder) {
  if (auto why = makeFolder(folder)) return *why;
  for (const auto& table : dataset.tables) {
    if (!plainName(table.name)) return Error{"'" + table.name + "' cannot be the name of a file"};
  }
  std::vector<fs::path> made;
  const auto write = [&](const fs::path& file, const std::string& text) {
    auto failure = writeNewFile(file, text, made);
    if (failure) removeAll(made);  // half a case is none
    return failure;
  };
  for (const auto& table : dataset.tables) {
    if (auto failure = write(folder / (table.name + ".csv"), formatCsv(table))) return *failure;
  }
  // Last, so that a folder which was not finished is no case.
  ConfigJson config;
  config["method"] = dataset.method;
  for (const auto& [key, value] : dataset.config) config[key] = jsonOf(value);
  if (auto failure = write(folder / kConfig, config.dump(1) + "\n")) return *failure;
  return folder;
}

}  // namespace probebox::casefolder
