#pragma once
#include <string>
#include <string_view>

#include "board/describe/keys.hpp"
#include "protocol/units/outcome.hpp"

// Who issues calibration certificates and who receives them (parties.toml).
namespace probebox::board {

struct Party {
  std::string name, email, city, country;

  static constexpr void keys(auto& self, auto&& key) {
    key("name", self.name, kAnyText, "of the company");
    key("email", self.email, kAnyText, "where it can be reached");
    key("city", self.city, kAnyText, "where it is");
    key("country", self.country, kAnyText, "two letters of ISO 3166-1, such as DE");
  }
};

struct Parties {
  Party laboratory, customer;
};

Outcome<Parties> parseParties(std::string_view text, std::string_view file_name);

}  // namespace probebox::board
