#include <algorithm>
#include <utility>

#include "board/describe/parties.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {
namespace {

Party readParty(Section section) {
  Party party;
  readKeys(section, party);
  const bool is_code =
      party.country.size() == 2 && std::ranges::all_of(party.country, [](char c) { return c >= 'A' && c <= 'Z'; });
  if (section.good("country") && !is_code)
    section.problem("country",
                    "= " + inQuotes(party.country) + " is no code of a country: write two capitals, such as \"DE\"");
  section.finish();
  return party;
}

}  // namespace

Outcome<Parties> parseParties(std::string_view text, std::string_view file_name) {
  return readDocument<Parties>(text, file_name, [](Section& root) {
    return Parties{.laboratory = readParty(root.section("laboratory")),
                   .customer = readParty(root.section("customer")),
                   .calibration = read<CalibrationWords>(root.section("calibration", false))};
  });
}

}  // namespace probebox::board
