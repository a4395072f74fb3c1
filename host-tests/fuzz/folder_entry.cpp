#include "folder_entry.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <variant>

#include "host-tests/support/temporary_folder.hpp"
#include "require.hpp"
#include "tools/case/case_folder.hpp"

namespace {

using namespace probebox;
using fuzz::require;
namespace fs = std::filesystem;

fs::path empty(const fs::path& folder) {
  fs::remove_all(folder);
  fs::create_directory(folder);
  return folder;
}

constexpr std::string_view kMark = "=== ";

void writeFiles(std::string_view text, const fs::path& folder) {
  while (text.starts_with(kMark)) {
    text.remove_prefix(kMark.size());
    const auto name = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), name.size() + 1));
    auto end = text.find("\n" + std::string{kMark});
    end = end == std::string_view::npos ? text.size() : end + 1;
    const bool is_a_name = !name.empty() && name.size() < 40 && std::ranges::all_of(name, [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-';
    });
    if (is_a_name && name != "." && name != "..") {
      std::ofstream file{folder / name, std::ios::binary};
      file << text.substr(0, end);
    }
    text.remove_prefix(end);
  }
}

bool alike(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

bool alike(const metrology::Dataset& a, const metrology::Dataset& b) {
  if (a.method != b.method || a.config != b.config || a.tables.size() != b.tables.size()) return false;
  for (const auto& table : a.tables) {
    const auto other = std::ranges::find(b.tables, table.name, &metrology::Table::name);
    if (other == b.tables.end() || other->columns.size() != table.columns.size()) return false;
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
      if (other->columns[k].name != table.columns[k].name) return false;
      if (!std::ranges::equal(table.columns[k].values, other->columns[k].values,
                              [](double x, double y) { return alike(x, y); }))
        return false;
    }
  }
  return true;
}

void check(const metrology::Dataset& dataset, const fs::path& again) {
  const auto written = casefolder::writeCase(dataset, again);
  if (!written) return require(!written.error().what.empty());
  const auto read = casefolder::readCase(again);
  require(read.ok(), "what was written cannot be read");
  require(alike(*read, dataset), "what was written reads differently");
}

}  // namespace

int feedFolder(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  static const support::TemporaryFolder scratch{support::inMemory()};
  const auto folder = empty(scratch.path() / "case");
  writeFiles({reinterpret_cast<const char*>(data), size}, folder);
  const auto read = casefolder::readCase(folder);
  if (read) {
    check(*read, empty(scratch.path() / "again"));
    return 0;
  }
  if (const auto* unreadable = std::get_if<casefolder::Unreadable>(&read.error())) {
    require(!unreadable->reason.empty());
    return 0;
  }
  const auto& refusal = std::get<casefolder::Unsupported>(read.error()).refusal;
  require(!refusal.name.empty() && !refusal.reason.empty());
  require(std::ranges::none_of(refusal.reason, [](unsigned char c) { return c != '\n' && std::iscntrl(c) != 0; }),
          refusal.reason);
  return 0;
}
