#pragma once
#include <string>
#include <string_view>

#include "board/describe/keys.hpp"
#include "protocol/units/outcome.hpp"

// Who issues calibration certificates and who receives them, and what only people know of a calibration: a laboratory's
// template (parties.toml), with what ISO/IEC 17025:2017, 7.8.2 and 7.8.4, asks for beyond the measurement.
namespace probebox::board {

struct Party {
  std::string name, email, city, country, address{}, accreditation{};

  static constexpr void keys(auto& self, auto&& key) {
    key("name", self.name, kAnyText, "of the company");
    key("email", self.email, kAnyText, "where it can be reached");
    key("city", self.city, kAnyText, "where it is");
    key("country", self.country, kAnyText, "two letters of ISO 3166-1, such as DE");
    key("address", self.address, kAnyText.orUsual(), "street and number");
    key("accreditation", self.accreditation, kAnyText.orUsual(), "number of the laboratory's accreditation");
  }
};

// What stands in a certificate as the laboratory writes it; empty: not stated.
struct CalibrationWords {
  std::string place{}, item{}, item_condition{}, received{}, environment{}, deviations{}, statement{};

  static constexpr void keys(auto& self, auto&& key) {
    key("place", self.place, kAnyText.orUsual(), "where it was done");
    key("item", self.item, kAnyText.orUsual(), "what was calibrated: maker, type, serial number");
    key("item_condition", self.item_condition, kAnyText.orUsual(), "of the item when it came");
    key("received", self.received, kAnyText.orUsual(), "day on which it came");
    key("environment", self.environment, kAnyText.orUsual(), "such as 20.3 +/- 0.5 degrees, 45 % humidity");
    key("deviations", self.deviations, kAnyText.orUsual(), "from the method, additions and exclusions");
    key("statement", self.statement, kAnyText.orUsual(), "a sentence of the laboratory");
  }
};

struct Parties {
  Party laboratory, customer;
  CalibrationWords calibration{};
};

Outcome<Parties> parseParties(std::string_view text, std::string_view file_name);

}  // namespace probebox::board
