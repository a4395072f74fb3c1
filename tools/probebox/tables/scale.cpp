#include "tools/probebox/tables/scale.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string_view>

namespace probebox::command {
namespace {

constexpr int kMostDecimals = 15;          // more is the noise of a double
constexpr double kMostExact = 1ULL << 53;  // whole numbers above it are not all doubles

std::optional<int> decimalsOf(double scale) {
  std::array<char, 400> digits{};
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), scale, std::chars_format::fixed);
  if (error != std::errc{} || !std::isfinite(scale)) return std::nullopt;
  const std::string_view text{digits.data(), end};
  const auto point = text.find('.');
  const int decimals = point == std::string_view::npos ? 0 : static_cast<int>(text.size() - point - 1);
  return decimals <= kMostDecimals ? std::optional{decimals} : std::nullopt;
}

}  // namespace

Scale::Scale(double per_count) : per_count_{per_count}, decimals_{decimalsOf(per_count)} {}

std::string Scale::text(std::int64_t count) const {
  std::array<char, 400> digits{};
  char* const begin = digits.data();
  char* const limit = begin + digits.size();
  if (per_count_ == 1.0) return {begin, std::to_chars(begin, limit, count).ptr};
  const double value = static_cast<double>(count) * per_count_;
  const bool fits = decimals_ && std::abs(value) * std::pow(10.0, *decimals_) < kMostExact;
  return {begin, fits ? std::to_chars(begin, limit, value, std::chars_format::fixed, *decimals_).ptr
                      : std::to_chars(begin, limit, value).ptr};
}

double Scale::value(std::int64_t count) const {
  return std::strtod(text(count).c_str(), nullptr);
}

std::string columnName(const messages::ChannelDescription& channel) {
  std::string unit = channel.unit;
  for (auto& c : unit) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return unit.empty() ? channel.name : channel.name + "_" + unit;
}

}  // namespace probebox::command
