#include "firmware/store/copy_before.hpp"

#include <filesystem>
#include <system_error>

#include "firmware/store/schema.hpp"

namespace probebox::store {
namespace {

std::string nameOfCopy(const std::string& path, std::int64_t schema) {
  return path + ".schema-" + std::to_string(schema);
}

void removeCopy(const std::string& path, std::int64_t schema) {
  for (const char* companion : {"-journal", ""}) {
    std::error_code ignored;
    std::filesystem::remove(nameOfCopy(path, schema) + companion, ignored);
  }
}

// The number of the last change that decides what is in force. States of a newer version count too: all but "proposed"
// and "refused".
Outcome<std::int64_t, Failure> lastChangeIn(const std::string& path) {
  TRY(auto file, Database::openToRead(path));
  return file.number("SELECT coalesce(max(id), 0) FROM transitions WHERE state NOT IN (0, 4)");
}

}  // namespace

Outcome<void, Failure> keepCopyBefore(Database& database, std::int64_t schema) {
  for (std::int64_t other = 1; other < knownSchema(); ++other) removeCopy(database.path(), other);
  TRY(auto copy, Database::open(nameOfCopy(database.path(), schema)));
  TRY(copy.run(kDurable));
  return database.copyInto(copy);
}

std::string copyBefore(const std::string& path) {
  for (auto schema = knownSchema(); schema > 0; --schema) {
    auto copy = nameOfCopy(path, schema);
    if (std::error_code error; std::filesystem::is_regular_file(copy, error)) return copy;
  }
  return {};
}

bool holdsSince(const std::string& path, const std::string& copy) {
  const auto now = lastChangeIn(path);
  const auto then = lastChangeIn(copy);
  return now && then && *now == *then;
}

}  // namespace probebox::store
