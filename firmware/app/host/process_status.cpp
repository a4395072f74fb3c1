#include "firmware/app/host/process_status.hpp"

#include <charconv>
#include <fstream>
#include <iterator>
#include <string>

namespace probebox::app {
namespace {

// The first number of the line that begins with `key`; nothing where there is no such line.
std::optional<std::uint64_t> numberOf(std::string_view text, std::string_view key, int base) {
  const auto line = text.find(key);
  if (line == std::string_view::npos) return std::nullopt;
  const auto at = text.find_first_not_of(" \t", line + key.size());
  std::uint64_t number = 0;
  if (at == std::string_view::npos ||
      std::from_chars(text.data() + at, text.data() + text.size(), number, base).ec != std::errc{})
    return std::nullopt;
  return number;
}

}  // namespace

messages::ProcessStatus processStatusIn(std::string_view text) {
  constexpr std::uint64_t kFiltered = 2;  // SECCOMP_MODE_FILTER
  const auto resident_kb = numberOf(text, "\nVmRSS:", 10);
  const auto user = numberOf(text, "\nUid:", 10);
  if (!resident_kb || !user) return {};
  return {.resident_bytes = *resident_kb * 1024,
          .is_root = *user == 0,
          .capabilities = numberOf(text, "\nCapEff:", 16).value_or(0),
          .no_new_privileges = numberOf(text, "\nNoNewPrivs:", 10) == 1U,
          .calls_filtered = numberOf(text, "\nSeccomp:", 10) == kFiltered};
}

messages::ProcessStatus processStatus() {
  std::ifstream file{"/proc/self/status"};
  return processStatusIn(std::string{std::istreambuf_iterator<char>{file}, {}});
}

}  // namespace probebox::app
