#include "firmware/store/replacement.hpp"

#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "firmware/store/set_aside.hpp"
#include "firmware/store/twin_file.hpp"

namespace probebox::store {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNoticeBytes = 8000;
constexpr std::array<std::string_view, 4> kCompanions{"", "-journal", "-wal", "-shm"};

std::string nameOfRepaired(const std::string& path) {
  return path + ".repaired";
}

struct Repaired {
  std::string aside;
  std::string notice;
};

// Empty where no whole PATH.new was made.
Repaired repairedBeside(const std::string& path) {
  const auto text = TwinFile::peek(nameOfRepaired(path), kMostNoticeBytes);
  if (!text) return {};
  const auto end = text->find('\n');
  if (end == std::string::npos) return {};
  return {text->substr(0, end), text->substr(end + 1)};
}

}  // namespace

std::string nameOfNew(const std::string& path) {
  return path + ".new";
}

std::string nameOfSalvage(const std::string& path) {
  return path + ".salvage";
}

Outcome<void, Failure> replaceByNew(const std::string& path, const std::string& aside, const std::string& notice) {
  {
    auto repaired = TwinFile::open(nameOfRepaired(path), kMostNoticeBytes, {});
    TRY(repaired.write((aside + "\n" + notice).substr(0, kMostNoticeBytes)));
  }
  return putInPlace(nameOfNew(path), path, aside);
}

Outcome<std::string, Failure> finishReplacement(const std::string& path) {
  const auto [aside, notice] = repairedBeside(path);
  if (aside.empty()) return std::string{};
  if (waitsForItsName(path)) {
    TRY(putInPlace(nameOfNew(path), path, aside));
    return notice;
  }
  // A cut of the power may leave both names of the new file.
  std::error_code error;
  const bool is_done = !isThere(nameOfNew(path)) || fs::equivalent(nameOfNew(path), path, error);
  return is_done && isThere(path) ? notice : std::string{};
}

bool waitsForItsName(const std::string& path) {
  return !isThere(path) && isThere(nameOfNew(path)) && !repairedBeside(path).aside.empty();
}

void discardReplacement(const std::string& path) {
  if (!isThere(path)) return;
  std::error_code ignored;
  const auto repaired = nameOfRepaired(path);
  // While the new file waits, what calls it whole goes first; where it has its name, the notice goes last.
  if (isThere(nameOfNew(path)) && fs::remove(repaired, ignored)) syncFolderOf(path);
  fs::remove(repaired + ".new", ignored);
  for (const auto companion : kCompanions) {
    fs::remove(nameOfNew(path).append(companion), ignored);
    fs::remove(nameOfSalvage(path).append(companion), ignored);
  }
  fs::remove(repaired, ignored);
}

}  // namespace probebox::store
