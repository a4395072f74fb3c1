#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace probebox::report {

// One line of a factory sheet.
struct SheetRow {
  enum class Verdict : std::uint8_t { passed, failed, no_limit, not_told };
  std::string name;   // for a program: "stamp-lateness"
  std::string title;  // for a person
  std::string measured;
  std::string limit;  // empty without one
  Verdict verdict{Verdict::no_limit};
};

struct Sheet {
  std::string title;
  std::string box;    // who it is about
  std::string when;   // ISO 8601
  std::string by;     // a person; may be empty
  std::string where;  // URI of the link
  std::vector<SheetRow> rows;

  std::size_t failed() const;
};

// "passed", "FAILED", "no limit", "not told by this box"
std::string verdictText(SheetRow::Verdict verdict);

// Writes the sheet as one HTML document, as page() does. version: of the program that writes it.
std::string sheetPage(const Sheet& sheet, const std::string& version);

}  // namespace probebox::report
